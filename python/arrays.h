// Between NumPy and our values. Whatever comes in is looked at before it is used; what goes out
// owns its memory or keeps alive who does.
#pragma once

#include <pybind11/numpy.h>

#include <memory>
#include <utility>
#include <vector>

#include "nn/geometry/body.h"
#include "python/bind.h"

namespace restage::python {

/// Whatever holds numbers as an array, without a copy where its memory can be read in place:
/// arrays, DLPack (PyTorch's tensors), __array__, the buffer protocol, lists. InputError naming
/// `what` for anything else, and for memory that is not the CPU's.
py::array array_like(const py::handle& value, const std::string& what);
/// The same for a value that offers its memory (no list, no iterator); any other as it is.
py::object array_or_same(const py::object& value, const std::string& what);
/// Whether a value offers its memory by DLPack, or by the buffer protocol.
bool lends_memory(const py::handle& value);
/// An array of real numbers, C-contiguous, of type T. InputError naming `what` for anything else.
template <class T>
py::array_t<T, py::array::c_style> numbers(const py::handle& value, const std::string& what);
/// InputError naming `what` for a masked array.
void refuse_mask(const py::handle& value, const std::string& what);
/// "[2, 3]"
std::string shape_text(const py::array& a);

struct Cloud {
  Points points;
  size_t left_out = 0;  ///< points that were NaN or infinite, as in Frame
};
/// [n, 3]; n may be 0. InputError naming `what` for anything else.
Cloud cloud_of(const py::handle& value, const std::string& what);
/// The same; InputError also where no point is left.
Cloud some_cloud_of(const py::handle& value, const std::string& what);
/// [22, 3]
Joints joints_of(const py::handle& value, const std::string& what);
/// [frames, 22, 3], or one frame.
std::vector<Joints> joint_frames_of(const py::handle& value, const std::string& what);

/// An array over memory that lives in `values`, which it takes.
template <class T, class V>
py::array array_of(std::vector<V> values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<V>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<V>*>(p); });
  return py::array_t<T>(std::move(shape), reinterpret_cast<const T*>(kept->data()), owner);
}
py::array array_of(const Joints& joints);  ///< float64 [22, 3]
py::array array_of(Points points);         ///< float32 [n, 3]
py::array array_of(std::vector<Triangle> faces);
/// Unit quaternions w x y z, w >= 0, as PredictionWriter writes them.
void append_rotations(const Rotations& global, std::vector<float>& out);
void append_joints(const Joints& joints, std::vector<float>& out);

}  // namespace restage::python
