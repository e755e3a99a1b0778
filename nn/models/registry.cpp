#include "nn/models/registry.h"

#include "autograd/base/nearest.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/patch_transformer.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/models/smrm.h"

namespace restage {
namespace {

int64_t or_default(int64_t value, int64_t standard) { return value > 0 ? value : standard; }

std::unique_ptr<Module> point_transformer(const ModelSizes& s, const Init& init) {
  PointTransformerConfig c;
  c.points = or_default(s.points, c.points);
  c.width = or_default(s.width, c.width);
  c.blocks = or_default(s.layers, c.blocks);
  c.neighbours = or_default(s.neighbours, c.neighbours);
  return std::make_unique<PointTransformer>(c, init);
}

std::unique_ptr<Module> pointnet(const ModelSizes& s, const Init& init) {
  PointNetConfig c;
  c.points = or_default(s.points, c.points);
  if (s.dropout >= 0) c.dropout = s.dropout;
  return std::make_unique<PointNet>(c, init);
}

std::unique_ptr<Module> patch_transformer(const ModelSizes& s, const Init& init) {
  PatchTransformerConfig c;
  c.points = or_default(s.points, c.points);
  c.width = or_default(s.width, c.width);
  c.layers = or_default(s.layers, c.layers);
  c.centres = or_default(s.centres, c.centres);
  c.neighbours = or_default(s.neighbours, c.neighbours);
  if (c.width % c.heads != 0)
    throw InputError("",
                     "width " + std::to_string(c.width) +
                         " of skeleton/patch_transformer does not fit its heads",
                     "give a multiple of " + std::to_string(c.heads));
  return std::make_unique<PatchTransformer>(c, init);
}

template <RotationForm form>
std::unique_ptr<Module> smrm(const ModelSizes& s, const Init& init) {
  SmrmConfig c;
  c.rotation = form;
  c.hidden = or_default(s.hidden, c.hidden);
  c.standardise = s.standardise;
  c.rest_pose_start = s.rest_pose_start;
  if (s.dropout >= 0) c.dropout = s.dropout;
  return std::make_unique<Smrm>(c, init);
}

std::unique_ptr<Module> discriminator(const ModelSizes&, const Init& init) {
  return std::make_unique<Discriminator>(DiscriminatorConfig{}, init);
}

template <std::unique_ptr<Mlp3> (*make)(const Init&, int64_t)>
std::unique_ptr<Module> mlp(const ModelSizes& s, const Init& init) {
  auto net = make(init, kMlpWidth);
  if (s.dropout >= 0) net->dropout_rate = s.dropout;
  return net;
}

}  // namespace

const std::vector<ModelInfo>& models() {
  static const std::vector<ModelInfo> table = {
      {"skeleton/point_transformer", "the paper's extractor: 4 blocks, width 512, 1024 points",
       point_transformer},
      {"skeleton/pointnet", "the first version's extractor: PointNet with a 3x3 T-net", pointnet},
      {"skeleton/patch_transformer", "our small extractor for CPUs: patch tokens that vote",
       patch_transformer},
      {"smrm/rot6d", "the motion retargeting network with 6D rotations", smrm<RotationForm::sixd>},
      {"smrm/quaternion", "the first version's, with quaternions", smrm<RotationForm::quaternion>},
      {"smrm/discriminator", "the motion discriminator of the adversarial loss", discriminator},
      {"deformation/weights", "skinning weights of a rest point", mlp<make_weight_net>},
      {"deformation/offsets", "pose-corrective offset of a rest point", mlp<make_offset_net>},
      {"deformation/root", "the third MLP: rest joints to pelvis in the scan", mlp<make_root_net>},
      {"deformation/v1_field", "the first version's skinning field", mlp<make_v1_field>},
  };
  return table;
}

std::unique_ptr<Module> make_model(const std::string& name, const ModelSizes& sizes,
                                   const Init& init) {
  std::vector<std::string> names;
  for (const ModelInfo& info : models()) {
    if (info.name == name) {
      auto model = info.make(sizes, init);
      name_scopes(*model, name);
      return model;
    }
    names.push_back(info.name);
  }
  const std::string near = nearest(name, names);
  throw InputError(
      "", "there is no model '" + name + "'",
      near.empty() ? "'restage info --help' lists them" : "did you mean '" + near + "'?");
}

std::unique_ptr<SkeletonModel> make_skeleton_model(const std::string& name, const ModelSizes& sizes,
                                                   const Init& init) {
  auto model = make_model(name, sizes, init);
  auto* skeleton = dynamic_cast<SkeletonModel*>(model.get());
  if (skeleton == nullptr)
    throw InputError("", "'" + name + "' is not a skeleton extractor", "name one of skeleton/*");
  model.release();
  return std::unique_ptr<SkeletonModel>(skeleton);
}

}  // namespace restage
