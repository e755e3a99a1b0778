// What --bones FILE names must hang together as a person does (check_asked()).
#include <gtest/gtest.h>

#include "datasets/importers/motions/source_motion.h"
#include "datasets/importers/rigs/profiles.h"
#include "tests/datasets/rig_lists_games.h"
#include "tests/datasets/rig_lists_studios.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using test::BuiltRig;
using test::RigBuilder;
using test::RigList;

/// A profile that names all bones of joints that the skeleton has.
Profile naming(const SourceSkeleton& skeleton, const std::array<int, kJoints>& bones) {
  std::string yaml = "title: Mine\njoints:\n";
  for (size_t j = 0; j < kJoints; ++j)
    if (bones[j] >= 0)
      yaml += "  " + std::string(kJointNames[j]) + ": '" +
              skeleton.names[static_cast<size_t>(bones[j])] + "'\n";
  return parse_profile(yaml, "mine.yaml");
}
std::string asked_says(const SourceSkeleton& skeleton, const std::array<int, kJoints>& bones) {
  const Profile profile = naming(skeleton, bones);
  return test::error_of([&] { name_joints(skeleton, "x.bvh", &profile); });
}
void expect_taken(const SourceSkeleton& skeleton, const std::array<int, kJoints>& bones) {
  const Profile profile = naming(skeleton, bones);
  const NamedJoints found = name_joints(skeleton, "x.bvh", &profile);
  for (const int j : {1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21})
    EXPECT_EQ(found.map[j].joint, bones[static_cast<size_t>(j)]) << kJointNames[j];
}
std::array<int, kJoints> crossed_at(std::array<int, kJoints> bones, size_t left) {
  std::swap(bones[left], bones[left + 1]);
  return bones;
}

/// The same bones in the same places beside each other, on a root. With `places` all positions
/// stand in the offsets, else only in position channels.
SourceSkeleton beside_each_other(const SourceSkeleton& s, bool places) {
  const std::vector<Vec3> zero = zero_positions(s);
  SourceSkeleton out;
  out.add("World", -1, Vec3::Zero());
  for (size_t b = 0; b < s.size(); ++b)
    out.add(s.names[b], 0, places ? zero[b] : Vec3(Vec3::Zero()));
  return out;
}

constexpr size_t kOfLimbs[] = {1, 4, 7, 10, 13, 16, 18, 20};  // of the left

TEST(ImportersAsked, SidesCrossedWithinALimbAreRefused) {
  size_t tried = 0;
  for (const auto* lists : {&test::rigs_of_games(), &test::rigs_of_studios()})
    for (const RigList& list : *lists) {
      const BuiltRig rig = RigBuilder(list).built();
      expect_taken(rig.skeleton, rig.bone);
      for (const size_t j : kOfLimbs) {
        if (rig.bone[j] < 0) continue;
        const std::string says = asked_says(rig.skeleton, crossed_at(rig.bone, j));
        EXPECT_HAS(says, ", hangs on the bone for ") << list.name << " " << kJointNames[j];
        EXPECT_HAS(says, "correct the names in the file of bones");
        ++tried;
      }
    }
  EXPECT_GT(tried, 200u);
  const BuiltRig mixamo = RigBuilder(test::rigs_of_studios()[0]).built();
  EXPECT_HAS(asked_says(mixamo.skeleton, crossed_at(mixamo.bone, 4)),
             "the bone for left_knee, 'RightLeg', hangs on the bone for right_hip, 'RightUpLeg'");
}

/// A joint of another part of the body: a hand for the head, the neck for a knee.
TEST(ImportersAsked, JointsOfOtherPartsAreRefused) {
  const BuiltRig rig = RigBuilder(test::rigs_of_studios()[0]).built();
  const auto bone = [&](const std::string& name) {
    const auto& names = rig.skeleton.names;
    return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  std::array<int, kJoints> bones = rig.bone;
  bones[15] = bone("LeftHandThumb1");
  EXPECT_HAS(asked_says(rig.skeleton, bones),
             "the bone for head, 'LeftHandThumb1', hangs on the bone");
  bones[15] = bone("Spine2");
  bones[9] = -1;
  EXPECT_HAS(asked_says(rig.skeleton, bones), "hangs on the bone for head, 'Spine2'");
  bones = rig.bone;
  bones[12] = -1;
  bones[4] = bone("Neck");
  EXPECT_HAS(asked_says(rig.skeleton, bones), "left_knee, 'Neck'");
  bones = rig.bone;
  std::swap(bones[4], bones[7]);
  EXPECT_HAS(asked_says(rig.skeleton, bones), "hangs on the bone for left_ankle, 'LeftLeg'");
}

/// Where nothing hangs on anything, rest positions tell the sides apart; where these are not known
/// either, what is named is taken.
TEST(ImportersAsked, BonesBesideEachOtherGoByTheirPlaces) {
  const BuiltRig rig = RigBuilder(test::rigs_of_studios()[0]).built();
  std::array<int, kJoints> bones = rig.bone;
  for (int& b : bones) ++b;  // the root
  const SourceSkeleton skeleton = beside_each_other(rig.skeleton, true);
  expect_taken(skeleton, bones);
  for (const size_t j : {size_t{4}, size_t{7}, size_t{18}, size_t{20}})
    EXPECT_HAS(asked_says(skeleton, crossed_at(bones, j)), "left and right are exchanged");
  EXPECT_HAS(asked_says(skeleton, crossed_at(bones, 4)), "left_knee, 'RightLeg'");
  expect_taken(beside_each_other(rig.skeleton, false), crossed_at(bones, 4));
}

}  // namespace
}  // namespace restage
