#include "experiments/adapt/assess.h"

#include <algorithm>
#include <numeric>

#include "autograd/base/interrupt.h"
#include "datasets/doctor/examine.h"
#include "infer/own_body.h"
#include "infer/retargeter.h"
#include "nn/geometry/steady_bones.h"
#include "nn/metrics/label_free.h"
#include "nn/metrics/surfaces.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

constexpr size_t kShown = 32;          // frames whose clouds are kept
constexpr size_t kBodyFrames = 8;      // of them make the person's own body
constexpr size_t kCloudPoints = 2000;  // of a cloud that is kept
constexpr double kRemembering =
    8;  // frames per second, as retargeting: else a frame tells too little

/// Clouds evenly spread over a sequence whose length nobody knows: every so many frames one, and
/// half of them go when there are too many.
class SomeFrames {
 public:
  struct Kept {
    Points cloud;
    SeenJoints seen;
  };
  void add(int64_t frame, const Points& cloud, const SeenJoints& seen, Rng& rng) {
    if (frame % step_ != 0) return;
    Kept& kept = kept_.emplace_back();
    kept.seen = seen;
    for (size_t i = 0; i < std::min(cloud.size(), kCloudPoints); ++i)
      kept.cloud.push_back(cloud[rng.below(cloud.size())]);
    if (kept_.size() < 2 * kShown) return;
    for (size_t i = 0; i < kShown; ++i) kept_[i] = std::move(kept_[2 * i]);
    kept_.resize(kShown);
    step_ *= 2;
  }
  const std::vector<Kept>& kept() const { return kept_; }

 private:
  std::vector<Kept> kept_;
  int64_t step_ = 1;
};

/// Some of the frames make the body; the others are compared with it.
std::optional<double> surface_distance(const SomeFrames& frames) {
  const auto& kept = frames.kept();
  if (kept.size() < 2) return std::nullopt;
  const size_t step = std::max<size_t>(2, kept.size() / kBodyFrames);
  OwnBody body;
  for (size_t i = 0; i < kept.size(); i += step) body.add(kept[i].cloud, kept[i].seen);
  std::vector<double> distances;
  for (size_t i = 0; i < kept.size(); ++i)
    if (i % step != 0) distances.push_back(body.distance(kept[i].cloud, kept[i].seen));
  return std::accumulate(distances.begin(), distances.end(), 0.0) /
         static_cast<double>(distances.size());
}

double lowest_of(const Points& cloud) {
  std::vector<double> heights;
  for (const auto& p : cloud) heights.push_back(static_cast<double>(p.y()));
  return *metrics::percentile(std::move(heights), 0.01);
}

/// What a sequence showed, frame by frame.
struct Seen {
  std::vector<int64_t> number;
  std::vector<Joints> joints, held;
  std::vector<double> lowest, confidence;
};

/// Jitter of each frame that was seen, and of how many there is one: only frames that follow each
/// other in the source tell it.
std::pair<std::vector<double>, int64_t> shaking_of(const Seen& seen) {
  std::vector<double> out;
  int64_t measured = 0;
  for (size_t from = 0, to = 0; from < seen.number.size(); from = to) {
    for (to = from + 1; to < seen.number.size() && seen.number[to] == seen.number[to - 1] + 1;)
      ++to;
    const auto run = metrics::jitter(std::span(seen.joints).subspan(from, to - from));
    measured += std::max<int64_t>(0, std::ssize(run) - 6);  // not of the first and last three
    out.insert(out.end(), run.begin(), run.end());
    out.resize(to, 0.0);
  }
  return {std::move(out), measured};
}

void read_shaking(const Seen& seen, Assessment* out) {
  const auto seen_shaking = shaking_of(seen);
  const auto& shaking = std::get<0>(seen_shaking);
  const auto measured = std::get<1>(seen_shaking);
  if (measured == 0) return;
  out->jitter =
      std::accumulate(shaking.begin(), shaking.end(), 0.0) / static_cast<double>(measured);
  std::vector<size_t> order(shaking.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return shaking[a] != shaking[b] ? shaking[a] > shaking[b] : a < b;
  });
  order.resize(std::min<size_t>(order.size(), 5));
  for (const size_t i : order)
    if (shaking[i] > 0) out->shakiest.push_back(seen.number[i]);
}

