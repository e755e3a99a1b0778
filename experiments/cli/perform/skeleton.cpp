// restage skeleton: joints of clouds.
#include <filesystem>
#include <memory>

#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/kernels/kernel.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/joint_source.h"
#include "experiments/cli/perform/retarget_words.h"
#include "experiments/cli/perform/standard_weights.h"
#include "experiments/source.h"
#include "experiments/text.h"
#include "nn/models/extraction.h"
#include "nn/weights/bundle.h"

namespace restage::cli {
namespace {

struct SkeletonOptions {
  std::string weights, source, out, device = "cpu", joints;
  std::optional<int64_t> sequence;
  int samples = 1;
};

Json json_of(const Joints& joints) {
  Json rows = Json::array();
  for (const Vec3& p : joints) rows.push_back({p[0], p[1], p[2]});
  return rows;
}

using Radius = std::optional<std::array<double, kJoints>>;

Radius radius_of(const SeenJoints& seen) {
  return seen.uncertainty ? Radius(radius_of_90(*seen.uncertainty)) : std::nullopt;
}

std::string text_of(const Joints& joints, const Radius& radius) {
  std::string out;
  for (size_t j = 0; j < kJoints; ++j) {
    out += format("  %-15s %9.4f %9.4f %9.4f", std::string(kJointNames[j]).c_str(), joints[j][0],
                  joints[j][1], joints[j][2]);
    out += radius ? format("  +- %.3f\n", (*radius)[j]) : "\n";
  }
  return out;
}

/// The file of the joints: a row for each frame of the source. In a frame without points the
/// nearest one before stands in, and before the first with points that one.
class JointFile {
 public:
  JointFile(const std::string& path, const JointDefinition& definition, double fps)
      : writer_(path, 0, {}, FileInfo{}, fps) {
    writer_.set_definition(definition);
  }
  void add(const Joints& joints, const Radius& radius) {
    last_ = {joints, radius};
    any_ = true;
    for (; waiting_ > 0; --waiting_) fill();
    write();
  }
  void add_empty() {
    if (any_)
      fill();
    else
      ++waiting_;
  }
  void commit() {
    writer_.set_filled(filled_);
    writer_.commit();
  }

 private:
  void fill() {
    filled_.push_back(rows_);
    write();
  }
  void write() {
    const auto& [joints, radius] = last_;
    if (radius)
      writer_.append_joints(joints, *radius);
    else
      writer_.append(joints, {});
    ++rows_;
  }

