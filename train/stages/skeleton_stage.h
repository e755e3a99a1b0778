// Supervised training of a skeleton extractor (spec 2.1; the paper's first stage).
#pragma once

#include "datasets/sampling/evaluation.h"
#include "nn/models/skeleton.h"
#include "train/stages/supervised_stage.h"

namespace restage {

template <class V>
void visit(V& v, CloudConfig& c) {
  v("noise", c.noise, "Gaussian noise per coordinate, metres", at_least(0));
  v("heading", c.heading, "turn clouds by any angle about y");
  v("mirror", c.mirror, "every second cloud mirrored");
  v("tpose_share", c.tpose_share, "part of the clouds that are rest poses", between(0, 1));
  v("tpose_heading", c.tpose_heading, "rest poses turn by up to this, degrees", between(0, 180));
  v("scale_jitter", c.scale_jitter, "bodies scaled by 1 +- this", below(0, 1));
  v("min_fraction", c.min_fraction, "least part of distinct points", between(0.05, 1));
  v("recombined", c.recombined, "part in which a limb or the upper body performs another frame",
    between(0, 1));
  v("dressed", c.dressed, "part of the clouds in clothes and hair", between(0, 1));
  v("one_camera", c.one_camera, "part of the clouds that one depth camera sees", between(0, 1));
  v("camera_ring", c.camera_ring, "part that three to seven cameras around see", between(0, 1));
  v("intruder", c.intruder, "part of what cameras see with somebody else's limb beside it",
    between(0, 1));
  v("bend", c.bend, "every joint but the pelvis turned by about this, degrees", between(0, 90));
  v("things", c.things, "part with a thing in the hand or beside the foot",
    added("0", between(0, 1)));
  v("cut_floor", c.cut_floor, "part whose lowest centimetres were cut away with the floor",
    added("0", between(0, 1)));
  v("smoothed", c.smoothed, "part whose surface a coarse volume has smoothed",
    added("0", between(0, 1)));
  v("skirts", c.skirts, "part with a skirt, or the lower part of a coat",
    added("0", between(0, 1)));
  v("ceiling", c.ceiling, "part of what cameras see that they see from above",
    added("0", between(0, 1)));
  v("cropped", c.cropped, "part of which a desk or the picture's edge hides something",
    added("0", between(0, 1)));
  v("sparse", c.sparse, "part with as few as 64 different points", added("0", between(0, 1)));
  v("noisy", c.noisy, "part with more noise, up to most_noise", added("0", between(0, 1)));
  v("most_noise", c.most_noise, "of noisy clouds, metres", added("0.045", at_least(0)));
  v("tilted", c.tilted, "part turned about an axis along the floor, most of them by little",
    added("0", between(0, 1)));
  v("upright", c.upright, "part shown with the trunk upright, as retarget shows people",
    added("0", between(0, 1)));
  v("remembered", c.remembered, "part with a memory of the frame before", between(0, 1));
  v("frame_step", c.frame_step, "only every so many frames of a motion (30: one a second)",
    between(1, 100000));
}

struct SkeletonStageConfig {
  ModelChoice model{"skeleton/point_transformer"};
  OptimiserConfig optimiser;
  CloudConfig clouds;
  Measure loss = Measure::mse;
  double bone_weight = 0, vote_weight = 0, segmentation_weight = 0, orientation_weight = 0.05;
  int64_t validation_clouds = 200;
};

template <class V>
void visit(V& v, SkeletonStageConfig& c) {
  visit_choice(v, c.model);
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("clouds", c.clouds, "how training clouds are made");
  v("loss", c.loss, "mse (the paper) or mean distance");
  v("bone_weight", c.bone_weight, "mean squared error of the bones' lengths (v1's trial)",
    at_least(0));
  v("vote_weight", c.vote_weight, "voting models: weight of each centre's own votes", at_least(0));
  v("segmentation_weight", c.segmentation_weight,
    "voting models: weight of naming the moving joint", at_least(0));
  v("orientation_weight", c.orientation_weight,
    "models that give rotations: weight of their columns' distance", at_least(0));
  v("validation_clouds", c.validation_clouds, "held-out clouds per validation", between(1, 1e6));
}

class SkeletonStage final : public SupervisedStage<CloudSampler> {
 public:
  using Config = SkeletonStageConfig;
  static std::vector<std::string> reads(const Config&) { return {}; }
  SkeletonStage(const Config& config, const StageInput& input);
  NamedValues validate() override;
  std::vector<std::string> figures() override;
  std::vector<Shown> show() override;

 private:
  void complete(int64_t step, const MicroBatch& part, CloudBatch* clouds) const override;
  Var loss(Context& ctx, const CloudBatch& batch, int64_t step, Tensor* answer) const override;
  Var loss_of(const SkeletonAnswer& answer, const CloudBatch& batch) const;
  Var voting_loss(const SkeletonOutput& out, const CloudBatch& batch) const;

  Config config_;
  SkeletonModel* model_;
  std::vector<CloudSubject> posed_, tposes_;
  // Held-out scans by ray casting, one batch for each kind of cloud; undefined if the stage does
  // not train on that kind.
  CloudBatch one_camera_, ring_, intruded_;
  CloudBatch followed_;  ///< held-out sequences of people whom one camera follows
};

/// Errors of a model on given clouds (evaluation mode); means over joints.
struct SkeletonErrors {
  double joints = 0;  ///< distance, metres
  /// Angle, radians; empty if the model gives no rotations or the truth is not known.
  std::optional<double> turns;
  std::optional<double> outside;  ///< part of the joints outside their 90 % regions
};
SkeletonErrors skeleton_errors(SkeletonModel& model, const CloudBatch& clouds);

/// An answer in the form in which the next clouds remember it (SkeletonInput::past). The centroids
/// of both are given in the world, [n, 3].
Tensor remembered(const SkeletonAnswer& answer, const Tensor& centres, const Tensor& now);
/// Mean distance over joints, metres. `clouds` holds sequences of `frames` frames, one after the
/// other; each frame is seen with the answer to the frame before it in memory.
double followed_error(SkeletonModel& model, const CloudBatch& clouds, int64_t frames,
                      Device device = {});

}  // namespace restage
