// Training of a network that poses a mesh without a skeleton: NPT, LART, 3D-CoreNet, TST (spec 9).
#pragma once

#include "datasets/sampling/transfers.h"
#include "nn/losses/transfer.h"
#include "train/stages/supervised_stage.h"

namespace restage {

inline EnumNames<Identity> config_names(Identity) {
  return {{"rest", Identity::rest}, {"posed", Identity::posed}};
}

template <class V>
void visit(V& v, TransferConfig& c) {
  v("points", c.points,
    "points of the source, from its vertices; 0, or a model that needs as many: all",
    between(0, kMostPoints));
  v("vertices", c.vertices, "that bodies are thinned to; 0: all", between(0, 1e6));
  v("identity", c.identity, "the target's mesh in T-pose (rest) or in any pose (posed, as NPT)");
  v("heading", c.heading, "windows are turned by up to so many degrees", between(0, 180));
  v("shuffle", c.shuffle, "points and vertices in random orders; false: in correspondence");
  v("frame_step", c.frame_step, "frames of the motion from one of a window to the next",
    between(1, 100000));
}

inline EnumNames<EdgeReference> config_names(EdgeReference) {
  return {{"identity", EdgeReference::identity}, {"truth", EdgeReference::truth}};
}

struct TransferLossConfig : TransferWeights {
  bool train_discriminator = true;
  int64_t metric_from = 0;
};

template <class V>
void visit(V& v, TransferLossConfig& c) {
  v("reconstruction", c.reconstruction, "weight of the mean squared difference of coordinates",
    at_least(0));
  v("edge", c.edge, "weight of the edge loss", at_least(0));
  v("edge_reference", c.edge_reference,
    "whose edges have the right length: those of the target's mesh, or of the true answer");
  v("distances", c.distances, "weight of the squared differences of distances between points",
    at_least(0));
  v("metric", c.metric, "weight of LART's metric loss on codes between two frames; LART only",
    at_least(0));
  v("metric_from", c.metric_from, "first step with the metric loss", at_least(0));
  v("metric_points", c.metric_points, "points whose distances to each other count",
    between(2, kMostPoints));
  v("adversarial", c.adversarial, "weight of TST's discriminator's judgement; 0: none",
    added("0", at_least(0)));
  v("train_discriminator", c.train_discriminator,
    "false: the discriminator stays random, as in TST's program", added("true"));
}

struct TransferStageConfig {
  ModelChoice model{"transfer/npt"};
  OptimiserConfig optimiser;
  TransferConfig pairs;
  TransferLossConfig loss;
  int64_t validation_pairs = 60;
};

template <class V>
void visit(V& v, TransferStageConfig& c) {
  visit_choice(v, c.model);
  v("optimiser", c.optimiser, "steps, batch, rate");
  v("pairs", c.pairs, "how training pairs are made");
  v("loss", c.loss, "weights of the losses");
  v("validation_pairs", c.validation_pairs, "held-out pairs per validation", between(1, 1e6));
}

class TransferStage final : public SupervisedStage<TransferSampler> {
 public:
  using Config = TransferStageConfig;
  static std::vector<std::string> reads(const Config&) { return {}; }
  TransferStage(const Config& config, const StageInput& input);
  NamedValues step(int64_t step) override;
  NamedValues validate() override;
  std::vector<std::string> figures() override { return {"distance_mm", "pmd_1e4"}; }
  std::vector<Shown> show() override;

 private:
  TransferBatch taken_there(const TransferBatch& here) const override;
  Var loss(Context& ctx, const TransferBatch& pairs, int64_t step, Tensor* posed) const override;
  Tensor truth(const TransferBatch& here) const override { return here.truth; }
  void check_losses() const;
  void add_discriminator(const StageInput& input);
  /// The discriminator learns to tell true frames from the network's; its loss.
  double update_discriminator(int64_t step);

  Config config_;
  TransferModel* model_;
  TstDiscriminator* discriminator_ = nullptr;     ///< null without an adversarial loss
  Optimiser* discriminator_optimiser_ = nullptr;  ///< null if the discriminator is not trained
};

}  // namespace restage
