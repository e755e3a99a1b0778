// Weights files: all trained models of one system in one safetensors file. Inside a stage names are
// state-dict names; models and sizes stand as JSON in the metadata ("restage").
#pragma once

#include <map>
#include <memory>
#include <string>

#include "nn/models/deformation.h"
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

/// The prefix under which a registered model stands in a weights file; InputError for models that
/// have no place there.
std::string stage_prefix(const std::string& model);
/// Puts a model into the set, in its place, replacing what was there.
void put_model(ModelSet* models, const std::string& name, const ModelSizes& sizes,
               std::unique_ptr<Module> net);

}  // namespace restage
