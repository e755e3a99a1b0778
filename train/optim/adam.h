// Adam as PyTorch's (spec 7); how near in float32 is said in autograd/kernels/update.h.
#pragma once

#include "nn/config/config_reader.h"
#include "train/optim/parameters.h"

namespace restage {

struct AdamConfig {
  double beta1 = 0.9, beta2 = 0.999, eps = 1e-8, weight_decay = 0;
};

template <class V>
void visit(V& v, AdamConfig& c) {
  v("beta1", c.beta1, "decay of the first moment", below(0, 1));
  v("beta2", c.beta2, "decay of the second moment", below(0, 1));
  v("eps", c.eps, "added to the root of the second moment", positive());
  v("weight_decay", c.weight_decay, "L2 term added to the gradient", at_least(0));
}

class Adam {
 public:
  Adam(const std::vector<NamedParameter>& parameters, const AdamConfig& config);
  /// One update by the gradients times `scale`; a parameter without gradient stays, as in PyTorch.
  void step(const Gradients& gradients, double rate, double scale);
  void save(const std::string& prefix, TensorFile& file) const;
  /// InputError if the state does not fit.
  void load(const std::string& prefix, const TensorFile& file, const std::string& where);

 private:
  struct Slot {
    NamedParameter of;
    Tensor m, v;
    int64_t steps = 0;
  };
  std::vector<Slot> slots_;
  AdamConfig config_;
};

}  // namespace restage
