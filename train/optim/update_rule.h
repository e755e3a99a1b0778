// What every kind of optimiser is: a rule that moves parameters by their gradients.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "train/optim/parameters.h"

namespace restage {

class UpdateRule {
 public:
  virtual ~UpdateRule() = default;
  UpdateRule(const UpdateRule&) = delete;
  UpdateRule& operator=(const UpdateRule&) = delete;
  /// One update by the gradients times `scale`; a parameter without gradient stays, as in PyTorch.
  virtual void step(const Gradients& gradients, double rate, double scale) = 0;
  /// Adds the state of every parameter, under its name after `prefix`.
  void save(const std::string& prefix, TensorFile& file) const;
  /// InputError naming `where` if the state does not fit.
  void load(const std::string& prefix, const TensorFile& file, const std::string& where);

 protected:
  /// What is carried from step to step of each parameter: so many of m and v, which are of its size
  /// and begin with zeros, and perhaps how often it has moved.
  struct Keeps {
    int tensors = 0;
    bool steps = false;
  };
  UpdateRule(const std::vector<NamedParameter>& parameters, const Keeps& keeps);
  struct Slot {
    NamedParameter of;
    Tensor m = {}, v = {};
    int64_t steps = 0;
  };
  std::vector<Slot> slots_;

 private:
  Keeps keeps_;
};

/// x times `factor`, in a new tensor.
Tensor times(const Tensor& x, double factor);
/// Weight decay apart from the gradient (Loshchilov and Hutter 2019): p becomes p times
/// 1 - rate * decay. With a decay of 0 no bit changes.
void decay_weights(Tensor& p, double rate, double decay);

/// The gradients of leaves with these identities, their numbers cut to between -most and most.
Gradients clipped(const Gradients& gradients, std::span<const uint64_t> ids, double most);

}  // namespace restage
