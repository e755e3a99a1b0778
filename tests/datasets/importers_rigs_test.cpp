// Finding a person in bones of any make: skeletons as programs name them (rig_lists.h), each plain
// and decorated in the ways that files come in; what must be refused.
#include <gtest/gtest.h>

#include <cctype>

#include "datasets/importers/motions/source_motion.h"
#include "datasets/importers/rigs/find_joints.h"
#include "datasets/importers/rigs/joint_fit.h"
#include "tests/datasets/rig_lists_games.h"
#include "tests/datasets/rig_lists_more.h"
#include "tests/datasets/rig_lists_studios.h"
#include "tests/datasets/rig_lists_words.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using test::BuiltRig;
using test::RigBuilder;
using test::RigList;

std::vector<RigList> rig_lists() {
  std::vector<RigList> out = test::rigs_of_games();
  for (const auto* more :
       {&test::rigs_of_studios(), &test::rigs_of_others(), &test::rigs_of_words()})
    out.insert(out.end(), more->begin(), more->end());
  return out;
}
BuiltRig rig(const std::string& name) {
  for (const RigList& list : rig_lists())
    if (name == list.name) return RigBuilder(list).built();
  throw std::runtime_error("no list " + name);
}
BuiltRig rig_of(const char* left, const char* right, const char* bones) {
  return RigBuilder({"", left, right, bones}).built();
}

/// Every joint of the list is found at its bone, every other one is placed.
void expect_right(const BuiltRig& rig, const std::string& what) {
  NamedJoints found;
  try {
    found = name_joints(rig.skeleton, "x.bvh");
  } catch (const InputError& error) {
    ADD_FAILURE() << what << ": " << error.what();
    return;
  }
  // Where the legs hang on a bone below the pelvis, that one turns it.
  const SourceJoint& pelvis = found.map[0];
  const std::vector<Vec3> zero = zero_positions(rig.skeleton);
  EXPECT_TRUE(hangs_on(rig.skeleton, pelvis.joint, rig.bone[0])) << what;
  EXPECT_LT((zero[pelvis.joint] + pelvis.offset - zero[rig.bone[0]]).norm(), 1e-12) << what;
  for (size_t j = 1; j < kJoints; ++j) {
    const bool placed = std::find(found.placed.begin(), found.placed.end(), static_cast<int>(j)) !=
                        found.placed.end();
    EXPECT_EQ(placed, rig.bone[j] < 0) << what << ": " << kJointNames[j];
    if (rig.bone[j] < 0 || placed) continue;
    const auto& names = rig.skeleton.names;
    EXPECT_EQ(names[static_cast<size_t>(found.map[j].joint)],
              names[static_cast<size_t>(rig.bone[j])])
        << what << ": " << kJointNames[j];
    EXPECT_EQ(found.map[j].joint, rig.bone[j]) << what << ": " << kJointNames[j];
  }
}

std::string refusal(const BuiltRig& rig) {
  return restage::test::error_of([&] { name_joints(rig.skeleton, "x.bvh"); });
}

using Change = std::function<void(SourceSkeleton&)>;

Change renamed(const std::function<std::string(const std::string&, size_t)>& as) {
  return [as](SourceSkeleton& s) {
    for (size_t b = 0; b < s.size(); ++b) s.names[b] = as(s.names[b], b);
  };
}
Change before(const std::string& text) {
  return renamed([text](const std::string& name, size_t) { return text + name; });
}
Change after(const std::string& text) {
  return renamed([text](const std::string& name, size_t) { return name + text; });
}

/// A root above all.
void add_root(SourceSkeleton& s, const std::string& name) {
  SourceSkeleton out;
  out.add(name, -1, Vec3::Zero());
  for (size_t b = 0; b < s.size(); ++b) out.add(s.names[b], s.parents[b] + 1, s.offsets[b]);
  s = out;
}

struct Decoration {
  const char* name;
  Change change;
  int moved = 0;  ///< by how much the bones' numbers grow
};

