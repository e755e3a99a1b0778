// restage compare: runs and trials side by side.
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/sweep/compare.h"

namespace restage::cli {
namespace {

struct CompareArguments {
  std::vector<std::string> folders;
  std::string out;
};

/// F.svg, or curves.svg in a folder that is there or whose name ends in '/'.
std::string place_of(const std::string& out) {
  std::error_code ignored;
  if (out.ends_with("/") || std::filesystem::is_directory(out, ignored)) return out + "/curves.svg";
  if (out.ends_with(".svg")) return out;
  throw InputError(out, "is no picture that can be written",
                   "give a name that ends in .svg, or a folder (with '/' at the end)");
}

int run_compare(const CompareArguments& a, const Common& common) {
  const std::string place = a.out.empty() ? "" : place_of(a.out);
  std::vector<tables::Compared> all;
  for (const std::string& folder : a.folders) {
    all.push_back(tables::read_compared(folder));
    if (!place.empty())
      check_output(place,
                   {folder + "/config.yaml", folder + "/metrics.jsonl", folder + "/result.json"});
  }
  if (!place.empty()) {
    std::error_code ignored;  // writing tells what is wrong
    if (a.out.ends_with("/")) std::filesystem::create_directories(a.out, ignored);
    write_file_atomically(place, tables::comparison_svg(all));
  }
  print(common.json, tables::comparison_json(all), tables::comparison_markdown(all));
  if (!place.empty()) log_info("wrote " + place);
  return 0;
}

}  // namespace

void add_compare(Program& program) {
  auto [app, a] = program.add("compare", "runs and trials side by side: settings, figures, curves",
                              "restage compare runs/lite-1 runs/lite-2 --out curves.svg\n"
                              "restage compare runs/smoothness/trials/* --json",
                              run_compare);
  app.add_option("RUN_OR_TRIAL", a.folders, "run directories, DIR/trials/ID of sweeps").required();
  app.add_option("--out", a.out, "curves as F.svg, or a folder for them").one_at_a_time();
}

}  // namespace restage::cli
