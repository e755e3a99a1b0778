// import_data() of arrays and scans: AMASS motions, body models, clouds.
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>

#include "autograd/base/output_check.h"
#include "datasets/builtin/body_shape.h"
#include "datasets/importers/bodies/smpl.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/motions/estimated.h"
#include "datasets/importers/scans.h"
#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/folders.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

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

/// The skeleton that estimated motions are done by: the user's body model's, else the average
/// built-in body's. Archives laid out as AMASS's are training data of true people: they need it.
class Skeletons {
 public:
  explicit Skeletons(const ImportOptions& options) {
    if (!options.body_model.empty()) models_.emplace(options.body_model, options.max_memory);
  }
  Motion import(const EstimatedMotion& from, const MotionOptions& how, ImportReport& report) {
    if (models_) return import_amass(*from.arrays, *models_, how, report, nullptr, from.hints);
    if (from.plain) refuse_without_model(from.arrays->path());
    return import_amass(*from.arrays, shape_joints({}), how, report, nullptr, from.hints);
  }
  [[noreturn]] static void refuse_without_model(const std::string& where) {
    throw InputError(where,
                     "holds motions of a body model (as AMASS does), whose skeletons are in the "
                     "model's own file",
                     "give your SMPL, SMPL-H or SMPL-X model with {body-model} MODEL.npz");
  }

 private:
  std::optional<BodyModels> models_;
};

std::vector<EstimatedMotion> wanted_people(const std::string& path, const ImportOptions& options) {
  std::vector<EstimatedMotion> all = read_estimated(path, options.max_memory);
  if (options.person.empty() || all.empty()) return all;
  return {one_person(std::move(all), options.person, path)};
}

/// All motions of a file.
void add_motions(const std::string& path, const MotionOptions& how, const ImportOptions& options,
                 Skeletons& skeletons, ImportWriter& writer, ImportSummary& summary) {
  const std::vector<EstimatedMotion> people = wanted_people(path, options);
  std::vector<Motion> motions;
  std::vector<ImportReport> reports;
  for (const EstimatedMotion& from : people) {
    ImportReport report;
    if (!from.person.empty()) report.fact("person", from.person);
    if (!from.place.empty()) report.fact("found in", from.place);
    MotionOptions one = how;
    if (people.size() > 1) {
      one.id += "_" + from.person;
      one.subject += "_" + from.person;
    }
    motions.push_back(skeletons.import(from, one, report));
    reports.push_back(std::move(report));
  }
  if (motions.empty())
    throw InputError(path, "holds no motion (it has " + list_of(Npz(path).names()) + ")",
                     "AMASS motions have poses and trans");
  writer.add(path, {}, motions);
  std::move(reports.begin(), reports.end(), std::back_inserter(summary.reports));
}

ImportSummary import_amass_files(const std::vector<std::string>& files, const std::string& source,
                                 const std::string& root, const std::string& out,
                                 const ImportOptions& options) {
  check_options({InputKind::amass}, source, options);
  check_fps(options);
  check_output(out, files);
  if (files.size() == 1) wanted_people(files[0], options);  // what is wrong here is said first
  Skeletons skeletons(options);
  FileInfo info = file_info(source, options);
  if (!options.body_model.empty())
    info.provenance +=
        " (AMASS), skeletons of " + absolute_path(options.body_model).filename().string();
  ImportSummary summary;
  ImportWriter writer(out, info, summary);
  const std::map<std::string, std::string> people = subjects_of(files, root, options.subjects);
  add_each(files, summary, [&](const std::string& path) {
    if (is_npz_name(path)) {
      const Npz file(path, options.max_memory);
      if (is_amass_shape(file)) {
        ++summary.shapes;
        return;
      }
      if (!named_cloud(file)) refuse_incomplete(file, body_parameters(file));
    }
    MotionOptions how = amass_options(path, root, options);
    if (const auto who = people.find(path); who != people.end()) how.subject = who->second;
    add_motions(path, how, options, skeletons, writer, summary);
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
  if (holds_estimates(source, options.max_memory))
    return import_amass_files({source}, source, folder, out, options);
  if (is_amass_shape(file))
    throw InputError(source, "holds a body's shape and no motion",
                     "import the body model and give this file as {betas}");
  find_cloud(file);  // refuses half a motion by what is missing
  return import_scan_files(source, out, options);
}

}  // namespace

ImportSummary import_array_file(const std::string& source, const std::string& out,
                                const ImportOptions& options) {
  if (is_npz_name(source)) return import_npz(source, out, options);
  if (!may_hold_estimates(source)) return import_scan_files(source, out, options);
  const std::string folder = absolute_path(source).parent_path().string();
  return import_amass_files({source}, source, folder, out, options);
}

ImportSummary import_array_folder(const std::string& source, const std::string& out,
                                  const ImportOptions& options) {
  const std::vector<std::string> files = files_below(source, may_hold_estimates);
  constexpr size_t kTries = 5;  // pickles of a folder without a motion: so are the others
  std::map<std::string, size_t> tried;
  const bool amass = std::any_of(files.begin(), files.end(), [&](const std::string& path) {
    if (is_pickle_name(path) && ++tried[fs::path(path).parent_path().string()] > kTries)
      return false;
    try {
      return is_npz_name(path) ? holds_estimates(path, options.max_memory)
                               : !read_estimated(path, options.max_memory).empty();
    } catch (const InputError&) {
      return false;  // one that is damaged is named when its turn comes
    }
  });
  ImportSummary summary = amass ? import_amass_files(files, source, source, out, options)
                                : import_scan_files(source, out, options);
  const auto of_scans = [](const std::string& path) {
    return may_be_cloud_name(path) ? is_cloud_by_content(path)
                                   : holds_scans(path) || is_pickle_name(path);
  };
  count_ignored(source, amass ? may_hold_estimates : of_scans, summary);
  return summary;
}

}  // namespace restage
