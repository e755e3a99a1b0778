// Groups of parameters with a rate, a decay or a beginning of their own.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nn/config/config_reader.h"
#include "train/optim/parameters.h"

namespace restage {

struct ParameterGroup {
  std::string match;  ///< of names of parameters; * stands for any text
  double rate = 1;    ///< factor of the stage's rate
  std::optional<double> decay;
  bool frozen = false;
  int64_t frozen_until = 0;  ///< the first step that moves them

  /// Whether a step moves the parameters of the group.
  bool moves_in(int64_t step) const { return !frozen && step >= frozen_until; }
};

template <class V>
void visit(V& v, ParameterGroup& c) {
  v("match", c.match, "names of parameters, as 'restage weights show' lists them; * for any text",
    required());
  v("rate", c.rate, "factor of the learning rate", at_least(0));
  v("decay", c.decay, "weight decay in the place of the optimiser's", at_least(0));
  v("frozen", c.frozen, "they stay as they are");
  v("frozen_until", c.frozen_until, "the first step (from 0) that moves them", at_least(0));
  v.check("frozen_until", !c.frozen || c.frozen_until == 0, "makes no sense with 'frozen'",
          "give one of them");
}

/// Those of `parameters` that no group takes, then those of each group: the first group that
/// matches a name takes it. InputError naming `where`: a group matches no name, or none that is
/// left by the groups before it.
std::vector<std::vector<NamedParameter>> grouped(const std::vector<NamedParameter>& parameters,
                                                 const std::vector<ParameterGroup>& groups,
                                                 const std::string& where);

}  // namespace restage
