// Skeletons of game engines, their assets, and avatars, written down from their conventions.
#pragma once

#include "tests/datasets/rig_lists.h"

namespace restage::test {

inline const std::vector<RigList>& rigs_of_games() {
  static const std::vector<RigList> lists = {
      {"unreal 4", "_l", "_r", R"(
root
  pelvis = pelvis
    spine_01 = spine1
      spine_02 = spine2
        spine_03 = spine3
          neck_01 = neck
            head = head
          clavicle@ = collar
            upperarm@ = shoulder
              upperarm_twist_01@
              lowerarm@ = elbow
                lowerarm_twist_01@
                hand@ = wrist
                  index_01@
                  weapon@
    thigh@ = hip
      thigh_twist_01@
      calf@ = knee
        calf_twist_01@
        foot@ = ankle
          ball@ = foot
  ik_foot_root
    ik_foot@
  ik_hand_root
    ik_hand_gun
      ik_hand@
  center_of_mass
)"},
      {"unreal 5", "_l", "_r", R"(
root
  pelvis = pelvis
    spine_01 = spine1
      spine_02
        spine_03 = spine2
          spine_04
            spine_05 = spine3
              neck_01 = neck
                neck_02
                  head = head
              clavicle@ = collar
                clavicle_out@
                upperarm@ = shoulder
                  upperarm_correctiveRoot@
                  upperarm_twist_01@
                  lowerarm@ = elbow
                    lowerarm_out@
                    wrist_inner@
                    hand@ = wrist
                      index_metacarpal@
    thigh@ = hip
      thigh_out@
      calf@ = knee
        calf_kneeBack@
        calf_knee@
        ankle_bck@
        foot@ = ankle
          ball@ = foot
            bigtoe_01@
)"},
      {"unity humanoid", "Left", "Right", R"(
Root
  Hips = pelvis
    @UpperLeg = hip
      @LowerLeg = knee
        @Foot = ankle
          @Toes = foot
    Spine = spine1
      Chest = spine2
        UpperChest = spine3
          Neck = neck
            Head = head
              Jaw
          @Shoulder = collar
            @UpperArm = shoulder
              @LowerArm = elbow
                @Hand = wrist
                  @IndexProximal
)"},
      {"vrm without upper chest, neck, collars and toes", "left", "right", R"(
hips = pelvis
  @UpperLeg = hip
    @LowerLeg = knee
      @Foot = ankle
  spine = spine1
    chest = spine3
      head = head
      @UpperArm = shoulder
        @LowerArm = elbow
          @Hand = wrist
)"},
      {"vroid", "L", "R", R"(
Root
  J_Bip_C_Hips = pelvis
    J_Bip_C_Spine = spine1
      J_Bip_C_Chest = spine2
        J_Bip_C_UpperChest = spine3
          J_Sec_@_Bust1
          J_Bip_C_Neck = neck
            J_Bip_C_Head = head
              J_Adj_@_FaceEye
              J_Sec_Hair1_01
              J_Sec_Hair1_02
                J_Sec_Hair2_02
          J_Bip_@_Shoulder = collar
            J_Bip_@_UpperArm = shoulder
              J_Sec_@_TopsUpperArmInside_01
              J_Bip_@_LowerArm = elbow
                J_Bip_@_Hand = wrist
                  J_Bip_@_Index1
    J_Bip_@_UpperLeg = hip
      J_Sec_@_CoatSkirtBack_01
      J_Bip_@_LowerLeg = knee
        J_Bip_@_Foot = ankle
          J_Bip_@_ToeBase = foot
)"},
      {"synty", "_L", "_R", R"(
Root
  Hips = pelvis
    UpperLeg@ = hip
      LowerLeg@ = knee
        Ankle@ = ankle
          Ball@ = foot
            Toes@
    Spine_01 = spine1
      Spine_02 = spine2
        Spine_03 = spine3
          Neck = neck
            Head = head
              Eyes
          Clavicle@ = collar
            Shoulder@ = shoulder
              Elbow@ = elbow
                Hand@ = wrist
                  Thumb_01 2@
)"},
      {"kaykit", ".l", ".r", R"(
root
  hips = pelvis
    spine = spine1
      chest = spine3
        head = head
        upperarm@ = shoulder
          lowerarm@ = elbow
            wrist@ = wrist
              hand@
                handslot@
    upperleg@ = hip
      lowerleg@ = knee
        foot@ = ankle
          toes@ = foot
  control-foot-roll@
  kneeIK@
)"},
      {"quaternius, universal animations", ".L", ".R", R"(
root
  DEF-hips = pelvis
    DEF-spine.001 = spine1
      DEF-spine.002 = spine2
        DEF-spine.003 = spine3
          DEF-neck = neck
            DEF-head = head
          DEF-shoulder@ = collar
            DEF-upper_arm@ = shoulder
              DEF-forearm@ = elbow
                DEF-hand@ = wrist
    DEF-thigh@ = hip
      DEF-shin@ = knee
        DEF-foot@ = ankle
          DEF-toe@ = foot
)"},
      {"quaternius, older", ".L", ".R", R"(
Bone
  Body
    Hips = pelvis
      Abdomen = spine1
        Torso = spine3
          Neck = neck
            Head = head
          Shoulder@ = collar
            UpperArm@ = shoulder
              LowerArm@ = elbow
                Palm@ = wrist
                  Thumb1@
      UpperLeg@ = hip
        LowerLeg@ = knee
          Foot@ = ankle
  PoleTarget@
)"},
      {"mmd, Japanese", "左", "右", R"(
全ての親
  センター
    グルーブ
      腰
        下半身 = pelvis
          腰キャンセル@
            @足 = hip
              @ひざ = knee
                @足首 = ankle
                  @つま先 = foot
        上半身 = spine1
          上半身2 = spine3
            首 = neck
              頭 = head
                両目
            @肩P
              @肩 = collar
                @肩C
                  @腕 = shoulder
                    @腕捩
                      @ひじ = elbow
                        @手捩
                          @手首 = wrist
                            @親指１
  @足ＩＫ
    @つま先ＩＫ
)"},
      {"mmd, English", "_L", "_R", R"(
ParentNode
  Center
    Groove
      Waist
        LowerBody = pelvis
          Leg@ = hip
            Knee@ = knee
              Ankle@ = ankle
                Toe@ = foot
        UpperBody = spine1
          UpperBody2 = spine3
            Neck = neck
              Head = head
            Shoulder@ = collar
              Arm@ = shoulder
                ArmTwist@
                  Elbow@ = elbow
                    Wrist@ = wrist
                      Thumb1@
  LegIK@
)"},
      {"3ds max biped", "L", "R", R"(
Bip001
  Bip001 Pelvis = pelvis
    Bip001 Spine = spine1
      Bip001 Spine1 = spine2
        Bip001 Spine2 = spine3
          Bip001 Neck = neck
            Bip001 Head = head
              Bip001 HeadNub
              Bip001 Ponytail1
            Bip001 @ Clavicle = collar
              Bip001 @ UpperArm = shoulder
                Bip001 @ Forearm = elbow
                  Bip001 @ Hand = wrist
                    Bip001 @ Finger0
      Bip001 @ Thigh = hip
        Bip001 @ Calf = knee
          Bip001 @ Foot = ankle
            Bip001 @ Toe0 = foot
              Bip001 @ Toe0Nub
  Bip001 Footsteps
)"},
      {"valve biped", "L", "R", R"(
ValveBiped.Bip01_Pelvis = pelvis
  ValveBiped.Bip01_Spine = spine1
    ValveBiped.Bip01_Spine1
      ValveBiped.Bip01_Spine2 = spine2
        ValveBiped.Bip01_Spine4 = spine3
          ValveBiped.Bip01_Neck1 = neck
            ValveBiped.Bip01_Head1 = head
          ValveBiped.Bip01_@_Clavicle = collar
            ValveBiped.Bip01_@_UpperArm = shoulder
              ValveBiped.Bip01_@_Forearm = elbow
                ValveBiped.Bip01_@_Hand = wrist
                  ValveBiped.Anim_Attachment_@H
  ValveBiped.Bip01_@_Thigh = hip
    ValveBiped.Bip01_@_Calf = knee
      ValveBiped.Bip01_@_Foot = ankle
        ValveBiped.Bip01_@_Toe0 = foot
)"},
      {"second life", "Left", "Right", R"(
mPelvis = pelvis
  mTorso = spine1
    mChest = spine3
      mNeck = neck
        mHead = head
          mSkull
      mCollar@ = collar
        mShoulder@ = shoulder
          mElbow@ = elbow
            mWrist@ = wrist
  mHip@ = hip
    mKnee@ = knee
      mAnkle@ = ankle
        mFoot@
          mToe@ = foot
)"},
      {"tripo and others after character creator", "L", "R", R"(
Root
  Hip = pelvis
    Pelvis
      @_Thigh = hip
        @_Calf = knee
          @_Foot = ankle
            @_ToeBase = foot
    Waist = spine1
      Spine01 = spine2
        Spine02 = spine3
          NeckTwist01 = neck
            NeckTwist02
              Head = head
          @_Clavicle = collar
            @_Upperarm = shoulder
              @_Forearm = elbow
                @_Hand = wrist
)"},
      {"meshy, its spine counted downwards", "Left", "Right", R"(
Hips = pelvis
  @UpLeg = hip
    @Leg = knee
      @Foot = ankle
        @ToeBase = foot
  Spine02 = spine1
    Spine01 = spine2
      Spine = spine3
        neck = neck
          Head = head
            head_end
            headfront
        @Shoulder = collar
          @Arm = shoulder
            @ForeArm = elbow
              @Hand = wrist
)"},
      {"skyrim", "L", "R", R"(
NPC Root [Root]
  NPC COM [COM ]
    NPC Pelvis [Pelv] = pelvis
      NPC @ Thigh [@Thg] = hip
        NPC @ Calf [@Clf] = knee
          NPC @ Foot [@ft ] = ankle
            NPC @ Toe0 [@Toe] = foot
      NPC Spine [Spn0] = spine1
        NPC Spine1 [Spn1] = spine2
          NPC Spine2 [Spn2] = spine3
            NPC Neck [Neck] = neck
              NPC Head [Head] = head
            NPC @ Clavicle [@Clv] = collar
              NPC @ UpperArm [@Uar] = shoulder
                NPC @ UpperarmTwist1 [@Ut1]
                NPC @ Forearm [@Lar] = elbow
                  NPC @ ForearmTwist1 [@Lt1]
                  NPC @ Hand [@Hnd] = wrist
                    NPC @ Finger00 [@F00]
)"},
      {"roblox", "Left", "Right", R"(
HumanoidRootNode
  LowerTorso = pelvis
    UpperTorso = spine1
      Head = head
      @UpperArm = shoulder
        @LowerArm = elbow
          @Hand = wrist
    @UpperLeg = hip
      @LowerLeg = knee
        @Foot = ankle
)"},
      {"dota", "_L", "_R", R"(
root_motion
  pelvis = pelvis
    spine_0 = spine1
      spine_1
        spine_2 = spine2
          spine_3 = spine3
            neck_0 = neck
              head = head
            clavicle@ = collar
              arm_upper@ = shoulder
                arm_upper@_TWIST
                arm_lower@ = elbow
                  hand@ = wrist
                    finger_index_0@
    leg_upper@ = hip
      leg_upper@_TWIST
      leg_lower@ = knee
        ankle@ = ankle
          ball@ = foot
)"},
      {"kaykit without its dots", "l", "r", R"(
root
  hips = pelvis
    spine = spine1
      chest = spine3
        head = head
        upperarm@ = shoulder
          lowerarm@ = elbow
            wrist@ = wrist
              hand@
    upperleg@ = hip
      lowerleg@ = knee
        foot@ = ankle
          toes@ = foot
)"},
      {"all in lower case", "left", "right", R"(
hips = pelvis
  spine = spine1
    chest = spine3
      neck = neck
        head = head
      @shoulder = collar
        @upperarm = shoulder
          @forearm = elbow
            @hand = wrist
  @upperleg = hip
    @lowerleg = knee
      @foot = ankle
        @toe = foot
)"}};
  return lists;
}

}  // namespace restage::test
