// What a network of a user's own may bring into its stage besides what its role asks for.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "nn/module.h"

namespace restage {

/// Values by name, on a tape or constant.
using NamedVars = std::vector<std::pair<std::string, Var>>;

/// Derived from by a network beside the interface of its role; a stage asks for it with own_loss()
/// or a dynamic_cast.
struct OwnTraining {
  OwnTraining() = default;
  virtual ~OwnTraining() = default;
  OwnTraining(const OwnTraining&) = delete;
  OwnTraining& operator=(const OwnTraining&) = delete;
  virtual bool has_loss() const = 0;
  /// The loss of some examples, [1], in the place of the stage's: `input` is what the network is
  /// shown, by the names of its role's input; `batch` is all that is known of the examples.
  virtual Var loss(Context& ctx, const NamedVars& input, const NamedVars& batch) const = 0;
  /// Figures of its own at a validation, lower is better, given those that the stage measured.
  virtual std::vector<std::pair<std::string, double>> measure(
      const std::vector<std::pair<std::string, double>>& measured) const = 0;
};

/// The network, if it has a loss of its own; else null.
inline const OwnTraining* own_loss(const Module* net) {
  const auto* own = dynamic_cast<const OwnTraining*>(net);
  return own != nullptr && own->has_loss() ? own : nullptr;
}

}  // namespace restage
