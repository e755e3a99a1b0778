// restage watch: a sweep as it runs, in the terminal.
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/live.h"

namespace restage::cli {
namespace {

using sweep::LiveSweep;

struct WatchArguments {
  std::string dir, metric;
  double every = 0;  ///< seconds; 0: 1 in a terminal, 10 elsewhere
  bool once = false;
};

struct Screen {
  bool terminal = false;
  int columns = 0, rows = 0;  ///< 0: no limit
};

Screen screen() {
  Screen out;
  const char* term = std::getenv("TERM");
  out.terminal = ::isatty(STDOUT_FILENO) == 1 && term != nullptr && std::string(term) != "dumb";
  winsize size{};
  if (!out.terminal || ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) return out;
  out.columns = size.ws_col > 1 ? size.ws_col - 1 : 79;
  out.rows = size.ws_row;
  return out;
}

double monotonic() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Json number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json live_json(const LiveSweep& live) {
  Json running = Json::array();
  for (const sweep::RunningTrial& one : live.running)
    running.push_back({{"id", one.trial.id},
                       {"stage", one.stage.empty() ? Json(nullptr) : Json(one.stage)},
                       {"step", one.step},
                       {"steps", one.steps},
                       {"seconds_left", number_or_null(one.left)},
                       {"now", number_or_null(one.now)},
                       {"holder", one.holder}});
  Json best = nullptr;
  if (live.best) best = {{"id", live.best->trial.id}, {"value", live.best->value}};
  return {{"metric", live.metric.empty() ? Json(nullptr) : Json(live.metric)},
          {"counts", live.counts},
          {"to_come", live.to_come},
          {"best", std::move(best)},
          {"running", std::move(running)},
          {"seconds_left", number_or_null(live.left)}};
}

/// Draws over what it drew before; the cursor is never hidden, so that nothing is left to mend.
class Drawing {
 public:
  void show(const std::vector<std::string>& lines, const Screen& on) {
    std::string text;
    if (on.terminal && drawn_ > 0) text += "\x1b[" + std::to_string(drawn_) + "A\r\x1b[J";
    for (const std::string& line : lines) text += line + "\n";
    if (!on.terminal && text == before_) return;  // a pipe wants news
    before_ = text;
    print(text);
    finish_output();
    drawn_ = lines.size();
  }

 private:
  size_t drawn_ = 0;
  std::string before_;
};

/// Sleeps, and wakes when a signal comes.
bool wait_for_signal(double seconds) {
  for (const double end = monotonic() + seconds; monotonic() < end && !stop_requested();)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return stop_requested();
}

int run_watch(const WatchArguments& a, const Common& common) {
  if (a.every < 0 || a.every > 86400)
    throw InputError("", "--every is out of range", "give seconds, such as 2");
  if (common.json && !a.once)
    throw InputError("", "--json prints one document", "give --once with it");
  const StopScope stop;
  sweep::Pace pace;
  sweep::DoneTrials done;
  Drawing drawing;
  while (true) {
    const sweep::SweepDir dir = sweep::read_sweep_dir(a.dir);
    LiveSweep live = sweep::look_at(dir, a.metric, &done);
    pace.fill_in(live, monotonic());
    const Screen on = screen();
    if (common.json) {
      print_json(live_json(live));
    } else {
      drawing.show(sweep::picture(live, a.dir, on.columns, on.rows), on);
    }
    if (a.once || live.over()) return 0;
    // The picture stays as it is, and the next prompt stands below it.
    if (wait_for_signal(a.every > 0 ? a.every : on.terminal ? 1 : 10)) return 128 + SIGINT;
  }
}

}  // namespace

void add_watch(Program& program) {
  auto [app, a] =
      program.add("watch", "a sweep as it runs: bars, figures, curves; it may run elsewhere",
                  "restage watch runs/smoothness\n"
                  "restage watch runs/smoothness --metric motion.pa_mpjpe --every 5\n"
                  "restage watch runs/smoothness --once\n"
                  "restage watch runs/smoothness --once --json",
                  run_watch);
  app.add_option("DIR", a.dir, "folder of the sweep").required();
  app.add_option("--metric", a.metric,
                 "STAGE.FIGURE or SET.METRIC to show (default: the sweep's search or early_stop, "
                 "else motion.pa_mpjpe)");
  app.add_option("--every", a.every,
                 "seconds between looks (default: 1 in a terminal, 10 elsewhere)");
  app.add_flag("--once", a.once, "show it as it stands, and end");
}

}  // namespace restage::cli
