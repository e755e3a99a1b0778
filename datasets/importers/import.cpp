#include "datasets/importers/import.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/importers/batches.h"
#include "datasets/importers/bodies/makehuman.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/motions/cmu.h"
#include "datasets/importers/motions/estimated.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/frames/hdf5_frames.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

void add_bodies(const std::string& folder, const std::string& garment, ImportWriter& writer) {
  const MakeHuman model(folder);
  const std::string list = folder + "/bodies.csv";
  const std::vector<BodyRecipe> recipes = read_recipes(list);
  in_batches<Body>(
      recipes.size(), [&](size_t i) { return model.build(recipes[i], garment); },
      [&](size_t, const Body& body) { writer.add(list, {body}, {}); });
}

ImportSummary import_data_folder(const std::string& folder, bool bodies, bool clips,
                                 const std::string& out, const ImportOptions& options) {
  check_options({InputKind::data_folder}, folder, options);
  const std::string body = folder + "/body", cmu = folder + "/cmu/clips30.h5";
  std::vector<std::string> inputs = {cmu, body + "/makehuman.h5", body + "/bodies.csv",
                                     body + "/joints22.json"};
  for (const char* ending : {".obj.gz", ".mhclo.gz"})
    inputs.push_back(body + "/clothes/" + options.garment + ending);
  check_output(out, inputs);
  ImportSummary summary;
  ImportWriter writer(out, data_folder_info(bodies, clips), summary);
  if (bodies) add_bodies(body, options.garment, writer);
  if (clips) writer.add(cmu, {}, import_cmu(cmu));
  writer.commit();
  return summary;
}

ImportSummary import_packed_clips(const std::string& source, const std::string& out,
                                  const ImportOptions& options) {
  check_options({InputKind::packed_clips}, source, options);
  ImportSummary summary;
  ImportWriter writer(out, data_folder_info(false, true), summary);
  std::vector<size_t> left_out;
  writer.add(source, {}, import_cmu(source, options.without, &left_out));
  ImportReport report{source, {}, {}};
  for (size_t i = 0; i < left_out.size(); ++i)
    report.fact("left out", cat(options.without[i], ": ", counted(left_out[i], "clip")));
  if (!left_out.empty()) summary.reports.push_back(std::move(report));
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
  if (recordings.empty() && holds_joints(source, options))
    return import_joints(source, out, options);
  if (recordings.empty() || are_bare_surfaces(recordings))
    return import_array_folder(source, out, options);
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
  if (may_hold_estimates(source) && !is_npz_name(source))
    return holds_joints(source, options) ? import_joints(source, out, options)
                                         : import_array_file(source, out, options);
  refuse_foreign_content(source);
  if (is_recording_name(source) && !are_bare_surfaces({source}))
    return import_recordings({source}, source, out, options);
  const bool estimated = options.motion.layout.empty() && is_npz_name(source) &&
                         holds_estimates(source, options.max_memory);
  if (!estimated && holds_joints(source, options)) return import_joints(source, out, options);
  if (is_hdf5(source) && is_packed_clips(source)) return import_packed_clips(source, out, options);
  if (holds_scans(source)) return import_array_file(source, out, options);
  if (source.ends_with(".asf") || source.ends_with(".asf.xz"))
    throw InputError(source, "is a skeleton without a motion",
                     "give an .amc file and this one with {asf}");
  refuse_foreign_kind(source);
  throw InputError(source, "is of no kind that can be imported, by its name",
                   "give .bvh, .amc, .glb, .npz, .npy, .h5, .ply, .obj, .pcd or .xyz files, or a "
                   "folder of them");
}

/// What no file can make right is said before any is opened.
void check_options(const ImportOptions& options) {
  const MotionOptions& motion = options.motion;
  if (!is_split(motion.split))
    throw InputError("", "{split} '" + motion.split.substr(0, 60) + "' is unknown",
                     "give train, validation or test");
  const Axis up = motion.rest.up, facing = motion.rest.facing;
  if (up != Axis::automatic && facing != Axis::automatic &&
      std::abs(vector_of(up).dot(vector_of(facing))) > 0.5)
    throw InputError("", "nobody faces up or down: {facing} lies along {up}",
                     "give {facing} across {up}");
}