const std::vector<Decoration>& decorations() {
  static const std::vector<Decoration> all = {
      {"plain", [](SourceSkeleton&) {}},
      {"mixamorig:", before("mixamorig:")},
      {"mixamorig", before("mixamorig")},
      {"mixamorig1:", before("mixamorig1:")},
      {"mixamorig_", before("mixamorig_")},
      {"a prefix of two parts", before("Skeleton_001_")},
      {"a prefix of three parts", before("Actor_02_Body_")},
      {"a prefix that names a part", before("HeadRig_")},
      {"a long namespace", before("Session_2024_03_12_Take_004_Performer_0001_LeftHand:")},
      {"two namespaces", before("scene:ann:")},
      {"an armature's path", before("Armature|")},
      {".001", after(".001")},
      {"_jnt", after("_jnt")},
      {"_ctrl", after("_ctrl")},
      {"_end", after("_end")},
      {"_R, whichever side", after("_R")},
      {"CTRL_", before("CTRL_")},
      {"_bind.001", after("_bind.001")},
      {"numbers as Sketchfab's, without one at the root",
       [](SourceSkeleton& s) {
         for (size_t b = 0; b < s.size(); ++b) s.names[b] += "_0" + std::to_string(b + 1);
         add_root(s, "_rootJoint");
       },
       1},
      {"a prefix and numbers",
       [](SourceSkeleton& s) {
         for (size_t b = 0; b < s.size(); ++b)
           s.names[b] = "Character1_" + s.names[b] + "_" + std::to_string(b);
       }},
      {"lower case", renamed([](std::string name, size_t) {
         for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
         return name;
       })},
      {"an armature above", [](SourceSkeleton& s) { add_root(s, "Armature"); }, 1},
      {"bones of another kind beside", [](SourceSkeleton& s) {
         const int last = static_cast<int>(s.size()) - 1;
         s.add("sword_joint", last, Vec3(0, 0.1, 0));
         s.add("Cube.003", 0, Vec3(0, 0.1, 0));
         s.add("ik_hand_l", 0, Vec3(0, 0.1, 0));
       }}};
  return all;
}

TEST(ImportersRigs, EveryFamilyIsFoundInEveryDecoration) {
  ASSERT_GE(rig_lists().size(), 25u);
  for (const RigList& list : rig_lists()) {
    const BuiltRig plain = RigBuilder(list).built();
    for (const Decoration& decoration : decorations()) {
      BuiltRig rig = plain;
      decoration.change(rig.skeleton);
      for (int& bone : rig.bone) bone += bone >= 0 ? decoration.moved : 0;
      // "lfemurX" is two words by its capital alone.
      if (list.name == std::string("jedi academy") &&
          decoration.name == std::string("lower case")) {
        EXPECT_HAS(refusal(rig), "left_hip");
      } else {
        expect_right(rig, std::string(list.name) + ", " + decoration.name);
      }
    }
  }
}

/// One bone's own decoration changes nothing, whichever bone it is.
TEST(ImportersRigs, OneOddBoneBesideGoodOnesIsFoundToo) {
  const BuiltRig plain = rig("mixamo");
  for (const int bone : plain.bone)
    for (const char* end : {".001", "_01", "_jnt"}) {
      BuiltRig odd = plain;
      odd.skeleton.names[static_cast<size_t>(bone)] += end;
      expect_right(odd, odd.skeleton.names[static_cast<size_t>(bone)]);
    }
}

