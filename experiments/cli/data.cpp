// restage data: making and looking at data files (HDF5, datasets/README.md).
#include <memory>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

constexpr int kMostBodies = 10000;  // guards against typing errors, not a limit of the format

// ---- build -------------------------------------------------------------------------------------

struct BuildOptions {
  std::string out;
  std::vector<int> bodies{24, 4, 4}, motions{60, 20, 20};  ///< train, validation, test
};

void check_counts(const std::string& name, const std::vector<int>& counts) {
  for (const int n : counts)
    if (n < 0 || n > kMostBodies)
      throw InputError("", name + " " + std::to_string(n) + " is out of range",
                       "give three numbers from 0 to " + std::to_string(kMostBodies));
}

int total(const std::vector<int>& counts) { return counts[0] + counts[1] + counts[2]; }

int run_build(const BuildOptions& options, const Common& common) {
  const auto &b = options.bodies, &m = options.motions;
  check_counts("--bodies", b);
  check_counts("--motions", m);
  if (total(b) + total(m) == 0)
    throw InputError("", "no bodies and no motions were asked for", "give --bodies or --motions");
  DatasetWriter writer(options.out,
                       {"CC0-1.0", "built-in source, seed " + std::to_string(common.seed)});
  log_info("building " + std::to_string(total(b)) + " bodies and " + std::to_string(total(m)) +
           " motions with seed " + std::to_string(common.seed));
  for (const Body& body : builtin_bodies(common.seed, b[0], b[1], b[2])) writer.add(body);
  for (const Motion& motion : builtin_motions(common.seed, m[0], m[1], m[2])) writer.add(motion);
  writer.commit();
  if (common.json)
    print_json({{"out", options.out}, {"bodies", b}, {"motions", m}, {"seed", common.seed}});
  else
    print("wrote " + options.out + "\n");
  return 0;
}

void add_build(Program& program, CLI::App& group) {
  const auto options = std::make_shared<BuildOptions>();
  CLI::App& app =
      program.add(group, "build", "make parametric bodies and motions, no data needed",
                  "restage data build --out data.h5\n"
                  "restage data build --bodies 40 5 5 --motions 120 20 20 --seed 1 "
                  "--out data.h5",
                  [options, &program] { return run_build(*options, program.common()); });
  app.add_option("--out", options->out, "file to write")->required();
  app.add_option("--bodies", options->bodies, "bodies for training, validation and test")
      ->expected(3);
  app.add_option("--motions", options->motions, "motions for training, validation and test")
      ->expected(3);
}

// ---- verify ------------------------------------------------------------------------------------

int run_verify(const std::string& file, const Common& common) {
  const std::vector<std::string> problems = verify(file);
  if (common.json) {
    print_json({{"file", file}, {"problems", problems}});
  } else {
    std::string text;
    for (const std::string& problem : problems) text += problem + "\n";
    print(problems.empty() ? file + ": all is well\n" : text);
  }
  return problems.empty() ? 0 : 1;
}

void add_verify(Program& program, CLI::App& group) {
  const auto file = std::make_shared<std::string>();
  CLI::App& app =
      program.add(group, "verify", "read all of a file and list what is wrong (exit code 1)",
                  "restage data verify data.h5\nrestage data verify data.h5 --json",
                  [file, &program] { return run_verify(*file, program.common()); });
  app.add_option("FILE", *file, "bodies, motions, scans or a prediction (HDF5)")->required();
}

}  // namespace

void add_data(Program& program) {
  CLI::App& group = program.add_group("data", "make, import and check data files");
  add_build(program, group);
  add_data_import(program, group);
  add_data_perform(program, group);
  add_data_merge(program, group);
  add_data_inspect(program, group);
  add_verify(program, group);
}

}  // namespace restage::cli
