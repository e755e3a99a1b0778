#include "datasets/importers/rigs/bone_dictionary.h"

#include <algorithm>
#include <string_view>

namespace restage {
namespace {

/// Adds words, separated by blanks. A later meaning of a word replaces an earlier one.
void add_words(BoneDictionary& out, BoneWord word, std::string_view words) {
  while (!words.empty()) {
    const size_t end = std::min(words.find(' '), words.size());
    if (end > 0) out[std::string(words.substr(0, end))] = word;
    words.remove_prefix(std::min(end + 1, words.size()));
  }
}

BoneDictionary english_words() {
  BoneDictionary out;
  const auto part = [&](BonePart is, std::string_view text) {
    add_words(out, {BoneWordKind::part, is}, text);
  };
  const auto kind = [&](BoneWordKind is, std::string_view text) {
    add_words(out, {is, BonePart::none}, text);
  };
  part(BonePart::pelvis, "pelvis pelvic sacrum lowerbody 下半身");
  part(BonePart::hip, "hip hips");
  part(BonePart::spine,
       "spine chest torso trunk abdomen abs ab waist back thorax rib ribs ribcage lumbar belly "
       "stomach sternum vertebra thoracic upperback lowerback upperbody 上半身");
  part(BonePart::neck, "neck cervical 首");
  part(BonePart::head, "head cranium 頭");
  part(BonePart::collar, "clavicle collar collarbone clav scapula 肩");
  part(BonePart::shoulder, "shoulder shldr");
  part(BonePart::upper_arm, "upperarm uparm uarm humerus bicep biceps 腕");
  part(BonePart::arm, "arm");
  part(BonePart::forearm, "forearm farm elbow radius ulna ひじ 肘");
  part(BonePart::hand, "hand wrist 手首");
  part(BonePart::palm, "palm fist 手");
  part(BonePart::thigh, "thigh upleg uleg femur 足");
  part(BonePart::leg, "leg");
  part(BonePart::shin, "shin calf knee shank tibia crus ひざ 膝");
  part(BonePart::ankle, "ankle talus 足首");
  part(BonePart::foot, "foot calcaneus calcn");
  part(BonePart::toe, "toe toes toebase ball つま先");
  out["larm"] = {BoneWordKind::l_and_part, BonePart::arm};
  out["lleg"] = {BoneWordKind::l_and_part, BonePart::leg};
  kind(BoneWordKind::left, "left l lft lf lt lhs 左");
  kind(BoneWordKind::right, "right r rgt rt rght rhs 右");
  kind(BoneWordKind::upper, "upper up");
  kind(BoneWordKind::lower, "lower low lo fore");
  kind(BoneWordKind::end, "end");
  kind(BoneWordKind::digit, "digit digits phalanx phalange phalanges 親指 人指 中指 薬指 小指 指");
  kind(BoneWordKind::plain,
       "bone bones joint joints jnt jt bn bind bnd skin def deform drv rig armature skeleton base "
       "bend stretch main c m x y z xy yz xz center centre mid");
  kind(BoneWordKind::helper,
       "twist roll ik fk pole ctrl ctl control controller con target goal nub tip top eff "
       "effector site aux corrective helper muscle volume jiggle dyn phys sec adj mch org vis "
       "tweak gizmo locator socket attach prop weapon sword gun shield slot camera pivot reverse "
       "heel hook parent space switch dummy grp group offset zero null auto sdk part "
       "thumb index middle ring pinky pinkie little finger fingers metacarpal metacarpals carpal "
       "metatarsal metatarsals knuckle bigtoe indextoe middletoe ringtoe littletoe "
       "eye eyes eyelid brow eyebrow jaw tongue teeth tooth lip lips cheek nose ear hair beard "
       "mouth chin face facial pony ponytail hat helmet bangs "
       "breast bust boob butt buttock glute pec skirt cape cloth tail wing cloak coat scarf "
       "strap pad armor armour pauldron belt bag quiver holster "
       "捩 捩れ 補助 キャンセル 先");
  return out;
}

/// Words of one language, by part. `uppers` and `lowers` go with the words for arm and leg.
struct LanguageWords {
  std::string_view lefts, rights, uppers, lowers;
  std::string_view pelvis, hip, spine, neck, head, collar, shoulder;
  std::string_view upper_arm, arm, forearm, hand, palm;
  std::string_view thigh, leg, shin, ankle, foot, toe;
  std::string_view helpers, plains;
  std::string_view digits = {};   ///< fingers and toes
  std::string_view without = {};  ///< words of other languages that mean nothing in this one
};

constexpr LanguageWords kLanguageWords[] = {
    {.lefts = "links linke linker linkes li",  // German
     .rights = "rechts rechte rechter rechtes re",
     .uppers = "ober obere oberer oberes oben",
     .lowers = "unter untere unterer unteres unten",
     .pelvis = "becken",
     .hip = "hufte huefte huften hueften",
     .spine = "wirbelsaule wirbelsaeule wirbel rucken ruecken brust brustkorb bauch rumpf taille "
              "oberkorper oberkoerper",
     .neck = "hals nacken",
     .head = "kopf",
     .collar = "schlusselbein schluesselbein schulterblatt",
     .shoulder = "schulter",
     .upper_arm = "oberarm",
     .arm = "arm",
     .forearm = "unterarm vorderarm ellenbogen ellbogen",
     .hand = "hand handgelenk",
     .palm = "handflache handflaeche faust",
     .thigh = "oberschenkel schenkel oberbein",
     .leg = "bein",
     .shin = "unterschenkel unterbein knie wade schienbein",
     .ankle = "knochel knoechel fussgelenk sprunggelenk fussknochel",
     .foot = "fuss",
     .toe = "zeh zehe zehen fussballen ballen fussspitze",
     .helpers = "daumen zeigefinger mittelfinger ringfinger kleinerfinger klein ferse auge kiefer "
                "haar drehung ende ziel zunge ohr",
     .plains = "knochen gelenk wurzel"},
    {.lefts = "gauche g gau",  // French
     .rights = "droite droit d dro",
     .uppers = "haut haute superieur superieure",
     .lowers = "bas basse inferieur inferieure",
     .pelvis = "bassin",
     .hip = "hanche hanches",
     .spine = "colonne vertebrale rachis dos torse poitrine thorax ventre abdomen taille buste",
     .neck = "cou nuque",
     .head = "tete",
     .collar = "clavicule omoplate",
     .shoulder = "epaule",
     .upper_arm = "hautbras hautdubras",
     .arm = "bras",
     .forearm = "avantbras coude",
     .hand = "main poignet",
     .palm = "paume poing",
     .thigh = "cuisse",
     .leg = "jambe",
     .shin = "tibia mollet genou",
     .ankle = "cheville",
     .foot = "pied",
     .toe = "orteil orteils pointe",
     .helpers = "pouce index majeur annulaire auriculaire talon oeil yeux machoire "
                "cheveux torsion fin cible langue oreille",
     .plains = "os articulation racine de du la le",
     .digits = "doigt doigts phalange phalanges"},
    {.lefts = "izquierda izquierdo izq izda izdo i",  // Spanish
     .rights = "derecha derecho der dcha dcho d",
     .uppers = "superior alto",
     .lowers = "inferior bajo",
     .pelvis = "pelvis",
     .hip = "cadera caderas",
     .spine = "columna espina espalda torso pecho torax vientre abdomen cintura tronco",
     .neck = "cuello",
     .head = "cabeza",
     .collar = "clavicula escapula omoplato",
     .shoulder = "hombro",
     .upper_arm = "brazosuperior",
     .arm = "brazo",
     .forearm = "antebrazo codo",
     .hand = "mano muneca",
     .palm = "palma puno",
     .thigh = "muslo",
     .leg = "pierna",
     .shin = "pantorrilla espinilla tibia rodilla canilla",
     .ankle = "tobillo",
     .foot = "pie",
     .toe = "punta puntera",
     .helpers = "pulgar indice medio anular menique talon ojo ojos mandibula pelo fin "
                "torsion objetivo lengua oreja",
     .plains = "hueso articulacion raiz de del la el",
     .digits = "dedo dedos falange falanges"},
    {.lefts = "sinistra sinistro sin sx",  // Italian
     .rights = "destra destro dx",
     .uppers = "superiore",
     .lowers = "inferiore",
     .pelvis = "bacino pelvi",
     .hip = "anca anche",
     .spine = "colonna spina schiena torso petto torace addome vita busto",
     .neck = "collo",
     .head = "testa",
     .collar = "clavicola scapola",
     .shoulder = "spalla",
     .upper_arm = "omero",
     .arm = "braccio",
     .forearm = "avambraccio gomito",
     .hand = "mano polso",
     .palm = "palmo pugno",
     .thigh = "coscia",
     .leg = "gamba",
     .shin = "polpaccio stinco tibia ginocchio",
     .ankle = "caviglia",
     .foot = "piede",
     .toe = "punta alluce",
     .helpers = "pollice indice medio anulare mignolo tallone occhio occhi mascella "
                "capelli torsione fine lingua orecchio",
     .plains = "osso giunto radice",
     .digits = "dito dita falange falangi"},
    {.lefts = "esquerda esquerdo esq e",  // Portuguese
     .rights = "direita direito dir d",
     .uppers = "superior",
     .lowers = "inferior",
     .pelvis = "pelve bacia",
     .hip = "quadril quadris anca",
     .spine = "coluna espinha costas torso tronco peito torax barriga abdomen cintura",
     .neck = "pescoco",
     .head = "cabeca",
     .collar = "clavicula escapula",
     .shoulder = "ombro",
     .upper_arm = "bracosuperior",
     .arm = "braco",
     .forearm = "antebraco cotovelo",
     .hand = "mao pulso",
     .palm = "palma punho",
     .thigh = "coxa",
     .leg = "perna",
     .shin = "canela panturrilha tibia joelho",
     .ankle = "tornozelo",
     .foot = "pe",
     .toe = "ponta biqueira artelho artelhos",
     .helpers = "polegar indicador medio anelar minimo calcanhar olho olhos mandibula "
                "cabelo fim torcao lingua orelha",
     .plains = "osso articulacao raiz de do da",
     .digits = "dedo dedos falange falanges"},
    {.lefts = "左侧 左側",  // Chinese; 手首 and 足首 are Japanese
     .rights = "右侧 右側",
     .uppers = "上",
     .lowers = "下 前 小",
     .pelvis = "骨盆 盆骨",
     .hip = "臀 臀部 胯 胯部 髋 髖 髋部 屁股",
     .spine =
         "脊柱 脊椎 脊骨 脊 腰 腰部 腰椎 胸 胸部 胸腔 胸椎 上胸 背 背部 腹 腹部 躯干 軀幹 上身",
     .neck = "脖子 脖 颈 頸 颈部 頸部 颈椎 頸椎",
     .head = "头 頭 头部 頭部 头骨 頭骨",
     .collar = "锁骨 鎖骨 肩胛 肩胛骨",
     .shoulder = "肩 肩膀 肩部",
     .upper_arm = "上臂 大臂 上臂骨 肱骨 上腕",
     .arm = "臂 手臂 胳膊",
     .forearm = "前臂 小臂 下臂 前腕 下腕 肘 手肘 肘部 胳膊肘",
     .hand = "手腕 腕 腕部 手腕部",
     .palm = "手 手掌 手部 掌",
     .thigh = "大腿 大腿骨 股骨",
     .leg = "腿 腿部",
     .shin = "小腿 膝 膝盖 膝蓋 胫骨 脛骨 小腿骨",
     .ankle = "脚踝 腳踝 踝 踝部 足踝 脚腕 腳腕",
     .foot = "脚 腳 足 脚掌 腳掌 脚部 足部",
     .toe = "脚趾 腳趾 脚尖 腳尖 足趾 足尖 趾 趾头 趾頭",
     .helpers = "手指 脚跟 腳跟 眼 下巴 舌 牙 "
                "发 髮 头发 頭髮 裙 尾 扭转 扭轉 末端 控制 控制器 目标 目標",
     .plains = "骨 骨骼 关节 關節 部 根 节 節",
     .digits = "拇指 大拇指 食指 中指 无名指 無名指 小指 小拇指 指 指头 指頭",
     .without = "首 手首 足首 ひじ ひざ つま先"},
    {.lefts = "ひだり レフト",  // Japanese, where 足 is the foot
     .rights = "みぎ ライト",
     .uppers = "上 アッパー アップ",
     .lowers = "下 前 ロア ロアー ロウアー ロワー ロー フォア",
     .pelvis = "骨盤 こし 腰 ペルビス ペルヴィス",
     .hip = "尻 臀部 股関節 ヒップ ヒップス",
     .spine = "背骨 脊椎 脊柱 背中 背 胸 胸部 腹 腹部 お腹 胴 胴体 むね スパイン チェスト "
              "トルソ トルソー ウエスト ウェスト バック",
     .neck = "首 くび 頸 ネック",
     .head = "頭 頭部 あたま ヘッド",
     .collar = "鎖骨 肩甲骨 クラビクル クラヴィクル カラー",
     .shoulder = "肩 かた ショルダー ショルダ",
     .upper_arm = "上腕 二の腕",
     .arm = "腕 うで アーム",
     .forearm = "前腕 下腕 ひじ 肘 肘関節 エルボー エルボ",
     .hand = "手首 てくび ハンド リスト",
     .palm = "手 て 掌 手のひら パーム",
     .thigh = "太もも 太腿 もも 腿 大腿 大腿部 ふともも 上腿 股 サイ",
     .leg = "脚 レッグ レグ",
     .shin = "すね 脛 ふくらはぎ 下腿 ひざ 膝 膝関節 シン ニー カーフ",
     .ankle = "足首 あしくび 足関節 くるぶし アンクル",
     .foot = "足 あし フット",
     .toe = "つま先 爪先 足先 足指 足の指 足趾 トゥ トゥー トー トウ トゥベース",
     .helpers =
         "かかと 踵 目 顎 舌 髪 髪の毛 スカート 捩 "
         "フィンガー サム インデックス ミドル リング ピンキー アイ ジョー ヘア ヒール ツイスト "
         "ロール コントロール コントローラー ターゲット ポール 先端 エンド",
     .plains = "骨 部 の ・ 関節 ボーン ジョイント ルート センター ベース メイン",
     .digits = "親指 人差指 人差し指 中指 薬指 小指 指 ゆび"},
    {.lefts = "왼쪽 왼 왼편 좌 좌측",  // Korean
     .rights = "오른쪽 오른 오른편 오 우 우측",
     .uppers = "위 위쪽 윗 윗쪽 상",
     .lowers = "아래 아래쪽 아랫 하 앞",
     .pelvis = "골반",
     .hip = "엉덩이 고관절",
     .spine = "척추 가슴 허리 등 배 몸통 흉부",
     .neck = "목",
     .head = "머리",
     .collar = "쇄골",
     .shoulder = "어깨",
     .upper_arm = "상완 위팔 윗팔",
     .arm = "팔",
     .forearm = "전완 하완 아래팔 팔꿈치 팔뚝",
     .hand = "손목",
     .palm = "손 손바닥",
     .thigh = "허벅지 대퇴",
     .leg = "다리",
     .shin = "종아리 정강이 무릎",
     .ankle = "발목",
     .foot = "발",
     .toe = "발가락 발끝",
     .helpers = "손가락 눈 턱 혀 머리카락 치마 발뒤꿈치",
     .plains = "뼈 관절",
     .digits = "엄지 검지 중지 약지 소지 지골"},
    {.lefts = "левый левая левое лев л",  // Russian
     .rights = "правый правая правое прав п",
     .uppers = "верх верхний верхняя верхнее",
     .lowers = "низ нижний нижняя нижнее",
     .pelvis = "таз",
     .hip = "тазобедренный",
     .spine = "позвоночник спина грудь живот поясница торс туловище",
     .neck = "шея",
     .head = "голова",
     .collar = "ключица лопатка",
     .shoulder = "плечо",
     .upper_arm = "плечевая",
     .arm = "рука руки",
     .forearm = "предплечье локоть",
     .hand = "кисть запястье",
     .palm = "ладонь",
     .thigh = "бедро",
     .leg = "нога ноги ног",
     .shin = "голень колено икра",
     .ankle = "лодыжка щиколотка",
     .foot = "стопа стопы ступня ступни",
     .toe = "носок носки",
     .helpers = "пятка глаз глаза челюсть волосы язык",
     .plains = "кость сустав корень",
     .digits = "палец пальцы пальцев фаланга фаланги"}};

BoneDictionary with_language(const BoneDictionary& base, const LanguageWords& words) {
  BoneDictionary out = base;
  BoneDictionary foreign;
  add_words(foreign, {}, words.without);
  for (const auto& [word, meaning] : foreign) out.erase(word);
  using P = BonePart;
  for (const auto& [part, text] :
       std::initializer_list<std::pair<P, std::string_view>>{{P::pelvis, words.pelvis},
                                                             {P::hip, words.hip},
                                                             {P::spine, words.spine},
                                                             {P::neck, words.neck},
                                                             {P::head, words.head},
                                                             {P::collar, words.collar},
                                                             {P::shoulder, words.shoulder},
                                                             {P::upper_arm, words.upper_arm},
                                                             {P::arm, words.arm},
                                                             {P::forearm, words.forearm},
                                                             {P::hand, words.hand},
                                                             {P::palm, words.palm},
                                                             {P::thigh, words.thigh},
                                                             {P::leg, words.leg},
                                                             {P::shin, words.shin},
                                                             {P::ankle, words.ankle},
                                                             {P::foot, words.foot},
                                                             {P::toe, words.toe}})
    add_words(out, {BoneWordKind::part, part}, text);
  add_words(out, {BoneWordKind::left, P::none}, words.lefts);
  add_words(out, {BoneWordKind::right, P::none}, words.rights);
  add_words(out, {BoneWordKind::upper, P::none}, words.uppers);
  add_words(out, {BoneWordKind::lower, P::none}, words.lowers);
  add_words(out, {BoneWordKind::digit, P::none}, words.digits);
  add_words(out, {BoneWordKind::helper, P::none}, words.helpers);
  add_words(out, {BoneWordKind::plain, P::none}, words.plains);
  return out;
}

}  // namespace

const std::vector<BoneDictionary>& bone_dictionaries() {
  static const std::vector<BoneDictionary> all = [] {
    std::vector<BoneDictionary> out = {english_words()};
    for (const LanguageWords& words : kLanguageWords) out.push_back(with_language(out[0], words));
    return out;
  }();
  return all;
}

}  // namespace restage
