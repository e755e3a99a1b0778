// Bodies and motions that training and evaluation draw from, of one split or of all.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct Corpus {
  std::vector<Body> bodies;
  std::vector<Motion> motions;
  std::string description, license;  ///< where it comes from, what may be done with it
  JointDefinition joints = {};       ///< of all bodies; empty: their file does not say
};

struct SplitCounts {
  int train = 0, validation = 0, test = 0;
};

/// What load_corpus() loads.
struct CorpusSource {
  /// "builtin", a data set file (datasets/schema.h), or a benchmark's folder: SPLIT.h5 in it.
  std::string source = "builtin";
  uint64_t seed = 0;  ///< of the built-in source; seed and counts leave files alone
  SplitCounts bodies{24, 6, 6};
  SplitCounts motions{120, 20, 20};
  bool one_mesh = false;     ///< built-in bodies have the same faces; their vertices correspond
  std::string subject = {};  ///< split "train" has this person's motions only; empty: all
};

/// All of it, or one split ("train", "validation", "test"; else InputError). A body belongs to one
/// split, and a motion to the split of its subject, so splits never share either. InputError if
/// there is no body or no motion, none of the subject asked for, if what is loaded has a subject in
/// two splits or bodies of two definitions of joints, or if the file is missing or damaged; all of
/// a folder.
Corpus load_corpus(const CorpusSource& source, const std::string& split = "");
/// The bodies and the motions of one split. InputError if either is missing.
Corpus subset(const Corpus& corpus, const std::string& split);

/// What may be wrong with data before anybody has trained on them, a line each: motions of one
/// person only, few bodies, no split to measure on; nothing of
/// the built-in source. `train`: what would be trained on.
std::vector<std::string> remarks(const CorpusSource& source, const Corpus& train);

/// 64 hexadecimal digits that change with any number, id, subject or split, and with nothing else,
/// such as a licence or which joints the joints are.
std::string checksum(const Corpus& corpus);
/// The same of all that a data set file holds; that of a large file is kept (readers/file_sums.h).
std::string content_of_file(const std::string& path);

}  // namespace restage
