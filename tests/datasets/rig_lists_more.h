// Skeletons whose names are in other languages than English, whose limbs are only counted, and
// others of no known program.
#pragma once

#include "tests/datasets/rig_lists.h"

namespace restage::test {

inline const std::vector<RigList>& rigs_of_others() {
  static const std::vector<RigList> lists = {
      {"poser, genesis 2", "l", "r", R"(
p:hip 1:abdomen 2:abdomen2 3:chest n:neck h:head
hip pelvis
pelvis t:@Thigh k:@Shin a:@Foot f:@Toe
chest c:@Collar s:@Shldr e:@ForeArm w:@Hand @Index1
chest @Pectoral
)"},
      {"poser with a waist", "l", "r", R"(
p:hip 1:waist 2:abdomen 3:chest n:neck h:head
hip t:@Thigh k:@Shin a:@Foot f:@Toe
chest c:@Collar s:@Shldr e:@ForeArm w:@Hand
)"},
      {"rigify with underscores", "_L", "_R", R"(
p:DEF-spine 1:DEF-spine_001 2:DEF-spine_002 3:DEF-spine_003 n:DEF-spine_004 DEF-spine_005
DEF-spine_005 h:DEF-spine_006
DEF-spine DEF-pelvis@
DEF-spine t:DEF-thigh@ DEF-thigh@_001 k:DEF-shin@ DEF-shin@_001 a:DEF-foot@ f:DEF-toe@
DEF-spine_003 c:DEF-shoulder@ s:DEF-upper_arm@ DEF-upper_arm@_001 e:DEF-forearm@
DEF-forearm@ DEF-forearm@_001 w:DEF-hand@ DEF-f_index_01@
)"},
      {"rigify with a longer spine", ".L", ".R", R"(
p:spine 1:spine.001 spine.002 2:spine.003 3:spine.004 n:spine.005 spine.006 h:spine.007
spine t:thigh@ k:shin@ a:foot@ f:toe@
spine.004 c:shoulder@ s:upper_arm@ e:forearm@ w:hand@
)"},
      {"upper and lower by a letter", "l", "r", R"(
p:hips 1:spine1 2:spine2 3:spine3 n:neck h:head
hips t:@_uleg k:@_lleg a:@_foot f:@_toe
spine3 c:@_clav s:@_uarm e:@_larm w:@_hand
)"},
      {"upper and lower by a letter, joined", "L", "R", R"(
p:Hips 1:Spine 3:Chest n:Neck h:Head
Hips t:@ULeg k:@LLeg a:@Foot
Chest c:@Clavicle s:@UArm e:@LArm w:@Hand
)"},
      {"mgear", "L", "R", R"(
p:spine_C0_0_jnt 1:spine_C0_1_jnt 2:spine_C0_2_jnt 3:spine_C0_3_jnt n:neck_C0_0_jnt
neck_C0_0_jnt h:neck_C0_head_jnt
spine_C0_0_jnt t:leg_@0_0_jnt k:leg_@0_1_jnt a:leg_@0_end_jnt f:foot_@0_0_jnt foot_@0_1_jnt
spine_C0_3_jnt c:shoulder_@0_shoulder_jnt s:arm_@0_0_jnt e:arm_@0_1_jnt w:arm_@0_end_jnt
arm_@0_end_jnt finger_@0_0_jnt
arm_@0_end_jnt thumb_@0_0_jnt
)"},
      {"counted limbs", "_L", "_R", R"(
root p:hip 1:spine1 3:spine2 n:neck h:head
hip t:leg1@ k:leg2@ a:foot@ f:toe@
spine2 c:clavicle@ s:arm1@ e:arm2@ w:hand@
)"},
      {"3ds max CAT", "L", "R", R"(
p:CATRigPelvis 1:CATRigSpine1 2:CATRigSpine2 3:CATRigRibcage n:CATRigNeck h:CATRigHead
CATRigPelvis t:CATRig@Leg1 k:CATRig@Leg2 a:CATRig@LegAnkle
CATRigRibcage c:CATRig@ArmCollarbone s:CATRig@Arm1 e:CATRig@Arm2 w:CATRig@ArmPalm
)"},
      {"advanced skeleton, all of it", "_L", "_R", R"(
Group DeformationSystem p:Root_M 1:Spine1_M 2:Spine1Part1_M 3:Chest_M n:Neck_M NeckPart1_M h:Head_M
Root_M t:Hip@ HipPart1@ HipPart2@ k:Knee@ KneePart1@ a:Ankle@ f:Toes@ ToesEnd@
Chest_M c:Scapula@ s:Shoulder@ ShoulderPart1@ e:Elbow@ ElbowPart1@ w:Wrist@ Cup@ PinkyFinger1@
Head_M HeadEnd_M
)"},
      {"kinect", "Left", "Right", R"(
p:SpineBase 1:SpineMid 3:SpineShoulder n:Neck h:Head
SpineBase t:Hip@ k:Knee@ a:Ankle@ f:Foot@
SpineShoulder s:Shoulder@ e:Elbow@ w:Wrist@ Hand@ HandTip@
)"},
      {"arkit", "left", "right", R"(
root p:hips_joint 1:spine_1_joint spine_2_joint spine_3_joint 2:spine_4_joint spine_5_joint
spine_5_joint spine_6_joint 3:spine_7_joint n:neck_1_joint neck_2_joint neck_3_joint h:head_joint
hips_joint t:@_upLeg_joint k:@_leg_joint a:@_foot_joint f:@_toes_joint @_toesEnd_joint
spine_7_joint c:@_shoulder_1_joint s:@_arm_joint e:@_forearm_joint w:@_hand_joint
)"},
      {"pelvis and spine beside each other", "_l", "_r", R"(
Root p:pelvis
Root 1:spine_01 2:spine_02 3:spine_03 n:neck h:head
pelvis t:thigh@ k:calf@ a:foot@ f:ball@
spine_03 c:clavicle@ s:upperarm@ e:lowerarm@ w:hand@
)"},
      {"legs, pelvis and spine beside each other", "Left", "Right", R"(
Root p:Hips
Root 1:Spine 3:Chest n:Neck h:Head
Root t:@Thigh k:@Shin a:@Foot f:@Toe
Chest c:@Collar s:@UpperArm e:@ForeArm w:@Hand
)"},
      {"German", "_L", "_R", R"(
Wurzel p:Becken 1:Wirbelsäule 2:Bauch 3:Brust n:Hals h:Kopf Kiefer
Becken t:Oberschenkel@ k:Unterschenkel@ a:Fuß@ f:Zehen@
Brust c:Schlüsselbein@ s:Oberarm@ e:Unterarm@ w:Hand@ Zeigefinger1@
)"},
      {"German in words", "linke", "rechte", R"(
p:Huefte 1:Bauch 3:Brustkorb n:Nacken h:Kopf
Huefte t:@r_Schenkel k:@s_Knie a:@r_Knoechel f:@r_Fussballen
Brustkorb c:@_Schulter s:@r_Oberarm e:@r_Ellenbogen w:@s_Handgelenk
)"},
      {"French", "_gauche", "_droite", R"(
racine p:bassin 1:colonne1 2:colonne2 3:poitrine n:cou h:tête
bassin t:cuisse@ k:tibia@ a:cheville@ f:orteils@
poitrine c:clavicule@ s:bras@ e:avant_bras@ w:main@ pouce1@
)"},
      {"French by letters", "G", "D", R"(
p:Hanches 1:Dos 3:Torse n:Cou h:Tete
Hanches t:Cuisse_@ k:Genou_@ a:Pied_@
Torse s:Epaule_@ e:Coude_@ w:Poignet_@
)"},
      {"Spanish", "_izq", "_der", R"(
raíz p:cadera 1:columna 2:abdomen 3:pecho n:cuello h:cabeza
cadera t:muslo@ k:pantorrilla@ a:pie@ f:punta@
pecho c:clavícula@ s:brazo@ e:antebrazo@ w:muñeca@ mano@
)"},
      {"Italian", "_sx", "_dx", R"(
p:bacino 1:colonna 3:petto n:collo h:testa
bacino t:coscia@ k:polpaccio@ a:piede@ f:punta@
petto c:clavicola@ s:braccio@ e:avambraccio@ w:mano@
)"},
      {"Portuguese", "_esq", "_dir", R"(
p:quadril 1:coluna 3:peito n:pescoço h:cabeça
quadril t:coxa@ k:canela@ a:pé@ f:ponta@
peito c:clavícula@ s:braço@ e:antebraço@ w:mão@
)"},
      {"Chinese", "左", "右", R"(
根 p:骨盆 1:脊椎1 2:脊椎2 3:胸部 n:脖子 h:头部 下巴
骨盆 t:@大腿 k:@小腿 a:@脚踝 f:@脚趾
胸部 c:@肩膀 s:@上臂 e:@前臂 w:@手掌 @拇指1
)"},
      {"Chinese, plain", "左", "右", R"(
p:臀部 1:腰 3:胸 n:颈 h:头
臀部 t:@大腿 k:@膝盖 a:@脚
胸 c:@锁骨 s:@肩 e:@手肘 w:@手腕 @手
)"},
      {"Japanese, plain", "左", "右", R"(
p:腰 1:背骨 3:胸 n:首 h:頭
腰 t:@太もも k:@すね a:@足 f:@つま先
胸 c:@鎖骨 s:@上腕 e:@前腕 w:@手
)"},
      {"Japanese with the side behind", "左", "右", R"(
p:骨盤 1:背骨1 2:背骨2 3:胸 n:首 h:頭
骨盤 t:大腿.@ k:下腿.@ a:足首.@ f:足先.@
胸 c:肩.@ s:上腕.@ e:肘.@ w:手首.@
)"},
      {"Korean", "왼쪽", "오른쪽", R"(
p:골반 1:허리 3:가슴 n:목 h:머리
골반 t:@허벅지 k:@종아리 a:@발목 f:@발가락
가슴 c:@쇄골 s:@팔 e:@팔꿈치 w:@손목
)"},
      {"Russian", "_Л", "_П", R"(
p:Таз 1:Позвоночник 3:Грудь n:Шея h:Голова
Таз t:Бедро@ k:Голень@ a:Стопа@ f:Носок@
Грудь c:Ключица@ s:Плечо@ e:Предплечье@ w:Кисть@
)"}};
  return lists;
}

}  // namespace restage::test
