// A run directory: everything that one training leaves behind, safe against SIGKILL at any moment.
//
//   config.yaml      the resolved configuration
//   provenance.json  version, compiler, processor, data, command line (train/run_provenance.h)
//   metrics.jsonl    one JSON object per line: {"step": 10, "stage": "smrm", "loss": 0.5, ...}
//   log.txt          the log of every process that worked on the run
//   summary.json     how a training ended, and its warnings (experiments/observers/summary.h)
//   checkpoints/     <stage>-<step>-<checksum>.safetensors
//   best/            weights of the best validations (loop.keep_best; train/best_files.h)
//   .lock            held (flock) by the process that trains
//
// A checkpoint appears by rename and carries the checksum of its bytes in its name, so it is either
// absent, complete or recognised as damaged, and opens as a plain safetensors file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace restage {

/// A checkpoint, with the bytes that were given to save_checkpoint.
struct Checkpoint {
  std::string path, stage;
  int64_t step = 0;
  std::string bytes;
};

/// Which checkpoints of a stage stay.
struct KeepRule {
  int64_t last = 2;   ///< so many of the newest checkpoints
  int64_t every = 0;  ///< also the checkpoints whose step is a multiple of this; 0: no others
  int64_t best = -1;  ///< also the checkpoint of this step; -1: none
};

/// The newest undamaged checkpoint of a run, in the order of the stages and of the steps in each;
/// reads only, needs no lock. Each damaged checkpoint that is passed over gives a warning in the
/// log. If `stages` has a single stage, only its checkpoints count. InputError if `dir` is no run
/// directory.
std::optional<Checkpoint> latest_checkpoint(const std::string& dir,
                                            const std::vector<std::string>& stages);
/// The checkpoint of a step. InputError: it is not there, or it is damaged.
Checkpoint checkpoint_of(const std::string& dir, const std::string& stage, int64_t step);
/// `dir`/config.yaml; InputError if `dir` is no run directory.
std::string run_config_path(const std::string& dir);

class RunDir {
 public:
  /// Makes and locks `ROOT/NAME-TIMESTAMP-N` (UTC). The directory appears complete or not at
  /// all. `stages`: names (letters, digits, '_') in the order of training.
  static RunDir create(const std::string& root, const std::string& name,
                       const std::string& resolved_yaml, const std::string& provenance_json,
                       std::vector<std::string> stages);
  /// Makes and locks a run directory at `dir`, which must not exist or be an empty folder.
  static RunDir create_at(const std::string& dir, const std::string& resolved_yaml,
                          const std::string& provenance_json, std::vector<std::string> stages);
  /// Locks an existing run and takes it back to its newest undamaged checkpoint (resumed_from()):
  /// later lines of metrics.jsonl and the leftovers of an interrupted write are removed.
  /// InputError: not a run directory, in use by another process.
  static RunDir resume(const std::string& dir, std::vector<std::string> stages);

  RunDir(RunDir&& other) noexcept;
  RunDir& operator=(RunDir&&) = delete;
  RunDir(const RunDir&) = delete;
  RunDir& operator=(const RunDir&) = delete;
  ~RunDir();  ///< releases the lock and the log file

  const std::string& dir() const { return dir_; }
  /// The checkpoint to go on from; nothing if the run starts at the beginning. Moves the bytes out.
  std::optional<Checkpoint> take_resumed() { return std::exchange(resumed_, std::nullopt); }

  /// Appends one line to metrics.jsonl. Values that are not finite become null. WorkError if the
  /// disk is full; then no torn line is left.
  void metrics(const std::string& stage, int64_t step,
               const std::vector<std::pair<std::string, double>>& values);
  /// Makes the metrics and then the checkpoint `bytes` durable, and removes the checkpoints of the
  /// stage that `keep` does not keep. Returns the path.
  std::string save_checkpoint(const std::string& stage, int64_t step, std::string_view bytes,
                              const KeepRule& keep = {});
  /// Removes the checkpoints of a stage that the rule does not keep.
  void prune(const std::string& stage, const KeepRule& keep) const;

 private:
  RunDir(std::string dir, std::vector<std::string> stages, int lock);
  void open_metrics();

  std::string dir_;
  std::vector<std::string> stages_;
  int lock_ = -1, metrics_ = -1;  // file descriptors
  std::optional<Checkpoint> resumed_;
};

}  // namespace restage
