#include "train/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/kernels/stats.h"
#include "train/throughput.h"

namespace restage {
namespace {

std::string bytes_of(const Stage& stage) {
  TensorFile file;
  stage.save(file);
  return safetensors_bytes(file);
}

std::string line(const NamedValues& values) {
  std::string out;
  for (const auto& [name, value] : values) {
    char text[64];
    std::snprintf(text, sizeof text, "%s%s %.5g", out.empty() ? "" : ", ", name.c_str(), value);
    out += text;
  }
  return out;
}

NamedValues step_with(MatmulPrecision precision, Stage& stage, int64_t step) {
  const MatmulPrecisionScope scope(precision);
  return stage.step(step);
}

/// Steps `first` ... of one stage.
void run_stage(Stage& stage, int64_t first, RunDir& run, const LoopConfig& loop,
               const TrainOptions& options) {
  const auto tell = [&](auto&& event) {
    for (TrainObserver* observer : options.observers) event(*observer);
  };
  const StopScope stop;
  Throughput throughput;
  product_rate();
  const int64_t steps = stage.steps(), blocks_before = memory_stats().large_allocations;
  const auto validate = [&](int64_t done) {
    const NamedValues scores = stage.validate();
    run.metrics(stage.name(), done, scores);
    tell([&](TrainObserver& o) { o.on_validation(stage, done, scores); });
    return stage.name() + " after " + std::to_string(done) + " steps: " + line(scores);
  };
  const auto checkpoint = [&](int64_t done) {
    const std::string path = run.save_checkpoint(stage.name(), done, bytes_of(stage));
    tell([&](TrainObserver& o) { o.on_checkpoint(stage, done, path); });
  };
  if (steps == 0) {
    log_info(validate(0));
    checkpoint(0);
    return;
  }
  reset_peak_memory();
  Progress progress(stage.name(), steps, standard_progress(options.quiet), first);
  for (int64_t step = first; step < steps; ++step) {
    take_kernel_stats();  // not what validation did
    const auto start = std::chrono::steady_clock::now();
    NamedValues values = step_with(options.precision, stage, step);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    const KernelStats work = take_kernel_stats();
    throughput.add(stage.examples_per_step(), took.count(), work.flops);
    if (std::isfinite(work.active_share)) {
      values.emplace_back("active_share", work.active_share);
      values.emplace_back("active_score_share", work.active_score_share);
    }
    const int64_t done = step + 1;
    const bool last = done == steps, stopped = stop_requested();
    if (done % loop.log_every == 0 || last) run.metrics(stage.name(), done, values);
    NamedValues shown = values;  // the loss first, then speed
    const NamedValues speed = throughput.values();
    shown.insert(shown.begin() + std::min<std::ptrdiff_t>(1, std::ssize(shown)), speed.begin(),
                 speed.end());
    progress.update(done, shown);
    tell([&](TrainObserver& o) { o.on_step(stage, done, values); });
    if (done % loop.validate_every == 0 || last) progress.note(validate(done));
    if (done % loop.checkpoint_every == 0 || last || stopped) checkpoint(done);
    if (stopped) {
      progress.finish();
      throw_if_stopped();
    }
  }
  progress.finish();
  if (first >= steps) return;
  char text[300];
  std::snprintf(text, sizeof text,
                "%s: %lld steps, %.1f ms a step, %s, peak of tensors %.0f MiB, %lld "
                "large blocks taken",
                stage.name().c_str(), static_cast<long long>(steps - first),
                1e3 * throughput.seconds() / static_cast<double>(steps - first),
                line(throughput.values()).c_str(),
                static_cast<double>(memory_stats().peak) / 1048576.0,
                static_cast<long long>(memory_stats().large_allocations - blocks_before));
  log_info(text);
}

}  // namespace

Bundle train(RunDir& run, const std::vector<std::string>& stages, const LoopConfig& loop,
             const MakeStage& make, const TrainOptions& options) {
  const auto resumed = run.take_resumed();
  const auto begin =
      resumed ? std::find(stages.begin(), stages.end(), resumed->stage) - stages.begin() : 0;
  Bundle result;
  for (size_t i = 0; i < stages.size(); ++i) {
    const auto stage = make(stages[i], &result);
    if (stage == nullptr) continue;
    int64_t first = 0;
    const auto index = static_cast<std::ptrdiff_t>(i);
    if (resumed && index <= begin) {
      // The stage that was interrupted, or an earlier one that is complete.
      const auto checkpoint = index == begin ? resumed : latest_checkpoint(run.dir(), {stages[i]});
      if (!checkpoint)
        throw InputError(run.dir(), "the checkpoint of stage '" + stages[i] + "' is missing",
                         "train again from the start");
      stage->load(parse_safetensors(checkpoint->bytes, checkpoint->path), checkpoint->path);
      first = checkpoint->step;
    }
    run_stage(*stage, first, run, loop, options);
    result.add(stage->result());
  }
  return result;
}

}  // namespace restage