/// One bone of an unknown name, whichever it is: refused, or everything else is still right.
TEST(ImportersRigs, AnUnknownBoneMakesNoOtherOneWrong) {
  size_t refused = 0, found = 0;
  for (const RigList& list : rig_lists()) {
    const BuiltRig plain = RigBuilder(list).built();
    for (size_t damaged = 1; damaged < kJoints; ++damaged) {
      if (plain.bone[damaged] < 0 || damaged == 12) continue;  // of two necks either will do
      BuiltRig rig = plain;
      rig.skeleton.names[static_cast<size_t>(plain.bone[damaged])] = "Thing";
      NamedJoints joints;
      try {
        joints = name_joints(rig.skeleton, "x.bvh");
      } catch (const InputError&) {
        ++refused;
        continue;
      }
      ++found;
      const std::vector<Vec3> places = zero_positions(rig.skeleton);
      for (size_t j = 0; j < kJoints; ++j) {
        const bool toe = damaged == j && (j == 10 || j == 11);  // optional: placed without it
        if (rig.bone[j] < 0 || toe) continue;
        const auto at = static_cast<size_t>(joints.map[j].joint);
        const Vec3 place = places[at] + joints.map[j].offset;
        EXPECT_LT((place - places[static_cast<size_t>(rig.bone[j])]).norm(), 1e-9)
            << list.name << " without " << kJointNames[damaged] << ": " << kJointNames[j] << " is "
            << rig.skeleton.names[at];
      }
    }
  }
  EXPECT_GT(refused, 300u);
  EXPECT_GT(found, 150u);
}

/// What is not certain is refused, with what is missing in the first place.
TEST(ImportersRigs, NobodyIsGuessed) {
  const BuiltRig mixamo = rig("mixamo");
  const auto without = [&](const std::string& name, const std::string& now) {
    BuiltRig out = mixamo;
    for (std::string& bone : out.skeleton.names)
      if (bone == name) bone = now;
    return refusal(out);
  };
  EXPECT_HAS(without("LeftUpLeg", "LeftUpLegg"), "left_hip (is it 'LeftUpLegg'?)");
  EXPECT_HAS(without("LeftForeArm", "bone"), "left_elbow");
  EXPECT_HAS(without("Head", "bone"), "head");
  EXPECT_HAS(without("RightHand", "bone"), "right_wrist");
  for (const char* name : {"LeftForeArm", "Head", "RightHand"}) {
    const std::string says = without(name, "bone");
    EXPECT_HAS(says, "bones");
    EXPECT_EQ(says.find("profile"), std::string::npos) << says;  // no nearest family
    EXPECT_LT(says.size(), 380u);
  }
  BuiltRig nameless = mixamo;
  for (size_t b = 0; b < nameless.skeleton.size(); ++b)
    nameless.skeleton.names[b] = "joint_" + std::to_string(b);
  EXPECT_HAS(refusal(nameless), "none of its");
  EXPECT_HAS(refusal(nameless), "'joint_0'");
  for (std::string& name : nameless.skeleton.names) name.clear();
  EXPECT_HAS(refusal(nameless), "no names");
}

