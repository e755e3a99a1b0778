#include "bench/doctor/scans.h"

#include <array>
#include <cmath>
#include <map>

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

/// Every bone's orientation in the world, of a person who faces +z.
Rotations facing_forward(const Body& body, const Pose& pose) {
  const Mat3 back = turn_about_y(-heading_angle(forward_kinematics(body.joints, pose).joints));
  Rotations out = to_global(pose.local);
  for (Mat3& bone : out) bone = back * bone;
  return out;
}

/// Stands as `legs`, bends as `trunk`, and moves the arms as `arms`: what people also do, though
/// nobody recorded it. Bones keep their orientation in the world, arms theirs to the chest.
Pose mixed(const Body& body, const Pose& legs, const Pose& trunk, const Pose& arms) {
  constexpr std::array kLegs = {0, 1, 2, 4, 5, 7, 8, 10, 11};
  constexpr std::array kArms = {16, 17, 18, 19, 20, 21};
  Rotations bones = facing_forward(body, trunk);
  const Rotations below = facing_forward(body, legs);
  for (const int j : kLegs) bones[j] = below[j];
  Pose out{to_local(bones), legs.root};
  for (const int j : kArms) out.local[j] = arms.local[j];
  return out;
}

/// Turns every joint but the root a little more.
void disturb(double degrees, Rng& rng, Pose& pose) {
  for (size_t j = 1; j < pose.local.size(); ++j) {
    const Vec3 by = Vec3(rng.normal(), rng.normal(), rng.normal()) * degrees * kPi / 180;
    if (by.norm() > 0)
      pose.local[j] *= Eigen::AngleAxisd(by.norm(), by.normalized()).toRotationMatrix();
  }
}

}  // namespace

struct ScanMaker::State {
  const Corpus& corpus;
  ScanRecipe recipe;
  RngKey key;
  FrameIndex frames;
  std::vector<SurfaceSampler> surfaces;

  FrameRef frame(Rng& rng) const {
    FrameRef at = frames.at(rng.below(frames.count()));
    if (recipe.by_clip_share > 0 && rng.uniform() < recipe.by_clip_share) {
      at.motion = rng.below(corpus.motions.size());
      at.frame = rng.below(corpus.motions[at.motion].frames());
    }
    return at;
  }
  Pose pose(const FrameRef& at, const Body& body) const {
    return pose_on(corpus.motions[at.motion], body, at.frame);
  }
};

ScanMaker::ScanMaker(const Corpus& corpus, const ScanRecipe& recipe, uint64_t seed)
    : state_(new State{corpus, recipe, RngKey{seed, 0}.fold("doctor scans"),
                       FrameIndex(corpus.motions), surface_samplers(corpus.bodies)}) {}
ScanMaker::ScanMaker(ScanMaker&&) noexcept = default;
ScanMaker::~ScanMaker() = default;

TrueScan ScanMaker::make(uint64_t index) const {
  const ScanRecipe& recipe = state_->recipe;
  const RngKey key = state_->key.fold(index);
  Rng rng(key);
  TrueScan out;
  const size_t b = rng.below(state_->corpus.bodies.size());
  const Body& body = state_->corpus.bodies[b];
  const FrameRef at = state_->frame(rng);
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
    Pose pose = state_->pose(at, body);
    if (recipe.mixed_share > 0 && rng.uniform() < recipe.mixed_share) {
      const Pose trunk = state_->pose(state_->frame(rng), body);
      pose = mixed(body, pose, trunk, state_->pose(state_->frame(rng), body));
    }
    if (recipe.pose_noise > 0) disturb(recipe.pose_noise, rng, pose);
    out.points = samples.on_pose(body, pose);
    faces = heading_angle(forward_kinematics(body.joints, pose).joints);
    out.what = body.id + ", " + state_->corpus.motions[at.motion].id + " frame " +
               std::to_string(at.frame);
  }
  out.heading = rng.uniform(-recipe.heading, recipe.heading);
  const Eigen::Matrix3f turn = turn_about_y(out.heading * kPi / 180 - faces).cast<float>();
  for (Point& p : out.points) p = turn * p;
  add_noise(key.fold("noise"), recipe.noise, out.points);
  if (one_side) out.points = seen_from(out.points, rng);
  if (rng.uniform() < recipe.stray_share) add_strays(out.points, rng);
  return out;
}

Points random_thing(const RngKey& key) {
  Rng rng(key);
  Points out;
  const uint64_t parts = 1 + rng.below(7);
  for (uint64_t part = 0; part < parts; ++part) {
    Vec3 middle, half;
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = rng.uniform(-1, 1);
      half[axis] = std::exp(rng.uniform(std::log(0.02), 0));
    }
    Mat3 turn = Mat3::Identity();
    if (rng.below(2) == 0)
      turn = turn_about_y(rng.uniform(0, 2 * kPi)) *
             Eigen::AngleAxisd(rng.uniform(0, kPi), Vec3::UnitX()).toRotationMatrix();
    const bool ball = rng.below(2) == 0, full = rng.below(2) == 0;
    for (int i = 0; i < 300; ++i) {
      Vec3 p(rng.normal(), rng.normal(), rng.normal());
      p /= ball ? p.norm() : p.cwiseAbs().maxCoeff();  // on its surface
      if (full) p *= std::cbrt(rng.uniform());
      out.push_back((middle + turn * half.cwiseProduct(p)).cast<float>());
    }
  }
  return out;
}

}  // namespace restage::bench
