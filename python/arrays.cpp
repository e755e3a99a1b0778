#include "python/arrays.h"

#include <cmath>
#include <span>

#include "autograd/base/error.h"
#include "autograd/base/words.h"
#include "python/dlpack.h"

namespace restage::python {

std::string shape_text(const py::array& a) {
  return "[" + joined(std::span(a.shape(), static_cast<size_t>(a.ndim()))) + "]";
}

void refuse_mask(const py::handle& value, const std::string& what) {
  if (py::isinstance(value, py::module_::import("numpy.ma").attr("MaskedArray")))
    throw InputError(what, "is a masked array, whose mask would be lost",
                     "leave the masked rows out: numpy.ma.compress_rows(a)");
}

namespace {

/// The first line of what Python raised; what is no Exception, such as Ctrl-C, goes on.
std::string reason_of(const py::error_already_set& error) {
  if (!error.matches(PyExc_Exception)) throw error;
  const std::string text = py::str(error.value());
  return text.substr(0, text.find('\n'));
}

/// The memory of what is ours.
std::optional<py::array> own_array(const py::handle& value) {
  if (py::isinstance<Tensor>(value)) return array_of(value.cast<const Tensor&>());
  if (py::isinstance<Parameter>(value)) return array_of(value.cast<PyParameter>()->value);
  if (py::isinstance<PyVar>(value)) return array_of(value.cast<const PyVar&>().var.value);
  return {};
}

}  // namespace

bool lends_memory(const py::handle& value) {
  return offers_dlpack(value) || PyObject_CheckBuffer(value.ptr()) != 0;
}

py::array array_like(const py::handle& value, const std::string& what) {
  if (py::isinstance<py::array>(value)) return py::reinterpret_borrow<py::array>(value);
  if (auto own = own_array(value)) return *std::move(own);
  std::string why;
  if (offers_dlpack(value)) {
    try {
      return array_by_dlpack(value, what);
    } catch (const py::error_already_set& error) {  // its __array__ may know more
      why = reason_of(error);
    } catch (const py::buffer_error& error) {
      why = error.what();
    }
  }
  try {
    const py::object out = py::module_::import("numpy").attr("asarray")(value);
    const bool other = why.empty() || out.attr("dtype").attr("kind").cast<std::string>() != "O";
    if (other) return py::reinterpret_borrow<py::array>(out);
  } catch (const py::error_already_set& error) {
    const std::string text = reason_of(error);
    if (why.empty()) why = text;
  }
  throw InputError(what, "is no array: " + why, "give an array of numbers");
}

py::object array_or_same(const py::object& value, const std::string& what) {
  const bool known = py::isinstance<py::array>(value) || py::isinstance<py::list>(value) ||
                     py::isinstance<py::tuple>(value);
  if (known || !(lends_memory(value) || PyObject_HasAttrString(value.ptr(), "__array__") != 0))
    return value;
  return array_like(value, what);
}

template <class T>
py::array_t<T, py::array::c_style> numbers(const py::handle& value, const std::string& what) {
  const auto refuse = [&](const std::string& wrong) {
    throw InputError(what, wrong, "give an array of numbers");
  };
  if (!value || value.is_none() || py::isinstance<py::str>(value)) refuse("is no array");
  refuse_mask(value, what);
  const py::array any = array_like(value, what);
  const char kind = any.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u')
    refuse("holds " + std::string(py::str(any.dtype())) + ", no real numbers");
  auto out = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(any);
  if (!out) PyErr_Clear(), refuse("cannot be read");
  return py::reinterpret_borrow<py::array_t<T, py::array::c_style>>(out);
}
template py::array_t<float, py::array::c_style> numbers<float>(const py::handle&,
                                                               const std::string&);
template py::array_t<double, py::array::c_style> numbers<double>(const py::handle&,
                                                                 const std::string&);

Cloud cloud_of(const py::handle& value, const std::string& what) {
  const auto a = numbers<float>(value, what);
  if (a.ndim() != 2 || a.shape(1) != 3)
    throw InputError(what, "has the shape " + shape_text(a), "give points as [n, 3], metres, y up");
  Cloud out;
  out.points.reserve(static_cast<size_t>(a.shape(0)));
  const float* p = a.data();
  for (py::ssize_t i = 0; i < a.shape(0); ++i, p += 3)
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]))
      out.points.emplace_back(p[0], p[1], p[2]);
  out.left_out = static_cast<size_t>(a.shape(0)) - out.points.size();
  return out;
}

Cloud some_cloud_of(const py::handle& value, const std::string& what) {
  Cloud out = cloud_of(value, what);
  if (out.points.empty()) throw InputError(what, "holds no points", "give a cloud of a person");
  return out;
}

std::vector<Joints> joint_frames_of(const py::handle& value, const std::string& what) {
  const auto a = numbers<double>(value, what);
  const bool one = a.ndim() == 2;
  if ((!one && a.ndim() != 3) || a.shape(one ? 0 : 1) != kJoints || a.shape(one ? 1 : 2) != 3)
    throw InputError(what, "has the shape " + shape_text(a),
                     "give the 22 joints as [frames, 22, 3], metres");
  std::vector<Joints> out(one ? 1 : static_cast<size_t>(a.shape(0)));
  const double* p = a.data();
  for (Joints& joints : out)
    for (Vec3& joint : joints) {
      joint = Eigen::Map<const Vec3>(p);
      if (!joint.allFinite()) throw InputError(what, "holds NaN or infinity", "give finite joints");
      p += 3;
    }
  return out;
}

Joints joints_of(const py::handle& value, const std::string& what) {
  const std::vector<Joints> frames = joint_frames_of(value, what);
  if (frames.size() != 1)
    throw InputError(what, "is not one skeleton", "give the 22 joints as [22, 3], metres");
  return frames[0];
}

py::array array_of(const Joints& joints) {
  std::vector<double> flat;
  for (const Vec3& joint : joints) flat.insert(flat.end(), joint.data(), joint.data() + 3);
  return array_of<double>(std::move(flat), {kJoints, 3});
}

py::array array_of(Points points) {
  const auto n = static_cast<py::ssize_t>(points.size());
  return array_of<float>(std::move(points), {n, 3});
}

py::array array_of(std::vector<Triangle> faces) {
  const auto n = static_cast<py::ssize_t>(faces.size());
  return array_of<int32_t>(std::move(faces), {n, 3});
}

void append_rotations(const Rotations& global, std::vector<float>& out) {
  for (const auto& q : quaternions(global))
    for (const double x : q) out.push_back(static_cast<float>(x));
}

void append_joints(const Joints& joints, std::vector<float>& out) {
  for (const Vec3& joint : joints)
    for (int i = 0; i < 3; ++i) out.push_back(static_cast<float>(joint[i]));
}

}  // namespace restage::python
