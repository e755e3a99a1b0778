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
      adam_(add_optimiser("adam", {"deformation.weights", "deformation.offsets"},
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
    return scale(squared_distance_sum(out.posed, b.posed_points),
                 1.0 / static_cast<double>(o.batch));
  });
  const double rate = learning_rate(o.schedule, step, o.steps);
  adam_->step(d.gradients, rate, o.clip);
  return {{"loss", d.loss}, {"distance_mm", 1e3 * distance}, {"rate", rate}};
}

NamedValues DeformationStage::validate() {
  Context ctx;
  double with = 0, without = 0;
  const int64_t n = config_.validation_pairs, part = 4;
  for (int64_t i = 0; i < n; i += part) {
    const int64_t count = std::min(part, n - i);
    const DeformationBatch b = batch_of(validation_sampler_.batch(i, count));
    const auto share = static_cast<double>(count) / static_cast<double>(n);
    with += share * mean_distance(deform(ctx, *weights_, offsets_, b).posed.value, b.posed_points);
    without +=
        share * mean_distance(deform(ctx, *weights_, nullptr, b).posed.value, b.posed_points);
  }
  NamedValues values{{"skinning_mm", 1e3 * without}};
  if (offsets_ != nullptr) values.push_back({"with_offsets_mm", 1e3 * with});
  return values;
}

}  // namespace restage
