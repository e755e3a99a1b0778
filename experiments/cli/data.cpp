// restage data: making and looking at data files (HDF5, datasets/README.md).
#include <filesystem>
#include <map>
#include <memory>

#include "autograd/base/error.h"
#include "datasets/benchmark/manifest.h"
#include "datasets/importers/import.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"

namespace restage::cli {
namespace {

// ---- import ------------------------------------------------------------------------------------

struct ImportArguments {
  std::string source, out, up = "auto";
  ImportOptions options;
};

int run_import(ImportArguments arguments, const Common& common) {
  static const std::map<std::string, UpAxis> axes = {
      {"auto", UpAxis::automatic}, {"y", UpAxis::y}, {"z", UpAxis::z}};
  const auto axis = axes.find(arguments.up);
  if (axis == axes.end())
    throw InputError("", "--up '" + arguments.up + "' is no axis", "give auto, y or z");
  arguments.options.bvh.up = axis->second;
  if (arguments.options.bvh.scale < 0 || arguments.options.bvh.fps < 0)
    throw InputError("", "--scale and --fps cannot be negative",
                     "leave them out to have them found");
  const ImportSummary done = import_data(arguments.source, arguments.out, arguments.options);
  if (common.json) {
    print_json({{"out", arguments.out},
                {"bodies", done.bodies},
                {"motions", done.motions},
                {"frames", done.frames},
                {"skipped", done.skipped}});
    return 0;
  }
  print("wrote " + arguments.out + ": " + std::to_string(done.bodies) + " bodies, " +
        std::to_string(done.motions) + " motions, " + std::to_string(done.frames) + " frames\n");
  for (const std::string& file : done.skipped) print("skipped " + file + "\n");
  return 0;
}

void add_import(Program& program, CLI::App& group) {
  const auto given = std::make_shared<ImportArguments>();
  CLI::App& app =
      program.add(group, "import", "turn MakeHuman bodies, CMU clips or BVH files into a data file",
                  "restage data import DATA_FOLDER --out real.h5\n"
                  "restage data import walk.bvh --subject ann --license CC0-1.0 --out walk.h5",
                  [given, &program] { return run_import(*given, program.common()); });
  app.add_option("SOURCE", given->source, "data folder, BVH file (.bvh, .bvh.xz) or folder of them")
      ->required();
  app.add_option("--out", given->out, "file to write")->required();
  app.add_option("--garment", given->options.garment, "dress the bodies (a file of body/clothes)");
  app.add_option("--license", given->options.license, "licence of the BVH files");
  app.add_option("--subject", given->options.bvh.subject, "who moves in the BVH files");
  app.add_option("--split", given->options.bvh.split, "train, validation or test, for BVH files");
  app.add_option("--scale", given->options.bvh.scale, "metres per unit of the BVH files");
  app.add_option("--fps", given->options.bvh.fps, "true frame rate of the BVH files");
  app.add_option("--up", given->up, "up axis of the BVH files: auto, y or z");
  app.add_option("--rest-frame", given->options.bvh.rest_frame, "T-pose frame of the BVH files");
}

// ---- inspect and verify ------------------------------------------------------------------------

int run_inspect(const std::string& file, const Common& common) {
  const Inspection found = inspect(file);
  if (common.json) {
    print_json({{"kind", found.kind},
                {"counts", found.counts},
                {"units", found.units},
                {"license", found.license},
                {"provenance", found.provenance}});
    return 0;
  }
  std::string text = "kind        " + found.kind + "\n";
  for (const auto& [name, count] : found.counts)
    text += name + std::string(name.size() < 12 ? 12 - name.size() : 1, ' ') +
            std::to_string(count) + "\n";
  print(text + "units       " + found.units + "\nlicense     " + found.license + "\nprovenance  " +
        found.provenance + "\n");
  return 0;
}

int run_verify(const std::string& file, const Common& common) {
  const std::vector<std::string> problems =
      std::filesystem::is_directory(file) ? verify_benchmark(file) : verify(file);
  if (common.json) {
    print_json({{"file", file}, {"problems", problems}});
  } else {
    std::string text;
    for (const std::string& problem : problems) text += problem + "\n";
    print(problems.empty() ? file + ": all is well\n" : text);
  }
  return problems.empty() ? 0 : 1;
}

void add_file_command(Program& program, CLI::App& group, const std::string& name,
                      const std::string& help, const std::string& what,
                      int (*run)(const std::string&, const Common&)) {
  const auto file = std::make_shared<std::string>();
  CLI::App& app =
      program.add(group, name, help,
                  "restage data " + name + " data.h5\nrestage data " + name + " data.h5 --json",
                  [file, run, &program] { return run(*file, program.common()); });
  app.add_option("FILE", *file, what)->required();
}

}  // namespace

void add_data(Program& program) {
  CLI::App& group = program.add_group("data", "make, import and check data files");
  add_data_build(program, group);
  add_data_fetch(program, group);
  add_import(program, group);
  add_data_perform(program, group);
  add_data_sheet(program, group);
  add_data_realism(program, group);
  add_file_command(program, group, "inspect", "say what a file holds",
                   "bodies, motions, scans or a prediction (HDF5)", run_inspect);
  add_file_command(program, group, "verify",
                   "read all of a file or benchmark folder and list what is wrong (exit code 1)",
                   "an HDF5 file, or a folder made by restage data build", run_verify);
}

}  // namespace restage::cli
