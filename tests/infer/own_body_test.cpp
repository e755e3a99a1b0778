// A person's own body from some clouds explains others: with the true poses exactly where points
// follow one joint, with wrong poses not.
#include "infer/own_body.h"

#include <gtest/gtest.h>

#include "autograd/base/rng.h"
#include "datasets/corpus.h"
#include "datasets/sampling/evaluation.h"

namespace restage {
namespace {

/// Vertices of a body of the built-in source performing a motion, with its true joints.
struct Performed {
  Points cloud;
  SeenJoints seen;
};

Performed frame_of(const Body& body, const Motion& motion, size_t t, bool turns) {
  const Pose pose = pose_on(motion, body, t);
  const PosedSkeleton posed = forward_kinematics(body.joints, pose);
  Performed out{linear_blend_skinning(body, pose), SeenJoints(posed.joints)};
  if (turns) out.seen.turns = posed.global;
  return out;
}

class OwnBodyTest : public ::testing::TestWithParam<bool> {};

TEST_P(OwnBodyTest, ExplainsOtherFramesOfTheSamePerson) {
  const Corpus corpus = load_corpus({}, "test");
  const Body& body = corpus.bodies[0];
  const Motion& motion = corpus.motions[0];
  OwnBody own;
  for (size_t t = 0; t < motion.frames(); t += motion.frames() / 6) {
    const Performed at = frame_of(body, motion, t, GetParam());
    own.add(at.cloud, at.seen);
  }
  const Performed other = frame_of(body, motion, motion.frames() / 2 + 3, GetParam());
  const double right = own.distance(other.cloud, other.seen);
  EXPECT_LT(right, 0.012);
  SeenJoints wrong = other.seen;
  wrong.joints[kLeftElbow] += Vec3(0, 0.15, 0);
  wrong.joints[kLeftWrist] += Vec3(0, 0.3, 0);
  EXPECT_GT(own.distance(other.cloud, wrong), 1.4 * right);
}

INSTANTIATE_TEST_SUITE_P(All, OwnBodyTest, ::testing::Bool(), [](const auto& param) {
  return param.param ? "ByRotations" : "ByTheClosedForm";
});

}  // namespace
}  // namespace restage
