#include "infer/systems.h"

#include "autograd/base/nearest.h"
#include "infer/own_skin.h"
#include "infer/registration/refinement.h"
#include "infer/registration/registration.h"

namespace restage {
namespace {

std::unique_ptr<Retargeter> make_retargeter(SystemInput in) {
  if (in.rest)
    return std::make_unique<Retargeter>(in.weights, in.weights_name, std::move(in.target), *in.rest,
                                        in.options);
  return std::make_unique<Retargeter>(in.weights, in.weights_name, std::move(in.target),
                                      in.target_name, in.options);
}

std::unique_ptr<System> make_chain(SystemInput in) { return make_retargeter(std::move(in)); }

std::unique_ptr<System> make_refinement(SystemInput in) {
  const std::string where = in.target_name;
  return std::make_unique<Refinement>(make_retargeter(std::move(in)), where);
}

std::unique_ptr<System> make_registration(SystemInput in) {
  if (!in.rest)
    throw InputError(in.target_name, "comes without its rest joints, which registration needs",
                     "give --rest R.h5, or a rigged character as the target");
  return std::make_unique<Registration>(std::move(in.target), *in.rest, in.target_name);
}

}  // namespace

const std::vector<SystemType>& systems() {
  static const std::vector<SystemType> table = {
      {"chain", "extractor, motion network and deformation of the weights", true, make_chain},
      {"refine", "the chain's answer, then fitted to each cloud", true, make_refinement},
      {"register", "no learning: the target is registered to each cloud, then reposed", false,
       make_registration},
  };
  return table;
}

std::unique_ptr<System> make_system(const SystemType& type, SystemInput input) {
  const auto own = std::move(input.own);
  if (!own) return type.make(std::move(input));
  input.target = own->mesh();
  input.rest = own->rest();
  if (type.name == "chain")  // its surface would not be shown
    for (const char* role : {"deformation.weights", "deformation.offsets"})
      input.weights.erase(role);
  return std::make_unique<OwnSkin>(type.make(std::move(input)), own);
}

const SystemType& system_type(const std::string& name, const std::string& where) {
  std::vector<std::string> names;
  std::string all;
  for (const SystemType& type : systems()) {
    if (type.name == name) return type;
    names.push_back(type.name);
    all += (all.empty() ? "" : ", ") + type.name;
  }
  const std::string near = nearest(name, names);
  throw InputError(where, "there is no system '" + name + "'",
                   near.empty() ? "use one of " + all : "did you mean '" + near + "'?");
}

}  // namespace restage
