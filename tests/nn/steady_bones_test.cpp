// Bones are held at the mean of their lengths: the lengths of a noisy sequence settle, joints move
// no farther than the noise, and what is exact stays.
#include "nn/geometry/steady_bones.h"

#include <gtest/gtest.h>

#include "autograd/base/rng.h"
#include "nn/metrics/label_free.h"

namespace restage {
namespace {

Joints figure() {
  Joints out;
  for (size_t j = 0; j < kJoints; ++j)
    out[j] = j == 0 ? Vec3(0, 1, 0)
                    : out[static_cast<size_t>(kParents[j])] +
                          0.2 * Vec3(static_cast<double>(j % 3) - 1, 0.3, 0.5).normalized();
  return out;
}

std::vector<Joints> noisy(size_t n, double deviation) {
  Rng rng(RngKey{4, 0});
  std::vector<Joints> out(n, figure());
  for (Joints& frame : out)
    for (Vec3& p : frame)
      for (int c = 0; c < 3; ++c) p[c] += deviation * rng.normal();
  return out;
}

TEST(SteadyBones, ExactJointsStay) {
  SteadyBones bones;
  for (int t = 0; t < 3; ++t) {
    const Joints out = bones(figure(), std::nullopt);
    for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((out[j] - figure()[j]).norm(), 1e-9);
  }
}

TEST(SteadyBones, TheFirstFrameStaysAndLaterLengthsSettle) {
  const auto seen = noisy(120, 0.01);
  SteadyBones bones;
  std::vector<Joints> late;
  double off_before = 0, off_after = 0;
  for (size_t t = 0; t < seen.size(); ++t) {
    const Joints out = bones(seen[t], std::nullopt);
    for (size_t j = 0; t == 0 && j < kJoints; ++j) EXPECT_LT((out[j] - seen[0][j]).norm(), 1e-9);
    if (t < 60) continue;
    late.push_back(out);
    for (size_t j = 0; j < kJoints; ++j) {
      off_before += (seen[t][j] - figure()[j]).norm();
      off_after += (out[j] - figure()[j]).norm();
    }
  }
  const auto spread = metrics::bone_length_spread(late);
  for (const double sd : *spread) EXPECT_LT(sd, 0.001);
  EXPECT_LT(off_after, off_before);
}

TEST(SteadyBones, AnUncertainJointGivesWay) {
  SteadyBones bones;
  std::array<double, kJoints> uncertainty;
  uncertainty.fill(0.002);
  for (int t = 0; t < 50; ++t) bones(figure(), uncertainty);
  Joints off = figure();
  off[kLeftWrist] += 0.05 * (off[kLeftWrist] - off[kLeftElbow]).normalized();
  uncertainty[kLeftWrist] = 0.05;
  const Joints out = bones(off, uncertainty);
  EXPECT_LT((out[kLeftElbow] - figure()[kLeftElbow]).norm(), 1e-3);
  EXPECT_LT((out[kLeftWrist] - figure()[kLeftWrist]).norm(), 2e-3);
}

}  // namespace
}  // namespace restage
