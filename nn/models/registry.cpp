#include "nn/models/registry.h"

#include <filesystem>

#include "autograd/base/registry.h"
#include "nn/models/bone_field.h"
#include "nn/models/closed_form_motion.h"
#include "nn/models/corenet.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/h4d.h"
#include "nn/models/hybrid.h"
#include "nn/models/lart.h"
#include "nn/models/npt.h"
#include "nn/models/patch_transformer.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/models/smrm.h"
#include "nn/models/tst.h"

namespace restage {
namespace {

/// The paper's network takes numbers as they are, which is the default of its sizes. So far no
/// training of ours went well that way (docs/method.md), so trainings start with other sizes.
ModelType smrm(const char* name, const char* help, RotationForm rotation) {
  SmrmConfig config;
  config.rotation = rotation;
  ModelType out = model_of<Smrm>(name, "motion", help, config);
  config.standardise = config.rest_pose_start = true;
  out.training = AnyConfig(config);
  return out;
}

ModelType npt_pool() {
  NptConfig config;
  config.pool = true;
  return model_of<Npt>("transfer/npt_pool", "transfer", "NPT with a pooled pose code", config);
}

/// H4D's own sizes are for SMPL's 24 joints. Trainings start with those of our skeleton.
ModelType h4d() {
  ModelType out = model_of<H4d>("codes/h4d", "codes",
                                "H4D without clothes (Jiang et al. 2022): codes of a window");
  H4dConfig config;
  config.pose = 3 * kJoints;
  out.training = AnyConfig(config);
  return out;
}

std::deque<ModelType> ours() {
  return {
      model_of<PointTransformer>("skeleton/point_transformer", "skeleton",
                                 "the paper's extractor: 4 blocks, width 512, 1024 points"),
      model_of<PointNet>("skeleton/pointnet", "skeleton",
                         "the first version's extractor: PointNet with a 3x3 T-net"),
      model_of<PatchTransformer>("skeleton/patch_transformer", "skeleton",
                                 "our small extractor for CPUs: patch tokens that vote"),
      smrm("smrm/rot6d", "the motion retargeting network with 6D rotations", RotationForm::sixd),
      smrm("smrm/quaternion", "the first version's, with quaternions", RotationForm::quaternion),
      model_of<Hybrid>("smrm/hybrid", "motion",
                       "closed form of joints that a recurrent network corrects, twists and ends"),
      model_of<ClosedFormMotion>("motion/closed_form", "motion",
                                 "no network: the closed form of the joints, to compare with"),
      model_of<Discriminator>("smrm/discriminator", "discriminator",
                              "the motion discriminator of the adversarial loss"),
      model_of<WeightNet>("deformation/weights", "deformation.weights",
                          "skinning weights of a rest point"),
      model_of<OffsetNet>("deformation/offsets", "deformation.offsets",
                          "pose-corrective offset of a rest point"),
      model_of<RootNet>("deformation/root", "deformation.root",
                        "the third MLP: rest joints to pelvis in the scan"),
      model_of<BoneField>("deformation/bones", "deformation.weights",
                          "skinning weights from distances to the bones"),
      model_of<V1Field>("deformation/v1_field", "deformation.weights",
                        "the first version's skinning field"),
      model_of<Npt>("transfer/npt", "transfer", "Neural Pose Transfer (Wang et al. 2020)"),
      npt_pool(),
      model_of<Lart>("transfer/lart", "transfer", "LART (Chen et al. 2023), a reconstruction"),
      model_of<CoreNet>("transfer/corenet", "transfer", "3D-CoreNet (Song et al. 2021)"),
      model_of<Tst>("transfer/tst", "transfer",
                    "Temporal Shape Transfer (Regateiro and Boyer 2022)"),
      model_of<TstDiscriminator>("transfer/tst_discriminator", "transfer.discriminator",
                                 "TST's discriminator, which its program never trains"),
      h4d(),
  };
}

Registry<ModelType>& table() {
  static Registry<ModelType> all("model", ours());
  return all;
}

NetworkImporter& importer_of_networks() {
  static NetworkImporter importer;
  return importer;
}

}  // namespace

void set_network_importer(NetworkImporter importer) {
  importer_of_networks() = std::move(importer);
}

bool has_network_importer() { return importer_of_networks() != nullptr; }

void import_networks(std::vector<std::string>& files) {
  for (std::string& file : files) {
    std::error_code ignored;
    const auto whole = std::filesystem::absolute(file, ignored);
    if (!ignored) file = whole.lexically_normal().string();
    if (has_network_importer()) importer_of_networks()(file);
  }
}

const std::deque<ModelType>& models() { return table().all(); }

void register_model(ModelType type) { table().add(std::move(type)); }

void register_own_model(ModelType type) {
  table().put(std::move(type), [](const ModelType& known) { return !known.module.empty(); });
}

const ModelType& model_type(const std::string& name) { return table().get(name); }

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
