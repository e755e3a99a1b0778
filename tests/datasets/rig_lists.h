// Skeletons as programs of all kinds name them, written down from their conventions: a bone a line,
// indented below its parent, "= joint" where it is one of the 22. A '@' is the side: such a bone
// and all below it are there twice.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "datasets/readers/skeleton_file.h"
#include "tests/datasets/importers_bvh_text.h"

namespace restage::test {

struct RigList {
  const char* name;
  const char* left;  ///< what '@' stands for
  const char* right;
  const char* bones;
};

struct BuiltRig {
  SourceSkeleton skeleton;
  std::array<int, kJoints> bone{};  ///< which is which joint; -1: none
};

/// Bones of joints lie where a person's do, others a centimetre above their parents.
class RigBuilder {
 public:
  explicit RigBuilder(const RigList& list) : list_(list) {
    out_.bone.fill(-1);
    parse(list.bones);
    for (size_t i = 0; i < lines_.size(); ++i)
      if (parent_line(i) < 0) add(static_cast<int>(i), -1, "");
  }
  BuiltRig built() const { return out_; }

 private:
  struct Line {
    int indent;
    std::string bone, joint;
  };

  void parse(const std::string& text) {
    for (size_t at = 0; at < text.size();) {
      const size_t end = std::min(text.find('\n', at), text.size());
      const std::string line = text.substr(at, end - at);
      at = end + 1;
      const size_t begin = line.find_first_not_of(' ');
      if (begin == std::string::npos) continue;
      const size_t equals = line.find(" = ");
      lines_.push_back({static_cast<int>(begin), line.substr(begin, equals - begin),
                        equals == std::string::npos ? "" : line.substr(equals + 3)});
    }
  }
  int parent_line(size_t i) const {
    for (size_t p = i; p-- > 0;)
      if (lines_[p].indent < lines_[i].indent) return static_cast<int>(p);
    return -1;
  }

  /// `side`: "left", "right", or "" outside of a limb.
  void add(int line, int parent, const std::string& side) {
    const Line& it = lines_[static_cast<size_t>(line)];
    if (side.empty() && it.bone.find('@') != std::string::npos) {
      add(line, parent, "left");
      add(line, parent, "right");
      return;
    }
    std::string name = it.bone;
    for (size_t at = 0; (at = name.find('@')) != std::string::npos;)
      name.replace(at, 1, side == "left" ? list_.left : list_.right);
    const int bone = static_cast<int>(out_.skeleton.size());
    Vec3 place = parent < 0 ? Vec3(Vec3::Zero()) : Vec3(places_[static_cast<size_t>(parent)]);
    place.y() += 0.01;
    if (!it.joint.empty()) {
      const std::string full = (side.empty() ? "" : side + "_") + it.joint;
      const auto at = std::find(kJointNames.begin(), kJointNames.end(), full);
      if (at == kJointNames.end()) throw std::runtime_error(full + " is no joint");
      const auto j = static_cast<size_t>(at - kJointNames.begin());
      out_.bone[j] = bone;
      place = bvh_test::rest()[j];
    }
    const Vec3 from = parent < 0 ? Vec3(Vec3::Zero()) : Vec3(places_[static_cast<size_t>(parent)]);
    out_.skeleton.add(name, parent, place - from);
    places_.push_back(place);
    for (size_t i = 0; i < lines_.size(); ++i)
      if (parent_line(i) == line) add(static_cast<int>(i), bone, side);
  }

  const RigList& list_;
  std::vector<Line> lines_;
  std::vector<Vec3> places_;
  BuiltRig out_;
};

inline const std::vector<RigList>& rig_lists() {
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
    spine_01
      spine_02 = spine1
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
  spine05
    spine04 = spine1
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
