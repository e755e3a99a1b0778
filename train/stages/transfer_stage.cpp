#include "train/stages/transfer_stage.h"

#include "autograd/base/words.h"
#include "autograd/ops/reduce.h"
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

}  // namespace

TransferStage::TransferStage(const Config& config, const StageInput& in)
    : SupervisedStage("transfer", config.optimiser, in),
      config_(config),
      model_(add_network<TransferModel>(config.model, RngKey{in.seed, 0}.fold("transfer"),
                                        {{"points", std::to_string(config.pairs.points)}})) {
  const TransferConfig pairs = for_model(config.pairs, *model_);
  sampler_.emplace(in.train, pairs, sampler_seed(in.seed, "transfer.pairs"));
  held_out_.emplace(in.validation, pairs, 1, model_->corresponding() ? &*sampler_ : nullptr);
  check_losses();
  begin({"transfer"});
  if (config.loss.adversarial > 0) add_discriminator(in);
  if (config.pairs.vertices > 0) {
    set("transfer", "vertices", std::to_string(sampler_->vertices()));
    if (model_->corresponding()) {
      set("transfer", "kept", joined(sampler_->kept(), {}, ","));
      set("transfer", "kept_of", std::to_string(in.train.bodies[0].rest.vertices.size()));
    }
  }
  // What does not fit is found out before hours of training.
  Context ctx;
  const TransferBatch one = moved(held_out_->batch(0, 1), device());
  try {
    model_->forward(ctx, {one.pose, one.identity});
  } catch (const ShapeError& error) {
    const std::string text = error.what();
    throw InputError("", "pairs do not fit the model: " + text.substr(0, text.find("; got")),
                     "change transfer.pairs or transfer.sizes");
  }
}

void TransferStage::check_losses() const {
  const TransferLossConfig& l = config_.loss;
  if (model_->corresponding() && !(sampler_->corresponding() && held_out_->corresponding()))
    throw InputError("", "bodies have different faces, and this model needs corresponding vertices",
                     "train on bodies of one topology, such as those of the open benchmark, or set "
                     "data.one_mesh for the built-in ones");
  if (l.metric > 0 && dynamic_cast<Lart*>(model_) == nullptr)
    throw InputError("", "loss.metric needs a model whose codes can be mixed",
                     "choose model: transfer/lart, or set loss.metric: 0");
  if (l.metric > 0 && model_->frames() < 2)
    throw InputError("", "loss.metric needs windows of two frames at least",
                     "set sizes.frames: 3, or loss.metric: 0");
  if (l.adversarial > 0 && !model_->corresponding())
    throw InputError("", "loss.adversarial needs vertices in correspondence",
                     "choose model: transfer/tst, or set loss.adversarial: 0");
}

void TransferStage::add_discriminator(const StageInput& in) {
  const TstDiscriminatorConfig sizes{.vertices = sampler_->vertices()};
  discriminator_ =
      add_network<TstDiscriminator>("discriminator", "transfer/tst_discriminator", AnyConfig(sizes),
                                    RngKey{in.seed, 0}.fold("transfer.discriminator"), {}, false);
  if (!config_.loss.train_discriminator) return;
  OptimiserConfig optimiser = config_.optimiser;
  optimiser.groups.clear();  // they are of the network that is handed on
  discriminator_optimiser_ = add_optimiser("discriminator_optimiser", {"discriminator"}, optimiser);
}

TransferBatch TransferStage::taken_there(const TransferBatch& here) const {
  TransferBatch there = moved(here, device());
  there.faces = here.faces;  // the edge loss counts them on the host
  return there;
}

Var TransferStage::loss(Context& ctx, const TransferBatch& pairs, int64_t step,
                        Tensor* posed) const {
  if (const OwnTraining* own = own_loss(model_))
    return own->loss(ctx, {{"pose", pairs.pose}, {"identity", pairs.identity}}, as_vars(pairs));
  TransferWeights weights = static_cast<const TransferWeights&>(config_.loss);
  if (step < config_.loss.metric_from) weights.metric = 0;
  return transfer_loss(ctx, *model_, {pairs.pose, pairs.identity, pairs.truth, pairs.faces},
                       weights, discriminator_, posed);
}

double TransferStage::update_discriminator(int64_t step) {
  const RngKey key = key_.fold("discriminator").fold(static_cast<uint64_t>(step));
  const Differentiated d = parts(*discriminator_optimiser_, [&](const MicroBatch& part) {
    const TransferBatch pairs = moved(batch(step, part), device());
    Context plain;  // the other network gets no gradient from this
    const Var made = model_->forward(plain, {pairs.pose, pairs.identity}).detach();
    return differentiate(part.key(key), [&](Context& ctx) {
      const auto judged = [&](const Var& x, double label) {
        return bce_with_logits(discriminator_->logits(ctx, frames_below(x)), label);
      };
      return judged(Var(pairs.truth), 1) + judged(made, 0);
    });
  });
  discriminator_optimiser_->step(d.gradients, rate(step));
  return d.loss;
}

NamedValues TransferStage::step(int64_t step) {
  NamedValues out = SupervisedStage::step(step);
  if (discriminator_optimiser_ != nullptr)
    out.emplace_back("discriminator", update_discriminator(step));
  return out;
}

NamedValues TransferStage::validate() {
  Context ctx;
  double distance = 0, squares = 0;
  const int64_t n = config_.validation_pairs;
  in_validation(n, 1, [&](int64_t i, int64_t) {
    const TransferBatch pairs = held_out_->batch(i, 1), there = moved(pairs, device());
    const Tensor made = model_->forward(ctx, {there.pose, there.identity}).value.cpu();
    distance += mean_distance(made, pairs.truth) / static_cast<double>(n);
    squares += mse(made, pairs.truth).value.item() / static_cast<double>(n);
  });
  return {{"distance_mm", 1e3 * distance}, {"pmd_1e4", 3e4 * squares}};
}

std::vector<Shown> TransferStage::show() {
  const int64_t n = shown_of(config_.validation_pairs);
  const TransferBatch pairs = held_out_->batch(0, n), there = moved(pairs, device());
  Context ctx;
  const Tensor made = model_->forward(ctx, {there.pose, there.identity}).value.cpu();
  const std::vector<int64_t> first = spaced(n, 0, made.size(1));  // frames
  return {clouds_of("source", pairs.pose, first), clouds_of("posed target", made, first),
          clouds_of("true target", pairs.truth, first)};
}

}  // namespace restage
