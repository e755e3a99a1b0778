#include "train/stages/skeleton_stage.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/losses/deformation.h"

namespace restage {
namespace {

/// Euclidean lengths along the last axis (3), smooth at 0.
Var lengths(const Var& d) { return sqrt(add_scalar(sum(square(d), -1), 1e-8)); }

CloudConfig with_points(CloudConfig c, const SkeletonModel& model) {
  c.points = static_cast<int>(model.points());
  return c;
}

CloudConfig training_clouds(const SkeletonStageConfig& c, const SkeletonModel& model) {
  CloudConfig out = with_points(c.clouds, model);
  out.skin_weights = c.vote_weight > 0 || c.segmentation_weight > 0;
  return out;
}

/// Held-out clouds keep the noise and count of training, without mirror images.
CloudConfig held_out(CloudConfig c, const SkeletonModel& model) {
  c = with_points(c, model);
  c.mirror = false;
  c.scale_jitter = 0;
  c.dressed = c.one_camera = c.camera_ring = c.recombined = 0;
  return c;
}

}  // namespace

SkeletonStage::SkeletonStage(const Config& config, const StageInput& in)
    : Stage("skeleton", config.optimiser),
      config_(config),
      model_(add_network<SkeletonModel>(config.model, RngKey{in.seed, 0}.fold("skeleton.init"))),
      adam_(add_optimiser("adam", {"skeleton"}, config.optimiser.adam)),
      sampler_(in.train, training_clouds(config, *model_),
               RngKey{in.seed, 0}.fold("skeleton.clouds").stream),
      validation_sampler_(in.validation, held_out(config.clouds, *model_), 1),
      posed_(evaluation_clouds(in.validation, static_cast<size_t>(config.validation_clouds), 1)),
      tposes_(evaluation_tposes(in.validation, 4, config.clouds.tpose_heading, 1)),
      key_(RngKey{in.seed, 0}.fold("skeleton.step")) {
  const auto scans = [&](int cameras) {
    return evaluation_scans(in.validation, posed_, cameras, static_cast<int>(model_->points()), 1);
  };
  if (config.clouds.one_camera > 0) one_camera_ = scans(1);
  if (config.clouds.camera_ring > 0) ring_ = scans(6);
}

Var SkeletonStage::loss(Context& ctx, const CloudBatch& batch) const {
  const SkeletonOutput out = model_->forward(ctx, batch.points);
  Var total = config_.loss == SkeletonStageConfig::Loss::mse
                  ? mse(out.joints, Var(batch.joints))
                  : mean_all(lengths(out.joints - Var(batch.joints)));
  if (!out.centres.defined() || !batch.weights.defined()) return total;
  const int64_t n = batch.points.size(0), c = out.centres.size(1);
  const Var moved_by = gather(Var(batch.weights), out.centres);  // [n, c, 22] skin weights
  if (config_.vote_weight > 0) {
    const Var miss = lengths(out.votes - Var(batch.joints.reshape({n, 1, kJoints, 3})));
    total =
        total + scale(sum_all(miss * moved_by), config_.vote_weight / static_cast<double>(n * c));
  }
  if (config_.segmentation_weight > 0) {
    const Var log_share = log(add_scalar(softmax(out.segmentation), 1e-8));
    total = total - scale(sum_all(log_share * moved_by),
                          config_.segmentation_weight / static_cast<double>(n * c));
  }
  return total;
}

CloudBatch SkeletonStage::batch(int64_t step) const {
  const int64_t n = config_.optimiser.batch;
  return sampler_.batch(step * n, n);
}

NamedValues SkeletonStage::step(int64_t step) {
  const OptimiserConfig& o = config_.optimiser;
  const CloudBatch clouds = batch(step);
  const Differentiated d = differentiate(key_.fold(static_cast<uint64_t>(step)),
                                         [&](Context& ctx) { return loss(ctx, clouds); });
  const double rate = learning_rate(o.schedule, step, o.steps);
  adam_->step(d.gradients, rate, o.clip);
  return {{"loss", d.loss}, {"gradient_norm", d.norm}, {"rate", rate}};
}

double joint_error(SkeletonModel& model, const CloudBatch& clouds) {
  Context ctx;
  double total = 0;
  const int64_t n = clouds.points.size(0), part = 16;
  for (int64_t i = 0; i < n; i += part) {
    const int64_t to = std::min(n, i + part);
    const SkeletonOutput out = model.forward(ctx, clouds.points.rows(i, to));
    total +=
        mean_distance(out.joints.value, clouds.joints.rows(i, to)) * static_cast<double>(to - i);
  }
  return total / static_cast<double>(n);
}

NamedValues SkeletonStage::validate() {
  NamedValues out;
  const auto put = [&](const char* name, const CloudBatch& clouds) {
    if (clouds.points.defined()) out.push_back({name, 1e3 * joint_error(*model_, clouds)});
  };
  put("joint_error_mm", validation_sampler_.clouds(posed_));
  put("tpose_joint_error_mm", validation_sampler_.clouds(tposes_));
  put("ring_joint_error_mm", ring_);
  put("one_camera_joint_error_mm", one_camera_);
  return out;
}

}  // namespace restage
