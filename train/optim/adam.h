// Adam as PyTorch's (spec 7); how near in float32 is said in autograd/kernels/update.h. And AdamW,
// which is Adam whose weights shrink by themselves and not through the gradient.
#pragma once

#include "nn/config/config_reader.h"
#include "train/optim/update_rule.h"

namespace restage {

struct AdamConfig {
  double beta1 = 0.9, beta2 = 0.999, eps = 1e-8, weight_decay = 0;
};

template <class V>
void visit(V& v, AdamConfig& c) {
  v("beta1", c.beta1, "decay of the first moment", below(0, 1));
  v("beta2", c.beta2, "decay of the second moment", below(0, 1));
  v("eps", c.eps, "added to the root of the second moment", positive());
  v("weight_decay", c.weight_decay,
    "L2 term added to the gradient; kind adamw: share of a weight that goes, in rates",
    at_least(0));
}

class Adam final : public UpdateRule {
 public:
  /// What weight_decay is: a term of the gradient (torch.optim.Adam), or apart from it
  /// (torch.optim.AdamW).
  enum class Decay { in_gradient, of_weights };
  Adam(const std::vector<NamedParameter>& parameters, const AdamConfig& config,
       Decay decay = Decay::in_gradient);
  void step(const Gradients& gradients, double rate, double scale) override;

 private:
  AdamConfig config_;
  Decay decay_;
};

}  // namespace restage
