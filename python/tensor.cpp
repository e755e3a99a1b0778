// restage.Tensor: numbers, shared with NumPy.
#include "autograd/tensor/tensor.h"

#include "autograd/kernels/kernel.h"
#include "python/arrays.h"
#include "python/dlpack.h"

namespace restage::python {
namespace {

py::dtype numpy_of(DType type) {
  switch (type) {
    case DType::f32:
      return py::dtype::of<float>();
    case DType::f64:
      return py::dtype::of<double>();
    case DType::i32:
      return py::dtype::of<int32_t>();
    default:
      return py::dtype::of<int64_t>();
  }
}

[[noreturn]] void refuse(const std::string& why) { throw ShapeError("tensor: " + why); }

/// The type in which an array's numbers are held.
DType held_as(const py::dtype& type) {
  const char kind = type.kind();
  const auto size = type.itemsize();
  if (kind == 'f' && size <= 8) return size == 8 ? DType::f64 : DType::f32;
  if (kind == 'b') return DType::i32;
  if (kind == 'i' || (kind == 'u' && size < 8)) {
    const bool wide = size > 4 || (kind == 'u' && size == 4);
    return wide ? DType::i64 : DType::i32;
  }
  refuse("an array of " + std::string(py::str(static_cast<const py::object&>(type))) +
         " holds no numbers that an op could take");
}

/// Gives an array back under the GIL, from whatever thread.
std::shared_ptr<void> keeper_of(py::array array) {
  return {new py::array(std::move(array)), [](void* p) {
            if (!Py_IsInitialized()) return;
            const py::gil_scoped_acquire acquired;
            delete static_cast<py::array*>(p);
          }};
}

void copy_into(Tensor& t, const py::handle& value) {
  const Tensor from = tensor_of(value).cast(t.dtype());
  if (!(from.shape() == t.shape()))
    refuse("cannot take " + from.shape().str() + " into " + t.shape().str());
  const Tensor here = from.to(t.device());
  if (t.numel() > 0)
    backend(t.device())
        .copy(const_cast<void*>(t.address()), here.address(),
              static_cast<size_t>(t.numel()) * size_of(t.dtype()));
  t.written();
}

/// What pickle and copy carry.
py::tuple tensor_state(const Tensor& t) {
  const Tensor here = t.cpu();
  const auto size = static_cast<size_t>(here.numel()) * size_of(here.dtype());
  const auto* bytes = size == 0 ? "" : static_cast<const char*>(here.bytes());
  return py::make_tuple(name_of(here.dtype()), tuple_of(here.shape()), py::bytes(bytes, size));
}

Tensor tensor_of_state(const py::tuple& state) {
  if (state.size() != 3) refuse("this is no state of a tensor");
  const auto bytes = state[2].cast<std::string_view>();
  Tensor out = Tensor::empty(shape_of(state[1]), dtype_of(state[0].cast<std::string>()));
  if (bytes.size() != static_cast<size_t>(out.numel()) * size_of(out.dtype()))
    refuse("this is no state of a tensor");
  if (!bytes.empty()) std::memcpy(out.bytes(), bytes.data(), bytes.size());
  return out;
}

std::string text_of(const Tensor& t) {
  return "Tensor(" + t.shape().str() + ", " + name_of(t.dtype()) + ")";
}

}  // namespace

std::recursive_mutex& recording() {
  static std::recursive_mutex mutex;
  return mutex;
}

DType dtype_of(const std::string& name) {
  for (const DType type : {DType::f32, DType::f64, DType::i32, DType::i64})
    if (name == name_of(type)) return type;
  refuse("'" + name.substr(0, 40) + "' is none of float32, float64, int32, int64");
}

Shape shape_of(const py::handle& value) {
  Shape out;
  const auto size_of = [](const py::handle& size) {
    if (!PyIndex_Check(size.ptr()) || PyBool_Check(size.ptr()))
      refuse("a shape is a tuple of integers");
    const py::ssize_t n = PyNumber_AsSsize_t(size.ptr(), PyExc_OverflowError);
    if (n == -1 && PyErr_Occurred()) PyErr_Clear(), refuse("a shape is a tuple of integers");
    return static_cast<int64_t>(n);
  };
  if (PyIndex_Check(value.ptr()) && !py::isinstance<py::sequence>(value))
    return Shape{size_of(value)};
  if (!py::isinstance<py::sequence>(value) || py::isinstance<py::str>(value))
    refuse("a shape is a tuple of integers");
  for (const py::handle size : py::reinterpret_borrow<py::sequence>(value))
    out.push_back(size_of(size));
  return out;
}

py::tuple tuple_of(const Shape& shape) {
  py::tuple out(shape.rank());
  for (int i = 0; i < shape.rank(); ++i) out[static_cast<size_t>(i)] = shape[i];
  return out;
}

Tensor tensor_of(const py::handle& value, bool share) {
  if (py::isinstance<Tensor>(value)) return value.cast<Tensor>();
  if (!value || value.is_none() || py::isinstance<py::str>(value)) refuse("there is no array");
  refuse_mask(value, "tensor");
  const py::array any = array_like(value, "tensor");
  const DType type = held_as(any.dtype());
  if (any.ndim() > Shape::kMaxRank) refuse("more than six dimensions");
  Shape shape;
  for (py::ssize_t i = 0; i < any.ndim(); ++i) shape.push_back(any.shape(i));
  if (any.ndim() == 0) shape.push_back(1);
  const auto as_held =
      py::array::ensure(py::module_::import("numpy").attr("require")(any, numpy_of(type), "CA"));
  if (!as_held) throw py::error_already_set();
  void* data = const_cast<void*>(as_held.data());
  // What may not be written to is no memory for a tensor, which assign() writes to.
  if (share && (data != any.data() || !lends_memory(value) || !as_held.writeable()))
    refuse(
        "copy=False: this array's memory cannot be shared; give a C-contiguous array of float32, "
        "float64, int32 or int64 that may be written to, or leave copy out");
  if (share || data != any.data()) return Tensor::borrow(shape, type, data, keeper_of(as_held));
  Tensor out = Tensor::empty(shape, type);
  if (out.numel() > 0) std::memcpy(out.bytes(), data, static_cast<size_t>(as_held.nbytes()));
  return out;
}

py::array array_of(const Tensor& tensor) {
  const Tensor here = tensor.cpu();
  std::vector<py::ssize_t> shape;
  for (int i = 0; i < here.rank(); ++i) shape.push_back(here.size(i));
  auto* kept = new Tensor(here);
  const py::capsule owner(kept, [](void* p) { delete static_cast<Tensor*>(p); });
  py::array out(numpy_of(here.dtype()), shape, here.bytes(), owner);
  out.attr("setflags")(py::arg("write") = false);
  return out;
}

Tensor index_of(const py::handle& value) {
  const Tensor t = tensor_of(value);
  if (t.dtype() != DType::i32 && t.dtype() != DType::i64)
    refuse(std::string("an index holds integers, not ") + name_of(t.dtype()));
  if (t.dtype() == DType::i32) return t.cpu().clone();
  const Tensor wide = t.cpu();
  for (int64_t i = 0; i < wide.numel(); ++i) {
    const int64_t x = wide.data<int64_t>()[i];
    if (x != static_cast<int32_t>(x)) refuse("an index is too large");
  }
  return wide.cast(DType::i32);
}

void add_tensor(py::module_& m) {
  py::class_<Tensor> tensor(m, "Tensor",
                            R"(Numbers in memory: float32, float64, int32 or int64, up to six axes.

Tensor(array) copies; Tensor(array, copy=False) shares the array's memory and keeps the array alive; ShapeError where
it cannot. Who changes the array then changes the tensor, unseen by a tape: never between forward and backward. NumPy sees a tensor through numpy() or np.asarray(), PyTorch through torch.from_dlpack(), without a
copy and only to be read, since a tape relies on what it was given; assign() writes. array: whatever NumPy takes, and
what offers its memory by DLPack, as PyTorch's tensors on the CPU do.)");
  offer_memory(tensor, [](const Tensor& t) { return t; });
  tensor
      .def(py::init([](const py::object& a, bool copy, const std::optional<std::string>& dtype) {
             Tensor out = tensor_of(a, !copy);
             if (copy && py::isinstance<Tensor>(a)) out = out.clone();
             return dtype ? out.cast(dtype_of(*dtype)) : out;
           }),
           py::arg("array"), py::arg("copy") = true, py::arg("dtype") = py::none())
      .def_static(
          "zeros",
          [](const py::object& shape, const std::string& dtype) {
            return Tensor::zeros(shape_of(shape), dtype_of(dtype));
          },
          py::arg("shape"), py::arg("dtype") = "float32")
      .def_property_readonly("shape", [](const Tensor& t) { return tuple_of(t.shape()); })
      .def_property_readonly("dtype", [](const Tensor& t) { return numpy_of(t.dtype()); })
      .def_property_readonly("ndim", &Tensor::rank)
      .def_property_readonly("size", &Tensor::numel)
      .def_property_readonly("version", &Tensor::version, "how often the memory was written to")
      .def(
          "numpy", [](const Tensor& t) { return array_of(t); }, "A read-only view.")
      .def("assign", &copy_into, py::arg("values"),
           "Takes the values of an array of the same shape into this memory.")
      .def("clone", &Tensor::clone, "The same numbers in memory of their own.")
      .def("cast", [](const Tensor& t, const std::string& name) { return t.cast(dtype_of(name)); })
      .def(
          "item",
          [](const Tensor& t, int64_t i) {
            if (i < 0 || i >= t.numel()) refuse("there is no element " + std::to_string(i));
            return t.cpu().item(i);
          },
          py::arg("index") = 0)
      .def("__len__", [](const Tensor& t) { return t.rank() == 0 ? int64_t{0} : t.size(0); })
      .def("__repr__", &text_of)
      .def(py::pickle(&tensor_state, &tensor_of_state));
}

}  // namespace restage::python
