// Skeletons of game engines, their assets, and avatars, written down from their conventions.
#pragma once

#include "tests/datasets/rig_lists.h"

namespace restage::test {

inline const std::vector<RigList>& rigs_of_games() {
  static const std::vector<RigList> lists = {
      {"unreal 4", "_l", "_r", R"(
root p:pelvis 1:spine_01 2:spine_02 3:spine_03 n:neck_01 h:head
root ik_foot_root
ik_foot_root ik_foot@
root ik_hand_root ik_hand_gun
ik_hand_gun ik_hand@
root center_of_mass
pelvis t:thigh@ k:calf@ a:foot@ f:ball@
thigh@ thigh_twist_01@
calf@ calf_twist_01@
spine_03 c:clavicle@ s:upperarm@ e:lowerarm@ w:hand@ index_01@
upperarm@ upperarm_twist_01@
lowerarm@ lowerarm_twist_01@
hand@ weapon@
)"},
      {"unreal 5", "_l", "_r", R"(
root p:pelvis 1:spine_01 spine_02 2:spine_03 spine_04 3:spine_05 n:neck_01 neck_02 h:head
pelvis t:thigh@ k:calf@ a:foot@ f:ball@ bigtoe_01@
thigh@ thigh_out@
calf@ calf_kneeBack@
calf@ calf_knee@
calf@ ankle_bck@
spine_05 c:clavicle@ s:upperarm@ e:lowerarm@ w:hand@ index_metacarpal@
clavicle@ clavicle_out@
upperarm@ upperarm_correctiveRoot@
upperarm@ upperarm_twist_01@
lowerarm@ lowerarm_out@
lowerarm@ wrist_inner@
)"},
      {"unity humanoid", "Left", "Right", R"(
Root p:Hips 1:Spine 2:Chest 3:UpperChest n:Neck h:Head Jaw
Hips t:@UpperLeg k:@LowerLeg a:@Foot f:@Toes
UpperChest c:@Shoulder s:@UpperArm e:@LowerArm w:@Hand @IndexProximal
)"},
      {"vrm without upper chest, neck, collars and toes", "left", "right", R"(
p:hips 1:spine 3:chest h:head
hips t:@UpperLeg k:@LowerLeg a:@Foot
chest s:@UpperArm e:@LowerArm w:@Hand
)"},
      {"vroid", "L", "R", R"(
Root p:J_Bip_C_Hips 1:J_Bip_C_Spine 2:J_Bip_C_Chest 3:J_Bip_C_UpperChest n:J_Bip_C_Neck
J_Bip_C_Neck h:J_Bip_C_Head
J_Bip_C_Hips t:J_Bip_@_UpperLeg k:J_Bip_@_LowerLeg a:J_Bip_@_Foot f:J_Bip_@_ToeBase
J_Bip_@_UpperLeg J_Sec_@_CoatSkirtBack_01
J_Bip_C_UpperChest J_Sec_@_Bust1
J_Bip_C_UpperChest c:J_Bip_@_Shoulder s:J_Bip_@_UpperArm e:J_Bip_@_LowerArm w:J_Bip_@_Hand
J_Bip_@_Hand J_Bip_@_Index1
J_Bip_@_UpperArm J_Sec_@_TopsUpperArmInside_01
J_Bip_C_Head J_Adj_@_FaceEye
J_Bip_C_Head J_Sec_Hair1_01
J_Bip_C_Head J_Sec_Hair1_02 J_Sec_Hair2_02
)"},
      {"synty", "_L", "_R", R"(
Root p:Hips 1:Spine_01 2:Spine_02 3:Spine_03 n:Neck h:Head Eyes
Hips t:UpperLeg@ k:LowerLeg@ a:Ankle@ f:Ball@ Toes@
Spine_03 c:Clavicle@ s:Shoulder@ e:Elbow@ w:Hand@ Thumb_01~2@
)"},
      {"kaykit", ".l", ".r", R"(
root p:hips 1:spine 3:chest h:head
root control-foot-roll@
root kneeIK@
hips t:upperleg@ k:lowerleg@ a:foot@ f:toes@
chest s:upperarm@ e:lowerarm@ w:wrist@ hand@ handslot@
)"},
      {"quaternius, universal animations", ".L", ".R", R"(
root p:DEF-hips 1:DEF-spine.001 2:DEF-spine.002 3:DEF-spine.003 n:DEF-neck h:DEF-head
DEF-hips t:DEF-thigh@ k:DEF-shin@ a:DEF-foot@ f:DEF-toe@
DEF-spine.003 c:DEF-shoulder@ s:DEF-upper_arm@ e:DEF-forearm@ w:DEF-hand@
)"},
      {"quaternius, older", ".L", ".R", R"(
Bone Body p:Hips 1:Abdomen 3:Torso n:Neck h:Head
Bone PoleTarget@
Hips t:UpperLeg@ k:LowerLeg@ a:Foot@
Torso c:Shoulder@ s:UpperArm@ e:LowerArm@ w:Palm@ Thumb1@
)"},
      {"mmd, Japanese", "左", "右", R"(
全ての親 センター グルーブ 腰 1:上半身 3:上半身2 n:首 h:頭 両目
全ての親 @足ＩＫ @つま先ＩＫ
腰 p:下半身
下半身 腰キャンセル@ t:@足 k:@ひざ a:@足首 f:@つま先
上半身2 @肩P c:@肩 @肩C s:@腕 @腕捩 e:@ひじ @手捩 w:@手首 @親指１
)"},
      {"mmd, English", "_L", "_R", R"(
ParentNode Center Groove Waist 1:UpperBody 3:UpperBody2 n:Neck h:Head
ParentNode LegIK@
Waist p:LowerBody
LowerBody t:Leg@ k:Knee@ a:Ankle@ f:Toe@
UpperBody2 c:Shoulder@ s:Arm@ ArmTwist@ e:Elbow@ w:Wrist@ Thumb1@
)"},
      {"3ds max biped", "L", "R", R"(
Bip001 p:Bip001~Pelvis 1:Bip001~Spine 2:Bip001~Spine1 3:Bip001~Spine2 n:Bip001~Neck h:Bip001~Head
Bip001~Head Bip001~HeadNub
Bip001 Bip001~Footsteps
Bip001~Spine t:Bip001~@~Thigh k:Bip001~@~Calf a:Bip001~@~Foot f:Bip001~@~Toe0 Bip001~@~Toe0Nub
Bip001~Neck c:Bip001~@~Clavicle s:Bip001~@~UpperArm e:Bip001~@~Forearm w:Bip001~@~Hand
Bip001~@~Hand Bip001~@~Finger0
Bip001~Head Bip001~Ponytail1
)"},
      {"valve biped", "L", "R", R"(
p:ValveBiped.Bip01_Pelvis 1:ValveBiped.Bip01_Spine ValveBiped.Bip01_Spine1
ValveBiped.Bip01_Spine1 2:ValveBiped.Bip01_Spine2 3:ValveBiped.Bip01_Spine4
ValveBiped.Bip01_Spine4 n:ValveBiped.Bip01_Neck1 h:ValveBiped.Bip01_Head1
ValveBiped.Bip01_Pelvis t:ValveBiped.Bip01_@_Thigh k:ValveBiped.Bip01_@_Calf
ValveBiped.Bip01_@_Calf a:ValveBiped.Bip01_@_Foot f:ValveBiped.Bip01_@_Toe0
ValveBiped.Bip01_Spine4 c:ValveBiped.Bip01_@_Clavicle s:ValveBiped.Bip01_@_UpperArm
ValveBiped.Bip01_@_UpperArm e:ValveBiped.Bip01_@_Forearm w:ValveBiped.Bip01_@_Hand
ValveBiped.Bip01_@_Hand ValveBiped.Anim_Attachment_@H
)"},
      {"second life", "Left", "Right", R"(
p:mPelvis 1:mTorso 3:mChest n:mNeck h:mHead mSkull
mPelvis t:mHip@ k:mKnee@ a:mAnkle@ mFoot@ f:mToe@
mChest c:mCollar@ s:mShoulder@ e:mElbow@ w:mWrist@
)"},
      {"tripo and others after character creator", "L", "R", R"(
Root p:Hip 1:Waist 2:Spine01 3:Spine02 n:NeckTwist01 NeckTwist02 h:Head
Hip Pelvis
Pelvis t:@_Thigh k:@_Calf a:@_Foot f:@_ToeBase
Spine02 c:@_Clavicle s:@_Upperarm e:@_Forearm w:@_Hand
)"},
      {"meshy, its spine counted downwards", "Left", "Right", R"(
p:Hips 1:Spine02 2:Spine01 3:Spine n:neck h:Head head_end
Hips t:@UpLeg k:@Leg a:@Foot f:@ToeBase
Spine c:@Shoulder s:@Arm e:@ForeArm w:@Hand
Head headfront
)"},
      {"skyrim", "L", "R", R"(
NPC~Root~[Root] NPC~COM~[COM~] p:NPC~Pelvis~[Pelv] 1:NPC~Spine~[Spn0] 2:NPC~Spine1~[Spn1]
NPC~Spine1~[Spn1] 3:NPC~Spine2~[Spn2] n:NPC~Neck~[Neck] h:NPC~Head~[Head]
NPC~Pelvis~[Pelv] t:NPC~@~Thigh~[@Thg] k:NPC~@~Calf~[@Clf] a:NPC~@~Foot~[@ft~] f:NPC~@~Toe0~[@Toe]
NPC~Spine2~[Spn2] c:NPC~@~Clavicle~[@Clv] s:NPC~@~UpperArm~[@Uar] e:NPC~@~Forearm~[@Lar]
NPC~@~Forearm~[@Lar] w:NPC~@~Hand~[@Hnd] NPC~@~Finger00~[@F00]
NPC~@~UpperArm~[@Uar] NPC~@~UpperarmTwist1~[@Ut1]
NPC~@~Forearm~[@Lar] NPC~@~ForearmTwist1~[@Lt1]
)"},
      {"roblox", "Left", "Right", R"(
HumanoidRootNode p:LowerTorso 1:UpperTorso h:Head
LowerTorso t:@UpperLeg k:@LowerLeg a:@Foot
UpperTorso s:@UpperArm e:@LowerArm w:@Hand
)"},
      {"dota", "_L", "_R", R"(
root_motion p:pelvis 1:spine_0 spine_1 2:spine_2 3:spine_3 n:neck_0 h:head
pelvis t:leg_upper@ k:leg_lower@ a:ankle@ f:ball@
leg_upper@ leg_upper@_TWIST
spine_3 c:clavicle@ s:arm_upper@ e:arm_lower@ w:hand@ finger_index_0@
arm_upper@ arm_upper@_TWIST
)"},
      {"kaykit without its dots", "l", "r", R"(
root p:hips 1:spine 3:chest h:head
hips t:upperleg@ k:lowerleg@ a:foot@ f:toes@
chest s:upperarm@ e:lowerarm@ w:wrist@ hand@
)"},
      {"all in lower case", "left", "right", R"(
p:hips 1:spine 3:chest n:neck h:head
hips t:@upperleg k:@lowerleg a:@foot f:@toe
chest c:@shoulder s:@upperarm e:@forearm w:@hand
)"}};
  return lists;
}

}  // namespace restage::test
