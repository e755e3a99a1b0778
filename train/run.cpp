#include "train/run.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "train/run_files.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

std::string inside(const std::string& dir, const char* name) {
  return (fs::path(dir) / name).string();
}

void check_stages(const std::vector<std::string>& stages) {
  for (const auto& stage : stages) {
    const bool good =
        !stage.empty() && std::all_of(stage.begin(), stage.end(),
                                      [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (!good) throw Error("'" + stage + "' cannot be the name of a stage");
  }
}

/// The lock of a run. The kernel releases it when the process ends, however it ends.
int take_lock(const std::string& folder, const std::string& shown) {
  const std::string path = inside(folder, ".lock");
  const int fd = ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (fd < 0) throw_unwritable(path, errno);
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd);
    throw InputError(shown, "another process trains in this run", "wait for it or stop it first");
  }
  return fd;
}

/// The folder of a run in the making, beside its later place.
struct Draft : Temporary {
  explicit Draft(const std::string& place) : Temporary(name_beside(place, ".")) {
    std::error_code error;
    if (!fs::create_directories(path(), error) || error)
      throw_unwritable(place, error ? error.value() : EEXIST);
  }
  /// Moves the folder to `target`; false if there is something already.
  bool move_to(const std::string& target) {
    if (::rename(path().c_str(), target.c_str()) == 0) {
      keep();
      return moved = true;
    }
    if (errno == EEXIST || errno == ENOTEMPTY || errno == ENOTDIR) return false;
    throw_unwritable(target, errno);
  }
  bool moved = false;
};

/// Fills a draft that lies beside the later place of the run; returns its lock.
int fill(const Draft& draft, const std::string& yaml, const std::string& provenance) {
  if (::mkdir(inside(draft.path(), "checkpoints").c_str(), 0755) != 0)
    throw_unwritable(draft.path(), errno);
  write_file_atomically(inside(draft.path(), "provenance.json"), provenance);
  write_file_atomically(inside(draft.path(), "metrics.jsonl"), "");
  write_file_atomically(inside(draft.path(), "log.txt"), "");
  write_file_atomically(inside(draft.path(), "config.yaml"), yaml);
  return take_lock(draft.path(), draft.path());
}

std::string timestamp() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y%m%dT%H%M%S", &parts);
  return text;
}

/// Checks what a run needs to go on from `last`: the stages before it. Bad input is refused before
/// anything changes.
void check_resumable(const std::string& dir, const std::vector<std::string>& stages,
                     const std::optional<Checkpoint>& last) {
  for (const char* name : {"metrics.jsonl", "log.txt", "weights.safetensors"})
    AtomicFile(inside(dir, name));  // throws if the file cannot be written
  std::vector<std::string> ignored;
  for (const std::string& stage : stages) {
    if (!last || stage == last->stage) return;
    if (!run_files::newest_good(run_files::list_checkpoints(dir, {stage}), ignored))
      throw InputError(dir, "the checkpoint of stage '" + stage + "' is missing or damaged",
                       "train again from the start");
  }
}

}  // namespace

std::string run_config_path(const std::string& dir) {
  std::error_code ignored;
  const std::string path = inside(dir, "config.yaml");
  if (!fs::is_regular_file(path, ignored) || !fs::is_directory(inside(dir, "checkpoints"), ignored))
    throw InputError(dir, "is no run directory (no config.yaml and checkpoints/ in it)",
                     "give a folder that 'restage train' made");
  return path;
}

std::optional<Checkpoint> latest_checkpoint(const std::string& dir,
                                            const std::vector<std::string>& stages) {
  run_config_path(dir);
  std::vector<std::string> passed_over;
  auto found = run_files::newest_good(run_files::list_checkpoints(dir, stages), passed_over);
  for (const std::string& why : passed_over) log_warning(why);
  return found;
}

Checkpoint checkpoint_of(const std::string& dir, const std::string& stage, int64_t step) {
  auto entries = run_files::list_checkpoints(dir, {stage});
  std::erase_if(entries, [step](const auto& entry) { return entry.step != step; });
  std::vector<std::string> passed_over;
  if (auto found = run_files::newest_good(entries, passed_over)) return std::move(*found);
  throw InputError(dir,
                   "the checkpoint of stage '" + stage + "' at step " + std::to_string(step) +
                       " is missing or damaged",
                   "train again from the start");
}

RunDir::RunDir(std::string dir, std::vector<std::string> stages, int lock)
    : dir_(std::move(dir)), stages_(std::move(stages)), lock_(lock) {}

RunDir::RunDir(RunDir&& other) noexcept
    : dir_(std::move(other.dir_)),
      stages_(std::move(other.stages_)),
      lock_(std::exchange(other.lock_, -1)),
      metrics_(std::exchange(other.metrics_, -1)),
      resumed_(std::move(other.resumed_)) {}

