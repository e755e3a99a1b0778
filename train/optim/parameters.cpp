#include "train/optim/parameters.h"

namespace restage {

std::vector<NamedParameter> named_parameters(
    const std::vector<std::pair<std::string, Module*>>& modules) {
  std::vector<NamedParameter> out;
  for (const auto& [prefix, module] : modules)
    for (const StateEntry& e : state_of(*module, prefix))
      if (e.parameter != nullptr) out.push_back({e.name, e.parameter});
  return out;
}

Tensor saved_state(const TensorFile& file, const std::string& name, const Shape& shape,
                   const std::string& where, Device device) {
  const Tensor* t = file.find(name);
  if (t == nullptr || !(t->shape() == shape))
    throw InputError(where, "state '" + name + "' is missing or of another size",
                     "resume with the configuration that the run was made with");
  return t->clone().to(device);
}

}  // namespace restage
