// restage data: making and looking at data files (HDF5, datasets/README.md).
#include <filesystem>

#include "datasets/benchmark/manifest.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

int run_verify(const std::string& file, const Common& common) {
  const std::vector<std::string> problems =
      std::filesystem::is_directory(file) ? verify_benchmark(file) : verify(file);
  std::string text = problems.empty() ? file + ": all is well\n" : "";
  for (const std::string& problem : problems) text += on_one_line(problem) + "\n";
  print(common.json, {{"file", file}, {"problems", problems}}, text);
  return problems.empty() ? 0 : 1;
}

void add_verify(Program& program, CommandOptions group) {
  auto [app, file] = program.add(
      group, "verify",
      "read all of a file or benchmark folder and list what is wrong (exit code 1)",
      "restage data verify data.h5\nrestage data verify open_benchmark/ --json", run_verify);
  app.add_option("FILE", file, "an HDF5 file, or a folder made by restage data build").required();
}

}  // namespace

void add_data(Program& program) {
  CommandOptions group = program.add_group("data", "make, import and check data files");
  add_data_build(program, group);
  add_data_fetch(program, group);
  add_data_import(program, group);
  add_data_merge(program, group);
  add_data_split(program, group);
  add_data_perform(program, group);
  add_data_sheet(program, group);
  add_data_realism(program, group);
  add_data_inspect(program, group);
  add_verify(program, group);
}

}  // namespace restage::cli
