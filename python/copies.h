// What copy and pickle do with our classes.
#pragma once

#include "python/bind.h"

namespace restage::python {

/// A TypeError that says why, for copy.copy(), copy.deepcopy() and pickle.
template <class Class>
void refuse_copies(Class& c, const char* why) {
  c.def("__reduce_ex__",
        [why](const py::object&, const py::object&) -> py::object { throw py::type_error(why); });
}

}  // namespace restage::python
