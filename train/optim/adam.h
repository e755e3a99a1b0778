// Adam exactly as PyTorch's (spec 7).
#pragma once

#include "nn/config/config_reader.h"
#include "nn/module.h"
#include "nn/weights/safetensors.h"

namespace restage {

struct AdamConfig {
  double beta1 = 0.9, beta2 = 0.999, eps = 1e-8, weight_decay = 0;
  bool amsgrad = false;
};

template <class V>
void visit(V& v, AdamConfig& c) {
  v("beta1", c.beta1, "decay of the first moment", below(0, 1));
  v("beta2", c.beta2, "decay of the second moment", below(0, 1));
  v("eps", c.eps, "added to the root of the second moment", positive());
  v("weight_decay", c.weight_decay, "L2 term added to the gradient", at_least(0));
  v("amsgrad", c.amsgrad, "keep the largest second moment");
}

class Adam {
 public:
  /// Optimises the parameters of `modules`, each under its prefix (names of the saved state).
  Adam(const std::vector<std::pair<std::string, Module*>>& modules, const AdamConfig& config);
  /// One update; a parameter without gradient stays, as in PyTorch. `clip`: largest norm of the
  /// gradient of the parameters that this optimises (0: none), whatever else `gradients` holds; the
  /// gradient is scaled down to it as torch's clip_grad_norm_ does.
  void step(const Gradients& gradients, double rate, double clip);
  void save(const std::string& prefix, TensorFile& file) const;
  /// InputError if the state does not fit.
  void load(const std::string& prefix, const TensorFile& file, const std::string& where);

 private:
  struct Slot {
    std::string name;
    Parameter* parameter;
    Tensor m, v, v_max;
    int64_t steps = 0;
  };
  std::vector<Slot> slots_;
  std::vector<uint64_t> ids_;  // of the parameters, ascending
  AdamConfig config_;
};

}  // namespace restage
