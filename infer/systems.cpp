#include "infer/systems.h"

#include "autograd/base/format.h"
#include "autograd/base/registry.h"
#include "infer/h4d.h"
#include "infer/registration/refinement.h"
#include "infer/registration/registration.h"
#include "infer/transfer.h"

namespace restage {
namespace {

/// A Retargeter, or what is made from the same and from `more`.
template <class Kind, class... More>
std::unique_ptr<System> make_retargeter(SystemInput in, const More&... more) {
  if (in.rest)
    return std::make_unique<Kind>(more..., in.weights, in.weights_name, std::move(in.target),
                                  *in.rest, in.options);
  return std::make_unique<Kind>(more..., in.weights, in.weights_name, std::move(in.target),
                                in.target_name, in.options);
}

std::unique_ptr<System> make_chain(SystemInput in) {
  return make_retargeter<Retargeter>(std::move(in));
}

/// The chain with its motion network taken out: rotations are the closed form of the joints that
/// the extractor finds, and are copied.
std::unique_ptr<System> make_copy(SystemInput in) {
  const std::string model = "motion/closed_form";
  const AnyConfig sizes = model_config(model);
  in.weights.put("motion",
                 {model, sizes, make_model(model, sizes, Init{RngKey{}, DType::f32}), {}});
  in.weights.erase(kLateMotion);
  return make_retargeter<Retargeter>(std::move(in));
}

std::unique_ptr<System> make_refinement(SystemInput in) {
  const std::string where = in.target_name;
  in.options.late = false;  // each cloud is fitted in its own frame
  return make_retargeter<Refinement>(std::move(in), where);
}

std::unique_ptr<System> make_registration(SystemInput in) {
  if (!in.rest)
    throw InputError(in.target_name, "comes without its rest joints, which registration needs",
                     "give {rest} R.h5, or a rigged character as the target");
  return std::make_unique<Registration>(std::move(in.target), *in.rest, in.target_name);
}

std::unique_ptr<System> make_transfer(SystemInput in) {
  return std::make_unique<Transfer>(in.weights, in.weights_name, std::move(in.target),
                                    in.target_name, in.options);
}

std::unique_ptr<System> make_h4d(SystemInput in) {
  return std::make_unique<H4dSystem>(in.weights, in.weights_name, std::move(in.target),
                                     in.target_name, in.rest, in.options);
}

std::deque<SystemType> ours() {
  return {
      {.name = "chain",
       .help = "extractor, motion network and deformation of the weights",
       .roles = {"skeleton", "motion"},
       .surface = {"deformation.weights", "deformation.offsets"},
       .parts = true,
       .make = make_chain},
      {.name = "copy",
       .help = "no motion network: the rotations of the source's joints, copied as rig tools do",
       .roles = {"skeleton"},
       .surface = {"deformation.weights", "deformation.offsets"},
       .make = make_copy},
      {.name = "refine",
       .help = "the chain's answer, then fitted to each cloud",
       .roles = {"skeleton", "motion", "deformation.weights"},
       .make = make_refinement},
      {.name = "register",
       .help = "no learning: the target is registered to each cloud, then reposed",
       .needs_rest = true,
       .each_cloud = true,
       .make = make_registration},
      {.name = "transfer",
       .help = "one network that moves vertices, without a skeleton (NPT, LART, 3D-CoreNet)",
       .roles = {"transfer"},
       .each_cloud = true,
       .own_skin = false,
       .make = make_transfer},
      {.name = "h4d",
       .help = "codes of shape, pose and motion of windows of clouds (H4D)",
       .roles = {"codes"},
       .each_cloud = true,
       .make = make_h4d},
  };
}

Registry<SystemType>& table() {
  static Registry<SystemType> all("system", ours());
  return all;
}

}  // namespace

const std::deque<SystemType>& systems() { return table().all(); }

void register_system(SystemType type) { table().add(std::move(type)); }

std::unique_ptr<System> make_system(const SystemType& type, SystemInput input) {
  if (type.each_cloud && input.options.fps != kFps)
    throw InputError("",
                     format("the source has %g frames a second, and {system} %s answers each cloud",
                            input.options.fps, type.name.c_str()),
                     "give clouds at 30 frames a second, or use {system} chain");
  const auto own = std::move(input.own);
  if (!own) return type.make(std::move(input));
  if (!type.own_skin)
    throw InputError(input.target_name,
                     "has bones, and {system} " + type.name + " moves vertices without bones",
                     "use another system, or give the character as a mesh (.obj, .ply)");
  input.target = own->mesh();
  input.rest = own->rest();
  for (const std::string& role : type.surface) input.weights.erase(role);  // would not be shown
  auto system = type.make(std::move(input));
  system->wear(own);
  return system;
}

const SystemType& system_type(const std::string& name, const std::string& where) {
  return table().get(name, where);
}

}  // namespace restage
