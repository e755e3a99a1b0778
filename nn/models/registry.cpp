#include "nn/models/registry.h"

#include "autograd/base/nearest.h"
#include "nn/models/bone_field.h"
#include "nn/models/closed_form_motion.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/hybrid.h"
#include "nn/models/patch_transformer.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/models/smrm.h"

namespace restage {
namespace {

template <class M>
ModelType model(const char* name, const char* role, const char* help,
                typename M::Config config = {}) {
  return {name,
          help,
          role,
          AnyConfig(config),
          AnyConfig(config),
          [](const AnyConfig& c, const Init& init) -> std::unique_ptr<Module> {
            return std::make_unique<M>(c.as<typename M::Config>(), init);
          }};
}

/// The paper's network takes numbers as they are, which is the default of its sizes. So far no
/// training of ours went well that way (docs/method.md), so trainings start with other sizes.
ModelType smrm(const char* name, const char* help, RotationForm rotation) {
  SmrmConfig config;
  config.rotation = rotation;
  ModelType out = model<Smrm>(name, "motion", help, config);
  config.standardise = config.rest_pose_start = true;
  out.training = AnyConfig(config);
  return out;
}

}  // namespace

const std::vector<ModelType>& models() {
  static const std::vector<ModelType> table = {
      model<PointTransformer>("skeleton/point_transformer", "skeleton",
                              "the paper's extractor: 4 blocks, width 512, 1024 points"),
      model<PointNet>("skeleton/pointnet", "skeleton",
                      "the first version's extractor: PointNet with a 3x3 T-net"),
      model<PatchTransformer>("skeleton/patch_transformer", "skeleton",
                              "our small extractor for CPUs: patch tokens that vote"),
      smrm("smrm/rot6d", "the motion retargeting network with 6D rotations", RotationForm::sixd),
      smrm("smrm/quaternion", "the first version's, with quaternions", RotationForm::quaternion),
      model<Hybrid>("smrm/hybrid", "motion",
                    "closed form of joints that a recurrent network corrects, twists and ends"),
      model<ClosedFormMotion>("motion/closed_form", "motion",
                              "no network: the closed form of the joints, to compare with"),
      model<Discriminator>("smrm/discriminator", "discriminator",
                           "the motion discriminator of the adversarial loss"),
      model<WeightNet>("deformation/weights", "deformation.weights",
                       "skinning weights of a rest point"),
      model<OffsetNet>("deformation/offsets", "deformation.offsets",
                       "pose-corrective offset of a rest point"),
      model<RootNet>("deformation/root", "deformation.root",
                     "the third MLP: rest joints to pelvis in the scan"),
      model<BoneField>("deformation/bones", "deformation.weights",
                       "skinning weights from distances to the bones"),
      model<V1Field>("deformation/v1_field", "deformation.weights",
                     "the first version's skinning field"),
  };
  return table;
}

const ModelType& model_type(const std::string& name) {
  std::vector<std::string> names;
  for (const ModelType& type : models()) {
    if (type.name == name) return type;
    names.push_back(type.name);
  }
  const std::string near = nearest(name, names);
  throw InputError(
      "", "there is no model '" + name + "'",
      near.empty() ? "'restage info --help' lists them" : "did you mean '" + near + "'?");
}

std::unique_ptr<Module> make_model(const std::string& name, const AnyConfig& config,
                                   const Init& init) {
  auto module = model_type(name).make(config, init);
  name_scopes(*module, name);
  return module;
}

AnyConfig model_config(const std::string& name, const std::vector<std::string>& sizes) {
  AnyConfig out = model_type(name).config;
  ConfigNode tree = write_config(out);
  for (const std::string& size : sizes) apply_override(tree, size);
  read_config(tree, out);
  return out;
}

std::vector<std::string> models_of_role(const std::string& role) {
  std::vector<std::string> out;
  for (const ModelType& type : models())
    if (type.role == role) out.push_back(type.name);
  return out;
}

}  // namespace restage
