#include "datasets/importers/import.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "datasets/importers/cmu.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/makehuman.h"
#include "datasets/readers/array_frames.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/schema.h"

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

ImportSummary import_data_folder(const std::string& folder, bool bodies, bool clips,
                                 const std::string& out, const ImportOptions& options) {
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
  ImportSummary summary;
  DatasetWriter writer(out, info);
  if (bodies) add_bodies(folder + "/body", options.garment, writer, summary);
  if (clips)
    for (const Motion& motion : import_cmu(folder + "/cmu/clips30.h5"))
      add_motion(motion, writer, summary);
  writer.commit();
  return summary;
}

ImportSummary import_bvh_files(const std::vector<std::string>& files, const std::string& source,
                               const std::string& out, const ImportOptions& options) {
  ImportSummary summary;
  DatasetWriter writer(out, file_info(source, options));
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

ImportSummary import_folder(const std::string& source, const std::string& out,
                            const ImportOptions& options) {
  std::error_code ignored;
  const bool bodies = fs::exists(source + "/body/makehuman.h5", ignored);
  const bool clips = fs::exists(source + "/cmu/clips30.h5", ignored);
  if (bodies || clips) return import_data_folder(source, bodies, clips, out, options);
  std::vector<std::string> bvh;
  for (const fs::directory_entry& entry : fs::directory_iterator(source, ignored))
    if (entry.is_regular_file(ignored) && is_bvh(entry.path()))
      bvh.push_back(entry.path().string());
  std::sort(bvh.begin(), bvh.end());
  if (!bvh.empty()) return import_bvh_files(bvh, source, out, options);
  return import_array_folder(source, out, options);
}

}  // namespace

fs::path absolute_path(const fs::path& path) {
  const fs::path out = fs::absolute(path).lexically_normal();
  return out.has_filename() ? out : out.parent_path();
}

FileInfo file_info(const std::string& source, const ImportOptions& options) {
  FileInfo info;
  info.license = options.license;
  info.provenance = "imported from " + absolute_path(source).filename().string();
  return info;
}

void add_motion(const Motion& motion, DatasetWriter& writer, ImportSummary& summary) {
  writer.add(motion);
  ++summary.motions;
  summary.frames += motion.frames();
}

ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options) {
  std::error_code ignored;
  if (!fs::exists(source, ignored))
    throw InputError(source, "is not there", "give a file or a folder");
  if (!options.betas.empty() && !is_npz_name(source))
    throw InputError(source, "is no body model, to which --betas belongs", "leave --betas out");
  if (fs::is_directory(source, ignored)) return import_folder(source, out, options);
  if (source.ends_with(".pkl"))
    throw InputError(source, "is a pickle, which can run code and is never read",
                     "convert it to plain arrays (docs/data.md shows how)");
  if (is_array_name(source) || is_mesh_name(source)) return import_array_file(source, out, options);
  return import_bvh_files({source}, source, out, options);
}

}  // namespace restage
