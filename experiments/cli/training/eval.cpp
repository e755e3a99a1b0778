// restage eval: metrics of a prediction beside its ground truth and beside references.
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/benchmark/sequence.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/training/eval_report.h"
#include "experiments/evaluation/evaluation.h"
#include "experiments/evaluation/predictions.h"
#include "experiments/evaluation/world_map.h"
#include "nn/config/config.h"
#include "nn/geometry/closed_form.h"
#include "train/run.h"

namespace restage::cli {
namespace {

struct EvalOptions {
  std::string run, pred, truth, source, rest, mended, out, device, joints;
  int64_t every = 1;
  bool variants = false, per_joint = false;
  std::optional<double> anchor;
};

using File = PredictionFile;

void check_pair(const File& pred, const File& truth) {
  check_same_frames(pred, truth);
  const bool joints = pred.joints().present() && truth.joints().present();
  const bool vertices = pred.vertices().present() && truth.vertices().present();
  if (vertices && pred.data.vertex_count != truth.data.vertex_count)
    throw InputError(pred.path + ":/vertices",
                     "has " + std::to_string(pred.data.vertex_count) + " vertices, but " +
                         truth.path + " has " + std::to_string(truth.data.vertex_count),
                     "give surfaces with the same vertices");
  if (!joints && !vertices && truth.data.frames > 0)
    throw InputError(pred.path, "has nothing in common with " + truth.path,
                     "store /joints or /vertices in both");
}

/// All files come to hold the same joints: those of --joints, into which a file that says what it
/// holds is converted, else those that all files hold.
void settle_joints(const std::string& asked, const std::vector<File*>& files) {
  if (!asked.empty() && asked != "smpl" && asked != "makehuman")
    throw InputError("", "--joints '" + asked.substr(0, 40) + "' is unknown",
                     "give smpl or makehuman");
  std::vector<NamedDefinition> said;
  std::vector<std::string> silent;
  bool convertible = true;
  for (File* file : files) {
    if (file->data.joints.empty()) continue;
    JointDefinition& has = file->data.definition;
    convertible = convertible && (has.empty() || has == "smpl" || has == "makehuman");
    if (has.empty()) silent.push_back(file->path);
    if (!asked.empty() && !has.empty()) {
      JointConversion(has, asked, file->path).convert(file->data.joints);
      has = asked;
    }
    said.push_back({has, file->path});
  }
  JointDefinition all = common_definition(
      said, convertible ? "add --joints smpl or --joints makehuman to compare the same joints"
                        : "give files of the same joints (docs/joints.md)");
  if (all.empty()) all = asked;
  if (!all.empty() && !silent.empty())
    log_warning("not said which joints they are, taken as '" + all + "': " + joined(silent));
}

/// Where sequences begin and end: a file without that information is taken to agree.
std::vector<int64_t> common_sequences(const File& pred, const File& truth) {
  const auto& a = pred.data.sequence_offset;
  const auto& b = truth.data.sequence_offset;
  if (a == b || truth.sequences() <= 1) return a;
  if (pred.sequences() <= 1) return b;
  throw InputError(pred.path + ":/sequence_offset", "differs from that of " + truth.path,
                   "give files of the same sequences");
}

std::vector<double> errors_by_joint(const File& pred, const File& truth) {
  return metrics::mean_distance_by_point(pred.joints(), truth.joints(),
                                         {metrics::Alignment::Mode::frame});
}

/// Of a prediction that says how far its joints may be off, how often it is right; joints as they
/// are, without alignment.
metrics::Value claim_held(const File& pred, const File& truth) {
  if (pred.data.radius.empty() || !pred.joints().present() || !truth.joints().present())
    return std::nullopt;
  return metrics::share_within(pred.joints(), truth.joints(), pred.data.radius);
}

using Turns = std::optional<metrics::RotationError>;

void print_per_joint(const std::vector<double>& errors, const Turns& turns) {
  std::vector<std::vector<std::string>> rows{{"joint", "PA-MPJPE [m]"}};
  if (turns) rows[0].push_back("rotation [deg]");
  for (size_t j = 0; j < errors.size(); ++j) {
    rows.push_back({std::string(kJointNames[j]), format("%.4f", errors[j])});
    if (turns) rows.back().push_back(format("%.1f", turns->by_joint[j]));
  }
  print("\n" + markdown_table(rows));
}

void add_to(Json* document, const metrics::RotationError& turns, bool per_joint) {
  (*document)["rotation_deg"] = turns.mean;
  (*document)["rotation_over_90"] = turns.over_90;
  for (size_t j = 0; per_joint && j < kJoints; ++j)
    (*document)["rotation_deg_by_joint"][std::string(kJointNames[j])] = turns.by_joint[j];
}

EvalReport report_of(const SystemScores& scores) {
  EvalReport report;
  report.model = scores.model;
  report.frames = scores.frames;
  report.references = scores.references;
  return report;
}

/// What --out gets: the table and one sequence.
std::vector<std::string> result_files(const std::string& folder) {
  if (folder.empty()) return {};
  std::vector<std::string> out = sequence_files(folder);
  out.push_back(folder + "/metrics.md");
  return out;
}

/// In words, for the heading of a table.
std::string heading(const std::string& condition, bool skeletons) {
  if (condition == "clouds")
    return skeletons ? "From clouds alone (extracted skeletons)" : "From clouds alone";
  if (condition == "true_vertices") return "From the source's true vertices";
  if (condition == "true_skeletons") return "From true skeletons";
  if (condition == "source_joints") return "Extractor alone, clouds of the source";
  if (condition == "rest_joints") return "Extractor alone, the targets' T-poses";
  return "Surface alone (true skeletons and rotations of the target)";
}

/// `label`: the model of the row; `skeletons`: whether the system moves its target by joints.
std::string scores_text(const SystemEvaluation& scores, const EvaluationOptions& options,
                        const std::string& label, bool skeletons) {
  std::string out = std::to_string(options.sequences.size()) + " held-out sequences, seed " +
                    std::to_string(options.seed);
  char line[160];
  if (skeletons && options.anchor > 0) {
    std::snprintf(line, sizeof line, ", paths held to the source's within %g s", options.anchor);
    out += line;
  }
  out += ".\n";
  for (const auto& [name, part] : scores.conditions)
    out += "\n" + heading(name, skeletons) + ":\n\n" +
           to_markdown(report_of(part), name == "true_poses" ? "deformation" : label);
  if (scores.joint_error) {
    std::snprintf(line, sizeof line,
                  "\nExtractor on held-out clouds: %.1f mm; on held-out T-poses: %.1f mm.\n",
                  1e3 * *scores.joint_error, 1e3 * *scores.tpose_joint_error);
    out += line;
  }
  if (!scores.missing.empty()) out += "\n";
  for (const std::string& missing : scores.missing) out += "Not measured: " + missing + ".\n";
  return out;
}

/// The best that the weights can be judged on stands at the top: from clouds, else from true
/// skeletons, else the surface. Its name is "condition".
Json scores_json(const SystemEvaluation& scores, const EvaluationOptions& options) {
  const bool any = !scores.conditions.empty();
  EvalReport nothing;
  nothing.model.mean.assign(metrics::table().size(), std::nullopt);
  Json document = to_json(any ? report_of(scores.conditions.front().second) : nothing);
  document["condition"] = any ? Json(scores.conditions.front().first) : Json(nullptr);
  for (size_t i = 1; i < scores.conditions.size(); ++i)
    document[scores.conditions[i].first] = to_json(report_of(scores.conditions[i].second));
  if (scores.joint_error)
    document["extractor"] = {{"joint_error_mm", 1e3 * *scores.joint_error},
                             {"tpose_joint_error_mm", 1e3 * *scores.tpose_joint_error}};
  document["missing"] = scores.missing;
  document["seed"] = options.seed;
  document["anchor"] = options.anchor;
  return document;
}

int run_eval_run(const EvalOptions& options, const Common& common) {
  const std::string folder = options.run.substr(4);
  TrainConfig config;
  read_config(of_this_version(load_config_tree(run_config_path(folder))), config);
  const std::string weights_name = weights_path(folder);
  for (const std::string& file : result_files(options.out))
    check_output(file, {run_config_path(folder), weights_name, config.data.source});
  const Bundle weights = load_bundle(folder);
  if (!options.device.empty())
    move_networks(weights, system_type(config.evaluation.system).roles, device_of(options.device));
  const Corpus test = load_corpus(config.data, "test");
  EvaluationOptions how = evaluation_options(config, test, common.seed);
  if (options.anchor) how.anchor = *options.anchor;
  const SystemEvaluation scores = evaluate_system(weights, weights_name, test, how);
  const TrainedModel *motion = weights.find("motion"), *named = motion;
  for (const char* role : {"transfer", "codes"})
    if (named == nullptr) named = weights.find(role);
  const bool skeletons = named == motion;
  const std::string text = scores_text(scores, how, named ? named->model : "", skeletons);
  if (!options.out.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(options.out, failed);
    if (failed)
      throw InputError(options.out, "cannot be made a folder", "give a place you can write to");
    write_file_atomically(options.out + "/metrics.md", text);
    write_sequence(Performance(test, how.sequences[0], how.scans, common.seed),
                   {test.license, test.description}, options.out);
  }
  print(common.json, scores_json(scores, how), text);
  return 0;
}

/// Source joints of scans with a frame of their own go to the world, and so does what was predicted
/// from mended ones: turned and moved, its path stretched about the world's origin as the truth's
/// is, its size left as it was predicted.
std::optional<WorldMap> into_world(const EvalOptions& options, File& pred,
                                   std::optional<File>& source, const std::optional<File>& rest) {
  const std::optional<WorldMap> to_world = source_to_world(options.truth);
  if (to_world && source) source->carry(*to_world, false);
  if (options.mended.empty()) return std::nullopt;
  if (!to_world)
    throw InputError(options.truth, "does not say where its scans are",
                     "leave --mended out: nothing was in a frame of its own");
  const WorldMap map = mended_to_world(options.mended, *to_world);
  const bool joints = source->joints().present() && rest->joints().present();
  const double stretched = joints ? trajectory_scale(joints_of(source->joints().slice(0, 1))[0],
                                                     joints_of(rest->joints().slice(0, 1))[0])
                                  : 1;
  pred.carry(map, true, stretched);
  return map;
}

std::vector<metrics::Metric> chosen_metrics(const EvalOptions& options) {
  std::vector<metrics::Metric> out(metrics::table().begin(), metrics::table().end());
  if (options.variants)
    out.insert(out.end(), metrics::variants().begin(), metrics::variants().end());
  return metrics_of_every(options.every, out);
}

/// Options of the other way to call it would be of no effect.
void check_way(const EvalOptions& o) {
  const bool run = !o.run.empty();
  const std::pair<bool, const char*> others[] = {
      {run && !o.source.empty(), "--source"}, {run && !o.rest.empty(), "--rest"},
      {run && !o.mended.empty(), "--mended"}, {run && o.every != 1, "--every"},
      {run && o.variants, "--variants"},      {run && o.per_joint, "--per-joint"},
      {run && !o.joints.empty(), "--joints"}, {!run && !o.out.empty(), "--out"},
      {!run && o.anchor, "--anchor"},         {!run && !o.device.empty(), "--device"}};
  for (const auto& [given, name] : others)
    if (given)
      throw InputError(
          "", std::string(name) + " goes with " + (run ? "--pred and --truth" : "run=") + " only",
          "leave it out");
}

int run_eval(const EvalOptions& options, const Common& common) {
  if (!options.run.empty()) {
    if (!options.run.starts_with("run="))
      throw InputError("", "'" + options.run + "' is not understood",
                       "use 'run=RUN_DIR', or --pred and --truth");
    if (options.run == "run=")
      throw InputError("", "run= names no run directory", "write run=RUN_DIR");
    if (!options.pred.empty() || !options.truth.empty())
      throw InputError("", "run= and --pred do not go together", "give one of them");
    check_way(options);
    return run_eval_run(options, common);
  }
  if (options.pred.empty() || options.truth.empty())
    throw InputError("", options.pred.empty() ? "--pred is missing" : "--truth is missing",
                     "give --pred P.h5 (or a folder of meshes) --truth T.h5, or run=RUN_DIR");
  check_way(options);
  if (options.source.empty() != options.rest.empty())
    throw InputError("", "--source and --rest belong together",
                     "give both for the references, or neither");
  if (options.every < 1) throw InputError("", "--every is out of range", "give 1 or more frames");
  if (!options.mended.empty() && options.source.empty())
    throw InputError("", "--mended needs --source and --rest", "give both");
  File pred(options.pred), truth(options.truth);
  std::optional<File> source, rest;
  if (!options.source.empty()) {
    source.emplace(options.source);
    rest.emplace(options.rest);
  }
  std::vector<File*> files{&pred, &truth};
  for (auto* file : {&source, &rest})
    if (*file) files.push_back(&**file);
  settle_joints(options.joints, files);
  const std::optional<WorldMap> mended = into_world(options, pred, source, rest);
  if (options.every > 1) {
    truth.thin(options.every);
    if (source) source->thin(options.every);
  }
  check_pair(pred, truth);
  const std::vector<int64_t> offset = common_sequences(pred, truth);

  EvalReport report;
  const std::vector<metrics::Metric> chosen = chosen_metrics(options);
  report.metrics = chosen;
  for (size_t s = 0; s + 1 < offset.size(); ++s) report.frames.push_back(offset[s + 1] - offset[s]);
  if (source) report.references = references(*source, *rest, truth, offset, report.metrics);
  report.model = metrics::evaluate(
      cut(offset, pred.joints(), pred.vertices(), pred.data.rotations, truth), report.metrics);

  for (const File* file : {&pred, &truth})  // frames are compared in their order
    for (const std::string& remark : file->remarks) log_warning(file->path + ": " + remark);
  const metrics::Value within = claim_held(pred, truth);
  const auto by_joint = options.per_joint ? errors_by_joint(pred, truth) : std::vector<double>();
  const Turns turns = metrics::rotation_error(pred.data.rotations, truth.data.rotations);
  if (common.json) {
    Json document = to_json(report);
    if (turns) add_to(&document, *turns, options.per_joint);
    for (size_t j = 0; j < by_joint.size(); ++j)
      document["pa_mpjpe_by_joint"][std::string(kJointNames[j])] = by_joint[j];
    if (within) document["joints_within_radius"] = *within;
    if (mended)
      document["mended"] = {{"scale_error", 1 / mended->scale}, {"tilt_degrees", mended->tilt()}};
    print_json(document);
    return 0;
  }
  print(to_markdown(report));
  if (!by_joint.empty()) print_per_joint(by_joint, turns);
  if (turns)
    print(format("\nRotations are %.1f degrees off on average; %.1f %% are more than 90 off.\n",
                 turns->mean, 100 * turns->over_90));
  if (within)
    print(format("\n%.1f %% of the true joints lie within /radius of the predicted ones.\n",
                 100 * *within));
  return 0;
}

}  // namespace

void add_eval(Program& program) {
  auto [app, options] = program.add(
      "eval", "measure a prediction against its ground truth",
      "restage eval run=runs/demo-1 --out demo/\n"
      "restage eval --pred result.h5 --truth truth.h5\n"
      "restage eval --pred result.h5 --truth truth.h5 --source a.h5 --rest b.h5 --json\n"
      "restage eval --pred frames/ --truth truth.h5\n"
      "restage eval run=runs/demo-1 --anchor 0\n"
      "restage eval run=runs/demo-1 --device cuda\n"
      "restage eval --pred result.h5 --truth truth.h5 --every 3 --variants --per-joint\n"
      "restage eval --pred r.h5 --truth t.h5 --source a.h5 --rest b.h5 --mended mended.h5\n"
      "restage eval --pred ours.h5 --truth amass.h5 --joints smpl",
      run_eval);
  app.add_option("RUN", options.run, "run=RUN_DIR: the trained system on its held-out data");
  app.add_option("--out", options.out,
                 "with run=: folder for the table and the files of one sequence");
  app.add_option("--anchor", options.anchor,
                 "with run=: as in 'restage retarget'; 0: the papers' sum of velocities (default: "
                 "0.25)");
  app.add_option("--device", options.device,
                 "with run=: where extractor and motion network run, cpu or cuda (default: cpu)");
  app.add_option(
      "--pred", options.pred,
      "predicted /joints and /vertices (HDF5), or a folder of meshes, one a frame: of one "
      "sequence, or a folder for each");
  app.add_option("--truth", options.truth, "true /joints and /vertices (HDF5)");
  app.add_option("--source", options.source, "joints of the source, for the references");
  app.add_option("--rest", options.rest,
                 "rest joints of the target (one row, or one a sequence), for the references");
  app.add_option("--joints", options.joints,
                 "compare joints of this definition: smpl or makehuman; files of another are "
                 "converted (default: the files' own)");
  app.add_option("--every", options.every,
                 "the prediction holds only every so many frames of the truth's sequences");
  app.add_option("--mended", options.mended,
                 "what restage doctor --fix made of the scans that the prediction is from");
  app.add_flag("--variants", options.variants, "further alignments: rigid, sequence, root");
  app.add_flag("--per-joint", options.per_joint,
               "also the aligned error of every joint, and of its rotation");
}

}  // namespace restage::cli
