// What the name of a bone says: its words, in all languages, without decoration.
#include <gtest/gtest.h>

#include "datasets/importers/rigs/bone_words.h"

namespace restage {
namespace {

TEST(ImportersWords, OfNames) {
  const auto is = [](const char* name, BonePart part, BoneWords::Side side, bool helper = false) {
    const BoneWords words = bone_words(name);
    EXPECT_EQ(static_cast<int>(words.part), static_cast<int>(part)) << name;
    EXPECT_EQ(words.side, side) << name;
    EXPECT_EQ(words.helper, helper) << name;
  };
  using enum BonePart;
  const auto left = BoneWords::left, right = BoneWords::right, middle = BoneWords::middle;
  is("LeftUpLeg", thigh, left);
  is("mixamorig:LeftLeg", leg, left);
  is("thigh.R", thigh, right);
  is("b_l_foot_toe", toe, left);
  is("LUArm", upper_arm, left);
  is("arm_lower_R", forearm, right);
  is("RThigh_012", thigh, right);
  is("lfemur", thigh, left);
  is("lLeg", leg, left);
  is("l_lleg", shin, left);
  is("RLArm", forearm, right);
  is("r_uleg", thigh, right);
  is("arm_L0_end", arm, left, true);
  is("Bip01 L Toe0", toe, left);
  is("左足首", ankle, left);
  is("上半身2", spine, middle);
  is("CC_Base_L_ThighTwist01", thigh, left, true);
  is("LeftHandThumb1", hand, left, true);
  is("ik_foot_l", foot, left, true);
  is("HeadTop_End", head, middle, true);
  is("J_Sec_Hair1_01", none, middle, true);
  is("Chip", none, middle);  // no hip
  is("Alarm", none, middle);
  is("LeftRightHand", hand, right, true);  // both sides: neither
  is("lf_hip", hip, left);
  is("RtKnee", shin, right);
  is("lft_upArm", upper_arm, left);
  is("rgt_wrist", hand, right);
  EXPECT_LT(bone_words("hand_l").cost, bone_words("hand_weapon_l").cost + 1);
  EXPECT_EQ(bone_words("arm_L0_1").last_number, 1);
  EXPECT_EQ(bone_words("main_G", 0).part, none);
  EXPECT_EQ(bone_words("main_G", 2).part, hand);  // French
  EXPECT_EQ(bone_words("Schlüsselbein_L", 1).part, collar);
  EXPECT_EQ(bone_words("ПЛЕЧО", 9).part, shoulder);
  EXPECT_EQ(bone_words("左ﾋｯﾌﾟ", 7).part, hip);  // kana of half width
  EXPECT_EQ(bone_words("ﾍｯﾄﾞ", 7).part, head);
  EXPECT_EQ(bone_words("左足ＩＫ").helper, true);
  EXPECT_EQ(bone_words("Ｌｅｆｔ＿Ａｒｍ").side, left);
  // Fingers or toes: the name says it, or where the bone hangs.
  EXPECT_EQ(bone_words("dedos_pie", 3).part, toe);
  EXPECT_FALSE(bone_words("dedos_pie", 3).helper);
  EXPECT_TRUE(bone_words("dedos_mano", 3).helper);
  EXPECT_TRUE(bone_words("dedos", 3).digit);
  EXPECT_EQ(bone_words("엄지발가락_왼", 8).part, toe);
  EXPECT_TRUE(bone_words("엄지손가락_왼", 8).helper);
  EXPECT_EQ(bone_words("左足親指", 7).part, toe);
  EXPECT_TRUE(bone_words("dedos", 3).helper);
  EXPECT_LT(bone_words("hand_l").cost, bone_words("hand_xyz_l").cost);
  EXPECT_EQ(other_side("LeftUpLeg"), "rightupleg");
  EXPECT_EQ(other_side("thigh.R.001"), "thigh.l.001");
  EXPECT_EQ(other_side("Hips"), "");
}

}  // namespace
}  // namespace restage
