#include "train/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "autograd/kernels/stats.h"
#include "train/best_files.h"
#include "train/failure.h"
#include "train/forecast.h"
#include "train/phases.h"
#include "train/stage_watch.h"
#include "train/throughput.h"

namespace restage {
namespace {

constexpr int64_t kForecastAfter = 30;  // steps
// In a checkpoint whose validation was left unfinished.
constexpr const char* kUnvalidated = "loop.unvalidated";
// In one after which the stage is over, as an observer said.
constexpr const char* kToldToEnd = "loop.told_to_end";

std::string line(const NamedValues& values) {
  return joined(values, [](const auto& one) { return one.first + format(" %.5g", one.second); });
}

/// The most that tensors took since reset_peak_memory(), where there are any: "812 MiB", or of a
/// stage on a GPU "812 MiB on cuda and 40 MiB on the host".
std::string peak_of_tensors(Device device) {
  const auto mebibytes = [](Device of) {
    return format("%.0f MiB", static_cast<double>(memory_stats(of).peak) / 1048576.0);
  };
  if (device == Device{}) return mebibytes({});
  return mebibytes(device) + " on " + name_of(device) + " and " + mebibytes({}) + " on the host";
}

/// Which numbers are of Muon's kind depends on the network, so this shows what `kind: muon` does.
void log_optimisers(const Stage& stage) {
  const OptimisedNumbers n = stage.optimised();
  const std::string said = cat(stage.name(), ": Muon moves ", n.muon, " numbers, Adam ", n.adam);
  if (n.muon > 0) return log_info(said);
  log_warning(cat(said, "; Muon is for matrices of ", Muon::kLeastSide, " rows and columns"));
}

/// Ends a training that was asked to stop, after its checkpoint.
[[noreturn]] void end_stopped() {
  throw_if_stopped();
  throw Interrupted(SIGTERM);  // the signal came to another process of the team
}

/// The training of one stage.
class StageRun {
 public:
  /// `given`: what earlier stages have left.
  StageRun(Stage& stage, const Bundle& given, RunDir& run, const LoopConfig& loop,
           const TrainOptions& options)
      : stage_(stage),
        given_(given),
        run_(run),
        loop_(loop),
        options_(options),
        monitor_(monitored(loop.selection, stage.name())),
        best_(monitor_, loop.selection.min_delta),
        best_files_(run.dir(), stage.name(), loop.selection.keep_best),
        watch_(stage) {
    if (WeightAverage::wanted(loop.selection)) average_.emplace(stage, loop.selection);
  }

  /// Removes the checkpoints that a stage need not keep once a later stage has begun.
  void tidy() const { run_.prune(stage_.name(), {1, loop_.keep_every, best_.step()}); }

  void go_on_from(const Checkpoint& checkpoint) {
    const TensorFile file = parse_safetensors(checkpoint.bytes, checkpoint.path);
    stage_.load(file, checkpoint.path);
    if (average_) average_->load(file, checkpoint.path);
    if (loop_.selection.judges()) best_.load(file, checkpoint.path);
    unvalidated_ = file.find(kUnvalidated) != nullptr;
    told_to_end_ = file.find(kToldToEnd) != nullptr;
    done_ = checkpoint.step;
    resumed_ = true;
  }

  /// The same of a run that was resumed.
  void resume_from(const Checkpoint& checkpoint) {
    go_on_from(checkpoint);
    best_files_.forget_after(done_);
  }

  /// Trains the stage to its end; then the stage holds the weights that it hands on.
  void run() {
    if (!resumed_) best_files_.forget_after(-1);
    tell([&](TrainObserver& o) { o.on_begin(stage_, done_); });
    if (stage_.steps() == 0) {
      if (!resumed_ || unvalidated_) settle(true, true, log_info);
      return;  // a resumed one was validated and saved then
    }
    if (!over() || unvalidated_) all_steps();
    hand_on();
  }

