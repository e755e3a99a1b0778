// Examples for the network of datasets/importers/joints/turn_net.h, and its training.
#pragma once

#include <functional>
#include <string>

#include "autograd/tensor/tensor.h"
#include "datasets/corpus.h"
#include "datasets/importers/joints/turn_net.h"

namespace restage::bench {

/// What is wrong with joints that somebody else found.
struct JointFaults {
  double noise = 0.5;         ///< share of examples with noise of up to `most_noise`
  double most_noise = 0.025;  ///< metres, standard deviation per coordinate
  double other = 0.7;         ///< share whose joints are other places of the body than ours
  double off = 0.02;          ///< how far those lie from ours, standard deviation per coordinate
  double missing = 0.7;       ///< share in which joints of the trunk, feet and head are not known
  double hidden = 0.2;        ///< share in which single limbs are not seen for a while
  double late = 0.35;         ///< share without frames after the one that is asked for
};

struct TurnBatch {
  Tensor seen;   ///< [n, kInputs]
  Tensor truth;  ///< [n, 22, 3, 3] world turns from the T-pose in the axes of the trunk
};

/// Bodies of a corpus that perform its motions, and skeletons of the motions themselves.
class TurnExamples {
 public:
  TurnExamples(const Corpus& corpus, const JointFaults& faults, uint64_t seed);
  /// Examples `first` to `first` + n - 1: each is a function of (corpus, faults, seed, number).
  TurnBatch batch(int64_t first, int64_t n) const;

 private:
  void fill(int64_t index, float* seen, float* truth) const;

  const Corpus& corpus_;
  JointFaults faults_;
  RngKey key_;
};

struct TurnFitOptions {
  int64_t steps = 40000, batch = 256;
  double rate = 2e-3;
  uint64_t seed = 1;
};

void fit_turn_net(const TurnExamples& examples, const TurnFitOptions& options,
                  const std::function<void(const std::string&)>& say, joints_detail::TurnNet& net);

}  // namespace restage::bench
