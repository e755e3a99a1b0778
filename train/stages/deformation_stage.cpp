#include "train/stages/deformation_stage.h"

#include <algorithm>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

PairConfig held_out(PairConfig c) {
  c.mirror = false;
  return c;
}

/// The pelvis, which is the origin of both, seen from the centroid of the rest points: [n, 3].
Tensor minus_centroid(const Tensor& points) {
  const int64_t n = points.size(0), v = points.size(1);
  Tensor out = Tensor::zeros({n, 3}, points.dtype());
  for (int64_t s = 0; s < n; ++s)
    for (int64_t i = 0; i < v; ++i)
      for (int64_t c = 0; c < 3; ++c)
        out.data<float>()[3 * s + c] -=
            points.data<float>()[3 * (s * v + i) + c] / static_cast<float>(v);
  return out;
}

}  // namespace

DeformationStage::DeformationStage(const Config& config, const StageInput& in)
    : Stage("deformation", config.optimiser),
      config_(config),
      weights_(add_network<DeformationModel>(config.model,
                                             RngKey{in.seed, 0}.fold("deformation/weights"))),
      offsets_(config.offsets
                   ? add_network<OffsetNet>(
                         "deformation.offsets", "deformation/offsets", config.model.sizes,
                         RngKey{in.seed, 0}.fold("deformation/offsets"),
                         {{"keep_root_rotation", config.keep_root_rotation ? "true" : "false"}})
                   : nullptr),
      root_(config.root_net
                ? add_network<RootNet>("deformation.root", "deformation/root", config.model.sizes,
                                       RngKey{in.seed, 0}.fold("deformation/root"))
                : nullptr),
      adam_(add_optimiser("adam",
                          {"deformation.weights", "deformation.offsets", "deformation.root"},
                          config.optimiser.adam)),
      sampler_(in.train, config.pairs, RngKey{in.seed, 0}.fold("deformation.pairs").stream),
      validation_sampler_(in.validation, held_out(config.pairs), 1),
      key_(RngKey{in.seed, 0}.fold("deformation.step")) {}

DeformationBatch DeformationStage::batch_of(const PairBatch& p) const {
  DeformationBatch b{p.rest_points, p.posed_points, p.rest_joints, p.local, p.axis_angle};
  if (!config_.keep_root_rotation) {
    b.axis_angle = b.axis_angle.clone();
    for (int64_t i = 0; i < b.axis_angle.size(0); ++i)
      std::fill_n(b.axis_angle.data<float>() + i * 66, 3, 0.0f);
  }
  return b;
}

Var DeformationStage::root_loss(Context& ctx, const DeformationBatch& b) const {
  const int64_t n = b.rest_points.size(0);
  return mse((*root_)(ctx, Var(b.rest_joints.reshape({n, 3 * kJoints}))),
             Var(minus_centroid(b.rest_points)));
}

PairBatch DeformationStage::batch(int64_t step) const {
  const int64_t n = config_.optimiser.batch;
  return sampler_.batch(step * n, n);
}

NamedValues DeformationStage::step(int64_t step) {
  const OptimiserConfig& o = config_.optimiser;
  const DeformationBatch b = batch_of(batch(step));
  const OffsetNet* offsets = step >= config_.skinning_steps ? offsets_ : nullptr;
  double distance = 0;
  const Differentiated d = differentiate(key_.fold(static_cast<uint64_t>(step)), [&](Context& ctx) {
    const DeformationOutput out = deform(ctx, *weights_, offsets, b);
    distance = mean_distance(out.posed.value, b.posed_points);
    // Sum over the points of a pair, mean over pairs.
    Var total =
        scale(squared_distance_sum(out.posed, b.posed_points), 1.0 / static_cast<double>(o.batch));
    if (root_ != nullptr) total = total + root_loss(ctx, b);
    return total;
  });
  const double rate = learning_rate(o.schedule, step, o.steps);
  adam_->step(d.gradients, rate, o.clip);
  return {{"loss", d.loss}, {"distance_mm", 1e3 * distance}, {"rate", rate}};
}

NamedValues DeformationStage::validate() {
  Context ctx;
  double with = 0, without = 0, root = 0;
  const int64_t n = config_.validation_pairs, part = 4;
  for (int64_t i = 0; i < n; i += part) {
    const int64_t count = std::min(part, n - i);
    const DeformationBatch b = batch_of(validation_sampler_.batch(i, count));
    const auto share = static_cast<double>(count) / static_cast<double>(n);
    with += share * mean_distance(deform(ctx, *weights_, offsets_, b).posed.value, b.posed_points);
    without +=
        share * mean_distance(deform(ctx, *weights_, nullptr, b).posed.value, b.posed_points);
    if (root_ != nullptr) root += share * root_loss(ctx, b).value.item();
  }
  NamedValues values{{"skinning_mm", 1e3 * without}};
  if (offsets_ != nullptr) values.push_back({"with_offsets_mm", 1e3 * with});
  if (root_ != nullptr) values.push_back({"root_mse", root});
  return values;
}

}  // namespace restage
