// v[...] of restage.Var.
#include <limits>
#include <numeric>

#include "autograd/ops/layout.h"
#include "python/arrays.h"
#include "python/var.h"

namespace restage::python {
namespace {

/// An index of NumPy, read for a shape: parts along axes, then rows that are picked, then the shape
/// of the result.
class Indexing {
 public:
  Indexing(const py::object& index, const Shape& of) : of_(of) {
    const py::tuple parts =
        py::isinstance<py::tuple>(index) ? py::tuple(index) : py::make_tuple(index);
    const int rest = of.rank() - named_by(parts);
    if (rest < 0)
      throw py::index_error("index: " + std::to_string(of.rank() - rest) +
                            " axes are named, and the value has " + std::to_string(of.rank()));
    bool opened = false;
    for (const py::handle part : parts) {
      if (part.ptr() == Py_Ellipsis) {
        if (std::exchange(opened, true)) throw py::index_error("index: ... stands there twice");
        for (int i = 0; i < rest; ++i) keep();
      } else {
        take(part);
      }
    }
    while (axis_ < of.rank()) keep();
  }

  bool nothing() const { return cuts_.empty() && picks_.empty() && shape_ == of_; }

  Var operator()(Var x) const {
    for (const Cut& cut : cuts_) x = slice(x, cut.axis, cut.from, cut.to);
    for (const Pick& pick : picks_) x = picked(x, pick);
    return x.shape() == shape_ ? x : reshape(x, shape_);
  }

 private:
  struct Cut {
    int axis;
    int64_t from, to;
  };
  struct Pick {
    int axis;
    std::vector<int32_t> places;
  };

  /// How many axes the parts name.
  static int named_by(const py::tuple& parts) {
    int out = 0;
    for (const py::handle part : parts) out += !part.is_none() && part.ptr() != Py_Ellipsis;
    return out;
  }

  static Var picked(const Var& x, const Pick& pick) {
    const int64_t before = x.shape().product(0, pick.axis), n = std::ssize(pick.places);
    Tensor index = Tensor::empty({before, n}, DType::i32);
    for (int64_t i = 0; i < before; ++i)
      std::copy(pick.places.begin(), pick.places.end(), index.data<int32_t>() + i * n);
    Shape out = x.shape();
    out.set(pick.axis, n);
    const int64_t after = x.shape().product(pick.axis + 1, x.rank());
    return reshape(gather(reshape(x, {before, x.size(pick.axis), after}), index), out);
  }

  void keep() {
    shape_.push_back(of_[axis_++]);
    parted();
  }
  /// An axis between an integer and an array: NumPy would put the array's axes first.
  void parted() { parted_ = parted_ || numbered_; }

  void take(const py::handle& part) {
    if (part.is_none()) {
      shape_.push_back(1);
      return parted();
    }
    if (PySlice_Check(part.ptr())) return take_slice(part);
    if (PyLong_Check(part.ptr()) && !PyBool_Check(part.ptr()))
      return take_integer(PyNumber_AsSsize_t(part.ptr(), PyExc_IndexError));
    if (py::isinstance(part, py::module_::import("numpy").attr("integer")))
      return take_integer(part.cast<int64_t>());
    take_array(part);
  }

  void take_slice(const py::handle& part) {
    py::ssize_t from = 0, to = 0, step = 0;
    if (PySlice_Unpack(part.ptr(), &from, &to, &step) < 0) throw py::error_already_set();
    const py::ssize_t count = PySlice_AdjustIndices(of_[axis_], &from, &to, step);
    shape_.push_back(count);
    parted();
    if (count == 0) return cut(0, 0);
    if (step == 1) return cut(from, to);
    Pick pick{axis_++, {}};
    for (py::ssize_t i = 0; i < count; ++i) pick.places.push_back(place(from + i * step));
    picks_.push_back(std::move(pick));
  }

  void cut(int64_t from, int64_t to) {
    if (from != 0 || to != of_[axis_]) cuts_.push_back({axis_, from, to});
    ++axis_;
  }

