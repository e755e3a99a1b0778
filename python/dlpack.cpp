#include "python/dlpack.h"

#include <array>

#include "autograd/base/error.h"

namespace restage::python {
namespace {

// The layout that all libraries agree on (dlpack.h).
struct DlTensor {
  void* data;
  int32_t device, device_id;
  int32_t ndim;
  uint8_t code, bits;
  uint16_t lanes;
  int64_t* shape;
  int64_t* strides;  // of elements; null: row-major
  uint64_t byte_offset;
};
struct DlManaged {
  DlTensor tensor;
  void* owner;
  void (*deleter)(DlManaged*);
};
struct DlVersioned {
  uint32_t major, minor;
  void* owner;
  void (*deleter)(DlVersioned*);
  uint64_t flags;
  DlTensor tensor;
};
constexpr int32_t kDlCpu = 1;
constexpr uint64_t kDlReadOnly = 1, kDlCopied = 2;
constexpr uint8_t kDlInt = 0, kDlUnsigned = 1, kDlFloat = 2, kDlComplex = 5, kDlBool = 6;

/// The names of a capsule before and after somebody took it.
template <class Managed>
constexpr std::pair<const char*, const char*> kCapsule{"dltensor", "used_dltensor"};
template <>
constexpr std::pair<const char*, const char*> kCapsule<DlVersioned>{"dltensor_versioned",
                                                                    "used_dltensor_versioned"};

[[noreturn]] void refuse_buffer(const std::string& why) { throw py::buffer_error(why); }

std::string device_text(int kind, int id) {
  constexpr std::array<std::pair<int, const char*>, 3> names{
      {{2, "CUDA"}, {8, "Metal"}, {10, "ROCm"}}};
  std::string name = "DLPack's kind " + std::to_string(kind);
  for (const auto& [known, text] : names)
    if (known == kind) name = text;
  return name + ", number " + std::to_string(id);
}

/// The CPU reads its own memory, and what GPUs share with it.
bool readable(int kind) {
  constexpr int kCudaHost = 3, kRocmHost = 11;
  return kind == kDlCpu || kind == kCudaHost || kind == kRocmHost;
}

py::dtype numpy_type(const DlTensor& t) {
  const bool known = t.code == kDlInt || t.code == kDlUnsigned ? t.bits >= 8 && t.bits <= 64
                     : t.code == kDlFloat                      ? t.bits >= 16 && t.bits <= 64
                     : t.code == kDlComplex                    ? t.bits == 64 || t.bits == 128
                                                               : t.code == kDlBool && t.bits == 8;
  if (!known || t.lanes != 1 || (t.bits & (t.bits - 1)) != 0)
    refuse_buffer("NumPy has no numbers of this kind (DLPack's type " + std::to_string(t.code) +
                  " of " + std::to_string(t.bits) + " bits)");
  const char kind = t.code == kDlInt        ? 'i'
                    : t.code == kDlUnsigned ? 'u'
                    : t.code == kDlFloat    ? 'f'
                    : t.code == kDlComplex  ? 'c'
                                            : 'b';
  return py::dtype(kind + std::to_string(t.bits / 8));
}

/// Takes a capsule of this kind, and with it the duty to give the memory back.
template <class Managed>
py::capsule taken(const py::object& capsule, Managed*& out) {
  const auto [fresh, used] = kCapsule<Managed>;
  out = static_cast<Managed*>(PyCapsule_GetPointer(capsule.ptr(), fresh));
  if (out == nullptr || PyCapsule_SetName(capsule.ptr(), used) != 0) throw py::error_already_set();
  return py::capsule(static_cast<const void*>(out), [](void* p) {
    auto* managed = static_cast<Managed*>(p);
    if (managed->deleter != nullptr) managed->deleter(managed);
  });
}

py::array array_over(const DlTensor& t, const py::capsule& owner, bool writable) {
  const py::dtype type = numpy_type(t);
  std::vector<py::ssize_t> shape(t.shape, t.shape + t.ndim), strides;
  bool empty = false;
  for (const py::ssize_t size : shape) {
    if (size < 0) refuse_buffer("it has a size below zero");
    empty = empty || size == 0;
  }
  if (t.data == nullptr && !empty) refuse_buffer("it has no memory");
  if (t.strides != nullptr)
    for (int i = 0; i < t.ndim; ++i) strides.push_back(t.strides[i] * type.itemsize());
  if (empty) return py::array(type, shape);  // where its memory begins means nothing
  py::array out(type, shape, strides, static_cast<const char*>(t.data) + t.byte_offset, owner);
  if (!writable) out.attr("setflags")(py::arg("write") = false);
  return out;
}

/// The capsule of a value: of version 1 if it knows that there is one.
py::object capsule_of(const py::handle& value) {
  const py::object ask = value.attr("__dlpack__");
  try {
    return ask(py::arg("max_version") = py::make_tuple(1, 0));
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError)) throw;
  }
  return ask();
}

