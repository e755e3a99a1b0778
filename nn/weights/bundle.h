// Weights files: all trained models of one system in one safetensors file. Inside a stage names are
// state-dict names; models and sizes stand as JSON in the metadata ("restage").
#pragma once

#include <map>
#include <memory>
#include <string>

#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/registry.h"
#include "nn/models/skeleton.h"
#include "nn/models/smrm.h"
#include "nn/weights/safetensors.h"

namespace restage {

/// One trained model: its name in the registry, its sizes, itself (null: absent).
template <class M>
struct TrainedModel {
  std::string name;
  ModelSizes sizes;
  std::unique_ptr<M> net;

  explicit operator bool() const { return net != nullptr; }
  M& operator*() const { return *net; }
  M* operator->() const { return net.get(); }
};

/// Everything that `skeleton` and `retarget` may need.
struct ModelSet {
  TrainedModel<SkeletonModel> skeleton;  ///< "skeleton."
  TrainedModel<Smrm> smrm;               ///< "smrm."
  TrainedModel<Mlp3> weights;            ///< "deformation.weights."
  TrainedModel<Mlp3> offsets;            ///< "deformation.offsets.", may be absent
  TrainedModel<Mlp3> root;               ///< "deformation.root.", may be absent
  // Not used by either, but at home in such files:
  TrainedModel<Mlp3> v1_field;                ///< "deformation.v1_field."
  TrainedModel<Discriminator> discriminator;  ///< "discriminator."
  /// Whatever else belongs to the models, such as the meaning of the translation.
  std::map<std::string, std::string> extra;
};

/// What the caller cannot do without; `deformation` means at least the skinning weights.
struct NeededModels {
  bool skeleton = false, smrm = false, deformation = false;
};

TensorFile to_file(const ModelSet& models);
void save_models(const std::string& path, const ModelSet& models);

/// All models of a file, in float32. InputError naming `where` if a needed model is missing, a
/// model is unknown, sizes are impossible or (StateError) the tensors do not fit; nothing is loaded
/// then.
ModelSet models_of(const TensorFile& file, const NeededModels& needs, const std::string& where);
ModelSet load_models(const std::string& path, const NeededModels& needs);

/// The prefix under which a registered model stands in a weights file.
std::string stage_prefix(const std::string& model);
/// Puts a model into the set, in its place, replacing what was there.
void put_model(ModelSet* models, const std::string& name, const ModelSizes& sizes,
               std::unique_ptr<Module> net);

/// Builds a model, fills it with a plain state dict (StateError if that does not fit) and puts it
/// into the set.
void import_model(ModelSet* models, const std::string& name, const ModelSizes& sizes,
                  const TensorFile& state, const std::string& where);
/// One model as a plain state dict, with its name and sizes in the metadata. `which` is its name or
/// its place ("smrm"); InputError if the set, read from `where`, has none.
TensorFile export_model(const ModelSet& models, const std::string& which, const std::string& where);
/// The sizes in the metadata of export_model(); the defaults in a file from elsewhere.
ModelSizes exported_sizes(const TensorFile& state, const std::string& where);
/// Sets a size by its name, from text "256" or "true"; InputError if there is no such size.
void set_size(ModelSizes* sizes, const std::string& name, const std::string& value);

}  // namespace restage
