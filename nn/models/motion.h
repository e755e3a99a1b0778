// The interface of motion networks: joints and translation of A in, the motion of B out (spec 3.1).
#pragma once

#include <vector>

#include "autograd/kernels/rotation.h"
#include "nn/geometry/skeleton.h"
#include "nn/module.h"

namespace restage {

/// What a network carries from frame to frame; the form is the network's own. Empty at the start.
using MotionState = std::vector<Var>;

/// What is seen of A, and who is to perform it. The last three may be undefined, and no network
/// needs them: they are what an extractor may say beside the joints, and how the axes of the input
/// turn with A's heading.
struct MotionInput {
  Var joints;            ///< [n, t, 22, 3] of A relative to its root
  Var trans;             ///< [n, t, 3], in the configured meaning
  Var rest;              ///< [n, 22, 3] of B relative to its root
  Tensor turns;          ///< [n, t, 22, 3, 3] rotation of each joint of A from the T-pose
  Tensor uncertainty;    ///< [n, t, 22] of A's joints, metres (SkeletonOutput)
  Tensor reframed = {};  ///< [n, t, 3, 3] takes what was in the directions of the frame before to
                         ///< this frame's; undefined where they stay
};

struct MotionOutput {
  Var raw;        ///< what the network gives before it becomes rotations, [n, t, 22 * numbers]
  Var rotations;  ///< [n, t, 22, 3, 3] local
  Var joints;     ///< [n, t, 22, 3] relative to the root, metres
  Var trans;      ///< [n, t, 3], in the configured meaning (velocity: m/s)
  Var standing;   ///< [n, t, 2] log odds that the left, the right foot stands; undefined where a
                  ///< network does not say
};

/// Mean and deviation per column of what a training shows to its network.
struct MotionStatistics {
  struct Columns {
    Tensor mean, deviation;
  };
  Columns joints, rest, trans, sixd;  ///< [66], [66], [3], [132]
};

struct MotionModel : Module {
  /// `state` is read and replaced.
  virtual MotionOutput forward(Context& ctx, const MotionInput& in, MotionState* state) const = 0;
  /// By how many frames an answer is late: answer t is the motion of frame t - latency().
  virtual int64_t latency() const { return 0; }
  /// Called once before a training; a network that takes numbers as they are ignores it.
  virtual void standardise(const MotionStatistics& statistics) = 0;
};

/// The input on a device.
MotionInput moved(MotionInput in, Device device);
/// The answer as constants in the host's memory.
MotionOutput on_host(const MotionOutput& out);
/// Frames [from, to) of an answer.
MotionOutput frames_of(const MotionOutput& out, int64_t from, int64_t to);
/// x relative to the mean of the training set, in units of its deviation.
Var in_units(const Var& x, const MotionStatistics::Columns& of);
/// rest [n, 22, 3] -> [n * frames, 22, 3].
Var rest_of_each_frame(const Var& rest, int64_t frames);
/// Length of a leg, hip to ankle, the mean of both: [n, 22, 3] -> [n].
Var leg_lengths(const Var& joints);
/// Rotations and joints of an output from local rotations [n * t, 22, 3, 3] of n motions.
void put_pose(const Var& local, const Var& rest_rows, int64_t n, MotionOutput* out);

/// Parents of the 22 joints as the kinematics op takes them.
inline std::span<const int> joint_parents() { return kParents; }

/// How the op swing_twist turns each of the 22 joints: as in the closed form
/// (nn/geometry/closed_form.h).
std::span<const SwingJoint> joint_swings();

}  // namespace restage
