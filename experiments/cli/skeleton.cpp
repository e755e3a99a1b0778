// restage skeleton: joints of clouds.
#include <filesystem>
#include <memory>

#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "autograd/kernels/kernel.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/retarget_words.h"
#include "experiments/cli/standard_weights.h"
#include "experiments/text.h"
#include "nn/models/extraction.h"
#include "nn/weights/bundle.h"

namespace restage::cli {
namespace {

struct SkeletonOptions {
  std::string weights, input, out, device = "cpu", joints;
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

void write(const Joints& joints, const Radius& radius, PredictionWriter* to) {
  if (radius)
    to->append_joints(joints, *radius);
  else
    to->append(joints, {});
}

/// Frames of a folder too, as --out may have any name.
std::vector<std::string> inputs_of(const SkeletonOptions& options) {
  std::vector<std::string> out = {options.input};
  std::error_code ignored;
  if (std::filesystem::is_directory(options.input, ignored))
    for (const std::string& file : frame_files(options.input)) out.push_back(file);
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
  const auto frames = open_frames(options.input, {"", common.max_memory});
  std::unique_ptr<PredictionWriter> writer;
  if (!options.out.empty())
    writer = std::make_unique<PredictionWriter>(options.out, 0, std::vector<Triangle>{}, FileInfo{},
                                                frames->fps());
  if (writer) writer->set_definition(definition);
  Json list = Json::array();
  std::string text;
  // The same points give the same joints wherever they stand, so every frame has the same key.
  const RngKey key = RngKey{common.seed, 0}.fold("skeleton");
  JointExtractor extract(model, options.samples, kAllAround, false, true);
  size_t left_out = 0;
  std::vector<double> sure;
  std::optional<SeenJoints> last;
  std::vector<int64_t> filled;  // frames of the result
  int64_t row = 0, empty = 0;
  while (const auto frame = frames->next()) {
    throw_if_stopped();
    if (frame->fault)
      throw InputError("", cause_of(*frame->fault),
                       "leave the frame out, as 'restage doctor --fix OUT' does");
    if (frame->points.empty() && frames->frames() > 1) {
      ++empty;
      if (writer && last) {
        filled.push_back(row++);
        write(last->joints, radius_of(*last), writer.get());
      }
      continue;
    }
    check_frame(frame->points, frame->source, FrameMends::none);
    left_out += frame->left_out;
    SeenJoints seen = extract(frame->points, frame->source, key);
    if (seen.uncertainty) sure.push_back(confidence(*seen.uncertainty));
    if (convert) seen.joints = (*convert)(seen.joints);
    const auto radius = radius_of(seen);
    if (writer) write(seen.joints, radius, writer.get()), ++row;
    if (common.json) {
      list.push_back({{"source", frame->source}, {"joints", json_of(seen.joints)}});
      if (radius) list.back()["radius"] = *radius;
    } else if (!writer) {
      text += frame->source + "\n" + text_of(seen.joints, radius);
    }
    last = std::move(seen);
  }
  if (!last) throw InputError(options.input, "holds no points", "give at least one cloud");
  if (writer) writer->set_filled(filled);
  if (writer) writer->commit();
  if (empty > 0)
    log_warning(options.input + ": " + counted(empty, "frame") + " without points" +
                (filled.empty() ? "" : "; the frame before stands in (/filled)"));
  for (const std::string& remark : frames->remarks()) log_info(options.input + ": " + remark);
  if (left_out > 0)
    log_info(options.input + ": left out " + std::to_string(left_out) +
             (left_out == 1 ? " point" : " points") + " whose coordinates are NaN or infinite");
  warn_if_unsure(options.input, std::move(sure));
  if (common.json) {
    Json document = {{"frames", list}, {"seed", common.seed}};
    if (!definition.empty()) document["joint_definition"] = definition;
    print_json(document);
  } else {
    const std::string seed = "seed " + std::to_string(common.seed);
    print(writer ? "wrote " + options.out + " (" + seed + ")\n" : text + seed + "\n");
  }
  return 0;
}

}  // namespace

void add_skeleton(Program& program) {
  auto [app, options] =
      program.add("skeleton", "the 22 joints of clouds",
                  "restage skeleton --input scan.ply --json\n"
                  "restage skeleton --weights w.safetensors --input scans/ --out joints.h5\n"
                  "restage skeleton --weights w.safetensors --input scan.ply --samples 8\n"
                  "restage skeleton --weights w.safetensors --input scan.ply --joints smpl\n"
                  "restage skeleton --weights w.safetensors --input scans/ --device cuda",
                  run_skeleton);
  app.add_option("--weights", options.weights,
                 "weights file or run directory (default: the standard weights)");
  app.add_option("--input", options.input, "cloud, folder of clouds, or HDF5 file of scans")
      .required();
  app.add_option("--out", options.out, "HDF5 file for the joints");
  app.add_option("--joints", options.joints,
                 "convert to joints of this definition: smpl or makehuman (default: the weights')");
  app.add_option("--device", options.device,
                 "where the network runs: cpu, or cuda in a program built for it");
  app.add_option("--samples", options.samples,
                 "views of a cloud to average: choices of its points, turned and mirrored");
}

}  // namespace restage::cli