  PredictionWriter writer_;
  std::pair<Joints, Radius> last_;
  bool any_ = false;                // of the frames had points
  int64_t rows_ = 0, waiting_ = 0;  // frames before the first with points
  std::vector<int64_t> filled_;
};

/// Frames of a folder too, as --out may have any name.
std::vector<std::string> inputs_of(const SkeletonOptions& options) {
  std::vector<std::string> out = {options.source};
  std::error_code ignored;
  if (std::filesystem::is_directory(options.source, ignored))
    for (const std::string& file : frame_files(options.source)) out.push_back(file);
  out.push_back(weights_path(options.weights));
  return out;
}

int run_skeleton(const SkeletonOptions& given, const Common& common) {
  SkeletonOptions options = given;
  if (options.weights.empty()) options.weights = standard_weights();
  if (options.samples < 1 || options.samples > 256)
    throw InputError("", "--samples is out of range", "give a number from 1 to 256");
  check_output(options.out, inputs_of(options));
  const Bundle models = load_bundle(options.weights);
  auto& model = models.need_as<SkeletonModel>("skeleton", weights_path(options.weights));
  move_module(model, device_of(options.device));
  JointDefinition definition = joint_definition(models.only({"skeleton"}), options.weights);
  std::optional<JointConversion> convert;
  if (!options.joints.empty()) {
    convert.emplace(definition, options.joints, options.weights);
    definition = options.joints;
  }
  refuse_joints(options.source);
  const auto frames = open_frames(
      options.source, {.clip = "", .max_memory = common.max_memory, .sequence = options.sequence});
  check_one_sequence(options.source, frames->sequences(), options.sequence);
  std::optional<JointFile> file;
  if (!options.out.empty()) file.emplace(options.out, definition, frames->fps());
  Json list = Json::array();
  std::string text;
  // The same points give the same joints wherever they stand, so every frame has the same key.
  const RngKey key = RngKey{common.seed, 0}.fold("skeleton");
  JointExtractor extract(model, {.samples = options.samples, .any_size = true, .any_way_up = true});
  size_t left_out = 0;
  std::vector<double> sure;
  SparseWatch sparse;
  int64_t seen_frames = 0, empty = 0;
  while (const auto frame = frames->next()) {
    throw_if_stopped();
    if (frame->fault)
      throw InputError(frame->fault->where(), frame->fault->cause(),
                       "leave the frame out, as 'restage doctor --fix OUT' does");
    if (frame->points.empty() && frames->frames() > 1) {
      ++empty;
      if (file) file->add_empty();
      continue;
    }
    check_frame(frame->points, frame->source, FrameMends::none);
    left_out += frame->left_out;
    SeenJoints seen = extract(frame->points, frame->source, key);
    if (seen.uncertainty) sure.push_back(confidence(*seen.uncertainty));
    sparse.add(frame->points);
    if (convert) seen.joints = (*convert)(seen.joints);
    const auto radius = radius_of(seen);
    if (file) file->add(seen.joints, radius);
    if (common.json) {
      list.push_back({{"source", frame->source}, {"joints", json_of(seen.joints)}});
      if (radius) list.back()["radius"] = *radius;
    } else if (!file) {
      text += frame->source + "\n" + text_of(seen.joints, radius);
    }
    ++seen_frames;
  }
  if (seen_frames == 0)
    throw InputError(options.source, "holds no points", "give at least one cloud");
  if (file) file->commit();
  if (empty > 0)
    log_warning(options.source + ": " + counted(empty, "frame") + " without points" +
                (file ? "; the nearest other frame stands in (/filled)" : ""));
  for (const std::string& remark : frames->remarks()) log_info(options.source + ": " + remark);
  if (left_out > 0)
    log_info(options.source + ": left out " + counted(left_out, "point") +
             " whose coordinates are NaN or infinite");
  if (!sure.empty()) sparse.warn(options.source);
  warn_if_unsure(options.source, std::move(sure));
  if (common.json) {
    Json document = {{"frames", list}, {"seed", common.seed}};
    if (!definition.empty()) document["joint_definition"] = definition;
    print_json(document);
  } else {
    const std::string seed = "seed " + std::to_string(common.seed);
    print(file ? "wrote " + options.out + " (" + seed + ")\n" : text + seed + "\n");
  }
  return 0;
}

}  // namespace

void add_skeleton(Program& program) {
  auto [app, options] =
      program.add("skeleton", "the 22 joints of clouds",
                  "restage skeleton scan.ply --json\n"
                  "restage skeleton --weights w.safetensors --source scans/ --out joints.h5\n"
                  "restage skeleton takes.h5 --sequence 2 --out joints.h5\n"
                  "restage skeleton --weights w.safetensors --source scan.ply --samples 8\n"
                  "restage skeleton --weights w.safetensors --source scan.ply --joints smpl\n"
                  "restage skeleton --weights w.safetensors --source scans/ --device cuda",
                  run_skeleton);
  app.add_option("--weights", options.weights,
                 "weights file or run directory (default: the standard weights)");
  app.add_option("--source,SOURCE", options.source,
                 "cloud, folder of clouds, or file of them (HDF5, NPZ, NPY)")
      .required()
      .formerly("--input");
  app.add_option("--sequence", options.sequence,
                 "which sequence of an HDF5 source, from 0 (default: the only one)");
  app.add_option("--out", options.out, "HDF5 file for the joints (default: they are printed)");
  app.add_option("--joints", options.joints,
                 "convert to joints of this definition: smpl or makehuman (default: the weights')");
  app.add_option("--device", options.device,
                 "where the network runs: cpu, or cuda in a program built for it");
  app.add_option("--samples", options.samples,
                 "views of a cloud to average: choices of its points, turned and mirrored");
}

}  // namespace restage::cli
