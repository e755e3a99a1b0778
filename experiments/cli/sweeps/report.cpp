// restage report: one page about runs, or about a sweep.
#include <chrono>
#include <filesystem>
#include <thread>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/report/gather.h"

namespace restage::cli {
namespace {

struct ReportArguments {
  std::vector<std::string> folders;
  std::string out;
  report::GatherOptions how;
  bool no_play = false;
  int every = 0;  ///< seconds; 0: once
};

void check(const ReportArguments& a) {
  if (!a.out.ends_with(".html"))
    throw InputError(a.out, "is no page that can be written", "give a name that ends in .html");
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_directory(fs::absolute(a.out).parent_path(), ignored))
    throw InputError(a.out, "cannot be written (its folder is not there)", "make the folder first");
  const bool sweep = report::is_sweep(a.folders[0]);
  for (const std::string& folder : a.folders)
    if (a.folders.size() > 1 && report::is_sweep(folder))
      throw InputError(folder, "is a sweep, and a page shows runs or one sweep", "give it alone");
  if (!a.how.trial.empty() && (!sweep || a.how.sequences.empty()))
    throw InputError("", "--trial goes with a sweep and --sequence only", "leave it out");
  if (a.no_play && !a.how.sequences.empty())
    throw InputError("", "--no-play and --sequence do not go together", "give one of them");
  if (a.every < 0 || a.every > 86400)
    throw InputError("", "--every is out of range", "give seconds, such as 30");
  if (a.every > 0 && (!sweep || !a.how.sequences.empty()))
    throw InputError("", "--every follows a sweep, without sequences", "leave it out");
  for (const std::string& folder : a.folders) check_output(a.out, report::inputs_of(folder));
  const AtomicFile before_the_work(a.out);
}

/// Writes the page again and again while the sweep is not over; the browser reads it again too.
report::Report follow(const ReportArguments& a) {
  const StopScope stop;
  log_info("writing " + a.out + " every " + std::to_string(a.every) +
           " s until the sweep is over; end it with Ctrl-C");
  while (true) {
    report::Report made = report::of_sweep(a.folders[0], a.how);
    made.refresh = made.unfinished ? a.every : 0;
    write_file_atomically(a.out, valid_utf8(report::page(made)));
    if (!made.unfinished) return made;
    for (int tenth = 0; tenth < 10 * a.every; ++tenth) {
      throw_if_stopped();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
}

int run_report(ReportArguments a, const Common& common) {
  check(a);
  a.how.seed = common.seed;
  a.how.play = !a.no_play;
  report::Report made;
  if (a.every > 0) {
    made = follow(a);
  } else {
    made = report::is_sweep(a.folders[0]) ? report::of_sweep(a.folders[0], a.how)
                                          : report::of_runs(a.folders, a.how);
    write_file_atomically(a.out, valid_utf8(report::page(made)));
  }
  Json played = Json::array();
  for (const report::Play& play : made.plays) played.push_back(play.title);
  print(common.json,
        {{"out", a.out}, {"runs", made.runs.size()}, {"sequences", played}, {"seed", common.seed}},
        "wrote " + a.out + "\n");
  return 0;
}

}  // namespace

void add_report(Program& program) {
  auto [app, a] = program.add(
      "report", "one page about runs or a sweep: results, curves, sequences, configurations",
      "restage report runs/lite-1 --out report.html\n"
      "restage report runs/lite-1 runs/lite-2 --out report.html --no-play\n"
      "restage report runs/smoothness --sequence benchmark/naked/dance-male-female --out r.html\n"
      "restage report runs/smoothness --out r.html --every 30\n"
      "restage report runs/s --sequence walk/ --trial 4f2a90c1d3e5 --out r.html",
      run_report);
  app.add_option("RUN_OR_DIR", a.folders, "run directories, or the folder of one sweep").required();
  app.add_option("--out", a.out, "the page, such as report.html").required();
  app.add_option("--sequence", a.how.sequences,
                 "folder of a sequence with its truth to be played (restage data build, restage "
                 "eval --out); may be repeated (default: of a run held-out ones of its own)")
      .one_at_a_time();
  app.add_option("--trial", a.how.trial,
                 "whose answer is played, of a sweep (default: the one with the least error)");
  app.add_option("--every", a.every,
                 "seconds; writes the page again until the sweep is over, and the browser follows "
                 "(default: once)");
  app.add_flag("--no-play", a.no_play, "leave the sequences out");
}

}  // namespace restage::cli
