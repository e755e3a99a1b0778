// restage data merge: several data files as one.

#include "datasets/merge.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

struct MergeArguments {
  std::vector<std::string> files;
  std::string out;
  MergeOptions options;
};

int run_merge(const MergeArguments& given, const Common& common) {
  const MergeSummary done = merge_data(given.files, given.out, given.options);
  print(common.json,
        {{"out", given.out},
         {"bodies", done.bodies},
         {"motions", done.motions},
         {"license", done.license},
         {"provenance", done.provenance}},
        "wrote " + given.out + ": " + std::to_string(done.bodies) + " bodies, " +
            std::to_string(done.motions) + " motions\nlicense     " + done.license + "\n");
  return 0;
}

}  // namespace

void add_data_merge(Program& program, CommandOptions group) {
  auto [app, given] =
      program.add(group, "merge", "put the bodies and motions of several data files into one",
                  "restage data merge real.h5 walk.h5 --out all.h5\n"
                  "restage data merge a.h5 b.h5 --prefix --out both.h5",
                  run_merge);
  app.add_option("FILES", given.files, "data files with bodies, motions or both").required();
  app.add_option("--out", given.out, "file to write").required();
  app.add_flag("--prefix", given.options.prefix, "put each file's name before its ids");
}

}  // namespace restage::cli
