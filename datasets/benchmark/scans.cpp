#include "datasets/benchmark/scans.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "datasets/benchmark/sequence.h"
#include "datasets/importers/batches.h"
#include "datasets/readers/clouds/non_finite.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr int kElbow = 18, kWrist = 20;  // the intruder's left arm

/// The ground that a performance covers.
struct Path {
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};

Path path_of(const Performance& performance) {
  Eigen::AlignedBox3d box;
  for (size_t i = 0; i < performance.frames(); ++i) box.extend(performance.pose_a(i).root);
  Path out;
  out.centre = 0.5 * (box.min() + box.max());
  out.centre.y() = 0.95;
  out.radius = 0.5 * std::hypot(box.sizes().x(), box.sizes().z());
  return out;
}

std::vector<DepthCamera> cameras_of(const ScannerRecipe& s, const Path& path) {
  DepthCamera model;
  model.width = model.height = s.pixels;
  model.view = s.view * kRadians;
  return camera_ring(s.cameras, path.radius + s.margin, s.azimuth * kRadians, path.centre,
                     s.heights, model);
}

/// Forearm and hand of a posed body, the hand 25 cm from A's chest, reaching from A's left.
Mesh reaching_arm(const Body& body, const Joints& a) {
  Mesh out = body.rest;
  const Vec3 across = (a[16] - a[17]).normalized();  // A's right to left
  const Vec3 bone = body.joints[kWrist] - body.joints[kElbow];
  const Mat3 turn = shortest_arc(bone, -across + Vec3(0, 0.15, 0));
  const Vec3 hand = a[9] + 0.45 * across + Vec3(0, 0.1, 0);
  std::vector<bool> of_arm;
  for (size_t v = 0; v < out.vertices.size(); ++v)
    of_arm.push_back(!(body.weights(v, kElbow) + body.weights(v, kWrist) < 0.5f));
  keep_points(of_arm, out.vertices, out.faces);
  for (Point& p : out.vertices)
    p = (hand + turn * (p.cast<double>() - body.joints[kWrist])).cast<float>();
  return out;
}

void append(const Mesh& part, Mesh& whole) {
  const auto first = static_cast<int32_t>(whole.vertices.size());
  whole.vertices.insert(whole.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (Triangle t : part.faces) {
    for (int32_t& v : t) v += first;
    whole.faces.push_back(t);
  }
}

/// A share of the points in random order.
Points keep_some(Points cloud, double least, const RngKey& key) {
  Rng rng(key);
  const double share = least + (1 - least) * rng.uniform();
  for (size_t i = cloud.size(); i > 1; --i) std::swap(cloud[i - 1], cloud[rng.below(i)]);
  const auto kept = static_cast<size_t>(std::ceil(share * static_cast<double>(cloud.size())));
  cloud.resize(std::min(kept, cloud.size()));
  return cloud;
}

/// From the world into the scanner's frame.
class ToSource {
 public:
  explicit ToSource(const SourceToWorld& t)
      : inverse_(t.leftCols<3>().inverse()), origin_(t.col(3)) {}
  Vec3 operator()(const Vec3& world) const { return inverse_ * (world - origin_); }

 private:
  Mat3 inverse_;
  Vec3 origin_;
};

/// What the cameras see of a frame, in the world.
Points seen(const ScanScene& scene, const std::vector<DepthCamera>& cameras, size_t i) {
  const Body& a = scene.performance.source();
  const RngKey key = scene.key.fold("scan").fold(i);
  Mesh surface{pose_surface(a, scene.performance.pose_a(i)), a.rest.faces};
  if (scene.intruder) append(reaching_arm(*scene.intruder, scene.performance.joints_a(i)), surface);
  return keep_some(scan_surface(surface, cameras, scene.scanner.noise, key),
                   scene.scanner.least_kept, key.fold("kept"));
}

}  // namespace

SourceToWorld draw_frame(const RngKey& key) {
  constexpr double kUnits[] = {1.0, 0.01, 0.001, 0.1, 0.0254};  // metres per unit
  Rng rng(key);
  const double unit = kUnits[rng.below(5)];
  const auto first = static_cast<int>(rng.below(3));
  const auto second = static_cast<int>((static_cast<uint64_t>(first) + 1 + rng.below(2)) % 3);
  Mat3 axes = Mat3::Zero();  // columns: where the scanner's x, y and z lie
  axes(first, 0) = rng.below(2) == 0 ? 1 : -1;
  axes(second, 1) = rng.below(2) == 0 ? 1 : -1;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  const Mat3 rotation = turn_about_y(rng.uniform(-std::numbers::pi, std::numbers::pi)) * axes;
  SourceToWorld out;
  out.leftCols<3>() = unit * rotation;
  for (int c = 0; c < 3; ++c) out(c, 3) = rng.uniform(-2, 2);
  return out;
}

size_t points_in_first_frame(const ScanScene& scene) {
  const auto cameras = cameras_of(scene.scanner, path_of(scene.performance));
  return seen(scene, cameras, 0).size();
}

void write_scan_sequence(const ScanScene& scene, bool known_frame, bool rotations,
                         const FileInfo& info, const std::string& folder) {
  const Performance& performance = scene.performance;
  SourceToWorld frame = SourceToWorld::Identity();
  if (!known_frame) frame = draw_frame(scene.key.fold("frame"));
  const ToSource to_source(frame);
  const std::vector<DepthCamera> cameras = cameras_of(scene.scanner, path_of(performance));

  ScanWriter scans(folder + "/source.h5", info);
  scans.set_definition(performance.source().definition);
  if (!known_frame) scans.set_foreign_frame();
  in_batches<Points>(
      performance.frames(),
      [&](size_t i) {
        Points cloud = seen(scene, cameras, i);
        for (Point& p : cloud) p = to_source(p.cast<double>()).cast<float>();
        return cloud;
      },
      [&](size_t i, const Points& cloud) {
        if (cloud.size() < kLeastPoints)
          throw WorkError(cat(folder, ": frame ", i, " has ", cloud.size(),
                              " points, too few for anybody; bring the scanner nearer"));
        Joints joints = performance.joints_a(i);
        for (Vec3& x : joints) x = to_source(x);
        scans.append(cloud, joints);
      });
  scans.commit();
  write_truth(performance, info, folder, &frame, rotations);
}

}  // namespace restage
