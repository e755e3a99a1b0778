// A bundle of weights: trained networks by the role that each fills in a system, with all that must
// be known to use them. It is what stages hand on, what weights files hold and what `retarget`
// reads.
//
//   role                 what fills it (interface)                       prefix in a file
//   skeleton             clouds -> joints (nn/models/skeleton.h)         skeleton.
//   motion               joints of A -> motion of B (nn/models/motion.h) smrm.
//   deformation.weights  skinning (nn/models/deformation.h)              deformation.weights.
//   deformation.offsets  OffsetNet, may be absent                        deformation.offsets.
//   any other            what its model is                               ROLE.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nn/models/registry.h"
#include "nn/weights/safetensors.h"

namespace restage {

/// What must be known to use a network besides its sizes, such as the meaning of its translation.
using Settings = std::map<std::string, std::string>;

struct TrainedModel {
  std::string model;  ///< its name in the registry
  AnyConfig config;   ///< its sizes
  std::shared_ptr<Module> net;
  Settings settings;

  /// The value of a setting, which must be one of `known`; without it the first of them.
  /// InputError otherwise: nothing is guessed.
  std::string setting(const std::string& name, const std::vector<std::string>& known) const;
};

class Bundle {
 public:
  /// InputError if the model is of another role than the registry says, or unknown.
  void put(const std::string& role, TrainedModel model);
  void erase(const std::string& role) { by_role_.erase(role); }
  /// Null if there is none.
  const TrainedModel* find(const std::string& role) const;
  /// InputError naming `where` the bundle comes from.
  const TrainedModel& need(const std::string& role, const std::string& where) const;
  /// The network of a role as what it is used for; null without one.
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
  /// Puts all of another bundle into this one; what was there for those roles goes.
  void add(const Bundle& other);
  /// Those of `roles` that are there.
  Bundle only(const std::vector<std::string>& roles) const;

  bool empty() const { return by_role_.empty(); }
  auto begin() const { return by_role_.begin(); }
  auto end() const { return by_role_.end(); }

 private:
  std::map<std::string, TrainedModel> by_role_;
};

/// Takes the networks of some roles to a device, for all who share them.
void move_networks(const Bundle& bundle, const std::vector<std::string>& roles, Device device);

/// The prefix of a role's tensors in a weights file.
std::string prefix_of(const std::string& role);

TensorFile to_file(const Bundle& bundle);
/// What identifies the networks of a bundle: the bytes of its file, with sizes as write_identity()
/// gives them.
std::string identity_bytes(const Bundle& bundle);
void save_bundle(const std::string& path, const Bundle& bundle);

/// All models of a file, in float32. InputError naming `where` if a model is unknown, its sizes are
/// impossible or unknown, tensors belong to none, or (StateError) do not fit; nothing is loaded
/// then.
Bundle bundle_of(const TensorFile& file, const std::string& where);
/// Of a weights file, or of a folder that holds weights.safetensors (a run, an artifact).
Bundle load_bundle(const std::string& path);
/// The weights file that load_bundle() reads. InputError if the folder holds none.
std::string weights_path(const std::string& file_or_folder);

/// Builds a model and fills it with a plain state dict (StateError if that does not fit). Sizes:
/// those that export_model() wrote down, then `sizes`, each "name=value".
TrainedModel import_model(const std::string& name, const std::vector<std::string>& sizes,
                          const TensorFile& state, const std::string& where);
/// One model as a plain state dict; its name, sizes and settings in the metadata. `which` is its
/// model, its role or its prefix without the dot ("smrm"); InputError if the bundle, read from
/// `where`, has none.
TensorFile export_model(const Bundle& bundle, const std::string& which, const std::string& where);

}  // namespace restage
