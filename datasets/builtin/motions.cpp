#include "datasets/builtin/motions.h"

#include <algorithm>
#include <cmath>

#include "datasets/builtin/actions.h"
#include "datasets/builtin/bodies.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

// Small slow unrest in every channel, so that nobody holds a pose like a statue.
class Unrest {
 public:
  explicit Unrest(Rng& r) {
    for (auto& c : waves_)
      for (Wave& w : c) w = {r.uniform(.2, 1.4), r.uniform(.1, .9), r.uniform(0, 6.28)};
    for (int side = 0; side < 2; ++side)  // feet that stand, stand still
      for (int c = kHipFlex; c < kSideChannels; ++c)
        for (Wave& w : waves_[channel(side, static_cast<SideChannel>(c))]) w.size *= .35;
  }
  double operator()(int channel, double t) const {
    double sum = 0;
    for (const Wave& w : waves_[channel])
      sum += w.size * std::sin(6.283185307179586 * w.rate * t + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double size, rate, phase;
  };
  std::array<std::array<Wave, 2>, kChannels> waves_;
};

struct Contact {
  int joint;
  double clearance;  // height of the joint over the floor when the body part rests on it
};

std::vector<Contact> contacts(const Joints& rest) {
  return {{7, rest[7].y()}, {8, rest[8].y()}, {10, rest[10].y()}, {11, rest[11].y()}, {4, 0.06},
          {5, 0.06},        {20, 0.03},       {21, 0.03},         {0, 0.12}};
}

std::vector<double> smoothed(const std::vector<double>& x, double sigma) {
  const int n = static_cast<int>(x.size()), reach = static_cast<int>(3 * sigma);
  std::vector<double> out(x.size());
  for (int i = 0; i < n; ++i) {
    double sum = 0, weight = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double w = std::exp(-.5 * k * k / (sigma * sigma));
      sum += w * x[std::clamp(i + k, 0, n - 1)];
      weight += w;
    }
    out[i] = sum / weight;
  }
  return out;
}

// Pelvis heights that put the lowest contact on the floor.
std::vector<double> floor_heights(const std::vector<PosedSkeleton>& frames, const Joints& rest) {
  const std::vector<Contact> all = contacts(rest);
  std::vector<double> y(frames.size());
  for (size_t f = 0; f < frames.size(); ++f) {
    double need = -1e9;
    for (const Contact& c : all) need = std::max(need, c.clearance - frames[f].joints[c.joint].y());
    y[f] = need;
  }
  return smoothed(y, 1.5);
}

// Pelvis path along x or z at a given speed in the direction that the pelvis faces.
std::vector<double> straight_path(const std::vector<PosedSkeleton>& frames, double speed,
                                  int axis) {
  std::vector<double> x(frames.size(), 0.0);
  for (size_t f = 1; f < frames.size(); ++f) {
    Vec3 front = frames[f].global[0].col(2);
    front.y() = 0;
    x[f] = x[f - 1] + speed / kFps * front.normalized()[axis];
  }
  return x;
}

// Pelvis path along x or z for which the supporting foot stays where it is: the feet's velocities
// (relative to the pelvis), weighted by how near to the floor they are, turned around.
std::vector<double> path(const std::vector<PosedSkeleton>& frames, const Joints& rest, int axis) {
  std::vector<double> v(frames.size(), 0.0);
  for (size_t f = 1; f < frames.size(); ++f) {
    double sum = 0, weight = 0, lowest = 1e9;
    const auto height = [&](int j) { return frames[f].joints[j].y() - rest[j].y(); };
    for (const int j : {7, 8, 10, 11}) lowest = std::min(lowest, height(j));
    for (const int j : {7, 8, 10, 11}) {
      const double w = std::exp(-(height(j) - lowest) / .008);
      sum += w * (frames[f].joints[j][axis] - frames[f - 1].joints[j][axis]);
      weight += w;
    }
    v[f] = -sum / weight;
  }
  v = smoothed(v, 1.2);
  for (size_t f = 1; f < v.size(); ++f) v[f] += v[f - 1];
  return v;
}

