// import_data() of arrays and scans: AMASS motions, body models, clouds.
#include <algorithm>
#include <filesystem>

#include "autograd/base/output_check.h"
#include "datasets/importers/bodies/smpl.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/motions/amass.h"
#include "datasets/importers/scans.h"
#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/folders.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

void check_fps(const ImportOptions& options) {
  const double fps = options.motion.fps;
  if (fps != 0 && !(fps >= 1 && fps <= 2000))
    throw InputError("", "{fps} is out of range", "give frames per second, 1 to 2000");
}

// ---- AMASS -------------------------------------------------------------------------------------

/// Names a clip by where it lies below `root`: the folder is the subject, the path the id.
MotionOptions amass_options(const fs::path& file, const fs::path& root,
                            const ImportOptions& options) {
  MotionOptions out = options.motion;
  const fs::path below = absolute_path(file).lexically_relative(absolute_path(root));
  if (out.subject.empty()) out.subject = below.parent_path().generic_string();
  if (out.subject.empty()) out.subject = absolute_path(root).filename().string();
  out.id = below.generic_string();
  out.id.resize(out.id.size() - below.extension().string().size());
  for (const std::string_view ending : {"_poses", "_stageii"})
    if (out.id.ends_with(ending)) out.id.resize(out.id.size() - ending.size());
  std::replace(out.id.begin(), out.id.end(), '/', '_');
  return out;
}

ImportSummary import_amass_files(const std::vector<std::string>& files, const std::string& source,
                                 const std::string& root, const std::string& out,
                                 const ImportOptions& options) {
  check_options({InputKind::amass}, source, options);
  if (options.body_model.empty())
    throw InputError(source,
                     "holds motions of a body model (as AMASS does), whose skeletons are in the "
                     "model's own file",
                     "give your SMPL, SMPL-H or SMPL-X model with {body-model} MODEL.npz");
  check_fps(options);
  check_output(out, files);
  BodyModels models(options.body_model, options.max_memory);
  FileInfo info = file_info(source, options);
  info.provenance +=
      " (AMASS), skeletons of " + absolute_path(options.body_model).filename().string();
  ImportSummary summary;
  ImportWriter writer(out, info, summary);
  const std::map<std::string, std::string> people = subjects_of(files, root, options.subjects);
  add_each(files, summary, [&](const std::string& path) {
    const Npz file(path, options.max_memory);
    if (is_amass_shape(file)) {
      ++summary.shapes;
      return;
    }
    if (!named_cloud(file)) refuse_incomplete(file, body_parameters(file));
    if (!is_amass_motion(file))
      throw InputError(path, "holds no motion (it has " + list_of(file.names()) + ")",
                       "AMASS motions have poses and trans");
    ImportReport report;
    MotionOptions how = amass_options(path, root, options);
    if (const auto who = people.find(path); who != people.end()) how.subject = who->second;
    writer.add(path, {}, {import_amass(file, models, how, report)});
    summary.reports.push_back(std::move(report));
  });
  check_any(summary, source);
  writer.commit();
  return summary;
}

// ---- body models -------------------------------------------------------------------------------

/// A person's name: the model's and the betas file's, numbered if that holds several.
std::string body_id(const std::string& model, const std::string& betas, size_t index,
                    size_t count) {
  std::string out = fs::path(model).stem().string() + "_" + fs::path(betas).stem().string();
  return count > 1 ? cat(out, "_", index) : out;
}

ImportSummary import_model(const std::string& source, const std::string& out,
                           const ImportOptions& options) {
  check_options({InputKind::body_model}, source, options);
  const Npz file(source, options.max_memory);
  SmplModel model(file);
  model.read_blend_shapes(file);
  ImportSummary summary;
  ImportWriter writer(out, file_info(source, options), summary);
  const std::vector<std::string> wanted =
      options.betas.empty() ? std::vector<std::string>{"zeros"} : options.betas;
  for (const std::string& name : wanted) {
    const std::vector<Betas> people =
        name == "zeros" ? std::vector<Betas>(1) : read_betas(name, options.max_memory);
    ImportReport report{name == "zeros" ? source : name, {}, {}};
    report.facts = {
        {"body model", cat(to_string(model.family()), ", ", model.vertices(), " vertices")},
        {"pose", model.has_blend_shapes() ? "the model's blend shapes (posedirs)"
                                          : "no blend shapes: bends by our own rule"},
        {"people", std::to_string(people.size())},
        {"betas", name == "zeros" ? "zeros: the mean person"
                                  : cat(people[0].size(), ", the model has ", model.shapes())}};
    if (people[0].size() > model.shapes())
      report.remark(cat("betas beyond the model's ", model.shapes(), " are left out"));
    for (size_t i = 0; i < people.size(); ++i) {
      Body body = model.body(people[i]);
      body.id = body_id(source, name, i, people.size());
      body.split = options.motion.split;
      writer.add(name, {std::move(body)}, {});
    }
    summary.reports.push_back(std::move(report));
  }
  writer.commit();
  return summary;
}

