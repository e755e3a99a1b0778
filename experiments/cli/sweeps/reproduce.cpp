// restage reproduce: the experiments of a paper, run and judged.
#include <algorithm>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "autograd/base/shipped.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/reproduce/page.h"
#include "experiments/reproduce/schedule.h"
#include "experiments/sweep/pool.h"
#include "experiments/text.h"

namespace restage::cli {
namespace {

using reproduce::Evidence;
using reproduce::Verdict;

struct ReproduceOptions {
  std::string paper, table, budget, out, page;
  std::string from = "experiments/studies";
  std::vector<std::string> words;
  int jobs = 1;
  bool no_run = false, keep = false, plan = false, printed = false;
};

void check(const ReproduceOptions& o, const Common& common) {
  if (o.jobs < 1)
    throw InputError("", "--jobs " + std::to_string(o.jobs) + " is out of range", "give 1 or more");
  for (const std::string& word : o.words)
    if (word.find('=') == std::string::npos)
      throw InputError("", "'" + word + "' is no key=value", "write motion.optimiser.steps=500");
  if (o.no_run && !o.words.empty())
    throw InputError("", "--no-run plans nothing, so '" + o.words[0] + "' has no effect",
                     "leave out one of the two");
  if (o.plan && o.printed)
    throw InputError("", "--plan and --printed ask two questions", "ask one at a time");
  const bool runs = !o.plan && !o.printed;
  if (o.budget.empty() && !o.printed)
    throw InputError("", "--budget is missing", "say smoke, lite or paper");
  if (o.out.empty() && runs) throw InputError("", "--out is missing", "name a folder");
  for (const auto& [given, name] :
       {std::pair(!o.out.empty(), "--out"), std::pair(!o.page.empty(), "--page"),
        std::pair(o.no_run, "--no-run"), std::pair(o.keep, "--keep"),
        std::pair(o.printed && !o.budget.empty(), "--budget"),
        std::pair(o.printed && !o.words.empty(), "WORDS"), std::pair(o.jobs != 1, "--jobs"),
        std::pair(o.printed && common.seed_given, "--seed")})
    if (given && !runs)
      throw InputError("", cat(name, " has no effect beside ", o.plan ? "--plan" : "--printed"),
                       "leave it out");
}

/// A word of a command without a folder of this machine: /a/b/c is runs/c, also behind --out= and
/// key=.
std::string for_other_machines(const std::string& word) {
  const size_t begin = word.find('=') + 1;  // 0 where there is none
  std::filesystem::path path = word.substr(begin);
  if (!path.is_absolute()) return word;
  if (!path.has_filename()) path = path.parent_path();
  return word.substr(0, begin) + "runs/" + path.filename().string();
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
  std::vector<std::string> before;
  if (!o.out.empty()) before.push_back("store=" + o.out + "/store");
  const std::vector<std::string>& budget = one.asked.budget(o.budget).words;
  before.insert(before.end(), budget.begin(), budget.end());
  std::erase_if(before, [&](const std::string& word) {
    return std::any_of(own.begin(), own.end(),
                       [&](const std::string& mine) { return key_of(mine) == key_of(word); });
  });
  std::vector<std::string> words = {one.sweep_file(one.asked.budget(o.budget))};
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

/// How long each network of each row is trained.
int show_schedule(const ReproduceOptions& o, const Common& common,
                  const std::vector<Evidence>& all) {
  Json rows = Json::array();
  std::vector<std::vector<std::string>> text = {
      {"table", "row", "stage", "model", "parameters", "steps", "batch", "rate", "hours here"}};
  bool measured = true;
  for (const std::string& word : o.words)
    if (const std::string file = word.substr(std::min(word.size(), word.find('=') + 1));
        key_of(word) == "data.source" && file != "builtin" && !std::filesystem::exists(file))
      throw InputError(file, "is not there, and its rows cannot be measured",
                       "name a data set file or a benchmark's folder, or leave data.source out");
  for (const Evidence& one : all) {
    if (!one.runs()) continue;
    std::vector<std::string> words = words_of(o, common, one);
    words.erase(words.begin());  // the file
    for (const reproduce::Scheduled& s : reproduce::schedule_of(one, o.budget, words)) {
      measured &= s.hours.has_value();
      rows.push_back({{"table", s.table},
                      {"row", s.row},
                      {"stage", s.stage},
                      {"model", s.model},
                      {"parameters", s.parameters},
                      {"steps", s.steps},
                      {"batch", s.batch},
                      {"rate", s.rate},
                      {"hours", s.hours ? Json(*s.hours) : Json(nullptr)}});
      text.push_back({s.table, s.row, s.stage, s.model, std::to_string(s.parameters),
                      std::to_string(s.steps), std::to_string(s.batch), format("%g", s.rate),
                      s.hours ? format("%.3g", *s.hours) : "-"});
    }
  }
  if (!measured)
    log_warning("hours are measured where a row's data are there; data.source=FILE says which");
  print(common.json, {{"paper", o.paper}, {"budget", o.budget}, {"rows", std::move(rows)}},
        markdown_table(text));
  return 0;
}

/// The rule of verdicts, asked about the paper's own figures: each sentence by the reading that
/// suits it.
int show_printed(const ReproduceOptions& o, const Common& common,
                 const std::vector<Evidence>& all) {
  Json claims = Json::array(), unprinted = Json::array(), contradicted = Json::array();
  std::vector<std::vector<std::string>> text = {{"table", "claim", "by the printed figures"}};
  bool good = true;
  for (const Evidence& one : all) {
    std::vector<Verdict> verdicts;
    for (const reproduce::Claim& claim : one.asked.claims)
      verdicts.push_back(printed_verdict(one.asked, claim));
    for (const auto& sentence : reproduce::sentences_of(one.asked.claims, verdicts)) {
      const Verdict verdict = best_reading(sentence);
      if (verdict == Verdict::not_run) {
        unprinted.push_back(sentence.says);
        continue;
      }
      good &= verdict == Verdict::holds;
      const std::string name = reproduce::kVerdicts[static_cast<int>(verdict)];
      claims.push_back({{"table", one.asked.table}, {"claim", sentence.says}, {"verdict", name}});
      text.push_back({one.asked.table, sentence.says, name});
    }
    for (const std::string& says : one.asked.contradicted) contradicted.push_back(says);
  }
  print(common.json,
        {{"paper", o.paper},
         {"claims", std::move(claims)},
         {"not_printed", std::move(unprinted)},
         {"contradicted", std::move(contradicted)}},
        markdown_table(text));
  return good ? 0 : 1;
}

int run_reproduce(ReproduceOptions o, const Common& common) {
  check(o, common);
  if (o.page.empty()) o.page = o.out;
  o.from = here_or_shipped(o.from);
  const std::vector<Evidence> all = reproduce::find_evidence(o.from, o.paper, o.table, o.out);
  if (o.plan) return show_schedule(o, common, all);
  if (o.printed) return show_printed(o, common, all);
  const StopScope stop;
  plan(o, common, all);
  make_folder(o.page);  // now, and not after the first training
  const bool done = o.no_run || run_trials(o, all);
  reproduce::PageOptions options{o.paper, o.budget, common.command_line};
  options.command[0] = "restage";
  for (std::string& word : options.command) word = for_other_machines(word);
  const std::vector<reproduce::Found> found = reproduce::found(all, options, o.page);
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
      "restage reproduce rekik2024 --budget lite --out runs/page --no-run --experiments "
      "experiments/studies\n"
      "restage reproduce chen2023 --budget paper --plan\n"
      "restage reproduce rekik2024 --printed\n"
      "restage reproduce ours --budget smoke --out runs/smoke\n"
      "restage reproduce marsot2023 --budget paper --out runs/marsot2023 data.source=amass.h5",
      run_reproduce);
  app.add_option("PAPER", o.paper, "rekik2024, marsot2023, chen2023 or ours")
      .required()
      .suggest({"rekik2024", "marsot2023", "chen2023", "ours"});
  app.add_option("WORDS", o.words, "key=value for all of its sweeps, as in 'sweep run'");
  app.add_option("--table", o.table, "only this one, such as 4 (default: all)");
  app.add_option("--budget", o.budget,
                 "smoke (minutes: does it run?), lite (hours on 2 cores) or paper (its schedule)")
      .one_of({"smoke", "lite", "paper"});
  app.add_option("--out", o.out, "folder of the sweeps and the page");
  app.add_option("--page", o.page, "folder for the page (default: that of --out)");
  app.add_option("--experiments", o.from, "folder of the experiments").formerly("--from");
  app.add_option("--jobs", o.jobs, "trials at once; they share the threads");
  app.add_flag("--no-run", o.no_run, "only the page, from results that are there");
  app.add_flag("--plan", o.plan,
               "what the budget means: steps, batch, rate and hours of each network; nothing runs");
  app.add_flag("--printed", o.printed, "judge the claims by the paper's own figures; nothing runs");
  app.add_flag("--keep", o.keep, "put results into the experiments' folders, to be committed");
}

}  // namespace restage::cli
