#include "datasets/importers/import.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "datasets/importers/cmu.h"
#include "datasets/importers/makehuman.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

bool is_bvh(const fs::path& path) {
  std::string name = path.filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.ends_with(".bvh") || name.ends_with(".bvh.xz");
}

void add_bodies(const std::string& folder, const std::string& garment, DatasetWriter& writer,
                ImportSummary& summary) {
  const MakeHuman model(folder);
  const std::vector<BodyRecipe> recipes = read_recipes(folder + "/bodies.csv");
  constexpr size_t kBatch = 16;  // built by all threads, written by one
  for (size_t begin = 0; begin < recipes.size(); begin += kBatch) {
    const size_t n = std::min(kBatch, recipes.size() - begin);
    std::vector<Body> bodies(n);
    parallel_for(static_cast<int64_t>(n), 1, [&](int64_t from, int64_t to) {
      for (int64_t i = from; i < to; ++i)
        bodies[static_cast<size_t>(i)] =
            model.build(recipes[begin + static_cast<size_t>(i)], garment);
    });
    for (const Body& body : bodies) writer.add(body);
  }
  summary.bodies += recipes.size();
}

void add_motion(const Motion& motion, DatasetWriter& writer, ImportSummary& summary) {
  writer.add(motion);
  ++summary.motions;
  summary.frames += motion.frames();
}

ImportSummary import_data_folder(const std::string& folder, bool bodies, bool clips,
                                 const std::string& out, const ImportOptions& options) {
  ImportSummary summary;
  DatasetWriter writer(out, data_folder_info(bodies, clips));
  if (bodies) add_bodies(folder + "/body", options.garment, writer, summary);
  if (clips)
    for (const Motion& motion : import_cmu(folder + "/cmu/clips30.h5"))
      add_motion(motion, writer, summary);
  writer.commit();
  return summary;
}

ImportSummary import_bvh_files(const std::vector<std::string>& files, const std::string& source,
                               const std::string& out, const ImportOptions& options) {
  FileInfo info;
  info.license = options.license;
  info.provenance = "imported from " + fs::path(source).filename().string();
  ImportSummary summary;
  DatasetWriter writer(out, info);
  for (const std::string& file : files) {
    try {
      add_motion(import_bvh(file, options.bvh), writer, summary);
    } catch (const InputError& error) {
      if (files.size() == 1) throw;
      log_warning("skipped " + std::string(error.what()));
      summary.skipped.emplace_back(error.what());
    }
  }
  if (summary.motions == 0)
    throw InputError(source,
                     "none of its " + std::to_string(files.size()) + " BVH files could be used",
                     "import one alone to see why");
  writer.commit();
  return summary;
}

}  // namespace

FileInfo data_folder_info(bool bodies, bool clips) {
  FileInfo info;
  info.license = info.provenance = "";
  if (bodies) {
    info.license = "bodies: CC0 1.0";
    info.provenance =
        "bodies: MakeHuman base mesh, targets and game-engine rig (makehumancommunity)";
  }
  if (clips) {
    info.license += std::string(bodies ? "; " : "") +
                    "motions: free for research and commercial use with acknowledgement, not to be "
                    "resold as data";
    info.provenance += std::string(bodies ? "; " : "") + "motions: " + kCmuAcknowledgement;
  }
  return info;
}

ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options) {
  std::error_code ignored;
  if (!fs::is_directory(source, ignored)) {
    if (!fs::exists(source, ignored))
      throw InputError(source, "is not there", "give a folder or a BVH file");
    return import_bvh_files({source}, source, out, options);
  }
  const bool bodies = fs::exists(source + "/body/makehuman.h5", ignored);
  const bool clips = fs::exists(source + "/cmu/clips30.h5", ignored);
  if (bodies || clips) return import_data_folder(source, bodies, clips, out, options);
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(source, ignored))
    if (entry.is_regular_file(ignored) && is_bvh(entry.path()))
      files.push_back(entry.path().string());
  if (files.empty())
    throw InputError(source, "holds neither body/makehuman.h5, cmu/clips30.h5 nor BVH files",
                     "give a data folder or a folder of .bvh files");
  std::sort(files.begin(), files.end());
  return import_bvh_files(files, source, out, options);
}

}  // namespace restage