// ---- scans -------------------------------------------------------------------------------------

ImportSummary import_scan_files(const std::string& source, const std::string& out,
                                const ImportOptions& options) {
  check_options({InputKind::scans}, source, options);
  ImportSummary summary;
  const std::vector<ScanSequence> sequences =
      find_scans(source, options.max_memory, summary.skipped);
  if (sequences.empty() && summary.skipped.empty())
    for (const std::string& file : files_below(source)) refuse_foreign_kind(file);
  if (sequences.empty() && summary.skipped.size() == 1) throw Error(summary.skipped[0], 2);
  if (sequences.empty() && !summary.skipped.empty())
    refuse_all(source, cat("holds nothing to import, ", summary.skipped.size(), " were skipped"),
               InputError::of_line(summary.skipped[0]));
  if (sequences.empty())
    throw InputError(source, "holds nothing to import",
                     "give a data folder, BVH files, AMASS motions, a body model or scans");
  check_fps(options);
  for (const ScanSequence& sequence : sequences) {
    check_output(out, sequence.frames.files);
    check_output(out, {sequence.file});
  }
  ScanWriter writer(out, file_info(source, options));
  for (const ScanSequence& sequence : sequences) {
    try {
      ImportReport report;
      summary.frames += static_cast<size_t>(
          import_scans(sequence, options.motion, options.max_memory, writer, report));
      summary.reports.push_back(std::move(report));
      ++summary.sequences;
    } catch (const InputError& error) {
      if (sequences.size() == 1) throw;
      writer.drop_sequence();
      const std::string why = error.what();
      const bool named = !sequence.file.empty() || why.starts_with(sequence.name + ": ");
      summary.skipped.push_back(named ? why : sequence.name + ": " + why);
    }
  }
  check_any(summary, source);
  writer.commit();
  return summary;
}

ImportSummary import_npz(const std::string& source, const std::string& out,
                         const ImportOptions& options) {
  const Npz file(source, options.max_memory);
  const std::string folder = absolute_path(source).parent_path().string();
  if (is_smpl_model(file)) return import_model(source, out, options);
  if (!options.betas.empty())
    throw InputError(source, "is no body model, to which {betas} belongs", "leave {betas} out");
  if (is_amass_motion(file)) return import_amass_files({source}, source, folder, out, options);
  if (is_amass_shape(file))
    throw InputError(source, "holds a body's shape and no motion",
                     "import the body model and give this file as {betas}");
  find_cloud(file);  // refuses half a motion by what is missing
  return import_scan_files(source, out, options);
}

}  // namespace

ImportSummary import_array_file(const std::string& source, const std::string& out,
                                const ImportOptions& options) {
  return is_npz_name(source) ? import_npz(source, out, options)
                             : import_scan_files(source, out, options);
}

ImportSummary import_array_folder(const std::string& source, const std::string& out,
                                  const ImportOptions& options) {
  const std::vector<std::string> npz = files_below(source, is_npz_name);
  const bool amass = std::any_of(npz.begin(), npz.end(), [&](const std::string& path) {
    try {
      return is_amass_motion(Npz(path, options.max_memory));
    } catch (const InputError&) {
      return false;  // one that is damaged is named when its turn comes
    }
  });
  ImportSummary summary = amass ? import_amass_files(npz, source, source, out, options)
                                : import_scan_files(source, out, options);
  const auto of_scans = [](const std::string& path) {
    return (holds_scans(path) && !is_text_name(path)) || path.ends_with(".pkl");
  };
  count_ignored(source, amass ? is_npz_name : of_scans, summary);
  return summary;
}

}  // namespace restage
