// Full training steps as the trainer does them: forward, backward, Adam.
#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"
#include "bench/training.h"
#include "bench/work.h"
#include "nn/losses/deformation.h"
#include "nn/losses/motion.h"
#include "nn/models/deformation.h"

namespace restage::bench {
namespace {

constexpr int kClouds = 4;

std::shared_ptr<SkeletonModel> extractor_of(const std::string& model, bool dropout) {
  const bool drops = model == "skeleton/pointnet";
  const std::vector<std::string> sizes = {"dropout=0"};
  return make_model_as<SkeletonModel>(
      model, model_config(model, drops && !dropout ? sizes : std::vector<std::string>()), Init{});
}

/// Either extractor.
class SkeletonTraining : public Training {
 public:
  SkeletonTraining(const Inputs& inputs, const std::string& variant, const std::string& model,
                   const std::string& file, bool dropout)
      : net_(extractor_of(model, dropout)) {
    inputs.load(*net_, variant, file);
    make_dense(*net_, variant);
    const Var points = inputs.at("clouds.points"), joints = inputs.at("clouds.joints");
    train({{"", net_.get()}},
          [=, this](Context& ctx) { return mse(net_->forward(ctx, points).joints, joints); });
  }

 private:
  std::shared_ptr<SkeletonModel> net_;
};

std::unique_ptr<Item> skeleton(const Inputs& inputs, const std::string& variant, bool dropout) {
  return std::make_unique<SkeletonTraining>(inputs, variant, "skeleton/point_transformer",
                                            "skeleton", dropout);
}

std::unique_ptr<Item> pointnet(const Inputs& inputs, const std::string& variant, bool dropout) {
  return std::make_unique<SkeletonTraining>(inputs, variant, "skeleton/pointnet", "pointnet",
                                            dropout);
}

/// A to B and back to A, losses without the discriminator's.
template <int64_t batch>
class MotionTraining : public Training {
 public:
  MotionTraining(const Inputs& inputs, const std::string& variant, bool dropout)
      : net_(config(dropout), Init{}) {
    inputs.load(net_, variant, "smrm");
    const auto part = [&](const char* name) {
      return inputs.at(std::string("windows.") + name).rows(0, batch);
    };
    const MotionBatch b{part("joints"), part("joints"), part("trans"), part("trans"),
                        part("rest_a"), part("rest_b"), part("sixd"),  part("self_mask")};
    train({{"", &net_}}, [=, this](Context& ctx) {
      return motion_losses(ctx, net_, nullptr, b, MotionWeights{}).total;
    });
  }

 private:
  static SmrmConfig config(bool dropout) {
    SmrmConfig c;
    if (!dropout) c.dropout = 0;
    return c;
  }
  Smrm net_;
};

/// Skinning weights and offsets together.
class DeformationTraining : public Training {
 public:
  DeformationTraining(const Inputs& inputs, const std::string& variant, bool dropout)
      : weights_(config(dropout), Init{}), offsets_(config(dropout), Init{}) {
    inputs.load(weights_, variant, "weights");
    inputs.load(offsets_, variant, "offsets");
    name_scopes(weights_, "weights");
    name_scopes(offsets_, "offsets");
    const DeformationBatch b{inputs.at("pairs.rest_points"), inputs.at("pairs.posed_points"),
                             inputs.at("pairs.rest_joints"), inputs.at("pairs.local"),
                             inputs.at("pairs.axis_angle").reshape({-1, 3 * kJoints})};
    train({{"weights.", &weights_}, {"offsets.", &offsets_}}, [=, this](Context& ctx) {
      return scale(distance_sum(deform(ctx, weights_, &offsets_, b).posed, b.posed_points),
                   1.0 / kClouds);
    });
  }

 private:
  static MlpConfig config(bool dropout) { return {MlpConfig().width, dropout ? 0.2 : 0.0}; }
  WeightNet weights_;
  OffsetNet offsets_;
};

}  // namespace

std::vector<ItemInfo> training_items() {
  const double extractor = 3 * extractor_gflop(), window = 2 * 30 * 3 * motion_gflop();
  // Nobody asks for the gradient of the networks' inputs.
  const double inputs =
      2 * gflop_of(static_cast<double>(kSurfacePoints * (3 * kJoints + 3) * MlpConfig().width));
  const double pair = 3 * (weights_gflop(kSurfacePoints) + offsets_gflop(kSurfacePoints)) - inputs;
  return {ItemInfo("skeleton_train", "point transformer, batch 4", "cloud", kClouds, extractor,
                   skeleton, {"skeleton"}, {"dense"}),
          ItemInfo("smrm_train_b16", "SMRM, batch 16, windows of 30", "window", 16, window,
                   make_item<MotionTraining<16>>),
          ItemInfo("smrm_train_b64", "SMRM, batch 64, windows of 30", "window", 64, window,
                   make_item<MotionTraining<64>>),
          ItemInfo("deformation_train", "skinning weights and offsets, batch 4 of 6,890 points",
                   "pair", kClouds, pair, make_item<DeformationTraining>),
          ItemInfo("pointnet_train", "PointNet, batch 4", "cloud", kClouds, 3 * pointnet_gflop(),
                   pointnet)};
}

}  // namespace restage::bench
