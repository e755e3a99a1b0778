// What makes two results the same result. The id of an artifact or a trial is the first 12 hex
// digits of the SHA-256 of everything that determines the result: the resolved keys that its
// training reads, the content of its data and of weights that it starts from, the seed, the ids of
// the artifacts that it reads, and the number of this program's behaviour. Names, folders, logging
// and thread counts are not part of it, so the same question has the same id on any machine.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "train/artifacts/artifact_id.h"
#include "train/training/train_config.h"

namespace restage {

/// Finds identities; remembers those of files that it has read, and checksums of large files beyond
/// its own life (datasets/readers/file_sums.h).
class Identities {
 public:
  /// The identity of bodies and motions: the checksum() of a data set file or of those of a
  /// benchmark, or the keys of the built-in source. InputError if a file cannot be read.
  std::string data(const CorpusSource& source);
  /// The identity of a weights file, run or artifact: the checksum of its bytes.
  std::string weights(const std::string& path);
  /// The identity of the networks of a stage in such a file: what else the file holds does not
  /// matter.
  std::string networks(const std::string& stage, const std::string& path);
  /// The identities of the stages that `config` trains, in order; a stage that is taken `from`
  /// elsewhere has none.
  std::vector<StageId> stages(const TrainConfig& config);
  /// The id of a trial: of everything that determines what `config` trains, and of `more`, which
  /// says what else determines the result, such as what it is measured on.
  std::string trial(const TrainConfig& config, const std::map<std::string, std::string>& more);

 private:
  std::map<std::string, std::string> seen_;
};

/// A network in Python that a configuration trains, and a checksum of its source.
struct NetworkSource {
  std::string stage, model, source;
};
/// Those of the stages that are not taken from elsewhere, in order.
std::vector<NetworkSource> network_sources(const TrainConfig& config);

}  // namespace restage