TEST(ImportersRigs, WhatOnlyLooksLikeAPersonIsRefused) {
  const BuiltRig horse = rig_of("L", "R", R"(
Root Hips Spine Chest Neck Head
Hips Back_UpperLeg_@ Back_LowerLeg_@ Back_Foot_@
Hips Tail1
Chest Front_UpperLeg_@ Front_LowerLeg_@ Front_Foot_@
)");
  EXPECT_HAS(refusal(horse), "left_shoulder");
  const BuiltRig arm_of_two = rig_of("Left", "Right", R"(
Hips Spine Chest Neck Head
Hips @UpLeg @Leg @Foot
Chest @Shoulder @Arm @Hand
)");
  EXPECT_HAS(refusal(arm_of_two), "left_elbow");  // no shoulder is made an upper arm
  const BuiltRig legs_by_number = rig_of("L", "R", R"(
Hips Spine Head
Hips Leg_@_01 Leg_@_02 Leg_@_03
Spine UpperArm_@ Forearm_@ Hand_@
)");
  EXPECT_HAS(refusal(legs_by_number), "left_knee");
  const BuiltRig arm_of_three = rig_of("L", "R", R"(
Hips Spine Chest Head
Hips t:Thigh_@ k:Shin_@ a:Foot_@
Chest c:Arm1_@ s:Arm2_@ e:Arm3_@ w:Hand_@
)");
  EXPECT_HAS(refusal(arm_of_three), "left_elbow");  // a collar is no upper arm
  const BuiltRig no_head = rig_of("L", "R", R"(
Hips Spine Spine1 Spine2 Spine3 Thing
Hips Thigh_@ Shin_@ Foot_@
Spine1 UpperArm_@ Forearm_@ Hand_@
)");
  EXPECT_HAS(refusal(no_head), "head");
  const BuiltRig four_arms = rig_of("L", "R", R"(
Hips Spine Chest Head
Hips Thigh_@ Shin_@ Foot_@
Chest A_UpperArm_@ A_Forearm_@ A_Hand_@
Chest B_UpperArm_@ B_Forearm_@ B_Hand_@
)");
  EXPECT_HAS(refusal(four_arms), "two of its limbs may be the left arm");
  const BuiltRig apart = rig_of("L", "R", R"(
Root Hips
Root Spine Chest
Root Head
Root UpperArm_@
Root Forearm_@
Root Hand_@
Root Thigh_@
Root Shin_@
Root Foot_@
)");
  EXPECT_HAS(refusal(apart), "do not hang on each other");
  BuiltRig giant_shin = rig("bandai namco");
  for (size_t b = 0; b < giant_shin.skeleton.size(); ++b)
    if (giant_shin.skeleton.names[b].starts_with("Foot")) giant_shin.skeleton.offsets[b] *= 20;
  EXPECT_HAS(refusal(giant_shin), "lengths");
}

TEST(ImportersRigs, OfManyCountedBonesTheOneThatBendsIsTheElbow) {
  for (const bool bent : {true, false}) {
    BuiltRig rig = rig_of("L", "R", R"(
p:spine_C0_0 1:spine_C0_1 3:spine_C0_2 n:neck_C0_0 h:neck_C0_head
spine_C0_0 t:leg_@0_0 leg_@0_1 k:leg_@0_2 leg_@0_3 a:leg_@0_end f:foot_@0_0
spine_C0_2 c:shoulder_@0_0 s:arm_@0_0 arm_@0_1 e:arm_@0_2 arm_@0_3 w:arm_@0_end
)");
    SourceSkeleton& s = rig.skeleton;
    for (size_t b = 0; b + 1 < s.size(); ++b) {
      if (!s.names[b].ends_with("0_1") && !s.names[b].ends_with("0_3")) continue;
      if (s.names[b].starts_with("spine")) continue;
      Vec3 whole = s.offsets[b] + s.offsets[b + 1];  // what it halves
      if (bent && s.names[b].starts_with("arm") && s.names[b].ends_with("3")) whole.z() += 0.05;
      s.offsets[b] = s.offsets[b + 1] = 0.5 * whole;
    }
    if (bent)
      expect_right(rig, "mgear with divided limbs");
    else
      EXPECT_HAS(refusal(rig), "left_elbow");
  }
}

TEST(ImportersRigs, TwoPeopleInOneFileAreRefused) {
  for (const char* name : {"mixamo", "vroid", "character creator 4"}) {
    const BuiltRig one = rig(name);
    SourceSkeleton two;
    two.add("World", -1, Vec3::Zero());
    for (int person = 0; person < 2; ++person) {
      const int first = static_cast<int>(two.size());
      for (size_t b = 0; b < one.skeleton.size(); ++b) {
        const int parent = one.skeleton.parents[b];
        two.add(person == 0 ? one.skeleton.names[b] : one.skeleton.names[b] + ".001",
                parent < 0 ? 0 : parent + first, one.skeleton.offsets[b]);
      }
    }
    EXPECT_HAS(refusal({two, {}}), "holds 2 characters");
  }
}

