#include "train/stages/deformation_stage.h"

#include <algorithm>
#include <array>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

PairConfig with_weights(PairConfig c, bool weights) {
  c.skin_weights = weights;
  return c;
}

PairConfig held_out(PairConfig c) {
  c.mirror = false;
  c.dressed = 0;
  c.skin_weights = true;
  return c;
}

/// Adds to `skin` how much of the points each joint moves in the data, and to `kept` how much of
/// that it moves by the predicted weights as well.
void add_shared_skin(const Tensor& predicted, const Tensor& truth,
                     std::array<double, kJoints>* skin, std::array<double, kJoints>* kept) {
  const float *p = predicted.data<float>(), *t = truth.data<float>();
  for (int64_t i = 0; i < truth.numel(); ++i) {
    const auto j = static_cast<size_t>(i % kJoints);
    (*skin)[j] += static_cast<double>(t[i]);
    (*kept)[j] += static_cast<double>(std::min(p[i], t[i]));
  }
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
      optimiser_(add_optimiser("optimiser", {"deformation.weights", "deformation.offsets"},
                               config.optimiser)),
      sampler_(in.train, with_weights(config.pairs, config.supervision > 0),
               sampler_seed(in.seed, "deformation.pairs")),
      validation_sampler_(in.validation, held_out(config.pairs), 1),
      key_(RngKey{in.seed, 0}.fold("deformation.step")) {}

DeformationBatch DeformationStage::batch_of(const PairBatch& p) const {
  DeformationBatch b{p.rest_points, p.posed_points, p.rest_joints, p.local,
                     p.axis_angle,  p.seen_points,  p.seen_joints};
  if (!config_.keep_root_rotation) {
    b.axis_angle = b.axis_angle.clone();
    for (int64_t i = 0; i < b.axis_angle.size(0); ++i)
      std::fill_n(b.axis_angle.data<float>() + i * 66, 3, 0.0f);
  }
  return b;
}

PairBatch DeformationStage::batch(int64_t step, const MicroBatch& part) const {
  const int64_t n = config_.optimiser.batch;
  return sampler_.batch(part.from(drawn(step) * n, n), part.count(n));
}

/// Sums over the points of a pair, means over pairs.
Var DeformationStage::loss(Context& ctx, const PairBatch& pairs, int64_t step,
                           double* distance) const {
  const DeformationBatch b = batch_of(pairs);
  const DeformationOutput out =
      deform(ctx, *weights_, step >= config_.skinning_steps ? offsets_ : nullptr, b);
  *distance = mean_distance(out.posed.value, b.posed_points);
  Var total = distance_sum(out.posed, b.posed_points, config_.loss);
  if (config_.supervision > 0)
    total = total + scale(skin_cross_entropy(out.weights, pairs.weights), config_.supervision);
  return scale(total, 1.0 / static_cast<double>(b.posed_points.size(0)));
}

NamedValues DeformationStage::step(int64_t step) {
  const OptimiserConfig& o = config_.optimiser;
  const Differentiated d = parts([&](const MicroBatch& part) {
    const PairBatch pairs = batch(step, part);
    double distance = 0;
    Differentiated out =
        differentiate(part.key(key_.fold(static_cast<uint64_t>(step))),
                      [&](Context& ctx) { return loss(ctx, pairs, step, &distance); });
    out.values = {distance};
    return out;
  });
  const double rate = learning_rate(o.schedule, step, o.steps);
  optimiser_->step(d.gradients, rate);
  return {{"loss", d.loss}, {"distance_mm", 1e3 * d.values[0]}, {"rate", rate}};
}

NamedValues DeformationStage::validate() {
  Context ctx;
  double with = 0, without = 0;
  std::array<double, kJoints> skin{}, kept{};
  const int64_t n = config_.validation_pairs, part = 4;
  for (int64_t i = 0; i < n; i += part) {
    const int64_t count = std::min(part, n - i);
    const PairBatch pairs = validation_sampler_.batch(i, count);
    const DeformationBatch b = batch_of(pairs);
    const auto share = static_cast<double>(count) / static_cast<double>(n);
    with += share * mean_distance(deform(ctx, *weights_, offsets_, b).posed.value, b.posed_points);
    const DeformationOutput plain = deform(ctx, *weights_, nullptr, b);
    without += share * mean_distance(plain.posed.value, b.posed_points);
    add_shared_skin(plain.weights.value, pairs.weights, &skin, &kept);
  }
  double lost = 0;  // by the joint that loses most
  for (int j = 0; j < kJoints; ++j)
    if (skin[j] > 0) lost = std::max(lost, 1 - kept[j] / skin[j]);
  NamedValues values{{"skinning_mm", 1e3 * without}, {"skin_lost", lost}};
  // First, since it is what the surface comes to.
  if (offsets_ != nullptr) values.insert(values.begin(), {"with_offsets_mm", 1e3 * with});
  return values;
}

std::vector<Shown> DeformationStage::show() {
  const int64_t n = std::min<int64_t>(8, config_.validation_pairs);
  const DeformationBatch b = batch_of(validation_sampler_.batch(0, n));
  Context ctx;
  const Tensor posed = deform(ctx, *weights_, offsets_, b).posed.value;
  Shown answered{"posed points", {}}, truth{"true points", {}};
  for (int64_t i = 0; i < n; ++i) {
    answered.clouds.push_back(points_of(posed, i, posed.size(1)));
    truth.clouds.push_back(points_of(b.posed_points, i, posed.size(1)));
  }
  return {answered, truth};
}

}  // namespace restage
