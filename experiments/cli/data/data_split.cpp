// restage data split: training, validation and test of one's own data.
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/split.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

struct SplitArguments {
  std::string file, out, by = "subject", bodies;
  std::vector<double> shares = {0.8, 0.1, 0.1};
  std::vector<std::string> only;
};

std::string first_names(const std::vector<std::string>& names) {
  constexpr size_t kShown = 8;
  if (names.empty()) return "-";
  return listed(names, kShown, [](const std::string& name) { return name.substr(0, 40); });
}

int run_split(const SplitArguments& a, const Common& common) {
  if (a.by != "subject" && a.by != "clip")
    throw InputError("", "--by is '" + a.by.substr(0, 40) + "'", "use subject or clip");
  if (a.shares.size() != 3)
    throw InputError("", format("--shares has %zu numbers", a.shares.size()),
                     "give three, of training, validation and test: 0.8,0.1,0.1");
  SplitOptions options{
      {a.shares[0], a.shares[1], a.shares[2]}, common.seed, a.by == "clip", a.bodies, a.only};
  const SplitSummary done = split_data(a.file, a.out, options);
  Json document = {{"out", a.out}, {"seed", common.seed}};
  std::vector<std::vector<std::string>> rows{{"split", "seconds", "subjects", "bodies"}};
  for (size_t s = 0; s < done.size(); ++s) {
    const SplitPart& part = done[s];
    document[kSplits[s]] = {
        {"subjects", part.subjects}, {"bodies", part.bodies}, {"seconds", part.seconds}};
    rows.push_back({kSplits[s], format("%.0f", part.seconds),
                    format("%zu: ", part.subjects.size()) + first_names(part.subjects),
                    format("%zu: ", part.bodies.size()) + first_names(part.bodies)});
  }
  print(common.json, document, markdown_table(rows) + "\nwrote " + a.out + "\n");
  return 0;
}

}  // namespace

void add_data_split(Program& program, CommandOptions group) {
  auto [app, a] =
      program.add(group, "split", "deal people and bodies to training, validation and test",
                  "restage data split people.h5 --out data.h5\n"
                  "restage data split recordings.h5 --bodies builtin --out data.h5\n"
                  "restage data split people.h5 --shares 0.7,0.15,0.15 --seed 3 --out "
                  "data.h5\n"
                  "restage data split all.h5 --only ann,ben,eve --bodies all.h5 --out few.h5\n"
                  "restage data split one_person.h5 --by clip --out data.h5",
                  run_split);
  app.add_option("FILE", a.file, "data file with bodies, motions or both").required();
  app.add_option("--out", a.out, "file to write").required();
  app.add_option("--shares", a.shares, "of training, validation and test, by seconds of motion")
      .separated_by(',');
  app.add_option("--bodies", a.bodies,
                 "data file (FILE too) whose bodies come along, in the splits that they have "
                 "there; or builtin");
  app.add_option("--only", a.only, "these people and nobody else (default: all)").separated_by(',');
  app.add_option("--by", a.by, "subject, or clip where there are too few people");
}

}  // namespace restage::cli
