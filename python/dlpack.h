// DLPack: how libraries of arrays hand memory to one another, without a copy.
// https://dmlc.github.io/dlpack/latest/python_spec.html
#pragma once

#include <pybind11/numpy.h>

#include "python/engine.h"

namespace restage::python {

/// Whether a value offers its memory by DLPack.
bool offers_dlpack(const py::handle& value);
/// An array over the memory that `value` offers, which it keeps alive; read-only where its owner
/// says so. InputError naming `what`: the memory is not the CPU's. BufferError where NumPy has no
/// such numbers; what `value` itself raises goes through.
py::array array_by_dlpack(const py::handle& value, const std::string& what);
/// A tensor's memory as a capsule, which keeps it alive: version 1 of DLPack, marked read-only, for
/// who can read that; else the version before, which cannot say so. BufferError for another device.
py::object dlpack_of(const Tensor& tensor, const py::object& max_version, const py::object& device,
                     const py::object& copy);

/// Adds __array__ to a class, for NumPy; `of` gives its tensor.
template <class Class, class Of>
void offer_array(Class& c, Of of) {
  using Self = typename Class::type;
  c.def(
      "__array__",
      [of](const Self& self, const py::object& dtype, const py::object&) -> py::object {
        const py::array out = array_of(of(self));
        return dtype.is_none() ? py::object(out)
                               : out.attr("astype")(dtype, py::arg("copy") = false);
      },
      py::arg("dtype") = py::none(), py::arg("copy") = py::none());
}
/// The same, and __dlpack__ and __dlpack_device__, for PyTorch and others.
template <class Class, class Of>
void offer_memory(Class& c, Of of) {
  using Self = typename Class::type;
  offer_array(c, of);
  c.def(
      "__dlpack__",
      [of](const Self& self, const py::object&, const py::object& max_version,
           const py::object& device,
           const py::object& copy) { return dlpack_of(of(self), max_version, device, copy); },
      py::kw_only(), py::arg("stream") = py::none(), py::arg("max_version") = py::none(),
      py::arg("dl_device") = py::none(), py::arg("copy") = py::none(),
      "The memory for torch.from_dlpack() and its like, without a copy; only to be read.");
  c.def("__dlpack_device__", [](const Self&) { return py::make_tuple(1, 0); });
}

}  // namespace restage::python