/// Which of many spine bones is spine3: the one that carries collars and neck, always.
TEST(ImportersRigs, TheLastOfAnyNumberOfSpineBonesCarriesTheArms) {
  for (int count = 1; count <= 9; ++count) {
    SourceSkeleton s;
    s.add("Hips", -1, Vec3::Zero());
    for (int i = 0; i < count; ++i)
      s.add(i == 0 ? "Spine" : "Spine" + std::to_string(i), i, Vec3(0, 0.4 / count, 0));
    const int chest = count;
    const auto chain = [&](std::vector<std::string> names, int on, const Vec3& step) {
      for (const std::string& name : names) {
        s.add(name, on, step);
        on = static_cast<int>(s.size()) - 1;
      }
    };
    chain({"Neck", "Head"}, chest, Vec3(0, 0.1, 0));
    for (const std::string side : {"Left", "Right"}) {
      const double x = side == "Left" ? 1 : -1;
      chain({side + "Shoulder", side + "Arm", side + "ForeArm", side + "Hand"}, chest,
            Vec3(0.2 * x, 0, 0));
      chain({side + "UpLeg", side + "Leg", side + "Foot", side + "ToeBase"}, 0,
            Vec3(0.05 * x, -0.4, 0.01));
    }
    const NamedJoints found = name_joints(s, "x.bvh");
    EXPECT_EQ(found.map[3].joint, 1) << count;
    if (count > 1) {
      EXPECT_EQ(found.map[9].joint, chest) << count;
      EXPECT_EQ(found.map[9].offset, Vec3(Vec3::Zero())) << count;
      EXPECT_LT(found.map[3].joint, found.map[9].joint) << count;
    }
    if (count > 2) {
      EXPECT_LT(found.map[3].joint, found.map[6].joint) << count;
      EXPECT_LT(found.map[6].joint, found.map[9].joint) << count;
    }
  }
}

/// Spine bones in one place are one joint: Second Life's go up and come back, GTA's spine begins on
/// the pelvis.
TEST(ImportersRigs, SpineBonesInOnePlaceAreOneJoint) {
  const BuiltRig second_life = rig_of("Left", "Right", R"(
p:mPelvis mSpine1 mSpine2 1:mTorso mSpine3 mSpine4 3:mChest n:mNeck h:mHead
mPelvis t:mHip@ k:mKnee@ a:mAnkle@ mFoot@ f:mToe@
mChest c:mCollar@ s:mShoulder@ e:mElbow@ w:mWrist@
)");
  BuiltRig folded = second_life;
  SourceSkeleton& s = folded.skeleton;
  const Vec3 torso(0, 0.1, 0), chest(0, 0.25, 0);
  const Vec3 steps[] = {torso, -torso, torso, chest, -chest, chest};
  for (size_t b = 1; b <= 6; ++b) s.offsets[b] = steps[b - 1];
  expect_right(folded, "Second Life's folded spine");
  BuiltRig gta = rig_of("L", "R", R"(
SKEL_ROOT p:SKEL_Pelvis
SKEL_ROOT SKEL_Spine_Root 1:SKEL_Spine0 SKEL_Spine1 2:SKEL_Spine2 3:SKEL_Spine3 h:SKEL_Head
SKEL_Pelvis t:SKEL_@_Thigh k:SKEL_@_Calf a:SKEL_@_Foot f:SKEL_@_Toe0
SKEL_Spine3 c:SKEL_@_Clavicle s:SKEL_@_UpperArm e:SKEL_@_Forearm w:SKEL_@_Hand
)");
  for (size_t b = 0; b < gta.skeleton.size(); ++b)
    if (gta.skeleton.names[b] == "SKEL_Spine_Root")
      gta.skeleton.offsets[b] = gta.skeleton.offsets[static_cast<size_t>(gta.bone[0])];
  expect_right(gta, "a spine's root on the pelvis");
}

