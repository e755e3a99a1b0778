// A run directory: everything that one training leaves behind, safe against SIGKILL at any moment.
//
//   config.yaml      the resolved configuration
//   provenance.json  version, compiler, processor, data, command line (train/run_provenance.h)
//   metrics.jsonl    one JSON object per line: {"step": 10, "stage": "smrm", "loss": 0.5, ...}
//   log.txt          the log of every process that worked on the run
//   checkpoints/     <stage>-<step>-<checksum>.safetensors
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

/// What was saved, with the bytes that were given to save_checkpoint.
struct Checkpoint {
  std::string path, stage;
  int64_t step = 0;
  std::string bytes;
};

/// Which checkpoints of a stage stay.
struct KeepRule {
  int64_t last = 2;   ///< the newest
  int64_t every = 0;  ///< those whose step is a multiple of this; 0: none
  int64_t best = -1;  ///< that of this step
};

/// The newest undamaged checkpoint of a run, in the order of the stages and of the steps in each;
/// reads only, needs no lock. Each damaged one that is passed over gives a warning in the log.
/// InputError if `dir` is no run directory. A single stage gives its newest one.
std::optional<Checkpoint> latest_checkpoint(const std::string& dir,
                                            const std::vector<std::string>& stages);
/// That of a step. InputError: it is not there, or damaged.
Checkpoint checkpoint_of(const std::string& dir, const std::string& stage, int64_t step);
/// `dir`/config.yaml; InputError if `dir` is no run directory.
std::string run_config_path(const std::string& dir);

class RunDir {
 public:
  /// Makes and locks `root`/<name>-<UTC timestamp>-<n>. The directory appears complete or not at
  /// all. `stages`: names (letters, digits, '_') in the order of training.
  static RunDir create(const std::string& root, const std::string& name,
                       const std::string& resolved_yaml, const std::string& provenance_json,
                       std::vector<std::string> stages);
  /// The same at a place of the user's choice, which must not exist or be an empty folder.
  static RunDir create_at(const std::string& dir, const std::string& resolved_yaml,
                          const std::string& provenance_json, std::vector<std::string> stages);
  /// Locks an existing run and takes it back to its newest undamaged checkpoint (resumed_from()):
  /// later lines of metrics.jsonl and what an interrupted write left are removed. InputError: not
  /// a run directory, in use by another process.
  static RunDir resume(const std::string& dir, std::vector<std::string> stages);

  RunDir(RunDir&& other) noexcept;
  RunDir& operator=(RunDir&&) = delete;
  RunDir(const RunDir&) = delete;
  RunDir& operator=(const RunDir&) = delete;
  ~RunDir();  ///< releases the lock and the log file

  const std::string& dir() const { return dir_; }
  /// The state to go on from; none: from the beginning. Moves the bytes out.
  std::optional<Checkpoint> take_resumed() { return std::exchange(resumed_, std::nullopt); }

  /// Appends one line. Non-finite values become null. WorkError on a full disk, and no torn line.
  void metrics(const std::string& stage, int64_t step,
               const std::vector<std::pair<std::string, double>>& values);
  /// Makes the metrics and then `bytes` durable, and prunes what the stage has beyond `keep`.
  /// Returns the path.
  std::string save_checkpoint(const std::string& stage, int64_t step, std::string_view bytes,
                              const KeepRule& keep = {});
  /// Prunes the checkpoints of a stage.
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
