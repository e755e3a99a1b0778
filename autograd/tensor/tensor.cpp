#include "autograd/tensor/tensor.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <span>

#include "autograd/base/error.h"
#include "autograd/base/module_path.h"
#include "autograd/base/words.h"
#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/scratch.h"
#include "autograd/tensor/host_view.h"

namespace restage {
namespace {

/// The kind of device whose memory data() may give now, and the distance of that memory from the
/// addresses of its tensors (HostView).
std::atomic<uint8_t> viewed{0};
std::atomic<std::ptrdiff_t> view_distance{0};

[[noreturn]] void not_readable(Device device) {
  const std::string name = name_of(device);
  if (viewed != 0)
    throw Error("a kernel of device '" + name_of(Device{viewed}) + "' was given memory of '" +
                name + "' (" + running_op() + ")");
  throw Error("the host reads memory of device '" + name + "' (" + running_op() +
              "); take cpu() of the tensor first");
}

}  // namespace

HostView::HostView(Device device, std::ptrdiff_t distance) {
  viewed = device.kind;
  view_distance = distance;
}
HostView::~HostView() {
  viewed = 0;
  view_distance = 0;
}

size_t size_of(DType type) { return type == DType::f64 || type == DType::i64 ? 8 : 4; }

const char* name_of(DType type) {
  static constexpr const char* names[] = {"float32", "float64", "int32", "int64"};
  return names[static_cast<int>(type)];
}

Shape::Shape(std::initializer_list<int64_t> dims) {
  for (const int64_t d : dims) push_back(d);
}

void Shape::push_back(int64_t size) {
  if (rank_ == kMaxRank) throw ShapeError("shape: more than six dimensions");
  if (size < -1) throw ShapeError("shape: negative dimension");
  dims_[rank_++] = size;
}

int64_t Shape::product(int from, int to) const {
  int64_t n = 1;
  for (int i = from; i < to; ++i) n *= dims_[i];
  return n;
}

int64_t Shape::numel() const { return product(0, rank_); }

std::string Shape::str() const {
  return "[" + joined(std::span(dims_).first(static_cast<size_t>(rank_))) + "]";
}

bool Shape::operator==(const Shape& other) const {
  if (rank_ != other.rank_) return false;
  for (int i = 0; i < rank_; ++i)
    if ((*this)[i] != other[i]) return false;
  return true;
}

Shape broadcast_shape(const Shape& a, const Shape& b, bool* ok) {
  const int rank = std::max(a.rank(), b.rank());
  Shape out;
  *ok = true;
  for (int i = 0; i < rank; ++i) {
    const int ia = i - (rank - a.rank()), ib = i - (rank - b.rank());
    const int64_t da = ia < 0 ? 1 : a[ia], db = ib < 0 ? 1 : b[ib];
    if (da != db && da != 1 && db != 1) *ok = false;
    out.push_back(da == 1 ? db : da);
  }
  return out;
}

struct Storage {
  Storage(size_t n, Device d) : bytes(n), device(d), data(backend(d).allocate(n)) {}
  Storage(void* foreign, size_t n, std::shared_ptr<void> keeper)
      : bytes(n), device{}, data(foreign), owner(std::move(keeper)) {}
  ~Storage() {
    if (!owner) backend(device).release(data, bytes);
  }
  Storage(const Storage&) = delete;
  Storage& operator=(const Storage&) = delete;
  size_t bytes;
  Device device;
  void* data;
  uint64_t version = 0;
  std::shared_ptr<void> owner;  ///< of memory that is not the backend's
};

Tensor Tensor::empty(const Shape& shape, DType type, Device device) {
  // Numbers: a larger size is a mistake, and must not overflow.
  constexpr int64_t kMost = int64_t{1} << 48;
  int64_t n = 1;
  for (int i = 0; i < shape.rank(); ++i) {
    if (shape[i] < 0) throw ShapeError("tensor: negative size in " + shape.str());
    if (shape[i] > kMost / n) throw ShapeError("tensor: " + shape.str() + " is too large");
    n *= std::max<int64_t>(1, shape[i]);
  }
  Tensor t;
  t.shape_ = shape;
  t.numel_ = shape.numel();
  t.dtype_ = type;
  t.storage_ = std::allocate_shared<Storage>(PoolAllocator<Storage>(),
                                             static_cast<size_t>(t.numel_) * size_of(type), device);
  t.base_ = t.storage_->data;
  return t;
}

Tensor Tensor::zeros(const Shape& shape, DType type, Device device) {
  Tensor t = empty(shape, type, device);
  backend(device).fill_zero(t.base_, t.size_in_bytes());
  return t;
}

Tensor Tensor::full(const Shape& shape, double value, DType type, Device device) {
  Tensor t = empty(shape, type);
  for (int64_t i = 0; i < t.numel_; ++i) {
    if (type == DType::f32)
      t.data<float>()[i] = static_cast<float>(value);
    else if (type == DType::f64)
      t.data<double>()[i] = value;
    else if (type == DType::i32)
      t.data<int32_t>()[i] = static_cast<int32_t>(value);
    else
      t.data<int64_t>()[i] = static_cast<int64_t>(value);
  }
  return t.to(device);
}

Tensor Tensor::borrow(const Shape& shape, DType type, void* data, std::shared_ptr<void> owner) {
  Tensor t;
  t.shape_ = shape;
  t.numel_ = shape.numel();
  t.dtype_ = type;
  t.storage_ = std::allocate_shared<Storage>(PoolAllocator<Storage>(), data, t.size_in_bytes(),
                                             std::move(owner));
  t.base_ = data;
  return t;
}

template <class T>
Tensor Tensor::from(const Shape& shape, const std::vector<T>& values) {
  if (shape.numel() != static_cast<int64_t>(values.size()))
    throw ShapeError("Tensor::from: shape " + shape.str() + " does not hold " +
                     std::to_string(values.size()) + " values");
  Tensor t = empty(shape, DTypeOf<T>::value);
  if (!values.empty()) std::memcpy(t.base_, values.data(), values.size() * sizeof(T));
  return t;
}

Device Tensor::device() const { return storage_ ? storage_->device : Device{}; }

uint64_t Tensor::version() const { return storage_ ? storage_->version : 0; }

void Tensor::written() {
  if (storage_) ++storage_->version;
}

bool Tensor::shared() const { return storage_ && (storage_.use_count() > 1 || storage_->owner); }

template <class T>
T* Tensor::data() {
  if (dtype_ != DTypeOf<T>::value)
    throw ShapeError(std::string("tensor holds ") + name_of(dtype_) + ", not " +
                     name_of(DTypeOf<T>::value));
  return static_cast<T*>(bytes());
}

void* Tensor::bytes() {
  if (!storage_) return nullptr;
  if (storage_->device.kind != viewed.load(std::memory_order_relaxed)) not_readable(device());
  return static_cast<char*>(base_) + view_distance.load(std::memory_order_relaxed);
}

template <class T>
const T* Tensor::data() const {
  return const_cast<Tensor*>(this)->data<T>();
}

Tensor Tensor::reshape(const Shape& shape) const {
  Shape target = shape;
  int64_t known = 1;
  int open = -1, opens = 0;
  for (int i = 0; i < target.rank(); ++i) {
    if (target[i] == -1) {
      open = i;
      ++opens;
    } else {
      known *= target[i];
    }
  }
  if (opens == 1) target.set(open, known > 0 ? numel_ / known : 0);
  if (opens > 1 || target.numel() != numel_)
    throw ShapeError("reshape: " + shape_.str() + " to " + shape.str());
  Tensor t = *this;
  t.shape_ = target;
  return t;
}

Tensor Tensor::rows(int64_t from, int64_t to) const {
  if (rank() == 0 || from < 0 || to < from || to > shape_[0])
    throw ShapeError("rows: " + std::to_string(from) + ".." + std::to_string(to) + " of " +
                     shape_.str());
  Tensor t = *this;
  t.shape_.set(0, to - from);
  t.numel_ = t.shape_.numel();
  const int64_t row = shape_.product(1, rank());
  t.base_ = static_cast<char*>(base_) + static_cast<size_t>(from * row) * size_of(dtype_);
  return t;
}

Tensor Tensor::clone() const {
  Tensor t = empty(shape_, dtype_, device());
  if (numel_ > 0) backend(device()).copy(t.base_, base_, size_in_bytes());
  return t;
}

Tensor Tensor::to(Device to) const {
  const Device from = device();
  if (!defined() || from == to) return *this;
  if (from.kind != 0 && to.kind != 0) return cpu().to(to);
  Tensor t = empty(shape_, dtype_, to);
  if (numel_ == 0) return t;
  if (from.kind == 0)
    backend(to).copy_in(t.base_, base_, size_in_bytes());
  else
    backend(from).copy_out(t.base_, base_, size_in_bytes());
  return t;
}

double Tensor::item(int64_t i) const {
  switch (dtype_) {
    case DType::f32:
      return data<float>()[i];
    case DType::f64:
      return data<double>()[i];
    case DType::i32:
      return data<int32_t>()[i];
    case DType::i64:
      return static_cast<double>(data<int64_t>()[i]);
  }
  return 0;
}

template <class T>
std::vector<T> Tensor::to_vector() const {
  std::vector<T> out(static_cast<size_t>(numel_));
  for (int64_t i = 0; i < numel_; ++i) out[i] = static_cast<T>(item(i));
  return out;
}

Tensor Tensor::cast(DType type) const {
  if (type == dtype_) return *this;
  Tensor out = empty(shape_, type, device());
  if (numel_ > 0) launch(CastArgs{*this, out});
  return out;
}

bool all_finite(const Tensor& x) {
  Tensor found = Tensor::empty({1}, DType::i32, x.device());
  launch(NonFiniteArgs{x, found});
  return found.cpu().item() == 0;
}

#define RESTAGE_INSTANTIATE(T)                                          \
  template Tensor Tensor::from<T>(const Shape&, const std::vector<T>&); \
  template T* Tensor::data<T>();                                        \
  template const T* Tensor::data<T>() const;                            \
  template std::vector<T> Tensor::to_vector<T>() const;
RESTAGE_INSTANTIATE(float)
RESTAGE_INSTANTIATE(double)
RESTAGE_INSTANTIATE(int32_t)
RESTAGE_INSTANTIATE(int64_t)
#undef RESTAGE_INSTANTIATE

}  // namespace restage
