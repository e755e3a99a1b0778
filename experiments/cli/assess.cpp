// restage assess: how plausible the joints of a capture are, without a truth.
#include <algorithm>
#include <numeric>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "datasets/doctor/examine.h"
#include "experiments/assess.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/scale_option.h"
#include "experiments/cli/standard_weights.h"
#include "experiments/slow_work.h"
#include "nn/models/extraction.h"

namespace restage::cli {
namespace {

struct AssessCommand {
  SourceRecord source;
  std::string weights;
  AssessOptions options;
  bool force = false;
};

Json millimetres(const std::optional<double>& metres) {
  return metres ? Json(1e3 * *metres) : Json(nullptr);
}

std::string shown(const std::optional<double>& value, double factor, const char* unit) {
  return value ? format("%.4g", factor * *value) + unit : "-";
}

/// "12, 13, 14 and 5 more".
std::string listed(const std::vector<int64_t>& frames) {
  constexpr size_t kMost = 8;
  std::string out;
  for (size_t i = 0; i < std::min(frames.size(), kMost); ++i)
    out += (i > 0 ? ", " : "") + std::to_string(frames[i]);
  if (frames.size() > kMost) out += " and " + std::to_string(frames.size() - kMost) + " more";
  return out;
}

std::string worst_bones(const Assessment& found) {
  std::vector<size_t> order(kJoints - 1);
  std::iota(order.begin(), order.end(), size_t{1});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return found.bone_sds[a] > found.bone_sds[b]; });
  std::string out;
  for (size_t k = 0; k < 4; ++k)
    out += (k > 0 ? ", " : "") + std::string(kJointNames[order[k]]) +
           format(" %.1f mm", 1e3 * found.bone_sds[order[k]]);
  return out;
}

Json document_of(const Assessment& found, uint64_t seed) {
  Json bones = Json::object();
  for (size_t j = 1; j < kJoints; ++j) bones[std::string(kJointNames[j])] = 1e3 * found.bone_sds[j];
  return {{"frames", found.frames},
          {"bone_length_sd_mm", millimetres(found.bone_length_sd)},
          {"held_bone_length_sd_mm", millimetres(found.held_bone_length_sd)},
          {"swaps", found.swaps},
          {"jitter_mm", millimetres(found.jitter)},
          {"surface_mm", millimetres(found.surface)},
          {"confidence", found.confidence ? Json(*found.confidence) : Json(nullptr)},
          {"floor_mm", millimetres(found.floor)},
          {"left_out", found.left_out},
          {"bones_sd_mm", bones},
          {"swapped_frames", found.swapped},
          {"shakiest_frames", found.shakiest},
          {"seed", seed}};
}

std::string text_of(const Assessment& found, const std::string& path, uint64_t seed) {
  std::string out = markdown_table(
      {{path, std::to_string(found.frames) + " frames"},
       {"bone lengths, standard deviation", shown(found.bone_length_sd, 1e3, " mm")},
       {"the same, held, after two seconds", shown(found.held_bone_length_sd, 1e3, " mm")},
       {"legs or arms changed sides", format("%.3g %% of frames", 100 * found.swaps)},
       {"jitter", shown(found.jitter, 1e3, " mm")},
       {"surface from the person's own body", shown(found.surface, 1e3, " mm")},
       {"confidence", shown(found.confidence, 1, "")},
       {"floor", shown(found.floor, 1e3, " mm")}});
  if (found.bone_length_sd) out += "bones that vary most: " + worst_bones(found) + "\n";
  if (!found.swapped.empty()) out += "frames with sides changed: " + listed(found.swapped) + "\n";
  if (!found.shakiest.empty()) out += "frames that shake most: " + listed(found.shakiest) + "\n";
  return out + "seed " + std::to_string(seed) + "\n";
}

/// The doctor's words on what would make the figures nonsense.
void check_first_frames(Source& source, const AssessCommand& c) {
  if (c.force) return;
  std::vector<Mesh> first;
  for (int i = 0; i < kSourceFrames; ++i) {
    auto cloud = source.next();
    if (!cloud) break;
    if (cloud->fault || cloud->frame.points.size() < kLeastDistinctPoints) continue;
    first.push_back({std::move(cloud->frame.points), std::move(cloud->frame.faces)});
  }
  source.rewind();
  check_source(first, c.source.path, {c.source.scale, c.source.up});
}

int run_assess(const AssessCommand& c, const Common& common) {
  if (c.options.samples < 1 || c.options.samples > 256)
    throw InputError("", "--samples is out of range", "give a number from 1 to 256");
  const std::string weights = c.weights.empty() ? standard_weights() : c.weights;
  const Bundle models = load_bundle(weights);
  Source source(c.source, common.max_memory);
  if (source.frames() == 0)
    throw InputError(c.source.path, "holds no frames", "give at least one cloud");
  if (!c.source.sequence && source.sequences() > 1)
    throw InputError(c.source.path, "holds " + std::to_string(source.sequences()) + " sequences",
                     "choose one with --sequence N, from 0");
  check_first_frames(source, c);
  AssessOptions options = c.options;
  options.seed = common.seed;
  SlowWork slow;
  slow.on("looking at " + std::to_string(source.frames()) + " frames");
  const Assessment found = assess(source, models, weights_path(weights), options);
  slow.on("");
  for (const std::string& remark : source.remarks()) log_warning(remark);
  if (found.left_out > 0)
    log_warning(std::to_string(found.left_out) + " frames are left out; the first: " + found.why);
  print(common.json, document_of(found, common.seed), text_of(found, c.source.path, common.seed));
  return 0;
}

}  // namespace

void add_assess(Program& program) {
  auto [app, c] =
      program.add("assess", "how plausible the joints of a capture are, without a truth",
                  "restage assess scans/\n"
                  "restage assess scans.h5 --sequence 2 --weights runs/finetune-1 --json\n"
                  "restage assess mm/ --scale mm --source-up z --fps 60\n"
                  "restage assess hero.glb --clip Walk --samples 1\n"
                  "restage assess toy/ --force",
                  run_assess);
  app.add_option("SOURCE", c.source.path,
                 "clouds of one person: a folder, HDF5 file, glTF or arrays")
      .required();
  app.add_option("--weights", c.weights,
                 "weights file, run or artifact (default: the standard ones)");
  add_scale(app, c.source.scale, "the source's units in metres");
  app.add_option("--source-up", c.source.up,
                 "the source's axis that points up: x, -x, y, -y, z or -z");
  app.add_option("--fps", c.source.fps,
                 "frames per second of the source (default: the file's, else 30)");
  app.add_option("--clip", c.source.clip, "animation of a glTF source");
  app.add_option("--sequence", c.source.sequence, "which sequence of an HDF5 source, from 0");
  app.add_option("--samples", c.options.samples,
                 "views of a cloud to average: choices of its points, turned and mirrored");
  app.add_flag("--force", c.force, "take what the doctor would refuse");
}

}  // namespace restage::cli
