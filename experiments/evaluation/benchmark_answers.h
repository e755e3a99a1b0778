// Answers of any program to the open benchmark's sequences, in a folder (docs/benchmark.md,
// "A row of your own"):
//   ANSWERS/SET/NAME.h5     /vertices, /joints or both (datasets/README.md)
//   ANSWERS/SET/NAME/       a folder of meshes, one a frame
//   ANSWERS/scans/NAME.mended.h5  what 'restage doctor --fix' made of the scans, if the answer is
//   in
//                           its frame; without it an answer is in the world
#pragma once

#include <string>
#include <vector>

#include "experiments/evaluation/benchmark_sets.h"

namespace restage {

/// Which sequences are asked for. `refused`: "SET/NAME" of those that a system gives no answer to.
struct AnswersAsked {
  std::string benchmark;  ///< a folder of 'restage data build'
  std::vector<std::string> sets, refused;
};

/// InputError: the folder is no benchmark, a file that answers are compared with is not what its
/// manifest says, a set is not known or `refused` names what is no sequence of the sets. Reads
/// every such file once.
void check_asked(const AnswersAsked& asked);

/// InputError that names what is wrong: answers that are missing (how many, and the first of them),
/// that are there for a refused sequence, or have other numbers of frames or vertices. Quick: no
/// vertices are read.
void check_answers(const std::string& answers, const AnswersAsked& asked);

/// The scores of a set. InputError of an answer that holds numbers which are not finite, or joints
/// of a definition that cannot be converted into the truth's.
SystemScores score_answers(const std::string& answers, const AnswersAsked& asked,
                           const std::string& set, std::span<const metrics::Metric> metrics,
                           std::vector<std::string>* names);

}  // namespace restage
