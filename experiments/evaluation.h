// The whole system on held-out bodies and subjects: what `restage eval run=RUN` prints.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "datasets/sampling/evaluation.h"
#include "infer/retargeter.h"
#include "nn/metrics/metrics.h"

namespace restage {

/// One way of looking at the same sequences: from true skeletons, or from clouds alone.
struct SystemScores {
  metrics::Evaluation model;
  std::vector<int64_t> frames;
  /// "rest_pose", "source_unchanged", "closed_form": no learning (nn/geometry/closed_form.h).
  std::vector<std::pair<std::string, metrics::Evaluation>> references;
};

struct SystemEvaluation {
  SystemScores extracted;  ///< clouds in, target's joints extracted: end to end
  SystemScores truth;      ///< true joints of source and target: no extractor
};

/// Judges every sequence of `list` on the bodies and motions of `corpus`. `anchor`:
/// RetargetOptions.
SystemEvaluation evaluate_system(const ModelSet& models, const Corpus& corpus,
                                 const std::vector<EvalSequence>& list, uint64_t seed,
                                 double anchor);

}  // namespace restage