/// A tensor that somebody else holds, too.
template <class Managed>
struct Lent {
  Tensor tensor;
  std::array<int64_t, Shape::kMaxRank> shape{}, strides{};
  Managed managed{};

  explicit Lent(Tensor t) : tensor(std::move(t)) {
    int64_t step = 1;
    for (int i = tensor.rank() - 1; i >= 0; --i) {
      const auto at = static_cast<size_t>(i);
      shape[at] = tensor.size(i), strides[at] = step;
      step *= tensor.size(i);
    }
    const bool floating = tensor.dtype() == DType::f32 || tensor.dtype() == DType::f64;
    managed.tensor = {tensor.numel() == 0 ? nullptr : tensor.bytes(),
                      kDlCpu,
                      0,
                      tensor.rank(),
                      floating ? kDlFloat : kDlInt,
                      static_cast<uint8_t>(8 * size_of(tensor.dtype())),
                      1,
                      shape.data(),
                      strides.data(),
                      0};
    managed.owner = this;
    managed.deleter = [](Managed* m) { delete static_cast<Lent*>(m->owner); };
  }
};

template <class Managed>
py::object lent(Lent<Managed>* kept) {
  return py::capsule(&kept->managed, kCapsule<Managed>.first, [](PyObject* capsule) {
    const char* name = kCapsule<Managed>.first;
    if (PyCapsule_IsValid(capsule, name) == 0) return;  // it has another owner now
    auto* m = static_cast<Managed*>(PyCapsule_GetPointer(capsule, name));
    m->deleter(m);
  });
}

}  // namespace

bool offers_dlpack(const py::handle& value) {
  return PyObject_HasAttrString(value.ptr(), "__dlpack__") != 0 &&
         PyObject_HasAttrString(value.ptr(), "__dlpack_device__") != 0;
}

py::array array_by_dlpack(const py::handle& value, const std::string& what) {
  const auto [kind, id] = value.attr("__dlpack_device__")().cast<std::pair<int, int>>();
  if (!readable(kind))
    throw InputError(what, "lies in the memory of another device (" + device_text(kind, id) + ")",
                     "copy it to the CPU first, as x.cpu() does in PyTorch");
  const py::object capsule = capsule_of(value);
  if (PyCapsule_IsValid(capsule.ptr(), kCapsule<DlVersioned>.first) != 0) {
    DlVersioned* found = nullptr;
    const py::capsule owner = taken(capsule, found);
    if (found->major != 1) refuse_buffer("it is of a version of DLPack that is too new");
    return array_over(found->tensor, owner, (found->flags & kDlReadOnly) == 0);
  }
  DlManaged* found = nullptr;
  const py::capsule owner = taken(capsule, found);
  return array_over(found->tensor, owner, true);
}

py::object dlpack_of(const Tensor& tensor, const py::object& max_version, const py::object& device,
                     const py::object& copy) {
  if (!device.is_none() && !device.equal(py::make_tuple(kDlCpu, 0)))
    refuse_buffer("the tensor lies in the memory of the CPU, and is lent only there");
  const bool own = !copy.is_none() && copy.cast<bool>();
  Tensor here = tensor.cpu();
  if (own) here = here.clone();
  if (max_version.is_none() || max_version[py::int_(0)].cast<int>() < 1)
    return lent(new Lent<DlManaged>(std::move(here)));
  auto* kept = new Lent<DlVersioned>(std::move(here));
  kept->managed.major = 1;
  kept->managed.flags = own ? kDlCopied : kDlReadOnly;
  return lent(kept);
}

}  // namespace restage::python
