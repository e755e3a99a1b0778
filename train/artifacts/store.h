// The store: a folder of artifacts, each what one finished stage left, in a folder STAGE-ID:
//
//   weights.safetensors  the networks and what must be known to use them (nn/weights/bundle.h)
//   config.yaml          the keys of the stage, resolved
//   metrics.jsonl        its curves
//   artifact.json        id, data, seed, what it read, its last validation, checksums of the others
//
// An artifact is complete or absent: it is made aside, in .STAGE-ID.partial, a run directory that
// the next process goes on from, and then renamed. Its bytes are a function of its id: no time,
// host or thread count is in it. Beside them lies answers/: what extractors were asked by the
// training of motion networks; it may be removed at any time.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "nn/weights/bundle.h"
#include "train/artifacts/artifact_id.h"
#include "train/run.h"

namespace restage {

class Store {
 public:
  explicit Store(std::string dir) : dir_(std::move(dir)) {}

  /// Its folder is there; whether its content is undamaged is seen when it is read. This and all
  /// that reads throws ReadError where the disk does not say: that is neither absence nor damage.
  bool has(const StageId& id) const;
  std::string path(const StageId& id) const;
  /// The artifact, or nothing. A damaged one, whose bytes do not fit their checksums, gives a
  /// warning, is moved aside and counts as absent. InputError: whole, but no weights of ours.
  std::optional<Bundle> find(const StageId& id) const;

  /// The curves of the artifact so far (metrics.jsonl), also while it is made; empty if nobody has
  /// begun to make it.
  std::string metrics(const StageId& id) const;

  /// The folder of what extractors were asked (train/artifacts/answers.h).
  std::string answers() const;

  /// Trains in the given run directory, which may hold the checkpoints of an earlier attempt.
  using Make = std::function<Bundle(RunDir& run)>;
  /// The artifact, made if it is absent. While another process makes it, this one waits.
  /// Interrupted on a signal; then the next call goes on.
  Bundle get(const StageId& id, const std::string& config_yaml, const Make& make) const;

 private:
  std::string partial(const StageId& id) const;
  void publish(const StageId& id, const std::string& run, const std::string& config_yaml,
               const Bundle& bundle) const;

  std::string dir_;
};

}  // namespace restage
