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
#include "datasets/readers/folders.h"
#include "datasets/readers/mesh_io.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

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
  check_options({InputKind::data_folder}, folder, options);
  ImportSummary summary;
  DatasetWriter writer(out, data_folder_info(bodies, clips));
  if (bodies) add_bodies(folder + "/body", options.garment, writer, summary);
  if (clips)
    for (const Motion& motion : import_cmu(folder + "/cmu/clips30.h5"))
      add_motion(motion, writer, summary);
  writer.commit();
  return summary;
}

ImportSummary import_folder(const std::string& source, const std::string& out,
                            const ImportOptions& options) {
  std::error_code ignored;
  const bool bodies = fs::exists(source + "/body/makehuman.h5", ignored);
  const bool clips = fs::exists(source + "/cmu/clips30.h5", ignored);
  if (bodies || clips) return import_data_folder(source, bodies, clips, out, options);
  const std::vector<std::string> recordings = files_below(source, is_recording_name);
  if (recordings.empty()) return import_array_folder(source, out, options);
  ImportSummary summary = import_recordings(recordings, source, out, options);
  count_ignored(
      source,
      [](const std::string& path) {
        return is_recording_name(path) || path.ends_with(".asf") || path.ends_with(".asf.xz");
      },
      summary);
  return summary;
}

ImportSummary import_file(const std::string& source, const std::string& out,
                          const ImportOptions& options) {
  if (is_recording_name(source)) return import_recordings({source}, source, out, options);
  if (is_array_name(source) || is_mesh_name(source)) return import_array_file(source, out, options);
  if (source.ends_with(".pkl"))
    throw InputError(source, "is a pickle, which can run code and is never read",
                     "convert it to plain arrays (docs/data.md shows how)");
  if (source.ends_with(".asf") || source.ends_with(".asf.xz"))
    throw InputError(source, "is a skeleton without a motion",
                     "give an .amc file and this one with --asf");
  throw InputError(source, "is of no kind that can be imported, by its name",
                   "give .bvh, .amc, .glb, .npz, .npy, .ply or .obj files, or a folder of them");
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

void add_each(const std::vector<std::string>& files, ImportSummary& summary,
              const std::function<void(const std::string&)>& add) {
  for (const std::string& file : files) {
    try {
      add(file);
    } catch (const InputError& error) {
      if (files.size() == 1) throw;
      log_warning("skipped " + std::string(error.what()));
      summary.skipped.emplace_back(error.what());
    }
  }
}

void count_ignored(const std::string& folder, bool (*considered)(const std::string&),
                   ImportSummary& summary) {
  for (const std::string& path : files_below(folder, [](const std::string&) { return true; }))
    if (!considered(path)) ++summary.ignored[fs::path(path).extension().string()];
}

bool is_importable(const std::string& source) {
  std::error_code ignored;
  return fs::is_directory(source, ignored) || is_recording_name(source) || is_array_name(source) ||
         is_mesh_name(source);
}

ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options) {
  std::error_code ignored;
  if (!fs::exists(source, ignored))
    throw InputError(source, "is not there", "give a file or a folder");
  return fs::is_directory(source, ignored) ? import_folder(source, out, options)
                                           : import_file(source, out, options);
}

}  // namespace restage
