// Rotations that put the bones of a skeleton where given joints are, and twist the bones about
// themselves.
#pragma once

#include "autograd/kernels/rotation.h"
#include "autograd/kernels/scratch.h"
#include "autograd/tape/tape.h"

namespace restage {

/// Rest joints, posed joints and a twist about each posed bone (radians) -> local rotations [n, j,
/// 3, 3]. With twists of zero this is the closed form of retargeting. `joints` says how each joint
/// turns (SwingJoint in kernels/rotation.h).
struct SwingTwist {
  static constexpr const char* name = "swing_twist";
  static constexpr const char* letters = "rest[n, j, 3], posed[n, j, 3], twist[n, j]";
  Scratch<SwingJoint> joints;  ///< parents come before children
  void check(Inputs x) const;
  Tensor forward(Inputs x, Saved& saved) const;
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const;
};

inline Var swing_twist(const Var& rest, const Var& posed, const Var& twist,
                       std::span<const SwingJoint> joints) {
  return call(SwingTwist{{joints.begin(), joints.end()}}, {rest, posed, twist});
}

}  // namespace restage
