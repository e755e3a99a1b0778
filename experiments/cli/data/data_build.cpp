// restage data build: the built-in source as a file, or a recipe as a benchmark folder.
#include <cstdlib>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "datasets/benchmark/build.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/training/benchmark_config.h"
#include "experiments/shipped_config.h"
#include "nn/config/config.h"

namespace restage::cli {
namespace {

constexpr int kMostBodies = 10000;  // guards against typing errors, not a limit of the format

struct BuildOptions {
  std::vector<std::string> arguments;  ///< RECIPE.yaml, out=, data= and key=value; none: built-in
  std::string out;
  std::vector<int> bodies, motions;  ///< train, validation, test; none: the usual numbers
};

void check_counts(const std::string& name, const std::vector<int>& counts) {
  for (const int n : counts)
    if (n < 0 || n > kMostBodies)
      throw InputError("", name + " " + std::to_string(n) + " is out of range",
                       "give three numbers from 0 to " + std::to_string(kMostBodies));
}

int total(const std::vector<int>& counts) { return counts[0] + counts[1] + counts[2]; }

int build_builtin(const BuildOptions& options, const Common& common) {
  const std::vector<int> b = options.bodies.empty() ? std::vector{24, 4, 4} : options.bodies,
                         m = options.motions.empty() ? std::vector{60, 20, 20} : options.motions;
  if (options.out.empty())
    throw InputError("", "there is no place to write to", "give --out FILE.h5");
  check_counts("--bodies", b);
  check_counts("--motions", m);
  if (total(b) + total(m) == 0)
    throw InputError("", "no bodies and no motions were asked for", "give --bodies or --motions");
  DatasetWriter writer(options.out,
                       {kBuiltinLicense, "built-in source, seed " + std::to_string(common.seed)});
  log_info("building " + std::to_string(total(b)) + " bodies and " + std::to_string(total(m)) +
           " motions with seed " + std::to_string(common.seed));
  for (const Body& body : builtin_bodies(common.seed, b[0], b[1], b[2])) writer.add(body);
  for (const Motion& motion : builtin_motions(common.seed, m[0], m[1], m[2])) writer.add(motion);
  writer.commit();
  print(common.json, {{"out", options.out}, {"bodies", b}, {"motions", m}, {"seed", common.seed}},
        "wrote " + options.out + "\n");
  return 0;
}

// ---- a recipe ----------------------------------------------------------------------------------

struct BuildRequest {
  std::string recipe, out, data;
  std::vector<std::string> overrides;
};

/// Where a data folder is looked for if none is named: what `data fetch --out data` fills, then
/// the one beside a checkout. Empty: neither is there.
std::string usual_data_folder() {
  for (const char* folder : {"data", "../shared/data"})
    if (std::filesystem::exists(std::string(folder) + "/body/makehuman.h5")) return folder;
  return "";
}

BuildRequest read_request(const BuildOptions& options, const Common& common) {
  BuildRequest out;
  out.out = options.out;
  if (!options.bodies.empty() || !options.motions.empty())
    throw InputError("", "--bodies and --motions are of built-in data, a recipe names its own",
                     "leave them out, or override train.bodies and the like");
  const auto once = [](std::string& place, const std::string& argument) {
    const size_t equals = argument.find('=');
    if (!place.empty())
      throw InputError("", argument.substr(0, equals + 1) + " is given twice", "give it once");
    place = argument.substr(equals + 1);
  };
  for (const std::string& a : options.arguments) {
    if (a.starts_with("out="))
      once(out.out, a);
    else if (a.starts_with("data="))
      once(out.data, a);
    else if (a.find('=') != std::string::npos)
      out.overrides.push_back(a);
    else if (out.recipe.empty())
      out.recipe = a;
    else
      throw InputError("", "there are two recipes, '" + out.recipe + "' and '" + a + "'",
                       "give one");
  }
  if (common.seed_given) out.overrides.push_back("seed=" + std::to_string(common.seed));
  if (const char* folder = std::getenv("RESTAGE_DATA"); folder && out.data.empty())
    out.data = folder;
  if (out.data.empty()) out.data = usual_data_folder();
  if (out.recipe.empty() || out.out.empty() || out.data.empty())
    throw InputError("",
                     std::string("there is no ") + (out.recipe.empty() ? "recipe"
                                                    : out.out.empty()  ? "place to write to"
                                                                       : "data folder"),
                     "use 'restage data build RECIPE.yaml out=DIR data=DATA_FOLDER' (or set "
                     "RESTAGE_DATA, or fill ./data with 'restage data fetch')");
  return out;
}

int build_recipe(const BuildOptions& options, const Common& common) {
  const BuildRequest request = read_request(options, common);
  BenchmarkRecipe recipe;
  load_config(config_file(request.recipe), request.overrides, recipe);
  const BenchmarkSummary done = build_benchmark(recipe, config_to_yaml(write_identity(recipe)),
                                                request.recipe, request.data, request.out);
  print(common.json,
        {{"out", request.out},
         {"data", request.data},
         {"files", done.files},
         {"bytes", done.bytes},
         {"seed", recipe.seed}},
        "wrote " + request.out + ": " + std::to_string(done.files) + " files, " +
            std::to_string((done.bytes + 500'000) / 1'000'000) + " MB, from " + request.data +
            "\n");
  return 0;
}

int run_build(const BuildOptions& options, const Common& common) {
  return options.arguments.empty() ? build_builtin(options, common) : build_recipe(options, common);
}

}  // namespace

void add_data_build(Program& program, CommandOptions group) {
  auto [app, options] = program.add(
      group, "build", "make the open benchmark from its recipe, or parametric data from nothing",
      "restage data build configs/data/open_benchmark.yaml out=benchmark data=DATA_FOLDER\n"
      "restage data build --out data.h5\n"
      "restage data build --bodies 40 5 5 --motions 120 20 20 --seed 1 --out data.h5",
      run_build);
  app.add_option("ARGUMENTS", options.arguments,
                 "RECIPE.yaml, out=DIR, data=DIR and key=value overrides");
  app.add_option("--out", options.out, "file (or folder, of a recipe) to write");
  app.add_option("--bodies", options.bodies, "built-in bodies for training, validation and test")
      .count(3);
  app.add_option("--motions", options.motions, "built-in motions for training, validation and test")
      .count(3);
}

}  // namespace restage::cli
