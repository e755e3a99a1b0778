// What `restage retarget` and `restage stream` make a system of: weights, options, the target.
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "datasets/builtin/bodies.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/standard_weights.h"
#include "infer/unpose.h"

namespace restage::cli {
namespace {

Joints rest_joints(const std::string& path) {
  const Prediction rest = read_prediction(path);
  if (rest.joints.empty() || rest.frames != 1)
    throw InputError(path + ":/joints", "is not one skeleton",
                     "give the target's rest joints as [1, 22, 3]");
  Joints out;
  for (size_t j = 0; j < out.size(); ++j) out[j] = Eigen::Map<const Vec3>(&rest.joints[3 * j]);
  return out;
}

/// The joints that the system gives: those of its networks and of --rest. InputError if they have
/// two.
JointDefinition joints_given(const RetargetCommand& c, const SystemInput& input) {
  std::vector<NamedDefinition> said{
      {joint_definition(input.weights.only(with_late(system_type(c.system).roles)),
                        input.weights_name),
       input.weights_name}};
  if (!c.rest.empty()) said.push_back({PredictionReader(c.rest).read_small().definition, c.rest});
  return common_definition(said);
}

/// A target that is refused as it stands may only lack the names of its bones: then that is what
/// there is to mend.
template <class Work>
auto with_target(const RetargetCommand& c, const TargetMesh& target, const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    if (!std::string(error.what()).starts_with(c.target)) throw;
    if (!target.parts.empty())
      throw InputError(
          c.target,
          cat("has no skin, and its ", target.parts, " are no body's: ", target.unknown_parts),
          "bind them to a skeleton in the program that made them, or name their nodes with "
          "--bones");
    if (target.unknown_rig.empty()) throw;
    throw InputError(
        c.target, "it would be posed by its rig, which was not recognised: " + target.unknown_rig,
        "say which bone is which joint with --bones names.yaml (docs/formats.md)");
  }
}

}  // namespace

namespace {

/// Options that only an extractor's system reads would be lost without a word.
void check_effect(const RetargetOptions& o, const SystemType& type) {
  if (std::count(type.roles.begin(), type.roles.end(), "skeleton") > 0) return;
  const RetargetOptions plain;
  for (const auto& [given, name] : {std::pair{o.samples != plain.samples, "--samples"},
                                    {o.anchor != plain.anchor, "--anchor"},
                                    {o.min_confidence != plain.min_confidence, "--min-confidence"},
                                    {o.foot_lock != plain.foot_lock, "--no-foot-lock"},
                                    {o.keep_limbs != plain.keep_limbs, "--no-keep-limbs"},
                                    {o.steady_bones != plain.steady_bones, "--no-steady-bones"}})
    if (given)
      throw InputError("", std::string(name) + " says nothing to --system " + type.name,
                       "leave it out");
}

}  // namespace

void check_options(const RetargetOptions& options, const SystemType& type) {
  check_effect(options, type);
  if (!(options.min_confidence >= 0 && options.min_confidence <= 1))
    throw InputError("", "--min-confidence is out of range", "give 0 to 1");
  if (options.samples < 1 || options.samples > 256)
    throw InputError("", "--samples is out of range", "give 1 to 256");
}

void check_kept(const RetargetCommand& c, const TargetMesh& target) {
  if (target.unknown_rig.empty() || !c.to.skeleton.empty()) return;
  if (!text::ends_in(c.to.out, {".glb", ".gltf", ".vrm"})) return;
  throw InputError(c.target, "its rig was not recognised: " + target.unknown_rig,
                   "name its bones with --bones names.yaml; or, if its mesh stands in T-pose, "
                   "facing +z, ask for a skeleton of ours with --skeleton restage");
}

namespace {

/// Whether a target that does not stand in T-pose can be put into it by the system's networks.
bool may_be_unposed(const RetargetCommand& c, const TargetMesh& target) {
  const SystemType& type = system_type(c.system);
  return !target.own && !target.rigged && c.rest.empty() &&
         std::count(type.roles.begin(), type.roles.end(), "skeleton") > 0;
}

void check_by_doctor(const RetargetCommand& c, const TargetMesh& target, bool any_pose) {
  ExamineOptions known = target.known();
  known.any_pose = any_pose;
  with_target(c, target, [&] { check_target(target.mesh, c.target, known); });
}

}  // namespace