/// How far these joints of a pose's turns, put on the middle of its hips, are from its points,
/// metres.
double off_its_points(const PosedSkeleton& pose, const Joints& rest,
                      const std::vector<int>& joints) {
  const Pose turns{to_local(pose.global), Vec3::Zero()};
  const Joints made = forward_kinematics(rest, turns).joints;
  const Vec3 moved = 0.5 * (pose.joints[1] + pose.joints[2] - made[1] - made[2]);
  double out = 0;
  for (const int j : joints) out = std::max(out, (made[j] + moved - pose.joints[j]).norm());
  return out;
}
const std::vector<int> kLimbs = {1,  2,  4,  5,  7,  8,  10, 11,
                                 15, 16, 17, 18, 19, 20, 21};  // and the head
const std::vector<int> kOfTrunk = {3, 6, 9, 12, 13, 14};

struct Seen {
  double before = 0, limbs = 0, trunk = 0;  ///< off_its_points(): of all before JointFit, after it
  std::vector<std::string> remarks;         ///< of JointFit
};
/// A skeleton's pose in which bone b is turned by `turn(b)`.
template <class Turn>
Seen seen_in(const SourceSkeleton& skeleton, const Turn& turn) {
  const NamedJoints found = name_joints(skeleton, "x.bvh");
  const Joints rest = rest_joints(skeleton, found.map);
  SourceMotion motion;
  motion.skeleton = skeleton;
  motion.position = {{}};
  motion.local.resize(1);
  for (size_t b = 0; b < skeleton.size(); ++b) motion.local[0].push_back(turn(b));
  PosedSkeleton pose = source_pose(motion, found.map, 0);
  Seen out;
  out.before = std::max(off_its_points(pose, rest, kLimbs), off_its_points(pose, rest, kOfTrunk));
  JointFit fit(rest);
  fit.turn(pose);
  ImportReport report;
  fit.report(report);
  out.limbs = off_its_points(pose, rest, kLimbs);
  out.trunk = off_its_points(pose, rest, kOfTrunk);
  out.remarks = report.remarks;
  return out;
}

/// Bones of the trunk that are left out turn too; joints are where they are in the file all the
/// same, or the report says that they are not.
TEST(ImportersRigs, BonesLeftOutOfTheTrunkMoveNoJoint) {
  int shown = 0;
  for (const RigList& list : rig_lists()) {
    const BuiltRig built = RigBuilder(list).built();
    const Seen seen = seen_in(built.skeleton, [](size_t b) {  // every bone, up to 17 degrees
      return Quat(Eigen::AngleAxisd(0.3 * std::sin(1.7 * static_cast<double>(b)),
                                    Vec3(1, 0.3, std::cos(static_cast<double>(b))).normalized()));
    });
    shown += seen.before > 0.02;
    EXPECT_LT(seen.limbs, 0.015) << list.name;
    EXPECT_LT(seen.trunk, 0.04) << list.name;
    EXPECT_EQ(!seen.remarks.empty(), std::max(seen.limbs, seen.trunk) > 0.02) << list.name;
  }
  EXPECT_GT(shown, 10);
}

/// The skeleton with one bone more on the way to `below`, halfway.
SourceSkeleton with_bone_above(const SourceSkeleton& s, const std::string& below) {
  SourceSkeleton out;
  std::vector<int> at;
  for (size_t b = 0; b < s.size(); ++b) {
    int parent = s.parents[b] < 0 ? -1 : at[static_cast<size_t>(s.parents[b])];
    Vec3 offset = s.offsets[b];
    if (s.names[b] == below) {
      out.add("Extra", parent, 0.5 * offset);
      parent = static_cast<int>(out.size()) - 1;
      offset *= 0.5;
    }
    at.push_back(static_cast<int>(out.size()));
    out.add(s.names[b], parent, offset);
  }
  return out;
}

/// What is off, at most, when one bone alone is turned by 30 degrees about each axis.
Seen turned_alone(const SourceSkeleton& skeleton, const std::string& bone) {
  Seen worst;
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}) {
    const Seen seen = seen_in(skeleton, [&](size_t b) {
      return Quat(Eigen::AngleAxisd(skeleton.names[b] == bone ? M_PI / 6 : 0, axis));
    });
    worst.before = std::max(worst.before, seen.before);
    worst.limbs = std::max(worst.limbs, seen.limbs);
    worst.trunk = std::max(worst.trunk, seen.trunk);
    worst.remarks.insert(worst.remarks.end(), seen.remarks.begin(), seen.remarks.end());
  }
  return worst;
}

