// restage reproduce: the experiments of a paper, run and judged.
#include <algorithm>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "autograd/base/shipped.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/reproduce/page.h"
#include "experiments/sweep/pool.h"

namespace restage::cli {
namespace {

using reproduce::Evidence;

struct ReproduceOptions {
  std::string paper, table, budget, out, page;
  std::string from = "experiments";
  std::vector<std::string> words;
  int jobs = 1;
  bool no_run = false, keep = false;
};

void check(const ReproduceOptions& o) {
  if (o.jobs < 1)
    throw InputError("", "--jobs " + std::to_string(o.jobs) + " is out of range", "give 1 or more");
  for (const std::string& word : o.words)
    if (word.find('=') == std::string::npos)
      throw InputError("", "'" + word + "' is no key=value", "write motion.optimiser.steps=500");
  if (o.no_run && !o.words.empty())
    throw InputError("", "--no-run plans nothing, so '" + o.words[0] + "' has no effect",
                     "leave out one of the two");
}

std::string key_of(const std::string& word) {
  const std::string key = word.substr(0, word.find('='));
  return key == "seed" ? "seeds" : key;
}

/// What a sweep is planned with: the words of the user win over those of the budget.
std::vector<std::string> words_of(const ReproduceOptions& o, const Common& common,
                                  const Evidence& one) {
  std::vector<std::string> own = o.words;
  if (common.seed_given) own.push_back("seed=" + std::to_string(common.seed));
  std::vector<std::string> before = {"store=" + o.out + "/store"};
  const std::vector<std::string>& budget = one.asked.budget(o.budget).words;
  before.insert(before.end(), budget.begin(), budget.end());
  std::erase_if(before, [&](const std::string& word) {
    return std::any_of(own.begin(), own.end(),
                       [&](const std::string& mine) { return key_of(mine) == key_of(word); });
  });
  std::vector<std::string> words = {one.sweep_file()};
  for (const auto* part : {&before, &own}) words.insert(words.end(), part->begin(), part->end());
  return words;
}

/// All sweeps are planned before one runs, so that bad input is told at once.
void plan(const ReproduceOptions& o, const Common& common, const std::vector<Evidence>& all) {
  for (const Evidence& one : all) {
    if (!one.runs()) continue;
    if (o.no_run) {
      if (!take_plan(one, o.budget)) continue;
    } else {
      sweep::plan_in_a_process(one.dir, words_of(o, common, one), common.quiet);
    }
    if (const int taken = take_results(one); taken > 0)
      log_info(one.name + ": " + std::to_string(taken) + " results are there already, in " +
               one.folder + "/results");
  }
}

/// Whether all trials are done.
bool run_trials(const ReproduceOptions& o, const std::vector<Evidence>& all) {
  bool done = true;
  for (const Evidence& one : all) {
    if (!one.runs()) continue;
    log_info(one.name + ": " + one.asked.table + ", " + one.asked.title);
    const sweep::SweepDir dir = sweep::read_sweep_dir(one.dir);
    const auto outcome = run_pool(dir, {o.jobs, std::max(1, threads() / o.jobs)});
    if (outcome.stop_requested && outcome.pending + outcome.stopped > 0)
      throw WorkError("stopped by 'restage sweep stop'; the same command goes on");
    done &= outcome.done + outcome.stopped_early == std::ssize(dir.trials);
    if (o.keep) keep_results(one, o.budget);
  }
  return done;
}

int run_reproduce(ReproduceOptions o, const Common& common) {
  check(o);
  if (o.page.empty()) o.page = o.out;
  o.from = here_or_shipped(o.from);
  const std::vector<Evidence> all = reproduce::find_evidence(o.from, o.paper, o.table, o.out);
  const StopScope stop;
  plan(o, common, all);
  make_folder(o.page);  // now, and not after the first training
  const bool done = o.no_run || run_trials(o, all);
  reproduce::PageOptions options{o.paper, o.budget, common.command_line, common.seed};
  options.command[0] = "restage";
  std::vector<reproduce::Found> found;
  for (const Evidence& one : all) found.push_back(reproduce::found(one, options, o.page));
  for (const auto& one : found)
    for (const std::string& notice : one.results.notices) log_warning(on_one_line(notice));
  write_page(found, options, o.page, o.from);
  print(common.json, page_json(found, options), o.page + "/" + o.paper + ".md\n");
  return done ? 0 : 1;
}

}  // namespace

void add_reproduce(Program& program) {
  auto [app, o] = program.add(
      "reproduce", "run a paper's experiments, and judge its claims by them",
      "restage reproduce rekik2024 --budget smoke --out runs/smoke\n"
      "restage reproduce rekik2024 --table 4 --budget lite --out runs/rekik2024 --jobs 2\n"
      "restage reproduce rekik2024 --budget lite --out runs/rekik2024 --keep --page "
      "docs/reproduction\n"
      "restage reproduce rekik2024 --budget lite --out runs/page --no-run --from experiments\n"
      "restage reproduce marsot2023 --budget paper --out runs/marsot2023 data.source=amass.h5",
      run_reproduce);
  app.add_option("PAPER", o.paper, "rekik2024, marsot2023 or chen2023")
      .required()
      .suggest({"rekik2024", "marsot2023", "chen2023", "ours"});
  app.add_option("WORDS", o.words, "key=value for all of its sweeps, as in 'sweep run'");
  app.add_option("--table", o.table, "only this one, such as 4 (all)");
  app.add_option("--budget", o.budget,
                 "smoke (minutes: does it run?), lite (hours on 2 cores) or paper (its schedule)")
      .required()
      .one_of({"smoke", "lite", "paper"});
  app.add_option("--out", o.out, "folder of the sweeps and the page").required();
  app.add_option("--page", o.page, "another folder for the page");
  app.add_option("--from", o.from, "folder of the experiments (experiments)");
  app.add_option("--jobs", o.jobs, "trials at once; they share the threads (1)");
  app.add_flag("--no-run", o.no_run, "only the page, from results that are there");
  app.add_flag("--keep", o.keep, "put results into the experiments' folders, to be committed");
}

}  // namespace restage::cli