RngKey motion_key(uint64_t seed, const std::string& split) {
  return RngKey{seed, 0}.fold("builtin.motion").fold(split);
}

// World rotations of all frames; joints relative to the pelvis come along for the floor.
std::vector<PosedSkeleton> posed_frames(const Choreography& p, const Temper& temper, Rng& r,
                                        const Joints& rest) {
  const Unrest unrest(r);
  const double heading = r.uniform(-180, 180);
  const auto count = static_cast<size_t>(std::lround(p.seconds * kFps));
  std::vector<PosedSkeleton> frames;
  for (size_t f = 0; f < count; ++f) {
    const double t = static_cast<double>(f) / kFps;
    Angles a = p.angles(t);
    for (int c = 0; c < kChannels; ++c) a[c] += temper.posture[c] + unrest(c, t);
    a[kYaw] += heading;
    frames.push_back(forward_kinematics(rest, {channel_rotations(limit(a)), Vec3::Zero()}));
  }
  return frames;
}

}  // namespace

const std::vector<std::string>& builtin_actions() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const Action& a : actions()) out.push_back(a.name);
    return out;
  }();
  return names;
}

Motion builtin_motion(uint64_t seed, const std::string& split, int index) {
  if (split != "train" && split != "validation" && split != "test")
    throw InputError("builtin motions", "unknown split \"" + split + "\"",
                     "use train, validation or test");
  if (index < 0)
    throw InputError("builtin motions", cat("negative motion number ", index), "count from 0");
  const RngKey key = motion_key(seed, split);
  const int subject = index / kMotionsPerSubject;
  const Action& action = actions()[index % actions().size()];
  const Temper temper = draw_temper(key.fold("subject").fold(subject));
  Rng r(key.fold("motion").fold(index));
  Choreography performance = action.perform(temper, r);
  performance.seconds = std::clamp(performance.seconds, 2.0, 6.0);

  Motion m;
  m.id = cat("builtin_", split, "_", index, "_", action.name);
  m.subject = cat("builtin_", split, "_subject_", subject);
  m.split = split;
  m.action = action.name;
  m.rest = builtin_rest_joints();
  const std::vector<PosedSkeleton> frames = posed_frames(performance, temper, r, m.rest);
  const auto travel = [&](int axis) {
    return performance.speed ? straight_path(frames, *performance.speed, axis)
                             : path(frames, m.rest, axis);
  };
  const std::vector<double> x = travel(0), z = travel(2);
  const std::vector<double> y = floor_heights(frames, m.rest);
  for (size_t f = 0; f < frames.size(); ++f) {
    std::array<Eigen::Quaternionf, kJoints> q;
    for (int j = 0; j < kJoints; ++j) q[j] = Quat(frames[f].global[j]).normalized().cast<float>();
    m.global.push_back(q);
    const double flight =
        performance.flight ? performance.flight(static_cast<double>(f) / kFps) : 0;
    const Vec3 hips =
        .5 * (frames[f].joints[1] + frames[f].joints[2]) + Vec3(x[f], y[f] + flight, z[f]);
    m.hips.push_back(hips.cast<float>());
  }
  return m;
}

std::vector<Motion> builtin_motions(uint64_t seed, int train, int validation, int test) {
  if (train < 0 || validation < 0 || test < 0)
    throw InputError("builtin motions", "a negative count", "ask for 0 or more motions per split");
  std::vector<Motion> out;
  for (int i = 0; i < train; ++i) out.push_back(builtin_motion(seed, "train", i));
  for (int i = 0; i < validation; ++i) out.push_back(builtin_motion(seed, "validation", i));
  for (int i = 0; i < test; ++i) out.push_back(builtin_motion(seed, "test", i));
  return out;
}

}  // namespace restage
