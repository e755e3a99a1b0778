// People for the doctor's tests: built-in bodies as scans and sequences.
#pragma once

#include <string>
#include <vector>

#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/doctor/examine.h"
#include "datasets/sampling/surface.h"

namespace restage {

inline const Body& somebody() {
  static const Body body = builtin_body(0, "test", 0);
  return body;
}

/// A scan of 1,100 points with 5 mm of noise: at rest, or in the middle of a motion, facing +z.
inline Points scan(const Body& body, const Motion* motion = nullptr, size_t frame = 0,
                   uint64_t seed = 1) {
  const RngKey key{seed, 0};
  const SurfaceSamples samples = SurfaceSampler(body).draw(key.fold("surface"), 1100);
  Points out = samples.on_rest(body);
  if (motion != nullptr) {
    const Pose pose = pose_on(*motion, body, frame);
    out = samples.on_pose(body, pose);
    const Mat3 turn = turn_about_y(-heading_angle(forward_kinematics(body.joints, pose).joints));
    for (Point& p : out) p = turn.cast<float>() * p;
  }
  add_noise(key.fold("noise"), 0.005, out);
  return out;
}

inline Mesh cloud(Points points) { return {std::move(points), {}}; }

inline Points moved(Points points, const Mat3& turn, double scale = 1,
                    const Point& by = Point::Zero()) {
  for (Point& p : points) p = turn.cast<float>() * p * static_cast<float>(scale) + by;
  return points;
}

inline Mat3 into_foreign(int up, int facing) {
  Orientation o;
  o.up = up;
  o.facing = facing;
  return o.turn().transpose();
}

inline bool notes(const Diagnosis& d, const std::string& topic, const std::string& words) {
  for (const Finding& f : d.findings)
    if (f.topic == topic && f.weight != Weight::fact && f.what.find(words) != std::string::npos)
      return true;
  return false;
}

/// Examined as what retargeting moves.
inline Diagnosis examine_target(const Mesh& mesh) {
  ExamineOptions options;
  options.target = true;
  return examine_surface(mesh, options);
}

/// Frames in memory.
class Frames : public FrameSource {
 public:
  explicit Frames(std::vector<Points> frames, std::vector<std::string> names = {}, double fps = 30)
      : frames_(std::move(frames)), names_(std::move(names)), fps_(fps) {
    if (!names_.empty()) numbers_ = order_frames(names_, "").numbers;
  }
  std::optional<Frame> next() override {
    if (at_ == frames_.size()) return std::nullopt;
    const std::string name = names_.empty() ? "x.h5:" + std::to_string(at_) : names_[at_];
    Frame frame{name, frames_[at_], {}, 0};
    if (!numbers_.empty()) frame.number = numbers_[at_];
    ++at_;
    return frame;
  }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return static_cast<int64_t>(frames_.size()); }
  double fps() const override { return fps_; }

 private:
  std::vector<Points> frames_;
  std::vector<int64_t> numbers_;
  std::vector<std::string> names_;
  double fps_;
  size_t at_ = 0;
};

inline std::vector<Points> performance(size_t frames) {
  const Motion motion = builtin_motion(0, "test", 0);
  std::vector<Points> out;
  for (size_t f = 0; f < std::min(frames, motion.frames()); ++f) {
    const Pose pose = pose_on(motion, somebody(), f);
    out.push_back(SurfaceSampler(somebody()).draw(RngKey{f, 0}, 1000).on_pose(somebody(), pose));
  }
  return out;
}

}  // namespace restage