 private:
  bool ended_early() const {
    const int64_t patience = loop_.selection.patience;
    return told_to_end_ || (patience > 0 && best_.worse() >= patience);
  }
  bool hands_on_best() const {
    return loop_.selection.choice == SelectionConfig::Export::best && best_.step() >= 0;
  }
  bool over() const { return done_ == stage_.steps() || ended_early(); }
  bool due(int64_t every) const { return done_ % every == 0 || done_ == stage_.steps(); }
  template <class Event>
  void tell(Event&& event) {
    for (TrainObserver* observer : options_.observers) event(*observer);
  }

  void all_steps();
  NamedValues step();
  using Note = std::function<void(const std::string&)>;
  void one_step(Progress* progress, int64_t first, const Note& note);
  void settle(bool validates, bool saves, const Note& note);
  void validate(const Note& note);
  std::string judged(NamedValues scores);
  void checkpoint();
  void hand_on();
  std::string keep_failure(const NonFiniteError& error) const;
  std::string forecast() const;
  void report(int64_t steps, int64_t blocks_before, double waited_before) const;

  void warn(const std::vector<TrainWarning>& warnings);

  Stage& stage_;
  const Bundle& given_;
  RunDir& run_;
  const LoopConfig& loop_;
  const TrainOptions& options_;
  std::optional<WeightAverage> average_;
  const std::string monitor_;
  BestSoFar best_;
  BestFiles best_files_;
  Throughput throughput_;
  StageWatch watch_;
  PhaseTimes phases_;             ///< of the last step
  Progress* progress_ = nullptr;  ///< what the terminal shows
  int64_t done_ = 0;
  bool resumed_ = false;
  bool told_to_end_ = false;  ///< by an observer
  bool unvalidated_ = false;  ///< a stop came before the end of the validation that was due
};

void StageRun::all_steps() {
  product_rate();
  reset_peak_memory();
  if (stage_.device() != Device{}) reset_peak_memory(stage_.device());
  const int64_t first = done_, blocks_before = memory_stats().large_allocations;
  const double waited_before = options_.team->waited();
  log_info(format("%s: %lld parameters, %lld steps of %lld", stage_.name().c_str(),
                  static_cast<long long>(count_parameters(stage_)),
                  static_cast<long long>(stage_.steps()),
                  static_cast<long long>(stage_.examples_per_step())));
  if (stage_.wants_muon()) log_optimisers(stage_);
  if (const int64_t frozen = stage_.optimised().frozen; frozen > 0)
    log_info(cat(stage_.name(), ": ", frozen, " numbers are frozen"));
  Progress progress(stage_.name(), stage_.steps(), standard_progress(options_.quiet), first);
  const Note note = [&](const std::string& said) { progress.note(said); };
  progress_ = &progress;
  try {
    // What the training must beat, and what is handed on if no later validation is better.
    if (stage_.started_from_weights() && !resumed_) settle(true, loop_.selection.judges(), note);
    if (unvalidated_) settle(true, true, note);
    while (!over()) one_step(&progress, first, note);
  } catch (const Interrupted&) {
    progress.finish();
    throw;
  }
  progress.finish();
  progress_ = nullptr;
  if (done_ > first) report(done_ - first, blocks_before, waited_before);
}

void StageRun::one_step(Progress* progress, int64_t first, const Note& note) {
  const NamedValues values = step();
  if (due(loop_.log_every)) {
    run_.metrics(stage_.name(), done_, values);
    tell([&](TrainObserver& o) { o.on_log(stage_, done_, values); });
  }
  NamedValues shown = values;  // the loss first, then speed
  const NamedValues speed = throughput_.values();
  shown.insert(shown.begin() + std::min<std::ptrdiff_t>(1, std::ssize(shown)), speed.begin(),
               speed.end());
  progress->update(done_, shown);
  if (done_ - first == kForecastAfter && stage_.steps() > 10 * done_) note(forecast());
  tell([&](TrainObserver& o) { o.on_step(stage_, done_, values); });
  warn(watch_.after_step(values, phases_));
  settle(due(loop_.validate_every), due(loop_.checkpoint_every), note);
}

/// Between two steps: validates and saves what is due. If a stop was asked for, saves in any case
/// and ends the training.
void StageRun::settle(bool validates, bool saves, const Note& note) {
  if (validates) validate(note);
  const bool stopped = options_.team->any(stop_requested());
  const bool keeps_best = loop_.selection.judges() && best_.step() == done_;
  if (saves || stopped || keeps_best || ended_early()) checkpoint();
  if (stopped) end_stopped();
}

void StageRun::warn(const std::vector<TrainWarning>& warnings) {
  for (const TrainWarning& one : warnings) {
    if (progress_ != nullptr) progress_->clear();
    log_warning(one.said);
    tell([&](TrainObserver& o) { o.on_warning(stage_.name(), done_, one); });
  }
}

NamedValues StageRun::step() {
  take_kernel_stats();  // forgets what a validation did
  take_phase_times();
  const auto start = std::chrono::steady_clock::now();
  NamedValues values;
  try {
    const MatmulPrecisionScope scope(options_.precision);
    const PhaseScope phase(Phase::step);
    values = stage_.step(done_);
  } catch (const NonFiniteError& error) {
    throw NonFiniteError(std::string(error.what()) + "; 'restage replay " + keep_failure(error) +
                         "' repeats the step");
  }
  ++done_;
  phases_ = take_phase_times();
  if (average_) average_->add(done_);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const KernelStats work = take_kernel_stats();
  throughput_.add(stage_.examples_per_step(), took.count(), work.flops);
  if (std::isfinite(work.active_share)) {
    values.emplace_back("active_share", work.active_share);
    values.emplace_back("active_score_share", work.active_score_share);
  }
  for (const auto& one : stage_.noise()) values.push_back(one);
  return values;
}

/// Writes what is needed to repeat the step; returns the file.
std::string StageRun::keep_failure(const NonFiniteError& error) const {
  Failure failure;
  failure.stage = stage_.name(), failure.said = error.what(), failure.step = done_;
  failure.config_yaml = read_file(run_config_path(run_.dir()));
  // The step has changed the stage, so the step is repeated from the last checkpoint.
  if (const auto last = latest_checkpoint(run_.dir(), {stage_.name()})) {
    failure.from = last->step;
    failure.state = parse_safetensors(last->bytes, last->path);
  }
  failure.examples = stage_.examples(done_);
  failure.given = given_;
  const std::string folder = run_.dir() + "/nonfinite";
  std::error_code ignored;  // write_failure() says what is wrong
  std::filesystem::create_directories(folder, ignored);
  const std::string path =
      folder + "/" + stage_.name() + "-" + std::to_string(done_) + ".safetensors";
  write_failure(path, failure);
  return path;
}

/// A validation that a stop leaves unfinished counts for nothing; the resumed training makes it up.
void StageRun::validate(const Note& note) {
  if (average_) average_->exchange();
  std::optional<NamedValues> scores;
  try {
    const PhaseScope phase(Phase::validate);
    scores = stage_.measure();
    tell([&](TrainObserver& o) { told_to_end_ |= !o.measure(stage_, done_, &*scores); });
  } catch (const Interrupted&) {
    scores.reset();
  }
  unvalidated_ = !scores;
  if (scores) note(judged(*scores));
  if (scores) warn(watch_.after_validation(*scores, done_));
  if (average_) average_->exchange();
}

std::string StageRun::judged(NamedValues scores) {
  std::string out = stage_.name() + " after " + std::to_string(done_) + " steps: " + line(scores);
  if (loop_.selection.judges()) {
    best_.add(done_, scores);
    if (best_.step() != done_) out += " (" + best_.text() + ")";
    if (ended_early() && !told_to_end_)
      out += "; ends here, " + std::to_string(best_.worse()) + " validations without a better one";
  }
  if (told_to_end_) out += "; ends here, as it was told";
  if (loop_.selection.keep_best > 0) {
    const auto& [figure, value] = figure_monitored(scores, monitor_);
    best_files_.add(done_, figure, value,
                    [&] { return safetensors_bytes(to_file(stage_.result())); });
  }
  if (hands_on_best()) scores.emplace_back("best_step", static_cast<double>(best_.step()));
  run_.metrics(stage_.name(), done_, scores);
  tell([&](TrainObserver& o) { o.on_validation(stage_, done_, scores); });
  return out;
}

void StageRun::checkpoint() {
  const PhaseScope phase(Phase::save);
  TensorFile file;
  stage_.save(file);
  if (average_) average_->save(&file);
  if (loop_.selection.judges()) best_.save(&file);
  if (unvalidated_) file.tensors[kUnvalidated] = Tensor::zeros({1});
  if (told_to_end_) file.tensors[kToldToEnd] = Tensor::zeros({1});
  const std::string path = run_.save_checkpoint(stage_.name(), done_, safetensors_bytes(file),
                                                {loop_.keep, loop_.keep_every, best_.step()});
  tell([&](TrainObserver& o) { o.on_checkpoint(stage_, done_, path); });
}

void StageRun::hand_on() {
  if (hands_on_best() && best_.step() != done_) {
    const int64_t end = done_;
    go_on_from(checkpoint_of(run_.dir(), stage_.name(), best_.step()));
    log_info(stage_.name() + ": hands on its " + best_.text() + ", not step " +
             std::to_string(end));
  }
  if (average_) average_->exchange();
}

/// What the steps that are left will take, by the time that the steps so far took.
std::string StageRun::forecast() const {
  const double left =
      throughput_.seconds() / kForecastAfter * static_cast<double>(stage_.steps() - done_);
  return format("%s: about %s to go without validations, tensors take %s", stage_.name().c_str(),
                duration_text(left).c_str(), peak_of_tensors(stage_.device()).c_str());
}

void StageRun::report(int64_t steps, int64_t blocks_before, double waited_before) const {
  log_info(format("%s: %lld steps, %.1f ms a step, %s, peak of tensors %s, %lld large blocks taken",
                  stage_.name().c_str(), static_cast<long long>(steps),
                  1e3 * throughput_.seconds() / static_cast<double>(steps),
                  line(throughput_.values()).c_str(), peak_of_tensors(stage_.device()).c_str(),
                  static_cast<long long>(memory_stats().large_allocations - blocks_before)));
  if (options_.team->size() > 1)
    log_info(format("%s: waited %.2f ms a step for the other processes", stage_.name().c_str(),
                    1e3 * (options_.team->waited() - waited_before) / static_cast<double>(steps)));
}

}  // namespace

Bundle train(RunDir& run, const std::vector<std::string>& stages, const LoopConfig& loop,
             const MakeStage& make, const TrainOptions& options) {
  const StopScope stop;
  const auto resumed = run.take_resumed();
  const auto begin =
      resumed ? std::find(stages.begin(), stages.end(), resumed->stage) - stages.begin() : 0;
  Bundle result;
  for (size_t i = 0; i < stages.size(); ++i) {
    const auto stage = make(stages[i], &result);
    if (stage == nullptr) continue;
    Bundle given = options.given;
    given.add(result);
    StageRun stage_run(*stage, given, run, loop, options);
    const auto index = static_cast<std::ptrdiff_t>(i);
    if (resumed && index <= begin) {
      // The stage that was interrupted, or an earlier one that is complete.
      stage_run.resume_from(index == begin ? *resumed
                                           : latest_checkpoint(run.dir(), {stages[i]}).value());
    }
    stage_run.run();
    if (options.team->any(stop_requested())) end_stopped();
    if (i + 1 < stages.size()) stage_run.tidy();
    result.add(stage->result());
    // The next stage's tensors have other sizes.
    trim_memory();
    if (stage->device() != Device{}) trim_memory(stage->device());
  }
  return result;
}

}  // namespace restage
