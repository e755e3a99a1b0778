// Stochastic gradient descent as torch.optim.SGD, with momentum or without.
#pragma once

#include "nn/config/config_reader.h"
#include "train/optim/update_rule.h"

namespace restage {

struct SgdConfig {
  double momentum = 0, weight_decay = 0;
  bool nesterov = false;
};

template <class V>
void visit(V& v, SgdConfig& c) {
  v("momentum", c.momentum, "decay of the sum of gradients; 0: none", added("0", below(0, 1)));
  v("nesterov", c.nesterov, "Nesterov's momentum, which looks a step ahead", added("false"));
  v("weight_decay", c.weight_decay, "L2 term added to the gradient", added("0", at_least(0)));
  v.check("nesterov", !c.nesterov || c.momentum > 0, "is a kind of momentum, which is 0",
          "set momentum, such as 0.9");
}

class Sgd final : public UpdateRule {
 public:
  Sgd(const std::vector<NamedParameter>& parameters, const SgdConfig& config);
  void step(const Gradients& gradients, double rate, double scale) override;

 private:
  SgdConfig config_;
};

}  // namespace restage
