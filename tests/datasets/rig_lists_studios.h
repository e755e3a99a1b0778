// Skeletons of modelling programs and motion capture, written down from their conventions.
#pragma once

#include "tests/datasets/rig_lists.h"

namespace restage::test {

inline const std::vector<RigList>& rigs_of_studios() {
  static const std::vector<RigList> lists = {
      {"mixamo", "Left", "Right", R"(
Hips = pelvis
  Spine = spine1
    Spine1 = spine2
      Spine2 = spine3
        Neck = neck
          Head = head
            HeadTop_End
            LeftEye
        @Shoulder = collar
          @Arm = shoulder
            @ForeArm = elbow
              @Hand = wrist
                @HandThumb1
                  @HandThumb2
                @HandIndex1
  @UpLeg = hip
    @Leg = knee
      @Foot = ankle
        @ToeBase = foot
          @Toe_End
)"},
      {"motionbuilder with roll bones and a longer spine", "Left", "Right", R"(
Reference
  Hips = pelvis
    Spine = spine1
      Spine1
        Spine2 = spine2
          Spine3 = spine3
            Neck = neck
              Neck1
                Head = head
            @Shoulder = collar
              @Arm = shoulder
                @ArmRoll
                @ForeArm = elbow
                  @ForeArmRoll
                  @Hand = wrist
                    @HandMiddle1
    @UpLeg = hip
      @UpLegRoll
      @Leg = knee
        @LegRoll
        @Foot = ankle
          @ToeBase = foot
)"},
      {"character creator 4", "L", "R", R"(
RL_BoneRoot
  CC_Base_Hip = pelvis
    CC_Base_Pelvis
      CC_Base_@_Thigh = hip
        CC_Base_@_ThighTwist01
          CC_Base_@_ThighTwist02
        CC_Base_@_Calf = knee
          CC_Base_@_CalfTwist01
          CC_Base_@_KneeShareBone
          CC_Base_@_Foot = ankle
            CC_Base_@_ToeBaseShareBone
            CC_Base_@_ToeBase = foot
              CC_Base_@_BigToe1
              CC_Base_@_IndexToe1
    CC_Base_Waist = spine1
      CC_Base_Spine01 = spine2
        CC_Base_Spine02 = spine3
          CC_Base_NeckTwist01 = neck
            CC_Base_NeckTwist02
              CC_Base_Head = head
                CC_Base_FacialBone
                  CC_Base_JawRoot
                  CC_Base_@_Eye
          CC_Base_@_Clavicle = collar
            CC_Base_@_Upperarm = shoulder
              CC_Base_@_UpperarmTwist01
              CC_Base_@_Forearm = elbow
                CC_Base_@_ForearmTwist01
                CC_Base_@_ElbowShareBone
                CC_Base_@_Hand = wrist
                  CC_Base_@_Mid1
          CC_Base_@_RibsTwist
            CC_Base_@_Breast
)"},
      {"accurig and older character creator", "L", "R", R"(
CC_Base_BoneRoot
  CC_Base_Hip = pelvis
    CC_Base_@_Thigh = hip
      CC_Base_@_Calf = knee
        CC_Base_@_Foot = ankle
          CC_Base_@_ToeBase = foot
    CC_Base_Waist = spine1
      CC_Base_Spine01 = spine2
        CC_Base_Spine02 = spine3
          CC_Base_NeckTwist01 = neck
            CC_Base_Head = head
          CC_Base_@_Clavicle = collar
            CC_Base_@_Upperarm = shoulder
              CC_Base_@_Forearm = elbow
                CC_Base_@_Hand = wrist
)"},
      {"daz genesis 8", "l", "r", R"(
Genesis8Female
  hip = pelvis
    pelvis
      @ThighBend = hip
        @ThighTwist
          @Shin = knee
            @Foot = ankle
              @Metatarsals
                @Toe = foot
                  @BigToe
              @Heel
    abdomenLower = spine1
      abdomenUpper
        chestLower = spine2
          @Pectoral
          chestUpper = spine3
            @Collar = collar
              @ShldrBend = shoulder
                @ShldrTwist
                  @ForearmBend = elbow
                    @ForearmTwist
                      @Hand = wrist
                        @Thumb1
                        @Carpal1
                          @Index1
            neckLower = neck
              neckUpper
                head = head
                  upperTeeth
                  lowerJaw
                  @Eye
)"},
      {"daz genesis 9", "l", "r", R"(
Genesis9
  hip = pelvis
    pelvis
      @_thigh = hip
        @_thightwist1
        @_thightwist2
        @_shin = knee
          @_shintwist1
          @_foot = ankle
            @_metatarsals
            @_toes = foot
              @_bigtoe1
    spine1 = spine1
      spine2
        spine3 = spine2
          @_pectoral
          spine4 = spine3
            @_shoulder = collar
              @_upperarm = shoulder
                @_upperarmtwist1
                @_forearm = elbow
                  @_forearmtwist1
                  @_hand = wrist
                    @_thumb1
            neck1 = neck
              neck2
                head = head
                  lowerjaw
)"},
      {"daz genesis 3 and Poser", "l", "r", R"(
hip = pelvis
  pelvis
    @ThighBend = hip
      @ThighTwist
        @Shin = knee
          @Foot = ankle
            @Toe = foot
  abdomen = spine1
    abdomen2 = spine2
      chest = spine3
        @Collar = collar
          @Shldr = shoulder
            @ForeArm = elbow
              @Hand = wrist
        neck = neck
          head = head
)"},
      {"rigify, as modelled", ".L", ".R", R"(
spine = pelvis
  pelvis@
  thigh@ = hip
    shin@ = knee
      foot@ = ankle
        toe@ = foot
        heel.02@
  spine.001 = spine1
    spine.002 = spine2
      spine.003 = spine3
        spine.004 = neck
          spine.005
            spine.006 = head
              face
        shoulder@ = collar
          upper_arm@ = shoulder
            forearm@ = elbow
              hand@ = wrist
                palm.01@
                  f_index.01@
                thumb.01@
        breast@
)"},
      {"rigify, game export", ".L", ".R", R"(
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
                  DEF-f_index.01@
                  DEF-thumb.01@
    DEF-thigh@ = hip
      DEF-shin@ = knee
        DEF-foot@ = ankle
          DEF-toe@ = foot
)"},
      {"rigify, limbs of two segments", ".L", ".R", R"(
root
  DEF-hips = pelvis
    DEF-spine.001 = spine1
      DEF-spine.002 = spine2
        DEF-spine.003 = spine3
          DEF-neck = neck
            DEF-head = head
          DEF-shoulder@ = collar
            DEF-upper_arm@ = shoulder
              DEF-upper_arm@.001
                DEF-forearm@ = elbow
                  DEF-forearm@.001
                    DEF-hand@ = wrist
    DEF-thigh@ = hip
      DEF-thigh@.001
        DEF-shin@ = knee
          DEF-shin@.001
            DEF-foot@ = ankle
              DEF-toe@ = foot
)"},
      {"auto-rig pro", ".l", ".r", R"(
root.x = pelvis
  thigh_stretch@ = hip
    thigh_twist@
    leg_stretch@ = knee
      leg_twist@
      foot@ = ankle
        toes_01@ = foot
  spine_01.x = spine1
    spine_02.x = spine2
      spine_03.x = spine3
        neck.x = neck
          head.x = head
        shoulder@ = collar
          arm_stretch@ = shoulder
            arm_twist@
            forearm_stretch@ = elbow
              forearm_twist@
              hand@ = wrist
                index1@
)"},
      {"rokoko", "Left", "Right", R"(
Root
  Hips = pelvis
    Spine1 = spine1
      Spine2
        Spine3 = spine2
          Spine4 = spine3
            Neck = neck
              Head = head
            @Shoulder = collar
              @Arm = shoulder
                @ForeArm = elbow
                  @Hand = wrist
                    @Finger1Metacarpal
    @Thigh = hip
      @Shin = knee
        @Foot = ankle
          @Toe = foot
            @ToeTip
)"},
      {"xsens mvn, BVH", "Left", "Right", R"(
Hips = pelvis
  Chest = spine1
    Chest2
      Chest3 = spine2
        Chest4 = spine3
          Neck = neck
            Head = head
          @Collar = collar
            @Shoulder = shoulder
              @Elbow = elbow
                @Wrist = wrist
  @Hip = hip
    @Knee = knee
      @Ankle = ankle
        @Toe = foot
)"},
      {"xsens mvn, FBX", "Left", "Right", R"(
Pelvis = pelvis
  L5 = spine1
    L3
      T12 = spine2
        T8 = spine3
          Neck = neck
            Head = head
          @ Shoulder = collar
            @ Upper Arm = shoulder
              @ Forearm = elbow
                @ Hand = wrist
  @ Upper Leg = hip
    @ Lower Leg = knee
      @ Foot = ankle
        @ Toe = foot
)"},
      {"optitrack motive", "L", "R", R"(
Hip = pelvis
  Ab = spine1
    Chest = spine3
      Neck = neck
        Head = head
      @Shoulder = collar
        @UArm = shoulder
          @FArm = elbow
            @Hand = wrist
              @Thumb1
  @Thigh = hip
    @Shin = knee
      @Foot = ankle
        @Toe = foot
)"},
      {"perception neuron", "Left", "Right", R"(
Hips = pelvis
  @UpLeg = hip
    @Leg = knee
      @Foot = ankle
  Spine = spine1
    Spine1
      Spine2 = spine2
        Spine3 = spine3
          Neck = neck
            Head = head
          @Shoulder = collar
            @Arm = shoulder
              @ForeArm = elbow
                @Hand = wrist
                  @HandThumb1
                  @InHandIndex
                    @HandIndex1
)"},
      {"makehuman, default rig", ".L", ".R", R"(
root = pelvis
  pelvis@
    upperleg01@ = hip
      upperleg02@
        lowerleg01@ = knee
          lowerleg02@
            foot@ = ankle
              toe4-1@
              toe1-1@ = foot
                toe1-2@
  spine05 = spine1
    spine04
      spine03 = spine2
        spine02
          breast@
          spine01 = spine3
            clavicle@ = collar
              shoulder01@
                upperarm01@ = shoulder
                  upperarm02@
                    lowerarm01@ = elbow
                      lowerarm02@
                        wrist@ = wrist
                          finger1-1@
                          metacarpal1@
            neck01 = neck
              neck02
                neck03
                  head = head
                    jaw
)"},
      {"makehuman for MORSE", "_L", "_R", R"(
Root
  Hips = pelvis
    UpLeg@ = hip
      LoLeg@ = knee
        Foot@ = ankle
          Toe@ = foot
    Spine1 = spine1
      Spine2 = spine2
        Spine3 = spine3
          Neck = neck
            Head = head
          Clavicle@ = collar
            UpArm@ = shoulder
              LoArm@ = elbow
                Hand@ = wrist
)"},
      {"smpl-h", "L", "R", R"(
Pelvis = pelvis
  @_Hip = hip
    @_Knee = knee
      @_Ankle = ankle
        @_Foot = foot
  Spine1 = spine1
    Spine2 = spine2
      Spine3 = spine3
        Neck = neck
          Head = head
        @_Collar = collar
          @_Shoulder = shoulder
            @_Elbow = elbow
              @_Wrist = wrist
                @_Hand
                @_Index1
)"},
      {"genea", "l", "r", R"(
body_world
  b_root = pelvis
    b_spine0 = spine1
      b_spine1
        b_spine2 = spine2
          b_spine3 = spine3
            b_neck0 = neck
              b_head = head
            b_@_shoulder = collar
              b_@_arm = shoulder
                b_@_arm_twist
                  b_@_forearm = elbow
                    b_@_wrist_twist
                      b_@_wrist = wrist
                        b_@_thumb0
    b_@_upleg = hip
      b_@_leg = knee
        b_@_foot_twist
          b_@_foot = ankle
            b_@_foot_toe = foot
)"},
      {"bandai namco", "_L", "_R", R"(
joint_Root
  Hips = pelvis
    Spine = spine1
      Chest = spine3
        Neck = neck
          Head = head
        Shoulder@ = collar
          UpperArm@ = shoulder
            LowerArm@ = elbow
              Hand@ = wrist
    UpperLeg@ = hip
      LowerLeg@ = knee
        Foot@ = ankle
          Toes@ = foot
)"},
      {"deepmotion", "l", "r", R"(
hips_JNT = pelvis
  spine_JNT = spine1
    spine1_JNT = spine2
      spine2_JNT = spine3
        neck_JNT = neck
          head_JNT = head
        @_shoulder_JNT = collar
          @_arm_JNT = shoulder
            @_forearm_JNT = elbow
              @_hand_JNT = wrist
  @_upleg_JNT = hip
    @_leg_JNT = knee
      @_foot_JNT = ankle
        @_toebase_JNT = foot
)"},
      {"advanced skeleton", "_L", "_R", R"(
Root_M = pelvis
  Hip@ = hip
    HipPart1@
    Knee@ = knee
      Ankle@ = ankle
        Toes@ = foot
          ToesEnd@
  Spine1_M = spine1
    Spine2_M = spine2
      Chest_M = spine3
        Scapula@ = collar
          Shoulder@ = shoulder
            ShoulderPart1@
            Elbow@ = elbow
              Wrist@ = wrist
                MiddleFinger1@
        Neck_M = neck
          Head_M = head
            Jaw_M
)"},
      {"azure kinect", "_LEFT", "_RIGHT", R"(
PELVIS = pelvis
  SPINE_NAVEL = spine1
    SPINE_CHEST = spine3
      NECK = neck
        HEAD = head
          NOSE
          EYE@
      CLAVICLE@ = collar
        SHOULDER@ = shoulder
          ELBOW@ = elbow
            WRIST@ = wrist
              HAND@
                HANDTIP@
              THUMB@
  HIP@ = hip
    KNEE@ = knee
      ANKLE@ = ankle
        FOOT@ = foot
)"},
      {"cascadeur", "_l", "_r", R"(
pelvis = pelvis
  stomach = spine1
    chest = spine3
      neck = neck
        head = head
      clavicle@ = collar
        arm@ = shoulder
          forearm@ = elbow
            hand@ = wrist
  thigh@ = hip
    calf@ = knee
      foot@ = ankle
        toes@ = foot
)"},
      {"maya, by hand", "L", "R", R"(
|group|rig|pelvis_jnt = pelvis
  |group|rig|hip_@_jnt = hip
    |group|rig|leg_lower_@_jnt = knee
      |group|rig|foot_@_jnt = ankle
        |group|rig|toe_@_jnt = foot
  |group|rig|spine_a_jnt = spine1
    |group|rig|spine_b_jnt = spine2
      |group|rig|spine_c_jnt = spine3
        |group|rig|neck_jnt = neck
          |group|rig|head_jnt = head
        |group|rig|clav_@_jnt = collar
          |group|rig|arm_upper_@_jnt = shoulder
            |group|rig|arm_lower_@_jnt = elbow
              |group|rig|hand_@_jnt = wrist
)"},
      {"human3.6m", "L", "R", R"(
Hip = pelvis
  @Hip = hip
    @Knee = knee
      @Foot = ankle
  Spine = spine1
    Thorax = spine3
      Neck = neck
        Head = head
      @Shoulder = shoulder
        @Elbow = elbow
          @Wrist = wrist
)"}};
  return lists;
}

}  // namespace restage::test
