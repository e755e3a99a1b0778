// Trials that will not be among the good ones end before their last step. What others have reached
// is read from the curves in the store, complete ones and those in the making, so nothing else has
// to be kept, and a trial that was killed and taken up again decides as it did before. Which trials
// have come how far depends on how many run at once: with one at a time the choice is reproducible,
// and what finishes has the same bytes in any case.
#pragma once

#include <string>
#include <vector>

#include "experiments/sweep/sweep_file.h"
#include "train/artifacts/store.h"
#include "train/trainer.h"

namespace restage::sweep {

/// Validations of one training, by step; lower is better.
struct CurvePoint {
  int64_t done = 0;
  double value = 0;
};
using Curve = std::vector<CurvePoint>;

/// The figure's values in a metrics.jsonl; lines that cannot be read are passed over.
Curve read_curve(const std::string& metrics_jsonl, const std::string& figure);

/// Why a training of `steps` steps that has come to the last point of `mine` should end; empty: it
/// goes on. Nobody is judged before `after` of the steps, at the last one, or beside fewer than
/// three others that have come as far.
///   median  (Golovin et al. 2017, section 3.2.2) the best value so far is worse than the median of
///           the others' means up to this step
///   asha    (Li et al. 2020) at `after`, 3 x `after`, 9 x `after` ... of the steps: the value is
///           not among the best third of all that have come there
std::string reason_to_stop(const EarlyStop& rule, const Curve& mine, int64_t steps,
                           const std::vector<Curve>& others);

/// Thrown by a training that is not worth its remaining steps; what() says why.
class StoppedEarly : public Error {
  using Error::Error;
};

class EarlyStopper final : public TrainObserver {
 public:
  /// `all`: the artifacts of the rule's stage in all trials of the sweep.
  EarlyStopper(EarlyStop rule, Store store, StageId own, std::vector<StageId> all);
  void on_validation(Stage& stage, int64_t done, const NamedValues&) override;

 private:
  EarlyStop rule_;
  Store store_;
  StageId own_;
  std::vector<StageId> all_;
};

}  // namespace restage::sweep
