// Lion (Chen et al. 2023, "Symbolic discovery of optimization algorithms", algorithm 2): every
// number moves by the rate, in the direction of the sign of an average of gradients. So rates are
// three to ten times smaller than Adam's, and decays as many times larger.
#pragma once

#include "nn/config/config_reader.h"
#include "train/optim/update_rule.h"

namespace restage {

struct LionConfig {
  double beta1 = 0.9, beta2 = 0.99, weight_decay = 0;
};

template <class V>
void visit(V& v, LionConfig& c) {
  v("beta1", c.beta1, "share of the average in the direction of a step", added("0.9", below(0, 1)));
  v("beta2", c.beta2, "decay of the average of gradients", added("0.99", below(0, 1)));
  v("weight_decay", c.weight_decay, "share of a weight that goes in a step, in rates",
    added("0", at_least(0)));
}

class Lion final : public UpdateRule {
 public:
  Lion(const std::vector<NamedParameter>& parameters, const LionConfig& config);
  void step(const Gradients& gradients, double rate, double scale) override;

 private:
  LionConfig config_;
};

}  // namespace restage
