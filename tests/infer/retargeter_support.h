// A small motion, a target and untrained networks, for the tests of the retargeter.
#pragma once

#include <algorithm>
#include <vector>

#include "infer/retargeter.h"
#include "tests/support/frames.h"
#include "tests/support/small_models.h"
#include "tests/support/tiny_body.h"

namespace restage::retargeter_test {

inline Bundle untrained(const std::string& smrm = "smrm/rot6d") {
  return testing::untrained_bundle(smrm);
}

inline std::vector<Joints> performance(size_t frames) {
  const Motion motion = testing::tiny_motion("m", "s", "test", frames);
  const Body body = testing::tiny_body("a", "test");
  std::vector<Joints> out;
  for (size_t f = 0; f < frames; ++f)
    out.push_back(forward_kinematics(body.joints, pose_on(motion, body, f)).joints);
  return out;
}

inline const Body& target() {
  static const Body body = testing::tiny_body("b", "test", 1.1, 1.2);
  return body;
}

inline std::vector<RetargetedFrame> run(Retargeter& r, const std::vector<Joints>& source) {
  std::vector<RetargetedFrame> out;
  for (const Joints& j : source)
    for (const RetargetedFrame& f : pushed_joints(r, j)) out.push_back(f);
  return out;
}

/// What becomes of a source on the target.
inline std::vector<RetargetedFrame> retargeted(const Bundle& models,
                                               const std::vector<Joints>& source,
                                               const RetargetOptions& options = {}) {
  Retargeter r(models, "w", target().rest, target().joints, options);
  return run(r, source);
}

inline double apart(const Joints& a, const Joints& b) {
  double most = 0;
  for (size_t j = 0; j < kJoints; ++j) most = std::max(most, (a[j] - b[j]).norm());
  return most;
}

inline double apart(const Points& a, const Points& b) {
  if (a.size() != b.size()) return 1e9;
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i)
    most = std::max(most, static_cast<double>((a[i] - b[i]).norm()));
  return most;
}

}  // namespace restage::retargeter_test
