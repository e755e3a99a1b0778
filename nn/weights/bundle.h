// A bundle of weights: trained networks by the role that each fills in a system, with everything
// that must be known to use them. Stages hand on a bundle, weights files hold one, and `retarget`
// reads one.
//
//   role                 what fills it (interface)                       prefix in a file
//   skeleton             clouds -> joints (nn/models/skeleton.h)         skeleton.
//   motion               joints of A -> motion of B (nn/models/motion.h) smrm.
//   motion.late          the same, looking some frames ahead: may be     motion.late.
//                        absent; for sources that need not be answered
//                        at once
//   deformation.weights  skinning (nn/models/deformation.h)              deformation.weights.
//   deformation.offsets  OffsetNet, may be absent                        deformation.offsets.
//   codes                windows of clouds -> codes, and their meaning   codes.
//                        (nn/models/h4d.h)
//   any other            what its model is                               ROLE.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nn/geometry/joint_definition.h"
#include "nn/models/registry.h"
#include "nn/weights/safetensors.h"

namespace restage {

inline constexpr const char* kLateMotion = "motion.late";
/// Whether a model that the registry knows for `role` may fill `place` in a bundle.
inline bool may_fill(const std::string& role, const std::string& place) {
  return role == place || (role == "motion" && place == kLateMotion);
}

/// What must be known to use a network besides its sizes, such as the meaning of its translation.
using Settings = std::map<std::string, std::string>;

struct TrainedModel {
  std::string model;  ///< its name in the registry
  AnyConfig config;   ///< its sizes
  std::shared_ptr<Module> net;
  Settings settings;

  /// The value of a setting; the first of `known` if the model has no such setting. InputError if
  /// the value is not one of `known`.
  std::string setting(const std::string& name, const std::vector<std::string>& known) const;
};

class Bundle {
 public:
  /// InputError unless the model may_fill() the role, or if the registry does not know it.
  void put(const std::string& role, TrainedModel model);
  void erase(const std::string& role) { by_role_.erase(role); }
  /// Null if there is none.
  const TrainedModel* find(const std::string& role) const;
  /// InputError naming `where` the bundle comes from.
  const TrainedModel& need(const std::string& role, const std::string& where) const;
  /// The network of a role as the type `M` that its users need; null if there is none or it is no
  /// `M`.
  template <class M>
  M* find_as(const std::string& role) const {
    const TrainedModel* found = find(role);
    return found == nullptr ? nullptr : dynamic_cast<M*>(found->net.get());
  }
  template <class M>
  M& need_as(const std::string& role, const std::string& where) const {
    M* net = dynamic_cast<M*>(need(role, where).net.get());
    if (net == nullptr)
      throw InputError(where, "holds a model for " + role + " that cannot be used as one",
                       "give weights of another training");
    return *net;
  }
  /// Puts all models of another bundle into this one, in the place of models of the same roles.
  void add(const Bundle& other);
  /// A bundle of the models of `roles` that are here.
  Bundle only(const std::vector<std::string>& roles) const;

  bool empty() const { return by_role_.empty(); }
  auto begin() const { return by_role_.begin(); }
  auto end() const { return by_role_.end(); }

 private:
  std::map<std::string, TrainedModel> by_role_;
};

/// The setting that names the joints a network was trained with.
inline constexpr const char* kJointsSetting = "joint_definition";
/// The definition of joints that all networks of a bundle share (common_definition()); empty: the
/// weights do not say. InputError naming `where`: two networks have different ones.
JointDefinition joint_definition(const Bundle& bundle, const std::string& where);

/// Roles, and kLateMotion where "motion" is one of them.
std::vector<std::string> with_late(std::vector<std::string> roles);

/// Takes the networks of some roles to a device, for everybody who shares the networks.
void move_networks(const Bundle& bundle, const std::vector<std::string>& roles, Device device);

/// The prefix of a role's tensors in a weights file.
std::string prefix_of(const std::string& role);

TensorFile to_file(const Bundle& bundle);
/// What identifies the networks of a bundle: the bytes of its file, with sizes as write_identity()
/// gives them and without kJointsSetting: the numbers already depend on the joints.
std::string identity_bytes(const Bundle& bundle);
void save_bundle(const std::string& path, const Bundle& bundle);

/// All models of a file, in float32. InputError naming `where` if a model is unknown, its sizes are
/// impossible or unknown, tensors belong to no model, or (StateError) tensors do not fit.
Bundle bundle_of(const TensorFile& file, const std::string& where);
/// The models of a weights file, or of a folder that holds weights.safetensors (a run, an
/// artifact).
Bundle load_bundle(const std::string& path);
/// The weights file that load_bundle() reads. InputError if the folder holds none.
std::string weights_path(const std::string& file_or_folder);

/// Builds a model and fills it with a plain state dict (StateError if that does not fit). The sizes
/// are what export_model() wrote down, changed by `sizes`, each "name=value".
TrainedModel import_model(const std::string& name, const std::vector<std::string>& sizes,
                          const TensorFile& state, const std::string& where);
/// One model as a plain state dict; its name, sizes and settings in the metadata. `which` names the
/// model by its name in the registry, its role or its prefix without the dot ("smrm"). InputError
/// if the bundle, which was read from `where`, has no such model, or two.
TensorFile export_model(const Bundle& bundle, const std::string& which, const std::string& where);

}  // namespace restage
