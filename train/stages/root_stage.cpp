#include "train/stages/root_stage.h"

#include <cmath>

#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

PairConfig bodies(int64_t points, bool mirror) {
  PairConfig c;
  c.points = static_cast<int>(points);
  c.mirror = mirror;
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

RootStage::RootStage(const Config& config, const StageInput& in)
    : Stage("root", config.optimiser, in.device),
      config_(config),
      net_(add_network<RootNet>(config.model, RngKey{in.seed, 0}.fold("deformation/root"))),
      optimiser_(add_optimiser("optimiser", {"deformation.root"}, config.optimiser)),
      sampler_(in.train, bodies(config.points, true), sampler_seed(in.seed, "root.bodies")),
      validation_sampler_(in.validation, bodies(config.points, false), 1),
      key_(RngKey{in.seed, 0}.fold("root.step")) {}

Var RootStage::loss(Context& ctx, const PairBatch& b) const {
  const int64_t n = b.rest_points.size(0);
  return mse((*net_)(ctx, Var(b.rest_joints.reshape({n, 3 * kJoints}).to(device()))),
             Var(minus_centroid(b.rest_points).to(device())));
}

NamedTensors RootStage::examples(int64_t step) const {
  const int64_t n = config_.optimiser.batch;
  return named_tensors(sampler_.batch(drawn(step) * n, n));
}

NamedValues RootStage::step(int64_t step) {
  const OptimiserConfig& o = config_.optimiser;
  const Differentiated d = parts([&](const MicroBatch& part) {
    const PairBatch b =
        sampler_.batch(part.from(drawn(step) * o.batch, o.batch), part.count(o.batch));
    return differentiate(part.key(key_.fold(static_cast<uint64_t>(step))),
                         [&](Context& ctx) { return loss(ctx, b); });
  });
  const double rate = learning_rate(o.schedule, step, o.steps);
  optimiser_->step(d.gradients, rate);
  return {{"loss", d.loss}, {"rate", rate}};
}

NamedValues RootStage::validate() {
  Context ctx;
  const PairBatch b = validation_sampler_.batch(0, config_.validation_bodies);
  return {{"root_mm", 1e3 * std::sqrt(3 * loss(ctx, b).value.cpu().item())}};
}

}  // namespace restage
