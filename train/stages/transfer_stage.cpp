#include "train/stages/transfer_stage.h"

#include <algorithm>
#include <numeric>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/losses/measure.h"
#include "nn/losses/transfer.h"
#include "nn/models/lart.h"

namespace restage {
namespace {

/// A window is as long as the model wants it; points correspond where the model needs that.
TransferConfig for_model(TransferConfig c, const TransferModel& model) {
  c.frames = static_cast<int>(model.frames());
  if (model.corresponding() && c.shuffle)
    throw InputError("", "pairs.shuffle mixes points, and this model needs their order",
                     "set pairs.shuffle: false");
  if (model.equal_counts()) c.points = 0;
  return c;
}

/// All frames of all items below one another: [n, t, v, 3] -> [n t, v, 3].
Var frames_of(const Var& x) { return reshape(x, {x.size(0) * x.size(1), x.size(2), 3}); }

/// Frame number `t` of windows [n, t, v, 3].
Var frame_of(const Var& x, int64_t t) {
  return reshape(slice(x, 1, t, t + 1), {x.size(0), x.size(2), 3});
}

std::string joined(const std::vector<int32_t>& numbers) {
  std::string out;
  for (const int32_t i : numbers) out += (out.empty() ? "" : ",") + std::to_string(i);
  return out;
}

/// i32 [n, up to `most`]: vertices below `all`, in each row the same random ones.
Tensor some_of(int64_t all, int64_t most, int64_t n, const RngKey& key) {
  std::vector<int32_t> order(static_cast<size_t>(all));
  std::iota(order.begin(), order.end(), 0);
  Rng rng(key.fold("vertices"));
  const auto count = static_cast<size_t>(std::min(all, most));
  for (size_t i = 0; i < count; ++i) std::swap(order[i], order[i + rng.below(order.size() - i)]);
  std::vector<int32_t> rows;
  for (int64_t k = 0; k < n; ++k) rows.insert(rows.end(), order.begin(), order.begin() + count);
  return Tensor::from<int32_t>({n, static_cast<int64_t>(count)}, rows);
}

}  // namespace

TransferStage::TransferStage(const Config& config, const StageInput& in)
    : Stage("transfer", config.optimiser, in.device),
      config_(config),
      model_(add_network<TransferModel>(config.model, RngKey{in.seed, 0}.fold("transfer"),
                                        {{"points", std::to_string(config.pairs.points)}})),
      optimiser_(add_optimiser("optimiser", {"transfer"}, config.optimiser)),
      sampler_(in.train, for_model(config.pairs, *model_), sampler_seed(in.seed, "transfer.pairs")),
      validation_sampler_(in.validation, for_model(config.pairs, *model_), 1,
                          model_->corresponding() ? &sampler_ : nullptr),
      key_(RngKey{in.seed, 0}.fold("transfer.step")) {
  if (model_->corresponding() && !(sampler_.corresponding() && validation_sampler_.corresponding()))
    throw InputError("", "bodies have different faces, and this model needs corresponding vertices",
                     "train on bodies of one topology, such as those of the open benchmark, or set "
                     "data.one_mesh for the built-in ones");
  if (config.loss.metric > 0 && dynamic_cast<Lart*>(model_) == nullptr)
    throw InputError("", "loss.metric needs a model whose codes can be mixed",
                     "choose model: transfer/lart, or set loss.metric: 0");
  if (config.loss.metric > 0 && model_->frames() < 2)
    throw InputError("", "loss.metric needs windows of two frames at least",
                     "set sizes.frames: 3, or loss.metric: 0");
  if (config.loss.adversarial > 0) {
    if (!model_->corresponding())
      throw InputError("", "loss.adversarial needs vertices in correspondence",
                       "choose model: transfer/tst, or set loss.adversarial: 0");
    const TstDiscriminatorConfig sizes{.vertices = sampler_.vertices()};
    discriminator_ = add_network<TstDiscriminator>(
        "discriminator", "transfer/tst_discriminator", AnyConfig(sizes),
        RngKey{in.seed, 0}.fold("transfer.discriminator"), {}, false);
    if (config.loss.train_discriminator)
      discriminator_optimiser_ =
          add_optimiser("discriminator_optimiser", {"discriminator"}, config.optimiser);
  }
  if (config.pairs.vertices > 0) {
    set("transfer", "vertices", std::to_string(sampler_.vertices()));
    if (model_->corresponding()) {
      set("transfer", "kept", joined(sampler_.kept()));
      set("transfer", "kept_of", std::to_string(in.train.bodies[0].rest.vertices.size()));
    }
  }
  // What does not fit is found out before hours of training.
  Context ctx;
  const TransferBatch one = moved(validation_sampler_.batch(0, 1), device());
  try {
    model_->forward(ctx, {one.pose, one.identity});
  } catch (const ShapeError& error) {
    const std::string text = error.what();
    throw InputError("", "pairs do not fit the model: " + text.substr(0, text.find("; got")),
                     "change transfer.pairs or transfer.sizes");
  }
}

TransferBatch TransferStage::batch(int64_t step, const MicroBatch& part) const {
  const int64_t n = config_.optimiser.batch;
  return sampler_.batch(part.from(drawn(step) * n, n), part.count(n));
}

/// LART's: a code between those of the first and the last frame gives a mesh whose distances lie
/// between theirs.
Var TransferStage::metric(Context& ctx, const TransferBatch& pairs) {
  auto& lart = dynamic_cast<Lart&>(*model_);
  const int64_t last = pairs.pose.size(1) - 1;
  const int64_t v = std::min(config_.loss.metric_points, pairs.identity.size(1));
  const double alpha = Rng(ctx.rng.fold("metric")).uniform();
  const Var codes = lart.codes(ctx, pairs.pose);
  const auto code = [&](int64_t t) { return slice(codes, 1, t, t + 1); };
  const Var mixed =
      frame_of(lart.decode(ctx, code(0) * (1 - alpha) + code(last) * alpha, pairs.identity), 0);
  // Vertices come in a random order, so the first ones are a random choice.
  const auto some = [&](const Var& x) { return slice(x, 1, 0, v); };
  return metric_loss(some(mixed), some(frame_of(pairs.truth, 0)).value,
                     some(frame_of(pairs.truth, last)).value, alpha);
}

Var TransferStage::loss(Context& ctx, const TransferBatch& pairs, int64_t step, Tensor* posed) {
  const TransferLossConfig& l = config_.loss;
  const Var made = model_->forward(ctx, {pairs.pose, pairs.identity});
  *posed = made.value;
  Var total = scale(mse(made, pairs.truth), l.reconstruction);
  const int64_t t = pairs.pose.size(1);
  const Var frames = frames_of(made);
  const Tensor truth = frames_of(pairs.truth).value;
  if (l.edge > 0) {
    const Tensor& right = l.edge_reference == EdgeReference::truth
                              ? truth
                              : repeat_items(Var(pairs.identity), t).value;
    total = total + scale(mean_all(edge_loss(frames, right, pairs.faces)), l.edge);
  }
  if (l.distances > 0) {
    const Tensor chosen =
        some_of(frames.size(1), l.metric_points, frames.size(0), ctx.rng).to(device());
    const auto some = [&](const Var& x) { return pair_distances(gather(x, chosen)); };
    total = total + scale(mse(some(frames), some(truth)), l.distances);
  }
  if (l.metric > 0 && step >= l.metric_from) total = total + scale(metric(ctx, pairs), l.metric);
  if (discriminator_ != nullptr) {
    const Frozen judge(ctx);
    const Var real = bce_with_logits(discriminator_->logits(ctx, frames), 1);
    total = total + scale(real, l.adversarial);
  }
  return total;
}

double TransferStage::update_discriminator(int64_t step, double rate) {
  const RngKey key = key_.fold("discriminator").fold(static_cast<uint64_t>(step));
  const Differentiated d = parts(*discriminator_optimiser_, [&](const MicroBatch& part) {
    const TransferBatch pairs = moved(batch(step, part), device());
    Context plain;  // the other network gets no gradient from this
    const Var made = model_->forward(plain, {pairs.pose, pairs.identity}).detach();
    return differentiate(part.key(key), [&](Context& ctx) {
      const auto judged = [&](const Var& x, double label) {
        return bce_with_logits(discriminator_->logits(ctx, frames_of(x)), label);
      };
      return judged(Var(pairs.truth), 1) + judged(made, 0);
    });
  });
  discriminator_optimiser_->step(d.gradients, rate);
  return d.loss;
}

NamedValues TransferStage::step(int64_t step) {
  const OptimiserConfig& o = config_.optimiser;
  const Differentiated d = parts(*optimiser_, [&](const MicroBatch& part) {
    const TransferBatch pairs =
        ahead_.take(may_draw_ahead(), step, part, [this](auto... of) { return batch(of...); });
    TransferBatch there = moved(pairs, device());
    there.faces = pairs.faces;  // the edge loss counts them on the host
    Tensor posed;
    Differentiated out =
        differentiate(part.key(key_.fold(static_cast<uint64_t>(step))),
                      [&](Context& ctx) { return loss(ctx, there, step, &posed); });
    out.values = {mean_distance(posed.cpu(), pairs.truth)};
    return out;
  });
  const double rate = learning_rate(o.schedule, step, o.steps);
  optimiser_->step(d.gradients, rate);
  NamedValues out = {{"loss", d.loss}, {"distance_mm", 1e3 * d.values[0]}, {"rate", rate}};
  if (discriminator_optimiser_ != nullptr)
    out.emplace_back("discriminator", update_discriminator(step, rate));
  return out;
}

NamedValues TransferStage::validate() {
  Context ctx;
  double distance = 0, squares = 0;
  const int64_t n = config_.validation_pairs;
  for (int64_t i = 0; i < n; ++i) {
    const TransferBatch pairs = validation_sampler_.batch(i, 1), there = moved(pairs, device());
    const Tensor made = model_->forward(ctx, {there.pose, there.identity}).value.cpu();
    distance += mean_distance(made, pairs.truth) / static_cast<double>(n);
    squares += mse(made, pairs.truth).value.item() / static_cast<double>(n);
  }
  return {{"distance_mm", 1e3 * distance}, {"pmd_1e4", 3e4 * squares}};
}

std::vector<Shown> TransferStage::show() {
  const int64_t n = std::min<int64_t>(8, config_.validation_pairs);
  const TransferBatch pairs = validation_sampler_.batch(0, n), there = moved(pairs, device());
  Context ctx;
  const Tensor made = model_->forward(ctx, {there.pose, there.identity}).value.cpu();
  Shown source{"source", {}}, answered{"posed target", {}}, truth{"true target", {}};
  const int64_t t = made.size(1);
  for (int64_t i = 0; i < n; ++i) {
    source.clouds.push_back(points_of(pairs.pose, i * t, pairs.pose.size(2)));
    answered.clouds.push_back(points_of(made, i * t, made.size(2)));
    truth.clouds.push_back(points_of(pairs.truth, i * t, made.size(2)));
  }
  return {source, answered, truth};
}

}  // namespace restage