void check_mesh(const RetargetCommand& c, const TargetMesh& target) {
  if (c.options.force) return;
  if (target.own) return check_sides(*target.joints, c.target);  // its rig says all else
  check_by_doctor(c, target, may_be_unposed(c, target));
}

SystemInput load_input(const RetargetCommand& c, const Common& common) {
  SystemInput input;
  input.options = c.options;
  input.options.seed = common.seed;
  input.target_name = c.target;
  const SystemType& type = system_type(c.system);
  if (!c.rest.empty() && !type.own_skin)  // it moves vertices without joints
    throw InputError("", "--rest says nothing to --system " + type.name, "leave it out");
  for (const auto& [given, option] : {std::pair(&c.floor, "--floor"), {&c.contacts, "--contacts"}})
    if (!given->empty() && std::count(type.roles.begin(), type.roles.end(), "skeleton") == 0)
      throw InputError("", cat(option, " says nothing to --system ", type.name), "leave it out");
  if (c.weights.empty() && type.roles.empty()) return input;
  const std::string weights = c.weights.empty() ? standard_weights() : c.weights;
  input.weights_name = weights_path(weights);
  input.weights = load_bundle(weights);
  std::vector<std::string> needed = type.roles;
  if (!type.surface.empty()) needed.push_back(type.surface.front());
  for (const std::string& role : needed) input.weights.need(role, input.weights_name);
  move_networks(input.weights, with_late(type.roles), device_of(c.device));
  return input;
}

SinkOptions sink_options(const RetargetCommand& c, const SystemInput& input,
                         const TargetMesh& target) {
  SinkOptions out = c.to;
  // A rig has its joints where its maker wants them.
  if (!target.own) out.definition = joints_given(c, input);
  if (!out.joints.empty())
    JointConversion(out.definition, out.joints,
                    target.own       ? c.target
                    : c.rest.empty() ? input.weights_name
                                     : c.rest);
  return out;
}

bool is_on(const std::string& asked, const RetargetCommand& c, const TargetMesh& target) {
  if (!asked.empty()) return asked == "on";
  return target.own || !(c.to.out.empty() || text::ends_in(c.to.out, {".h5", ".hdf5"}));
}

PartSurfaces average_surfaces() {
  Body body = builtin_average_body();
  const double leg = leg_length(body.joints);
  for (Vec3& x : body.joints) x /= leg;
  for (Point& p : body.rest.vertices) p /= static_cast<float>(leg);
  return {body.rest, body.joints, body.weights};
}

namespace {

/// By its shape alone.
bool stands_in_t_pose(const RetargetCommand& c, const TargetMesh& target) {
  try {
    check_by_doctor(c, target, false);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

/// A mesh that stands otherwise is put into T-pose, where the weights can.
void take_t_pose(const RetargetCommand& c, SystemInput& input, TargetMesh& target) {
  std::optional<Unposed> found;
  try {
    found = with_target(c, target, [&] {
      return unpose(input.weights, input.weights_name, target.mesh, c.target, average_surfaces(),
                    input.options.seed);
    });
    if (!found && !c.options.force) check_by_doctor(c, target, false);
  } catch (const InputError&) {
    if (!c.options.force && !stands_in_t_pose(c, target)) throw;
  }
  if (!found) return;
  log_info(c.target +
           format(": was put into T-pose (a limb was %.0f degrees from it)", found->farthest));
  target.mesh = std::move(found->mesh);
  target.unposed = found->from;
  input.rest = found->rest;
}

}  // namespace

std::unique_ptr<System> system_for(const RetargetCommand& c, SystemInput input,
                                   TargetMesh& target) {
  input.options.floor = is_on(c.floor, c, target);
  if (is_on(c.contacts, c, target))
    input.options.contacts = std::make_shared<PartSurfaces>(average_surfaces());
  if (!c.rest.empty()) input.rest = rest_joints(c.rest);
  joints_given(c, input);
  if (target.own && !c.rest.empty())
    throw InputError(c.target, "has a rig that says where its joints are", "leave --rest out");
  if (may_be_unposed(c, target)) take_t_pose(c, input, target);
  input.own = target.own;
  input.target = std::move(target.mesh);
  return with_target(c, target,
                     [&] { return make_system(system_type(c.system), std::move(input)); });
}

}  // namespace restage::cli
