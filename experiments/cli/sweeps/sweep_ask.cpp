// restage sweep ask, tell: a search that is driven by hand or by another program.
#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/words.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/asking.h"
#include "experiments/sweep/table_formats.h"

namespace restage::cli {
namespace {

struct AskArguments {
  std::string dir;
  std::vector<std::string> words;
  int up_to = 0;
};

struct TellArguments {
  std::string dir, trial, error;
  std::optional<double> value;
  bool failed = false;
};

int run_ask(const AskArguments& a, const Common& common) {
  if (a.up_to < 0)
    throw InputError("", "--up-to " + std::to_string(a.up_to) + " is out of range",
                     "give 1 or more");
  const std::string folder = a.dir;
  const auto question = sweep::ask(folder, a.words, a.up_to);
  if (!question) {
    const std::string why = a.up_to > 0 ? "so many trials were asked for, or no point is left"
                                        : "every point of the space has been asked for";
    print(common.json, {{"trial", nullptr}, {"why", why}}, why + "\n");
    return 0;
  }
  Json document = {{"trial", entry_json(question->trial)}, {"number", question->number}};
  const std::string values = joined(question->trial.overrides, [](const auto& one) {
    return one.first + "=" + tables::plain_text(one.second);
  });
  print(common.json, document,
        "trial " + question->trial.id + ", number " + std::to_string(question->number) + "\n" +
            values + "\nrun it with 'restage trial " + folder + " " + question->trial.id +
            "', or tell what it came to: 'restage sweep tell " + folder + " " + question->trial.id +
            " --value X'\n");
  return 0;
}

int run_tell(const TellArguments& a, const Common& common) {
  if (a.value.has_value() == a.failed)
    throw InputError("", a.failed ? "--value and --failed exclude each other" : "nothing is told",
                     "give --value X (less is better) or --failed");
  if (a.value && !std::isfinite(*a.value))
    throw InputError("", "--value is no number", "give --failed for a trial that came to nothing");
  sweep::tell(a.dir, a.trial, a.value, a.failed ? "told to have failed" : "");
  print(common.json, {{"trial", a.trial}, {"value", a.value ? Json(*a.value) : Json(nullptr)}},
        "trial " + a.trial + (a.failed ? " has failed\n" : " is done\n"));
  return 0;
}

}  // namespace

void add_sweep_ask(Program& program, CommandOptions group) {
  auto [p, ask] = program.add(
      group, "ask", "the next trial of a search by tpe, written into the sweep's folder",
      "restage sweep plan search.yaml --out runs/search && restage sweep ask runs/search --json\n"
      "restage sweep ask runs/search motion.optimiser.schedule.rate=0.001\n"
      "restage sweep ask runs/search --up-to 40",
      run_ask);
  p.add_option("DIR", ask.dir, "folder of the sweep ('sweep plan --out DIR')").required();
  p.add_option("KEY=VALUE", ask.words, "values of searched keys that are given, not proposed");
  p.add_option("--up-to", ask.up_to, "propose nothing if so many trials have been asked for");

  auto [t, tell] =
      program.add(group, "tell", "what a trial came to that was run or judged elsewhere",
                  "restage sweep tell runs/search 0123456789ab --value 0.042\n"
                  "restage sweep tell runs/search 0123456789ab --failed",
                  run_tell);
  t.add_option("DIR", tell.dir, "folder of the sweep").required();
  t.add_option("TRIAL", tell.trial, "its id").required();
  t.add_option("--value", tell.value, "the figure; less is better");
  t.add_flag("--failed", tell.failed, "it came to nothing");
}

}  // namespace restage::cli