  void take_integer(int64_t i) {
    if (i == -1 && PyErr_Occurred()) throw py::error_already_set();
    const int64_t at = within(i);
    beside();
    numbered_ = true;
    cut(at, at + 1);
  }

  int64_t within(int64_t i) const {
    const int64_t n = of_[axis_];
    if (i < -n || i >= n)
      throw py::index_error("index: " + std::to_string(i) + " is out of range for axis " +
                            std::to_string(axis_) + " of " + std::to_string(n));
    return i < 0 ? i + n : i;
  }

  static int32_t place(int64_t i) {
    if (i > std::numeric_limits<int32_t>::max())
      throw ShapeError("index: an axis of more than 2^31 places takes no step and no array");
    return static_cast<int32_t>(i);
  }

  /// Integers and arrays stand side by side, or NumPy means something else by them.
  void beside() const {
    if (numbered_ && parted_ && array_seen_)
      throw ShapeError(
          "index: an array of indices and an integer with another axis between them; index "
          "twice, as in v[i][:, index]");
  }

  void take_array(const py::handle& part) {
    if (py::isinstance<PyVar>(part))
      throw ShapeError(
          "index: a Var is no index, as it has no integers; multiply by a mask, or give "
          "np.flatnonzero(mask)");
    const py::array any = array_like(part, "index");
    const char kind = any.dtype().kind();
    if (kind == 'b')
      throw ShapeError(
          "index: a mask of True and False is no index, as the shape would depend on numbers; "
          "multiply by it, or give np.flatnonzero(mask)");
    if (kind != 'i' && kind != 'u' && any.size() != 0)
      throw ShapeError("index: give integers, slices, ..., None, or one array of integers");
    if (array_seen_)
      throw ShapeError("index: two arrays of indices; index twice, as in v[a][:, b]");
    array_seen_ = true;
    beside();
    numbered_ = true;
    const auto places = py::array_t<int64_t, py::array::c_style | py::array::forcecast>(any);
    for (py::ssize_t i = 0; i < any.ndim(); ++i) shape_.push_back(any.shape(i));
    if (places.size() == 0) return cut(0, 0);
    Pick pick{axis_, {}};
    for (py::ssize_t i = 0; i < places.size(); ++i)
      pick.places.push_back(place(within(places.data()[i])));
    ++axis_;
    picks_.push_back(std::move(pick));
  }

  Shape of_, shape_;
  int axis_ = 0;
  bool numbered_ = false, parted_ = false, array_seen_ = false;
  std::vector<Cut> cuts_;
  std::vector<Pick> picks_;
};

PyVar indexed(const PyVar& v, const py::object& index) {
  const Indexing indexing(index, v.var.shape());
  if (indexing.nothing()) return as_seen(v);
  return on_value(v, [&](const Var& x) { return indexing(x); });
}

}  // namespace

void add_indexing(VarClass& var) {
  var.def("__getitem__", &indexed, py::arg("index"),
          "v[1], v[:, ::2], v[..., None], v[[0, 2]]: integers, slices, ..., None, and one array of "
          "integers. A value of its own; gradients of places that are taken twice add up.")
      .def("__setitem__",
           [](const PyVar&, const py::object&, const py::object&) {
             throw py::type_error(
                 "a Var is not written to, as the tape would compute wrong gradients: build a new "
                 "value, as mask * new + (1 - mask) * old, or restage.ops.concat([...], axis)");
           })
      .def("__len__",
           [](const PyVar& v) {
             if (v.var.rank() == 0) throw py::type_error("len() of a single number");
             return v.var.size(0);
           })
      .def("__iter__", [](const py::object& v) {
        if (v.cast<const PyVar&>().var.rank() == 0)
          throw py::type_error("a single number has no rows to go through");
        return py::reinterpret_steal<py::object>(PySeqIter_New(v.ptr()));
      });
}

}  // namespace restage::python