double mean_bone(const std::array<double, kJoints>& of) {
  return std::accumulate(of.begin(), of.end(), 0.0) / (kJoints - 1);
}

void judge(const Seen& seen, double fps, Assessment* out) {
  out->frames = std::ssize(seen.joints);
  if (const auto spread = metrics::bone_length_spread(seen.joints)) {
    out->bone_sds = *spread;
    out->bone_length_sd = mean_bone(*spread);
  }
  const auto settled = static_cast<size_t>(2 * fps);
  if (seen.held.size() > settled)
    if (const auto spread = metrics::bone_length_spread(std::span(seen.held).subspan(settled)))
      out->held_bone_length_sd = mean_bone(*spread);
  const std::vector<bool> changed = metrics::side_changes(seen.joints);
  for (size_t i = 0; i < changed.size(); ++i)
    if (changed[i]) out->swapped.push_back(seen.number[i]);
  out->swaps = static_cast<double>(out->swapped.size()) /
               static_cast<double>(std::max<int64_t>(out->frames, 1));
  read_shaking(seen, out);
  out->floor = metrics::floor_spread(seen.lowest);
  if (!seen.confidence.empty())
    out->confidence = std::accumulate(seen.confidence.begin(), seen.confidence.end(), 0.0) /
                      static_cast<double>(seen.confidence.size());
}

}  // namespace

Assessment assess(Source& source, const Bundle& weights, const std::string& weights_name,
                  const AssessOptions& options) {
  auto& model = weights.need_as<SkeletonModel>("skeleton", weights_name);
  JointExtractor extract(model, {.samples = options.samples, .any_size = true, .any_way_up = true});
  const RngKey key = RngKey{options.seed, 0}.fold("assess");
  Rng rng(key.fold("points"));
  Assessment out;
  Seen all;
  SomeFrames some;
  std::optional<SeenJoints> before;
  int64_t gap = 0;  // frames left out since then
  SteadyBones bones;
  for (int64_t i = 0; auto cloud = source.next(); ++i) {
    throw_if_stopped();
    const Points& points = cloud->frame.points;
    try {
      if (cloud->fault) throw *cloud->fault;
      check_frame(points, cloud->frame.source);
      const double apart = static_cast<double>(gap + 1) / source.fps();  // seconds
      const bool remembers = before && 1 / apart > kRemembering;
      SeenJoints seen = extract(points, cloud->frame.source, key.fold(static_cast<uint64_t>(i)),
                                remembers ? &*before : nullptr);
      if (before && apart <= RetargetOptions().lost_seconds)
        if (const std::string fault = lost(seen, *before, apart); !fault.empty())
          throw InputError(cloud->frame.source, fault, "leave the frame out");
      before = std::move(seen);
      gap = 0;
    } catch (const InputError& fault) {
      if (out.left_out++ == 0) out.why = fault.what();
      ++gap;
      continue;
    }
    all.number.push_back(i);
    all.joints.push_back(before->joints);
    all.held.push_back(bones(before->joints, before->uncertainty));
    all.lowest.push_back(lowest_of(points));
    if (before->uncertainty) all.confidence.push_back(confidence(*before->uncertainty));
    some.add(i, points, *before, rng);
    if (options.show) options.show(i, points, *before);
  }
  if (all.joints.empty())
    throw InputError(source.record().path,
                     "has no frame in which a person can be found" +
                         (out.why.empty() ? "" : "; the first: " + out.why),
                     "see what 'restage doctor' says of it");
  judge(all, source.fps(), &out);
  out.surface = surface_distance(some);
  return out;
}

}  // namespace restage
