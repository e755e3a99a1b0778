// Skeletons of modelling programs and motion capture, written down from their conventions.
#pragma once

#include "tests/datasets/rig_lists.h"

namespace restage::test {

inline const std::vector<RigList>& rigs_of_studios() {
  static const std::vector<RigList> lists = {
      {"mixamo", "Left", "Right", R"(
p:Hips 1:Spine 2:Spine1 3:Spine2 n:Neck h:Head HeadTop_End
Hips t:@UpLeg k:@Leg a:@Foot f:@ToeBase @Toe_End
Spine2 c:@Shoulder s:@Arm e:@ForeArm w:@Hand @HandThumb1 @HandThumb2
@Hand @HandIndex1
Head LeftEye
)"},
      {"motionbuilder with roll bones and a longer spine", "Left", "Right", R"(
Reference p:Hips 1:Spine Spine1 2:Spine2 3:Spine3 n:Neck Neck1 h:Head
Hips t:@UpLeg k:@Leg a:@Foot f:@ToeBase
@UpLeg @UpLegRoll
@Leg @LegRoll
Spine3 c:@Shoulder s:@Arm e:@ForeArm w:@Hand @HandMiddle1
@Arm @ArmRoll
@ForeArm @ForeArmRoll
)"},
      {"character creator 4", "L", "R", R"(
RL_BoneRoot p:CC_Base_Hip 1:CC_Base_Waist 2:CC_Base_Spine01 3:CC_Base_Spine02
CC_Base_Spine02 n:CC_Base_NeckTwist01 CC_Base_NeckTwist02 h:CC_Base_Head CC_Base_FacialBone
CC_Base_FacialBone CC_Base_JawRoot
CC_Base_Hip CC_Base_Pelvis
CC_Base_Pelvis t:CC_Base_@_Thigh k:CC_Base_@_Calf a:CC_Base_@_Foot f:CC_Base_@_ToeBase
CC_Base_@_ToeBase CC_Base_@_BigToe1
CC_Base_@_Thigh CC_Base_@_ThighTwist01 CC_Base_@_ThighTwist02
CC_Base_@_Calf CC_Base_@_CalfTwist01
CC_Base_@_Calf CC_Base_@_KneeShareBone
CC_Base_@_Foot CC_Base_@_ToeBaseShareBone
CC_Base_@_ToeBase CC_Base_@_IndexToe1
CC_Base_Spine02 c:CC_Base_@_Clavicle s:CC_Base_@_Upperarm e:CC_Base_@_Forearm w:CC_Base_@_Hand
CC_Base_@_Hand CC_Base_@_Mid1
CC_Base_@_Upperarm CC_Base_@_UpperarmTwist01
CC_Base_@_Forearm CC_Base_@_ForearmTwist01
CC_Base_@_Forearm CC_Base_@_ElbowShareBone
CC_Base_Spine02 CC_Base_@_RibsTwist CC_Base_@_Breast
CC_Base_FacialBone CC_Base_@_Eye
)"},
      {"accurig and older character creator", "L", "R", R"(
CC_Base_BoneRoot p:CC_Base_Hip 1:CC_Base_Waist 2:CC_Base_Spine01 3:CC_Base_Spine02
CC_Base_Spine02 n:CC_Base_NeckTwist01 h:CC_Base_Head
CC_Base_Hip t:CC_Base_@_Thigh k:CC_Base_@_Calf a:CC_Base_@_Foot f:CC_Base_@_ToeBase
CC_Base_Spine02 c:CC_Base_@_Clavicle s:CC_Base_@_Upperarm e:CC_Base_@_Forearm w:CC_Base_@_Hand
)"},
      {"daz genesis 8", "l", "r", R"(
Genesis8Female p:hip 1:abdomenLower abdomenUpper 2:chestLower 3:chestUpper n:neckLower neckUpper
neckUpper h:head upperTeeth
hip pelvis
pelvis t:@ThighBend @ThighTwist k:@Shin a:@Foot @Metatarsals f:@Toe @BigToe
@Foot @Heel
chestLower @Pectoral
chestUpper c:@Collar s:@ShldrBend @ShldrTwist e:@ForearmBend @ForearmTwist w:@Hand @Thumb1
@Hand @Carpal1 @Index1
head lowerJaw
head @Eye
)"},
      {"daz genesis 9", "l", "r", R"(
Genesis9 p:hip 1:spine1 spine2 2:spine3 3:spine4 n:neck1 neck2 h:head lowerjaw
hip pelvis
pelvis t:@_thigh k:@_shin a:@_foot f:@_toes @_bigtoe1
@_thigh @_thightwist1
@_thigh @_thightwist2
@_shin @_shintwist1
@_foot @_metatarsals
spine3 @_pectoral
spine4 c:@_shoulder s:@_upperarm e:@_forearm w:@_hand @_thumb1
@_upperarm @_upperarmtwist1
@_forearm @_forearmtwist1
)"},
      {"daz genesis 3 and Poser", "l", "r", R"(
p:hip 1:abdomen 2:abdomen2 3:chest n:neck h:head
hip pelvis
pelvis t:@ThighBend @ThighTwist k:@Shin a:@Foot f:@Toe
chest c:@Collar s:@Shldr e:@ForeArm w:@Hand
)"},
      {"rigify, as modelled", ".L", ".R", R"(
p:spine 1:spine.001 2:spine.002 3:spine.003 n:spine.004 spine.005 h:spine.006 face
spine pelvis@
spine t:thigh@ k:shin@ a:foot@ f:toe@
foot@ heel.02@
spine.003 c:shoulder@ s:upper_arm@ e:forearm@ w:hand@ palm.01@ f_index.01@
hand@ thumb.01@
spine.003 breast@
)"},
      {"rigify, game export", ".L", ".R", R"(
root p:DEF-hips 1:DEF-spine.001 2:DEF-spine.002 3:DEF-spine.003 n:DEF-neck h:DEF-head
DEF-hips t:DEF-thigh@ k:DEF-shin@ a:DEF-foot@ f:DEF-toe@
DEF-spine.003 c:DEF-shoulder@ s:DEF-upper_arm@ e:DEF-forearm@ w:DEF-hand@ DEF-f_index.01@
DEF-hand@ DEF-thumb.01@
)"},
      {"rigify, limbs of two segments", ".L", ".R", R"(
root p:DEF-hips 1:DEF-spine.001 2:DEF-spine.002 3:DEF-spine.003 n:DEF-neck h:DEF-head
DEF-hips t:DEF-thigh@ DEF-thigh@.001 k:DEF-shin@ DEF-shin@.001 a:DEF-foot@ f:DEF-toe@
DEF-spine.003 c:DEF-shoulder@ s:DEF-upper_arm@ DEF-upper_arm@.001 e:DEF-forearm@ DEF-forearm@.001
DEF-forearm@.001 w:DEF-hand@
)"},
      {"auto-rig pro", ".l", ".r", R"(
p:root.x 1:spine_01.x 2:spine_02.x 3:spine_03.x n:neck.x h:head.x
root.x t:thigh_stretch@ k:leg_stretch@ a:foot@ f:toes_01@
thigh_stretch@ thigh_twist@
leg_stretch@ leg_twist@
spine_03.x c:shoulder@ s:arm_stretch@ e:forearm_stretch@ w:hand@ index1@
arm_stretch@ arm_twist@
forearm_stretch@ forearm_twist@
)"},
      {"rokoko", "Left", "Right", R"(
Root p:Hips 1:Spine1 Spine2 2:Spine3 3:Spine4 n:Neck h:Head
Hips t:@Thigh k:@Shin a:@Foot f:@Toe @ToeTip
Spine4 c:@Shoulder s:@Arm e:@ForeArm w:@Hand @Finger1Metacarpal
)"},
      {"xsens mvn, BVH", "Left", "Right", R"(
p:Hips 1:Chest Chest2 2:Chest3 3:Chest4 n:Neck h:Head
Hips t:@Hip k:@Knee a:@Ankle f:@Toe
Chest4 c:@Collar s:@Shoulder e:@Elbow w:@Wrist
)"},
      {"xsens mvn, FBX", "Left", "Right", R"(
p:Pelvis 1:L5 L3 2:T12 3:T8 n:Neck h:Head
Pelvis t:@~Upper~Leg k:@~Lower~Leg a:@~Foot f:@~Toe
T8 c:@~Shoulder s:@~Upper~Arm e:@~Forearm w:@~Hand
)"},
      {"optitrack motive", "L", "R", R"(
p:Hip 1:Ab 3:Chest n:Neck h:Head
Hip t:@Thigh k:@Shin a:@Foot f:@Toe
Chest c:@Shoulder s:@UArm e:@FArm w:@Hand @Thumb1
)"},
      {"perception neuron", "Left", "Right", R"(
p:Hips 1:Spine Spine1 2:Spine2 3:Spine3 n:Neck h:Head
Hips t:@UpLeg k:@Leg a:@Foot
Spine3 c:@Shoulder s:@Arm e:@ForeArm w:@Hand @HandThumb1
@Hand @InHandIndex @HandIndex1
)"},
      {"makehuman, default rig", ".L", ".R", R"(
p:root 1:spine05 spine04 2:spine03 spine02 3:spine01 n:neck01 neck02 neck03 h:head jaw
root pelvis@ t:upperleg01@ upperleg02@ k:lowerleg01@ lowerleg02@ a:foot@ f:toe1-1@ toe1-2@
foot@ toe4-1@
spine02 breast@
spine01 c:clavicle@ shoulder01@ s:upperarm01@ upperarm02@ e:lowerarm01@ lowerarm02@ w:wrist@
wrist@ finger1-1@
wrist@ metacarpal1@
)"},
      {"makehuman for MORSE", "_L", "_R", R"(
Root p:Hips 1:Spine1 2:Spine2 3:Spine3 n:Neck h:Head
Hips t:UpLeg@ k:LoLeg@ a:Foot@ f:Toe@
Spine3 c:Clavicle@ s:UpArm@ e:LoArm@ w:Hand@
)"},
      {"smpl-h", "L", "R", R"(
p:Pelvis 1:Spine1 2:Spine2 3:Spine3 n:Neck h:Head
Pelvis t:@_Hip k:@_Knee a:@_Ankle f:@_Foot
Spine3 c:@_Collar s:@_Shoulder e:@_Elbow w:@_Wrist @_Hand
@_Wrist @_Index1
)"},
      {"genea", "l", "r", R"(
body_world p:b_root 1:b_spine0 b_spine1 2:b_spine2 3:b_spine3 n:b_neck0 h:b_head
b_root t:b_@_upleg k:b_@_leg b_@_foot_twist a:b_@_foot f:b_@_foot_toe
b_spine3 c:b_@_shoulder s:b_@_arm b_@_arm_twist e:b_@_forearm b_@_wrist_twist w:b_@_wrist
b_@_wrist b_@_thumb0
)"},
      {"bandai namco", "_L", "_R", R"(
joint_Root p:Hips 1:Spine 3:Chest n:Neck h:Head
Hips t:UpperLeg@ k:LowerLeg@ a:Foot@ f:Toes@
Chest c:Shoulder@ s:UpperArm@ e:LowerArm@ w:Hand@
)"},
      {"deepmotion", "l", "r", R"(
p:hips_JNT 1:spine_JNT 2:spine1_JNT 3:spine2_JNT n:neck_JNT h:head_JNT
hips_JNT t:@_upleg_JNT k:@_leg_JNT a:@_foot_JNT f:@_toebase_JNT
spine2_JNT c:@_shoulder_JNT s:@_arm_JNT e:@_forearm_JNT w:@_hand_JNT
)"},
      {"advanced skeleton", "_L", "_R", R"(
p:Root_M 1:Spine1_M 2:Spine2_M 3:Chest_M n:Neck_M h:Head_M Jaw_M
Root_M t:Hip@ k:Knee@ a:Ankle@ f:Toes@ ToesEnd@
Hip@ HipPart1@
Chest_M c:Scapula@ s:Shoulder@ e:Elbow@ w:Wrist@ MiddleFinger1@
Shoulder@ ShoulderPart1@
)"},
      {"azure kinect", "_LEFT", "_RIGHT", R"(
p:PELVIS 1:SPINE_NAVEL 3:SPINE_CHEST n:NECK h:HEAD NOSE
PELVIS t:HIP@ k:KNEE@ a:ANKLE@ f:FOOT@
SPINE_CHEST c:CLAVICLE@ s:SHOULDER@ e:ELBOW@ w:WRIST@ HAND@ HANDTIP@
WRIST@ THUMB@
HEAD EYE@
)"},
      {"cascadeur", "_l", "_r", R"(
p:pelvis 1:stomach 3:chest n:neck h:head
pelvis t:thigh@ k:calf@ a:foot@ f:toes@
chest c:clavicle@ s:arm@ e:forearm@ w:hand@
)"},
      {"maya, by hand", "L", "R", R"(
p:|group|rig|pelvis_jnt 1:|group|rig|spine_a_jnt 2:|group|rig|spine_b_jnt 3:|group|rig|spine_c_jnt
|group|rig|spine_c_jnt n:|group|rig|neck_jnt h:|group|rig|head_jnt
|group|rig|pelvis_jnt t:|group|rig|hip_@_jnt k:|group|rig|leg_lower_@_jnt a:|group|rig|foot_@_jnt
|group|rig|foot_@_jnt f:|group|rig|toe_@_jnt
|group|rig|spine_c_jnt c:|group|rig|clav_@_jnt s:|group|rig|arm_upper_@_jnt
|group|rig|arm_upper_@_jnt e:|group|rig|arm_lower_@_jnt w:|group|rig|hand_@_jnt
)"},
      {"human3.6m", "L", "R", R"(
p:Hip 1:Spine 3:Thorax n:Neck h:Head
Hip t:@Hip k:@Knee a:@Foot
Thorax s:@Shoulder e:@Elbow w:@Wrist
)"}};
  return lists;
}

}  // namespace restage::test
