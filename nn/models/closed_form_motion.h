// `motion/closed_form`: no network. The rotations are the closed form of the joints as they come
// (nn/geometry/closed_form.h), the path is the path of A times the ratio of the legs' lengths.
// Every learned motion network has to beat this model. It has nothing to learn
// (motion.optimiser.steps=0).
#pragma once

#include "nn/models/motion.h"

namespace restage {

struct ClosedFormMotionConfig {};

template <class V>
void visit(V&, ClosedFormMotionConfig&) {}

/// The state is {how much longer B's legs are than A's in the first frame}, [n, 1, 1].
struct ClosedFormMotion final : MotionModel {
  using Config = ClosedFormMotionConfig;
  ClosedFormMotion(const ClosedFormMotionConfig&, const Init&) {}
  MotionOutput forward(Context& ctx, const MotionInput& in, MotionState* state) const override;
  void standardise(const MotionStatistics&) override {}
  void visit(Fields&) override {}
  const char* kind() const override { return "closed form"; }
};

}  // namespace restage
