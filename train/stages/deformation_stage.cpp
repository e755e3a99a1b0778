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

/// The sizes of the networks of ours are those of the offsets, too.
AnyConfig offset_sizes(const DeformationStageConfig& c) {
  return c.model.sizes.holds<MlpConfig>() ? c.model.sizes : AnyConfig(MlpConfig());
}

/// Adds to `skin`, for each joint, how much of the points it moves in the data, and to `kept` how
/// much of that it moves by the predicted weights as well.
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
    : SupervisedStage("deformation", config.optimiser, in),
      config_(config),
      weights_(add_network<DeformationModel>(config.model,
                                             RngKey{in.seed, 0}.fold("deformation/weights"))),
      offsets_(config.offsets
                   ? add_network<OffsetNet>(
                         "deformation.offsets", "deformation/offsets", offset_sizes(config),
                         RngKey{in.seed, 0}.fold("deformation/offsets"),
                         {{"keep_root_rotation", config.keep_root_rotation ? "true" : "false"}})
                   : nullptr) {
  sampler_.emplace(in.train, with_weights(config.pairs, config.supervision > 0),
                   sampler_seed(in.seed, "deformation.pairs"));
  held_out_.emplace(in.validation, held_out(config.pairs), 1);
  begin({"deformation.weights", "deformation.offsets"});
}

DeformationBatch DeformationStage::batch_of(const PairBatch& p) const {
  DeformationBatch b{p.rest_points, p.posed_points, p.rest_joints, p.local,
                     p.axis_angle,  p.seen_points,  p.seen_joints};
  if (!config_.keep_root_rotation) {
    const Tensor none = Tensor::zeros({p.axis_angle.size(0), 3}, DType::f32, p.axis_angle.device());
    b.axis_angle = concat({Var(none), slice(Var(p.axis_angle), 1, 3, 3 * kJoints)}, 1).value;
  }
  return b;
}

/// The loss: a sum over the points of a pair, a mean over pairs.
Var DeformationStage::loss(Context& ctx, const PairBatch& pairs, int64_t step,
                           Tensor* posed) const {
  const DeformationBatch b = batch_of(pairs);
  if (const OwnTraining* own = own_loss(weights_)) {
    const auto seen = [](const Tensor& other, const Tensor& plain) {
      return Var(other.defined() ? other : plain);
    };
    return own->loss(ctx,
                     {{"rest", seen(b.seen_joints, b.rest_joints)},
                      {"points", seen(b.seen_points, b.rest_points)}},
                     as_vars(pairs));
  }
  const DeformationOutput out =
      deform(ctx, *weights_, step >= config_.skinning_steps ? offsets_ : nullptr, b);
  *posed = out.posed.value;
  Var total = distance_sum(out.posed, b.posed_points, config_.loss);
  if (config_.supervision > 0)
    total = total + scale(skin_cross_entropy(out.weights, pairs.weights), config_.supervision);
  return scale(total, 1.0 / static_cast<double>(b.posed_points.size(0)));
}

NamedValues DeformationStage::validate() {
  Context ctx;
  double with = 0, without = 0;
  std::array<double, kJoints> skin{}, kept{};
  const int64_t n = config_.validation_pairs;
  in_validation(n, 4, [&](int64_t i, int64_t count) {
    const PairBatch pairs = held_out_->batch(i, count);
    const DeformationBatch b = batch_of(moved(pairs, device()));
    const auto error = [&](const DeformationOutput& out) {
      return static_cast<double>(count) / static_cast<double>(n) *
             mean_distance(out.posed.value.cpu(), pairs.posed_points);
    };
    with += error(deform(ctx, *weights_, offsets_, b));
    const DeformationOutput plain = deform(ctx, *weights_, nullptr, b);
    without += error(plain);
    add_shared_skin(plain.weights.value.cpu(), pairs.weights, &skin, &kept);
  });
  double lost = 0;  // of the joint that loses most
  for (int j = 0; j < kJoints; ++j)
    if (skin[j] > 0) lost = std::max(lost, 1 - kept[j] / skin[j]);
  NamedValues values{{"skinning_mm", 1e3 * without}, {"skin_lost", lost}};
  // The figure with offsets comes first, since it is the error of the surface in the end.
  if (offsets_ != nullptr) values.insert(values.begin(), {"with_offsets_mm", 1e3 * with});
  return values;
}

std::vector<std::string> DeformationStage::figures() {
  if (offsets_ == nullptr) return {"skinning_mm", "skin_lost"};
  return {"with_offsets_mm", "skinning_mm", "skin_lost"};
}

std::vector<Shown> DeformationStage::show() {
  const int64_t n = shown_of(config_.validation_pairs);
  const PairBatch pairs = held_out_->batch(0, n);
  Context ctx;
  const Tensor posed =
      deform(ctx, *weights_, offsets_, batch_of(moved(pairs, device()))).posed.value.cpu();
  return {clouds_of("posed points", posed, spaced(n)),
          clouds_of("true points", pairs.posed_points, spaced(n))};
}

}  // namespace restage
