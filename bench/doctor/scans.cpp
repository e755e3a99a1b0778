#include "bench/doctor/scans.h"

#include <cmath>
#include <map>
#include <memory>

#include "autograd/base/rng.h"
#include "datasets/sampling/frames.h"
#include "datasets/sampling/surface.h"

namespace restage::bench {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// What a camera in direction (sin a, 0, cos a), a little above or below, sees of a cloud: the
/// points near the front of each of its 3 cm rays.
Points seen_from(const Points& points, Rng& rng) {
  const double a = rng.uniform(0, 2 * kPi), e = rng.uniform(-0.2, 0.4);
  const Point eye(static_cast<float>(std::sin(a) * std::cos(e)), static_cast<float>(std::sin(e)),
                  static_cast<float>(std::cos(a) * std::cos(e)));
  const Point right = Point(eye.z(), 0, -eye.x()).normalized(), up = eye.cross(right);
  const auto ray = [&](const Point& p) {
    return std::pair(std::lround(p.dot(right) / 0.05f), std::lround(p.dot(up) / 0.05f));
  };
  std::map<std::pair<long, long>, float> front;
  for (const Point& p : points) {
    const auto [at, fresh] = front.try_emplace(ray(p), p.dot(eye));
    if (!fresh) at->second = std::max(at->second, p.dot(eye));
  }
  Points out;
  for (const Point& p : points)
    if (p.dot(eye) > front[ray(p)] - 0.06f) out.push_back(p);
  return out;
}

void add_strays(Points& points, Rng& rng) {
  const size_t n = points.size() / 50 + rng.below(points.size() / 30);
  for (size_t i = 0; i < n; ++i) {
    Point p = points[rng.below(points.size())];
    for (int axis = 0; axis < 3; ++axis) p[axis] += static_cast<float>(rng.uniform(-0.6, 0.6));
    points.push_back(p);
  }
}

}  // namespace

struct ScanMaker::State {
  const Corpus& corpus;
  ScanRecipe recipe;
  RngKey key;
  FrameIndex frames;
  std::vector<SurfaceSampler> surfaces;
};

ScanMaker::ScanMaker(const Corpus& corpus, const ScanRecipe& recipe, uint64_t seed)
    : state_(new State{corpus, recipe, RngKey{seed, 0}.fold("doctor scans"),
                       FrameIndex(corpus.motions), surface_samplers(corpus.bodies)}) {}
ScanMaker::~ScanMaker() = default;

TrueScan ScanMaker::make(uint64_t index) const {
  const ScanRecipe& recipe = state_->recipe;
  const RngKey key = state_->key.fold(index);
  Rng rng(key);
  TrueScan out;
  const size_t b = rng.below(state_->corpus.bodies.size());
  const Body& body = state_->corpus.bodies[b];
  FrameRef at = state_->frames.at(rng.below(state_->frames.count()));
  if (recipe.by_clip_share > 0 && rng.uniform() < recipe.by_clip_share) {
    at.motion = rng.below(state_->corpus.motions.size());
    at.frame = rng.below(state_->corpus.motions[at.motion].frames());
  }
  out.rest = rng.uniform() < recipe.rest_share;
  const auto n = static_cast<size_t>(recipe.least) +
                 rng.below(static_cast<uint64_t>(recipe.most - recipe.least + 1));
  const bool one_side = rng.uniform() < recipe.one_side_share;
  const SurfaceSamples samples =
      state_->surfaces[b].draw(key.fold("surface"), one_side ? 3 * n : n);
  double faces = 0;
  if (out.rest) {
    out.points = samples.on_rest(body);
    out.what = body.id + ", T-pose";
  } else {
    const Motion& motion = state_->corpus.motions[at.motion];
    const Pose pose = pose_on(motion, body, at.frame);
    out.points = samples.on_pose(body, pose);
    faces = heading_angle(forward_kinematics(body.joints, pose).joints);
    out.what = body.id + ", " + motion.id + " frame " + std::to_string(at.frame);
  }
  out.heading = rng.uniform(-recipe.heading, recipe.heading);
  const Eigen::Matrix3f turn = turn_about_y(out.heading * kPi / 180 - faces).cast<float>();
  for (Point& p : out.points) p = turn * p;
  add_noise(key.fold("noise"), recipe.noise, out.points);
  if (one_side) out.points = seen_from(out.points, rng);
  if (rng.uniform() < recipe.stray_share) add_strays(out.points, rng);
  return out;
}

}  // namespace restage::bench
