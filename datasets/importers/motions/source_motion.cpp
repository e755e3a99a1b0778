#include "datasets/importers/motions/source_motion.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"

namespace restage {

std::vector<Vec3> zero_positions(const SourceSkeleton& skeleton) {
  std::vector<Vec3> out(skeleton.size());
  for (size_t j = 0; j < out.size(); ++j) {
    const int p = skeleton.parents[j];
    out[j] = p < 0 ? Vec3::Zero() : Vec3(out[p] + skeleton.offsets[j]);
  }
  return out;
}

Joints rest_joints(const SourceSkeleton& skeleton, const JointMap& map) {
  const std::vector<Vec3> zero = zero_positions(skeleton);
  Joints out;
  for (int j = 0; j < kJoints; ++j) out[j] = zero[map[j].joint] + map[j].offset;
  const Vec3 pelvis = out[0];
  for (Vec3& x : out) x -= pelvis;
  return out;
}

void check_length(size_t frames, size_t joints, double fps, uint64_t bytes,
                  const std::string& path) {
  const double most = static_cast<double>(frames) * std::max(1.0, kFps / fps);
  const auto payload = static_cast<double>(bytes);
  // 22 positions of a frame are 528 bytes; a joint's three angles take at least 6 in a text.
  if (most > 100'000 + payload / 66 || most * static_cast<double>(joints) > 6e6 + payload / 2)
    throw InputError(path,
                     cat("would make ", static_cast<int64_t>(most), " frames of ", joints,
                         " joints, far more than is in the file"),
                     "check its frame rate, or cut it");
}

SourceMotion resample(const SourceMotion& motion) {
  SourceMotion out;
  out.skeleton = motion.skeleton;
  out.moving = motion.moving;
  out.fps = kFps;
  const size_t n = motion.local.size();
  if (n == 0) return out;
  // A hair more than the last frame's time: 1 / 0.00833333 s is not exactly 120.
  const double last = static_cast<double>(n - 1);
  const size_t frames = static_cast<size_t>(std::floor(last / motion.fps * kFps + 1e-3)) + 1;
  out.local.resize(frames);
  out.position.resize(frames);
  for (size_t k = 0; k < frames; ++k) {
    const double at = std::min(last, static_cast<double>(k) / kFps * motion.fps);
    const size_t a = static_cast<size_t>(at), b = std::min(a + 1, n - 1);
    const double t = at - static_cast<double>(a);
    out.local[k].resize(motion.skeleton.size());
    for (size_t j = 0; j < motion.skeleton.size(); ++j)
      out.local[k][j] = motion.local[a][j].slerp(t, motion.local[b][j]);
    out.position[k].resize(motion.moving.size());
    for (size_t m = 0; m < motion.moving.size(); ++m)
      out.position[k][m] = (1.0 - t) * motion.position[a][m] + t * motion.position[b][m];
  }
  return out;
}

namespace {

struct World {
  std::vector<Mat3> global;
  std::vector<Vec3> position;
};

World world_of(const SourceMotion& motion, size_t frame) {
  const SourceSkeleton& s = motion.skeleton;
  World out{std::vector<Mat3>(s.size()), std::vector<Vec3>(s.size())};
  auto& [global, position] = out;
  size_t moving = 0;
  for (size_t j = 0; j < s.size(); ++j) {
    Vec3 offset = s.offsets[j];
    if (moving < motion.moving.size() && motion.moving[moving] == static_cast<int>(j))
      offset = motion.position[frame][moving++];
    const Mat3 local = motion.local[frame][j].toRotationMatrix();
    if (s.parents[j] < 0) {
      global[j] = local;
      position[j] = offset;
    } else {
      const int p = s.parents[j];
      global[j] = global[p] * local;
      position[j] = position[p] + global[p] * offset;
    }
  }
  return out;
}

}  // namespace

PosedSkeleton source_pose(const SourceMotion& motion, const JointMap& map, size_t frame) {
  const auto [global, position] = world_of(motion, frame);
  PosedSkeleton out;
  for (int j = 0; j < kJoints; ++j) {
    const int source = map[j].joint;
    out.global[j] = global[source];
    out.joints[j] = position[source] + global[source] * map[j].offset;
  }
  return out;
}

FingerTurns source_fingers(const SourceMotion& motion, const FingerBones& bones, size_t frame) {
  const World world = world_of(motion, frame);
  FingerTurns out;
  for (size_t k = 0; k < out.size(); ++k)
    if (bones[k] >= 0) out[k] = world.global[static_cast<size_t>(bones[k])];
  return out;
}

double lowest_foot(const PosedSkeleton& p) {
  return std::min({p.joints[7].y(), p.joints[8].y(), p.joints[10].y(), p.joints[11].y()});
}

double floor_height(std::vector<double> lowest) {
  if (lowest.empty()) return 0.0;
  std::sort(lowest.begin(), lowest.end());
  const double at = 0.05 * static_cast<double>(lowest.size() - 1);
  const size_t a = static_cast<size_t>(at), b = std::min(a + 1, lowest.size() - 1);
  return lowest[a] + (at - static_cast<double>(a)) * (lowest[b] - lowest[a]);
}

double floor_height(const Poses& poses) {
  std::vector<double> lowest;
  for (const PosedSkeleton& pose : poses) lowest.push_back(lowest_foot(pose));
  return floor_height(std::move(lowest));
}

Motion to_motion(const Poses& poses, const Joints& rest, double floor_y, Motion named) {
  Motion out = std::move(named);
  out.rest = rest;
  out.global.resize(poses.size());
  out.hips.resize(poses.size());
  for (size_t f = 0; f < poses.size(); ++f) {
    for (int j = 0; j < kJoints; ++j)
      out.global[f][j] = Quat(poses[f].global[j]).normalized().cast<float>();
    const Vec3 hips = 0.5 * (poses[f].joints[1] + poses[f].joints[2]);
    out.hips[f] = (hips - Vec3(0, floor_y, 0)).cast<float>();
  }
  return out;
}

}  // namespace restage
