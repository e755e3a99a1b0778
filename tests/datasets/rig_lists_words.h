// Skeletons whose names take some reading: sides and limbs in other words, and fingers and toes
// that share one.
#pragma once

#include "tests/datasets/rig_lists.h"

namespace restage::test {

inline const std::vector<RigList>& rigs_of_words() {
  static const std::vector<RigList> lists = {
      {"Katakana", "左", "右", R"(
ルート p:ヒップ 1:スパイン 3:チェスト n:ネック h:ヘッド
ヒップ t:@アッパーレッグ k:@ロアーレッグ a:@フット f:@トゥ
チェスト c:@ショルダー s:@アッパーアーム e:@ロアーアーム w:@ハンド
)"},
      {"Katakana with the side behind", "_左", "_右", R"(
p:ヒップス 1:スパイン 2:スパイン1 3:スパイン2 n:ネック h:ヘッド
ヒップス t:アップレッグ@ k:レッグ@ a:フット@ f:トウベース@
スパイン2 c:ショルダー@ s:アーム@ e:フォアアーム@ w:ハンド@ インデックス1@
)"},
      {"Katakana, sides too", "レフト", "ライト", R"(
p:ペルビス 1:ウエスト 3:チェスト n:ネック h:ヘッド
ペルビス t:@サイ k:@ニー a:@アンクル
チェスト s:@ショルダー e:@エルボー w:@リスト
)"},
      {"Katakana of half width", "左", "右", R"(
p:ﾋｯﾌﾟ 1:ｽﾊﾟｲﾝ 3:ﾁｪｽﾄ n:ﾈｯｸ h:ﾍｯﾄﾞ
ﾋｯﾌﾟ t:@ｱｯﾊﾟｰﾚｯｸﾞ k:@ﾛｱｰﾚｯｸﾞ a:@ﾌｯﾄ
ﾁｪｽﾄ c:@ｼｮﾙﾀﾞｰ s:@ｱｯﾊﾟｰｱｰﾑ e:@ﾛｱｰｱｰﾑ w:@ﾊﾝﾄﾞ
)"},
      {"Katakana with L and R", "_L", "_R", R"(
p:ヒップ 1:スパイン 3:チェスト n:ネック h:ヘッド
ヒップ t:アップレッグ@ k:レッグ@ a:フット@ f:トゥ@
チェスト c:ショルダー@ s:アーム@ e:フォアアーム@ w:ハンド@
)"},
      {"Katakana with dots between words", "左・", "右・", R"(
p:ヒップ 1:スパイン 3:チェスト n:ネック h:ヘッド
ヒップ t:@アッパー・レッグ k:@ロアー・レッグ a:@フット
チェスト c:@ショルダー s:@アッパー・アーム e:@ロアー・アーム w:@ハンド
)"},
      {"Katakana, plain limbs", "左", "右", R"(
p:ヒップ 1:スパイン 3:チェスト n:ネック h:ヘッド
ヒップ t:@アッパーレッグ k:@ロウアーレッグ a:@フット f:@トー
チェスト c:@クラビクル s:@アーム e:@フォアアーム w:@ハンド @フィンガー1
)"},
      {"sides as lf and rt", "lf", "rt", R"(
p:root 1:spine_01 3:spine_02 n:neck h:head
root t:@_hip k:@_knee a:@_ankle f:@_toe
spine_02 c:@_clav s:@_shoulder e:@_elbow w:@_wrist
)"},
      {"sides as Lf and Rt, joined", "Lf", "Rt", R"(
p:Root 1:Spine 3:Chest n:Neck h:Head
Root t:@Hip k:@Knee a:@Foot
Chest c:@Clavicle s:@Shoulder e:@Elbow w:@Hand
)"},
      {"lf and rt, upper and lower", "lf", "rt", R"(
p:cog 1:spine_a 3:spine_b n:neck h:head
cog t:@_upleg k:@_loleg a:@_foot f:@_ball
spine_b c:@_clavicle s:@_uparm e:@_loarm w:@_hand
)"},
      {"sides behind as LF and RT", "_LF", "_RT", R"(
p:Pelvis 1:Spine 3:Chest n:Neck h:Head
Pelvis t:Hip@ k:Knee@ a:Ankle@ f:Toe@
Chest c:Clav@ s:Shoulder@ e:Elbow@ w:Wrist@
)"},
      {"sides as lft and rgt", "lft", "rgt", R"(
p:pelvis 1:spine1 3:chest n:neck h:head
pelvis t:@_thigh k:@_shin a:@_foot f:@_ball
chest c:@_clavicle s:@_upArm e:@_loArm w:@_hand
)"},
      {"Korean, short side behind", "왼", "오", R"(
p:골반 1:척추 3:가슴 n:목 h:머리
골반 t:허벅지_@ k:종아리_@ a:발_@ f:발가락_@
가슴 c:쇄골_@ s:위팔_@ e:아래팔_@ w:손_@ 손가락_@
)"},
      {"Korean, upper and lower by words", "왼", "오른", R"(
p:골반 1:허리 3:가슴 n:목 h:머리
골반 t:윗다리_@ k:아랫다리_@ a:발_@
가슴 c:어깨_@ s:윗팔_@ e:아랫팔_@ w:손_@
)"},
      {"Korean, side behind", "왼쪽", "오른쪽", R"(
p:골반 1:척추 3:가슴 n:목 h:머리
골반 t:다리_@ k:무릎_@ a:발목_@ f:발가락_@
가슴 c:어깨_@ s:팔_@ e:팔꿈치_@ w:손목_@
)"},
      {"Spanish toes", "_izq", "_der", R"(
p:cadera 1:columna 3:pecho n:cuello h:cabeza
cadera t:muslo@ k:pantorrilla@ a:pie@ f:Dedos@
pecho c:clavicula@ s:brazo@ e:antebrazo@ w:mano@ dedo1@
)"},
      {"Spanish, five toes", "_izq", "_der", R"(
p:cadera 1:columna 3:pecho n:cuello h:cabeza
cadera t:muslo@ k:pantorrilla@ a:pie@ f:dedo1@
pie@ dedo2@
pie@ dedo3@
pecho c:clavicula@ s:brazo@ e:antebrazo@ w:mano@ dedo1_mano@
mano@ dedo2_mano@
)"},
      {"Italian toes", "_sx", "_dx", R"(
p:bacino 1:colonna 3:petto n:collo h:testa
bacino t:coscia@ k:gamba@ a:piede@ f:DitaPiede@
petto c:clavicola@ s:braccio@ e:avambraccio@ w:mano@ dita@
)"},
      {"Italian toes below ankle and foot", "_sx", "_dx", R"(
p:bacino 1:colonna 3:petto n:collo h:testa
bacino t:coscia@ k:stinco@ a:caviglia@ piede@ f:Dita~P@
petto c:clavicola@ s:braccio@ e:avambraccio@ w:mano@ Dita@
)"},
      {"French toes", "_gauche", "_droite", R"(
p:bassin 1:colonne1 3:poitrine n:cou h:tete
bassin t:cuisse@ k:tibia@ a:cheville@ f:doigts_de_pied@
poitrine c:clavicule@ s:bras@ e:avant_bras@ w:main@ doigts@
)"},
      {"French toes below the foot", "_g", "_d", R"(
p:bassin 1:colonne1 3:poitrine n:cou h:tete
bassin t:cuisse@ k:tibia@ a:pied@ f:Doigts@
poitrine c:clavicule@ s:bras@ e:avant_bras@ w:main@ doigts_main@
)"},
      {"Portuguese toes", "_esq", "_dir", R"(
p:quadril 1:coluna 3:peito n:pescoço h:cabeça
quadril t:coxa@ k:canela@ a:pé@ f:dedos@
peito c:clavícula@ s:braço@ e:antebraço@ w:mão@ dedo@
)"},
      {"Russian toes", "_Л", "_П", R"(
p:Таз 1:Позвоночник 3:Грудь n:Шея h:Голова
Таз t:Бедро@ k:Голень@ a:Стопа@ f:Пальцы@
Грудь c:Ключица@ s:Плечо@ e:Предплечье@ w:Кисть@ Палец1@
)"},
      {"Russian toes of the leg", "_Л", "_П", R"(
p:Таз 1:Позвоночник 3:Грудь n:Шея h:Голова
Таз t:Бедро@ k:Голень@ a:Стопа@ f:Пальцы_ноги@
Грудь c:Ключица@ s:Плечо@ e:Предплечье@ w:Кисть@ Пальцы_руки@
)"},
      {"Chinese toes", "左", "右", R"(
根 p:骨盆 1:脊椎1 3:胸部 n:脖子 h:头部
骨盆 t:@大腿 k:@小腿 a:@脚 f:@脚指
胸部 c:@锁骨 s:@上臂 e:@前臂 w:@手 @手指1
)"},
      {"Japanese toes", "左", "右", R"(
p:腰 1:背骨 3:胸 n:首 h:頭
腰 t:@太もも k:@すね a:@足 f:@指
胸 c:@鎖骨 s:@上腕 e:@前腕 w:@手 @指1
)"},
      {"opensim", "_l", "_r", R"(
ground p:pelvis 1:torso h:head
pelvis t:femur@ k:tibia@ a:talus@ calcn@ f:toes@
torso s:humerus@ e:ulna@ radius@ w:hand@
)"},
      {"jedi academy", "l", "r", R"(
model_root p:pelvis 1:lower_lumbar 2:upper_lumbar 3:thoracic n:cervical h:cranium
pelvis t:@femurYZ @femurX k:@tibia a:@talus
thoracic c:@clavical s:@humerus @humerusX e:@radius @radiusX w:@hand
)"},
      {"sony mocopi", "l", "r", R"(
p:root 1:torso_1 torso_2 torso_3 2:torso_4 torso_5 torso_6 3:torso_7 n:neck_1 neck_2 h:head
root t:@_up_leg k:@_low_leg a:@_foot f:@_toes
torso_7 c:@_shoulder s:@_up_arm e:@_low_arm w:@_hand
)"}};
  return lists;
}

}  // namespace restage::test