RunDir::~RunDir() {
  if (metrics_ >= 0) {
    ::close(metrics_);
    set_log_file("");
  }
  if (lock_ >= 0) ::close(lock_);
}

void RunDir::open_metrics() {
  const std::string path = inside(dir_, "metrics.jsonl");
  metrics_ = ::open(path.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0644);
  if (metrics_ < 0) throw_unwritable(path, errno);
  set_log_file(inside(dir_, "log.txt"));
}

RunDir RunDir::create(const std::string& root, const std::string& name,
                      const std::string& resolved_yaml, const std::string& provenance_json,
                      std::vector<std::string> stages) {
  check_stages(stages);
  constexpr int kMostNames = 10000;
  Draft draft(inside(root, name.c_str()));
  RunDir run("", std::move(stages), fill(draft, resolved_yaml, provenance_json));
  const std::string stem = inside(root, name.c_str()) + "-" + timestamp() + "-";
  for (int n = 1; n <= kMostNames && !draft.moved; ++n) {
    run.dir_ = stem + std::to_string(n);
    // rename replaces an empty folder; a run is never empty, but a user's folder might be
    if (!fs::exists(run.dir_)) draft.move_to(run.dir_);
  }
  if (!draft.moved)
    throw InputError(root, "is full of runs of this second", "choose another folder");
  run.open_metrics();
  return run;
}

RunDir RunDir::create_at(const std::string& dir, const std::string& resolved_yaml,
                         const std::string& provenance_json, std::vector<std::string> stages) {
  check_stages(stages);
  fs::path place = fs::absolute(dir).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();  // "runs/x/"
  Draft draft(place.string());
  RunDir run(dir, std::move(stages), fill(draft, resolved_yaml, provenance_json));
  if (!draft.move_to(place.string()))
    throw InputError(dir, "exists already and is no empty folder",
                     "choose another folder, or give resume=" + dir);
  run.open_metrics();
  return run;
}

RunDir RunDir::resume(const std::string& dir, std::vector<std::string> stages) {
  check_stages(stages);
  run_config_path(dir);
  RunDir run(dir, std::move(stages), take_lock(dir, dir));
  run_files::remove_leftovers(dir);
  std::vector<std::string> passed_over;
  run.resumed_ = run_files::newest_good(run_files::list_checkpoints(dir, run.stages_), passed_over);
  check_resumable(dir, run.stages_, run.resumed_);
  for (const std::string& why : passed_over) log_warning(why);
  run_files::cut_metrics(dir, run.stages_, run.resumed_);
  // A checkpoint that is newer than the newest good one is damaged. It goes, since it would count
  // when checkpoints are pruned.
  for (const auto& entry : run_files::list_checkpoints(dir, run.stages_)) {
    const bool good = run.resumed_ && entry.path == run.resumed_->path;
    const auto order = std::find(run.stages_.begin(), run.stages_.end(), entry.stage);
    const auto last = !run.resumed_
                          ? run.stages_.begin()
                          : std::find(run.stages_.begin(), run.stages_.end(), run.resumed_->stage);
    const bool newer =
        !run.resumed_ || order > last || (order == last && entry.step >= run.resumed_->step);
    std::error_code ignored;
    if (!good && newer) fs::rename(entry.path, entry.path + ".damaged", ignored);
  }
  run.open_metrics();
  return run;
}

void RunDir::metrics(const std::string& stage, int64_t step,
                     const std::vector<std::pair<std::string, double>>& values) {
  nlohmann::ordered_json line = {{"step", step}, {"stage", stage}};
  for (const auto& entry : values)
    line[entry.first] =
        std::isfinite(entry.second) ? nlohmann::ordered_json(entry.second) : nullptr;
  const std::string text =
      line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  const off_t before = ::lseek(metrics_, 0, SEEK_END);
  const int code = write_all(metrics_, text);
  if (code == 0) return;
  if (before >= 0 && ::ftruncate(metrics_, before) != 0)
    log_debug("metrics.jsonl ends with a torn line");
  throw_unwritable(inside(dir_, "metrics.jsonl"), code);
}

std::string RunDir::save_checkpoint(const std::string& stage, int64_t step, std::string_view bytes,
                                    const KeepRule& keep) {
  if (::fsync(metrics_) != 0 && errno != EINVAL)
    throw_unwritable(inside(dir_, "metrics.jsonl"), errno);
  const fs::path folder = fs::path(dir_) / "checkpoints";
  const std::string path = (folder / run_files::checkpoint_name(stage, step, bytes)).string();
  write_file_atomically(path, bytes);
  std::error_code ignored;
  for (const auto& entry : run_files::list_checkpoints(dir_, {stage}))
    if (entry.step == step && entry.path != path) fs::remove(entry.path, ignored);
  prune(stage, keep);
  return path;
}

void RunDir::prune(const std::string& stage, const KeepRule& keep) const {
  run_files::prune(run_files::list_checkpoints(dir_, {stage}), keep);
}

}  // namespace restage