/// All that the options name; what is found in a folder is checked where it is found.
std::vector<std::string> inputs_of(const std::string& source, const ImportOptions& options) {
  std::vector<std::string> out = options.betas;
  std::error_code ignored;
  if (fs::is_directory(options.body_model, ignored))
    out = files_below(options.body_model, is_npz_name);
  for (const std::string& path :
       {source, options.asf, options.motion.profile, options.body_model, options.intrinsics})
    out.push_back(path);
  return out;
}

/// InputError for an id that another entry has, of this file or of another.
template <class T>
void check_ids(const std::string& file, const std::vector<T>& entries, const std::string& what,
               const std::map<std::string, std::string>& taken) {
  std::set<std::string> own;
  for (const T& entry : entries) {
    const auto at = taken.find(entry.id);
    if (at == taken.end() && own.insert(entry.id).second) continue;
    throw InputError(file,
                     "its " + what + " '" + entry.id.substr(0, 60) + "' has the name of one in " +
                         (at == taken.end() ? "the same file" : at->second),
                     "rename one of the two");
  }
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
    info.license +=
        cat(bodies ? "; " : "",
            "motions: free for research and commercial use with acknowledgement, not to be "
            "resold as data");
    info.provenance += cat(bodies ? "; " : "", "motions: ", kCmuAcknowledgement);
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

void ImportWriter::add(const std::string& file, const std::vector<Body>& bodies,
                       const std::vector<Motion>& motions) {
  check_ids(file, bodies, "body", bodies_);
  check_ids(file, motions, "motion", motions_);
  for (const Body& body : bodies) {
    writer_.add(body);
    bodies_.emplace(body.id, file);
  }
  for (const Motion& motion : motions) {
    writer_.add(motion);
    motions_.emplace(motion.id, file);
    summary_.frames += motion.frames();
  }
  summary_.bodies += bodies.size();
  summary_.motions += motions.size();
}

void refuse_all(const std::string& where, const std::string& what, const InputError& first) {
  throw InputError(where, what + ", the first: " + first.complaint(), first.mend());
}

void check_any(const ImportSummary& summary, const std::string& source) {
  if (summary.bodies + summary.motions + summary.sequences > 0) return;
  const std::string shapes = cat(summary.shapes, " files with a shape and no motion");
  if (summary.skipped.empty())
    throw InputError(source, "holds nothing but " + shapes,
                     "import the body model and give them as {betas}");
  refuse_all(source,
             cat("all ", summary.skipped.size(), " files were skipped",
                 summary.shapes > 0 ? " besides " + shapes : ""),
             InputError::of_line(summary.skipped[0]));
}

void add_each(const std::vector<std::string>& files, ImportSummary& summary,
              const std::function<void(const std::string&)>& add) {
  for (const std::string& file : files) {
    try {
      add(file);
    } catch (const InputError& error) {
      if (files.size() == 1) throw;
      summary.skipped.emplace_back(error.what());
    }
  }
}

void count_ignored(const std::string& folder, bool (*considered)(const std::string&),
                   ImportSummary& summary) {
  for (const std::string& path : files_below(folder))
    if (!considered(path)) ++summary.ignored[fs::path(path).extension().string()];
}

bool holds_scans(const std::string& path) {
  return is_array_name(path) || is_mesh_name(path) || is_cloud_name(path) ||
         may_be_cloud_name(path) || is_hdf5(path);
}

void refuse_pickle(const std::string& path) {
  throw InputError(path, "is a body model in a pickle, which needs to run code and is never read",
                   "convert it to plain arrays (docs/formats.md shows how)");
}

bool is_importable(const std::string& source) {
  std::error_code ignored;
  return fs::is_directory(source, ignored) || is_recording_name(source) || is_array_name(source) ||
         is_mesh_name(source) || is_cloud_name(source) || is_pickle_name(source) ||
         (may_be_cloud_name(source) && fs::exists(source, ignored) && is_cloud_by_content(source));
}

ImportSummary import_data(const std::string& source, const std::string& out,
                          const ImportOptions& options) {
  check_options(options);
  std::error_code ignored;
  if (!fs::exists(source, ignored))
    throw InputError(source, source.empty() ? "SOURCE is empty" : "is not there",
                     "give a file or a folder");
  check_output(out, inputs_of(source, options));
  if (is_depth_source(source, options)) return import_depth(source, out, options);
  return fs::is_directory(source, ignored) ? import_folder(source, out, options)
                                           : import_file(source, out, options);
}

}  // namespace restage
