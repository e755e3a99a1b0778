#include "train/stages/deformation_stage.h"

#include <algorithm>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

std::unique_ptr<Mlp3> make_net(std::unique_ptr<Mlp3> (*make)(const Init&, int64_t),
                               const char* name, double dropout, uint64_t seed) {
  auto net = make(Init{RngKey{seed, 0}.fold(name), DType::f32}, kMlpWidth);
  if (dropout >= 0) net->dropout_rate = dropout;
  name_scopes(*net, name);
  return net;
}

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

DeformationStage::DeformationStage(const DeformationStageConfig& config, const Corpus& train,
                                   const Corpus& validation, uint64_t seed)
    : config_(config),
      weights_(make_net(make_weight_net, "deformation/weights", config.dropout, seed)),
      offsets_(make_net(make_offset_net, "deformation/offsets", config.dropout, seed)),
      root_(make_net(make_root_net, "deformation/root", config.dropout, seed)),
      adam_({{"weights.", weights_.get()}, {"offsets.", offsets_.get()}, {"root.", root_.get()}},
            config.optimiser.adam),
      sampler_(train, config.pairs, RngKey{seed, 0}.fold("deformation.pairs").stream),
      validation_sampler_(validation, held_out(config.pairs), 1),
      key_(RngKey{seed, 0}.fold("deformation.step")) {}

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
  const bool with_offsets = config_.offsets && step >= config_.skinning_steps;
  double distance = 0;
  const Differentiated d = differentiate(key_.fold(static_cast<uint64_t>(step)), [&](Context& ctx) {
    const DeformationOutput out =
        deform(ctx, *weights_, with_offsets ? offsets_.get() : nullptr, b);
    distance = mean_distance(out.posed.value, b.posed_points);
    // Sum over the points of a pair, mean over pairs.
    Var total =
        scale(squared_distance_sum(out.posed, b.posed_points), 1.0 / static_cast<double>(o.batch));
    if (config_.root_net) total = total + root_loss(ctx, b);
    return total;
  });
  const double rate = learning_rate(o.schedule, step, o.steps);
  adam_.step(d.gradients, rate, o.clip);
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
    with += share *
            mean_distance(deform(ctx, *weights_, offsets_.get(), b).posed.value, b.posed_points);
    without +=
        share * mean_distance(deform(ctx, *weights_, nullptr, b).posed.value, b.posed_points);
    if (config_.root_net) root += share * root_loss(ctx, b).value.item();
  }
  NamedValues values{{"skinning_mm", 1e3 * without}};
  if (config_.offsets) values.push_back({"with_offsets_mm", 1e3 * with});
  if (config_.root_net) values.push_back({"root_mse", root});
  return values;
}

void DeformationStage::save(TensorFile& file) const {
  append(&file, *weights_, "weights.");
  append(&file, *offsets_, "offsets.");
  append(&file, *root_, "root.");
  adam_.save("adam.", file);
}

void DeformationStage::load(const TensorFile& file, const std::string& where) {
  load_state(*weights_, file, "weights.", where);
  load_state(*offsets_, file, "offsets.", where);
  load_state(*root_, file, "root.", where);
  adam_.load("adam.", file, where);
}

void DeformationStage::export_models(ModelSet& set) {
  ModelSizes sizes;
  sizes.dropout = config_.dropout;
  set.extra["keep_root_rotation"] = config_.keep_root_rotation ? "true" : "false";
  set.weights = {"deformation/weights", sizes, std::move(weights_)};
  if (config_.offsets) set.offsets = {"deformation/offsets", sizes, std::move(offsets_)};
  if (config_.root_net) set.root = {"deformation/root", sizes, std::move(root_)};
}

}  // namespace restage
