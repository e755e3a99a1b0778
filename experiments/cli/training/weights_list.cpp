#include "experiments/cli/training/weights_list.h"

#include <filesystem>
#include <fstream>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/shipped.h"
#include "experiments/cli/output.h"
#include "nn/weights/bundle.h"

namespace restage::cli {
namespace {

constexpr const char* kInstallAgain = "install Restage again";

/// experiments/weights/list.json: "weights" (name, for) and "captures" (capture, weights, set of
/// the benchmark, joints_mm, surface_mm). docs/make_results.py checks its figures.
Json read_list() {
  const std::string path = shipped("experiments/weights/list.json");
  if (path.empty())
    throw InputError("experiments/weights/list.json", "is not beside the program", kInstallAgain);
  std::ifstream file(path);
  Json list = Json::parse(file, nullptr, false);
  if (list.is_discarded() || !list.contains("weights") || !list.contains("captures"))
    throw InputError(path, "is damaged", kInstallAgain);
  return list;
}

/// What the weights file itself says is added to its row.
Json with_file(Json row) {
  const std::string path = weights_path(row.at("name"));
  row["joints"] = joint_definition(load_bundle(path), path);
  row["bytes"] = std::filesystem::file_size(path);
  row["file"] = path;
  return row;
}

std::string figure(const Json& row, const char* name) {
  return row.contains(name) ? format("%.1f", row.at(name).get<double>()) : "";
}

std::string text_of(const Json& weights, const Json& captures) {
  std::vector<std::vector<std::string>> files = {{"for", "weights", "joints", "MB"}},
                                        kinds = {
                                            {"capture", "weights", "joints, mm", "surface, mm"}};
  for (const Json& row : weights)
    files.push_back({row.at("for"), row.at("name"), row.at("joints"),
                     format("%.1f", 1e-6 * row.at("bytes").get<double>())});
  for (const Json& row : captures)
    kinds.push_back({row.at("capture"), row.at("weights"), figure(row, "joints_mm"),
                     figure(row, "surface_mm")});
  return markdown_table(files) + "\n" + markdown_table(kinds) +
         "\njoints: PA-MPJPE, surface: PA-MPVD, of the open benchmark (docs/results.md); blank: "
         "measured elsewhere (docs/which_command.md, \"Which weights\") or not at all\n";
}

int run_list(const Common& common) {
  const Json list = read_list();
  Json weights = Json::array();
  for (const Json& row : list.at("weights")) weights.push_back(with_file(row));
  print(common.json, {{"weights", weights}, {"captures", list.at("captures")}},
        text_of(weights, list.at("captures")));
  return 0;
}

}  // namespace

void add_weights_list(Program& program, CommandOptions group) {
  program.add(group, "list", "the weights that come with the program, by kind of capture",
              "restage weights list\nrestage weights list --json",
              [&program] { return run_list(program.common()); });
}

}  // namespace restage::cli
