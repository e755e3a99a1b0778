#include "python/bind.h"

PYBIND11_MODULE(_core, m) {
  using namespace restage::python;  // NOLINT
  m.doc() = "The C++ side of the package restage.";
  for (const auto add :
       {add_errors, add_command, add_retarget, add_system, add_skeleton, add_readers, add_metrics,
        add_tensor, add_tape, add_ops, add_own_op, add_gradcheck, add_context, add_model,
        add_own_network, add_data, add_optim, add_train, add_main})
    add(m);
}
