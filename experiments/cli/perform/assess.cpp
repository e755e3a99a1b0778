// restage assess: how plausible the joints of a capture are, without a truth.
#include <algorithm>
#include <numeric>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "datasets/doctor/examine.h"
#include "experiments/adapt/assess.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/joint_source.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/perform/standard_weights.h"
#include "experiments/slow_work.h"
#include "experiments/text.h"
#include "infer/render/page.h"
#include "nn/models/extraction.h"

namespace restage::cli {
namespace {

struct AssessCommand {
  SourceRecord source;
  std::string weights, out;
  AssessOptions options;
  bool force = false;
};

Json millimetres(const std::optional<double>& metres) {
  return metres ? Json(1e3 * *metres) : Json(nullptr);
}

std::string shown(const std::optional<double>& value, double factor, const char* unit) {
  return value ? format("%.4g", factor * *value) + unit : "-";
}

constexpr size_t kListedFrames = 8;

std::string worst_bones(const Assessment& found) {
  std::vector<size_t> order(kJoints - 1);
  std::iota(order.begin(), order.end(), size_t{1});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return found.bone_sds[a] > found.bone_sds[b]; });
  order.resize(4);
  return joined(order, [&](size_t j) {
    return cat(kJointNames[j], format(" %.1f mm", 1e3 * found.bone_sds[j]));
  });
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

using Rows = std::vector<std::vector<std::string>>;

Rows rows_of(const Assessment& found) {
  return {{"bone lengths, standard deviation", shown(found.bone_length_sd, 1e3, " mm")},
          {"the same, held, after two seconds", shown(found.held_bone_length_sd, 1e3, " mm")},
          {"legs or arms changed sides", format("%.3g %% of frames", 100 * found.swaps)},
          {"jitter", shown(found.jitter, 1e3, " mm")},
          {"surface from the person's own body", shown(found.surface, 1e3, " mm")},
          {"confidence", shown(found.confidence, 1, "")},
          {"floor", shown(found.floor, 1e3, " mm")}};
}

/// Where to look.
std::vector<std::string> places_of(const Assessment& found) {
  std::vector<std::string> out;
  if (found.bone_length_sd) out.push_back("bones that vary most: " + worst_bones(found));
  if (!found.swapped.empty())
    out.push_back("frames with sides changed: " + listed(found.swapped, kListedFrames));
  if (!found.shakiest.empty())
    out.push_back("frames that shake most: " + listed(found.shakiest, kListedFrames));
  return out;
}

std::string text_of(const Assessment& found, const std::string& path, uint64_t seed) {
  Rows rows = rows_of(found);
  rows.insert(rows.begin(), {path, counted(found.frames, "frame")});
  std::string out = markdown_table(rows);
  for (const std::string& place : places_of(found)) out += place + "\n";
  return out + "seed " + std::to_string(seed) + "\n";
}

/// The capture, the joints that were found in it, and the figures, on one page.
class AssessPage {
 public:
  /// Frames without joints are shown as the one before (the first: as the one after).
  void add(int64_t number, const Points& cloud, const SeenJoints& seen) {
    const size_t step = std::max<size_t>(1, cloud.size() / PageOptions().max_points);
    Points some;
    for (size_t i = 0; i < cloud.size(); i += step) some.push_back(cloud[i]);
    const Points bones = stick_figure(seen.joints);
    while (std::ssize(capture_.frames) < number) {
      const bool any = capture_.frames.size() > 0;
      put(any ? Points(capture_.frames.back()) : some, any ? Points(joints_.frames.back()) : bones,
          0.0);
    }
    put(std::move(some), bones, seen.uncertainty ? confidence(*seen.uncertainty) : 0.0);
    sure_ = sure_ || seen.uncertainty;
  }
  void write(const std::string& path, const Assessment& found, const std::string& source,
             double fps) const {
    PageOptions page;
    page.fps = fps;
    page.title = source;
    page.notes.push_back(joined(
        rows_of(found), [](const auto& row) { return row[0] + ": " + row[1]; }, "; "));
    for (const std::string& place : places_of(found)) page.notes.push_back(place);
    Clip joints = joints_;
    if (!sure_) joints.confidence.clear();
    write_page(path, {capture_, joints}, page);
  }

 private:
  void put(Points cloud, Points bones, double sure) {
    capture_.frames.push_back(std::move(cloud));
    joints_.frames.push_back(std::move(bones));
    joints_.confidence.push_back(sure);
  }

  Clip capture_{"capture", {}, {}}, joints_{"joints found", {}, {}};
  bool sure_ = false;  // whether the network states how far joints may be off
};

int run_assess(const AssessCommand& c, const Common& common) {
  if (!c.out.empty() && !c.out.ends_with(".html"))
    throw InputError(c.out, "names no page", "end --out in .html");
  if (!c.out.empty()) check_output(c.out, {c.source.path, c.weights});
  if (c.options.samples < 1 || c.options.samples > 256)
    throw InputError("", "--samples is out of range", "give a number from 1 to 256");
  const std::string weights = c.weights.empty() ? standard_weights() : c.weights;
  const Bundle models = load_bundle(weights);
  refuse_joints(c.source.path);
  Source source(c.source, common.max_memory);
  if (source.frames() == 0)
    throw InputError(c.source.path, "holds no frames", "give at least one cloud");
  if (!c.force) check_first_frames(source);
  AssessOptions options = c.options;
  options.seed = common.seed;
  AssessPage page;
  if (!c.out.empty())
    options.show = [&page](int64_t i, const Points& p, const SeenJoints& seen) {
      page.add(i, p, seen);
    };
  SlowWork slow;
  slow.on("looking at " + counted(source.frames(), "frame"));
  const Assessment found = assess(source, models, weights_path(weights), options);
  slow.on("");
  if (!c.out.empty()) page.write(c.out, found, c.source.path, source.fps());
  for (const std::string& remark : source.remarks()) log_warning(remark);
  if (found.left_out > 0)
    log_warning("left out: " + counted(found.left_out, "frame") + "; the first: " + found.why);
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
                  "restage assess --source scans/ --out page.html\n"
                  "restage assess toy/ --force",
                  run_assess);
  app.add_option("--source,SOURCE", c.source.path,
                 "clouds of one person: a folder, HDF5 file, glTF or arrays")
      .required();
  app.add_option("--weights", c.weights,
                 "weights file, run or artifact (default: the standard ones)");
  add_source_options(app, c.source);
  app.add_option("--samples", c.options.samples,
                 "views of a cloud to average: choices of its points, turned and mirrored");
  app.add_option("--out", c.out,
                 "page.html that plays the capture beside the joints found (default: none)");
  add_force(app, c.force);
}

}  // namespace restage::cli
