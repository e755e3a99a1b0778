#include "experiments/cli/training/watched.h"

#include <algorithm>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "nn/config/config.h"

namespace restage::cli {
namespace {

/// loop.monitor where it does nothing.
std::vector<TrainWarning> monitor_warnings(const TrainConfig& config) {
  std::vector<TrainWarning> out;
  const SelectionConfig& selection = config.loop.selection;
  const std::vector<std::string> trained = config.trained();
  for (const std::string& figure : selection.monitor) {
    const std::string stage = figure.substr(0, figure.find('.'));
    if (std::find(trained.begin(), trained.end(), stage) == trained.end())
      out.push_back({"unused_monitor", "loop.monitor names " + figure + ", and stage " + stage +
                                           " is not trained here: take it out, or name the stage "
                                           "in stages"});
  }
  if (!selection.monitor.empty() && !selection.judges() && selection.keep_best == 0)
    out.push_back({"unused_monitor",
                   "loop.monitor chooses nothing here: set loop.export=best, loop.patience or "
                   "loop.keep_best, or leave it out"});
  return out;
}

/// loop.logs, and what the options add to it.
std::vector<std::string> logs_named(const TrainConfig& config, const TrainArguments& arguments,
                                    bool first) {
  std::vector<std::string> out;
  if (first) out = config.loop.logs;
  if (arguments.tensorboard) out.emplace_back("tensorboard");
  if (arguments.csv) out.emplace_back("csv");
  return out;
}

}  // namespace

void Profiled::finish() {
  profile_.finish();
  file_.write(profile_.trace());
  file_.commit();
  log_info("wrote " + trace_);
}

Watched::Watched(const std::string& run, const TrainConfig& config, const TrainArguments& arguments,
                 bool first, Profiled* profile)
    : logs_(run, config.name, resolved_yaml(config), logs_named(config, arguments, first)),
      summary_(run),
      profile_(profile),
      more_(arguments.observers) {
  for (const TrainWarning& one : monitor_warnings(config)) {
    log_warning(one.said);
    summary_.on_warning("", 0, one);
  }
}

std::vector<TrainObserver*> Watched::observers() {
  std::vector<TrainObserver*> out = logs_.observers();
  out.push_back(&summary_);
  if (profile_ != nullptr) out.push_back(profile_->observer());
  out.insert(out.end(), more_.begin(), more_.end());
  return out;
}

void Watched::end(RunEnd how) {
  logs_.end(how);
  summary_.end(how);
  if (profile_ != nullptr) profile_->finish();
}

void Watched::run(const std::function<void()>& train) {
  try {
    train();
  } catch (const Interrupted&) {
    end(RunEnd::stopped);
    throw;
  } catch (...) {
    try {
      end(RunEnd::failed);
    } catch (const Error& error) {  // the disk is full, perhaps; what failed first counts
      log_warning(error.what());
    }
    throw;
  }
  end(RunEnd::finished);
}

}  // namespace restage::cli