/// Legs on the spine, arms on the neck, legs on a bone beside the spine; one bone more anywhere in
/// trunk, arms and legs.
TEST(ImportersRigs, BonesThatHangElsewhereTurnTheBody) {
  const Seen spine = turned_alone(rig("3ds max biped").skeleton, "Bip001 Spine");
  EXPECT_LT(std::max(spine.limbs, spine.trunk), 1e-6);
  for (const char* below : {"Spine1", "Spine2", "Neck", "Head", "LeftShoulder", "LeftForeArm",
                            "LeftHand", "RightUpLeg", "RightLeg", "RightFoot"}) {
    const Seen more = turned_alone(with_bone_above(rig("mixamo").skeleton, below), "Extra");
    EXPECT_GT(more.before, 0.01) << below;
    EXPECT_LT(std::max(more.limbs, more.trunk), 0.022) << below;
  }
  // Daz's pelvis turns beside the spine, and a neck takes the collars with it, which no turn of the
  // 22 joints can: said, and arms and legs are as near as bones of one length come.
  const Seen pelvis = turned_alone(rig("daz genesis 8").skeleton, "pelvis");
  EXPECT_LT(pelvis.limbs, 0.02);
  ASSERT_FALSE(pelvis.remarks.empty());
  EXPECT_HAS(pelvis.remarks[0], "the spine1 is up to 0.0");
  const Seen neck = turned_alone(rig("3ds max biped").skeleton, "Bip001 Neck");
  EXPECT_LT(neck.limbs, 0.032);
  ASSERT_FALSE(neck.remarks.empty());
  EXPECT_HAS(neck.remarks[0], "_collar is up to 0.0");
}

/// A missing toe is put where a person's is: before the ankle and below it.
TEST(ImportersRigs, MissingToesArePlacedAhead) {
  const BuiltRig kaykit = rig("vrm without upper chest, neck, collars and toes");
  const Joints rest = rest_joints(kaykit.skeleton, name_joints(kaykit.skeleton, "x").map);
  for (const int ankle : {7, 8}) {
    const Vec3 toe = rest[ankle + 3] - rest[ankle];
    EXPECT_GT(toe.z(), 0.08);
    EXPECT_LT(toe.z(), 0.2);
    EXPECT_LT(toe.y(), -0.03);
  }
}

TEST(ImportersRigs, NamesInOtherEncodingsAreTold) {
  const auto with_head = [](const std::string& head) {
    BuiltRig out = rig("mixamo");
    for (std::string& name : out.skeleton.names)
      if (name == "Head") name = head;
    return out;
  };
  BuiltRig japanese = with_head("Head");
  japanese.skeleton.names[0] = "\x83\x5A\x83\x93\x83\x5E\x81\x5B";  // "Center" in Shift-JIS
  expect_right(japanese, "the pelvis needs no name");
  EXPECT_HAS(refusal(with_head("\x93\xAA")), "Shift-JIS");
  EXPECT_HAS(refusal(with_head("\x93\xAA")), "iconv -f SHIFT_JIS");
  const std::string french = refusal(with_head("T\xEAte"));  // Latin-1
  EXPECT_HAS(french, "Latin-1");
  EXPECT_HAS(french, "iconv -f LATIN1");
  EXPECT_EQ(french.find("Shift-JIS"), std::string::npos) << french;
  const std::string chinese = refusal(with_head("\xD7\xF3\xCA\xD6"));  // GBK: both are named
  EXPECT_HAS(chinese, "may be Latin-1 (Western European), Shift-JIS (Japanese) or another");
}

}  // namespace
}  // namespace restage
