// Joints that a file calls by names: trackers' words, and those of characters' bones.
#include <algorithm>
#include <cctype>

#include "autograd/base/words.h"
#include "datasets/importers/joints/joint_file.h"
#include "datasets/importers/rigs/bone_words.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::joints_detail {
namespace {

/// Lower-case letters and digits of a name, the side taken out: "LeftUpLeg" -> "upleg", 'l'.
struct PlainName {
  std::string name;
  std::string side;                ///< "left_", "right_" or empty
  std::vector<std::string> words;  ///< that the name is made of
};

/// Blanks between words, and between aB and LHip.
std::string with_blanks(const std::string& name) {
  std::string out;
  for (size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool starts =
        i > 0 && std::isupper(c) != 0 && std::islower(static_cast<unsigned char>(name[i - 1])) != 0;
    const bool second = i == 1 && std::isupper(c) != 0 && (name[0] == 'L' || name[0] == 'R') &&
                        name.size() > 2 && std::islower(static_cast<unsigned char>(name[2])) != 0;
    if (starts || second) out += ' ';
    out += std::isalnum(c) != 0 ? static_cast<char>(std::tolower(c)) : ' ';
  }
  return out;
}

PlainName plain(const std::string& name) {
  const std::string words = with_blanks(name);
  PlainName out;
  std::string_view rest = words;
  for (std::string_view word = text::take_word(rest); !word.empty(); word = text::take_word(rest)) {
    if (word == "left" || word == "l")
      out.side = "left_";
    else if (word == "right" || word == "r")
      out.side = "right_";
    else
      out.words.emplace_back(word), out.name += word;
  }
  for (const auto& [start, side] : {std::pair("left", "left_"), std::pair("right", "right_")})
    if (out.side.empty() && out.name.starts_with(start) && out.name.size() > 5) {
      out.side = side;
      out.name.erase(0, std::string_view(start).size());
    }
  return out;
}

/// What a joint of this plain name is in a layout; "-" for others. "arm", "limb_hand", "limb_foot"
/// and the spine's say what they are beside others only.
std::string_view word_called(const std::string& name, bool sided) {
  using Words = std::vector<std::pair<std::string_view, std::vector<std::string_view>>>;
  static const Words both = {{"hip", {"hip", "upleg", "upperleg", "thigh"}},
                             {"knee", {"knee", "leg", "lowerleg", "shin", "calf"}},
                             {"ankle", {"ankle"}},
                             {"toe", {"bigtoe", "footindex", "toe", "toes"}},
                             {"toe_base", {"toebase", "ball"}},
                             {"small_toe", {"smalltoe"}},
                             {"heel", {"heel"}},
                             {"limb_foot", {"foot"}},
                             {"collar", {"collar", "clavicle", "thorax"}},
                             {"shoulder", {"shoulder"}},
                             {"arm", {"arm", "upperarm"}},
                             {"elbow", {"elbow", "forearm", "lowerarm"}},
                             {"wrist", {"wrist"}},
                             {"limb_hand", {"hand"}},
                             {"hand", {"middle1"}},
                             {"index", {"index", "index1"}},
                             {"pinky", {"pinky", "pinky1"}},
                             {"ear", {"ear"}}};
  static const Words single = {{"pelvis", {"pelvis", "hips", "root", "spinebase"}},
                               {"spine", {"spine"}},
                               {"spine1", {"spine1", "spinenavel", "navel"}},
                               {"spine2", {"spine2", "spinemid"}},
                               {"spine3", {"spine3", "spinechest"}},
                               {"chest", {"chest"}},
                               {"upper_chest", {"upperchest"}},
                               {"neck", {"neck", "spineshoulder"}},
                               {"head", {"head"}},
                               {"nose", {"nose"}}};
  for (const auto& [word, names] : sided ? both : single)
    if (std::find(names.begin(), names.end(), name) != names.end()) return word;
  return "-";
}

/// The same of a bone's part, as the rigs of characters call it (bone_words.h).
std::string_view word_of_bone(const BoneWords& bone) {
  if (bone.helper) return "-";
  const bool sided = bone.side != BoneWords::middle;
  switch (bone.part) {
    case BonePart::pelvis:
      return sided ? "-" : "pelvis";
    case BonePart::hip:
      return sided ? "hip" : "pelvis";
    case BonePart::neck:
      return sided ? "-" : "neck";
    case BonePart::head:
      return sided ? "-" : "head";
    case BonePart::collar:
      return sided ? "collar" : "-";
    case BonePart::shoulder:
      return sided ? "shoulder" : "-";
    case BonePart::upper_arm:
    case BonePart::arm:
      return sided ? "arm" : "-";
    case BonePart::forearm:
      return sided ? "elbow" : "-";
    case BonePart::hand:
    case BonePart::palm:
      return sided ? "limb_hand" : "-";
    case BonePart::thigh:
      return sided ? "hip" : "-";
    case BonePart::leg:
    case BonePart::shin:
      return sided ? "knee" : "-";
    case BonePart::ankle:
      return sided ? "ankle" : "-";
    case BonePart::foot:
      return sided ? "limb_foot" : "-";
    case BonePart::toe:
      return sided ? "toe_base" : "-";
    case BonePart::spine:
    case BonePart::none:
      return "-";
  }
  return "-";
}

struct CalledJoint {
  std::string side;  ///< "left_", "right_" or empty
  std::string word = "-";
};

/// `name`: without decoration, which may be the side where `written` names of one side only.
CalledJoint called(const std::string& name, const std::string& written) {
  PlainName one = plain(name);
  if (one.side.empty()) one.side = plain(written).side;
  CalledJoint out{one.side, std::string(word_called(one.name, !one.side.empty()))};
  if (out.word != "-") return out;
  // "PoseLandmark.LEFT_HIP": what stands before is passed over, as little of it as can be.
  for (size_t i = 1; i < one.words.size() && out.word == "-"; ++i) {
    std::string tail;
    for (size_t k = i; k < one.words.size(); ++k) tail += one.words[k];
    out.word = word_called(tail, !one.side.empty());
    // "UpLeg" without its first word is another bone.
    if (out.word == "knee" || out.word == "arm") out.word = "-";
  }
  if (out.word != "-") return out;
  BoneWords bone = bone_words(name);
  if (bone.side == BoneWords::middle && !out.side.empty())
    bone.side = out.side == "left_" ? BoneWords::left : BoneWords::right;
  out.word = word_of_bone(bone);
  if (bone.side != BoneWords::middle) out.side = bone.side == BoneWords::left ? "left_" : "right_";
  return out;
}

/// Gives words that depend on the others of a side, or of the trunk, their meaning.
void settle(std::vector<CalledJoint>& joints) {
  const auto has = [&](const std::string& side, std::string_view word) {
    return std::any_of(joints.begin(), joints.end(), [&](const CalledJoint& one) {
      return one.side == side && one.word == word;
    });
  };
  const auto turn = [&](const std::string& side, std::string_view from, std::string_view to) {
    for (CalledJoint& one : joints)
      if (one.side == side && one.word == from) one.word = to;
  };
  for (const std::string side : {"left_", "right_"}) {
    // Of bones the shoulder carries the arm; the bone of a foot begins at the ankle.
    if (has(side, "arm") && has(side, "shoulder") && !has(side, "collar"))
      turn(side, "shoulder", "collar");
    if (!has(side, "shoulder")) turn(side, "arm", "shoulder");
    turn(side, "limb_hand", has(side, "wrist") ? "hand" : "wrist");
    const bool of_bones = has(side, "limb_foot") && !has(side, "ankle");
    turn(side, "limb_foot", of_bones ? "ankle" : "foot");
    if (of_bones && !has(side, "toe_base")) turn(side, "toe", "toe_base");
    turn(side, "toe_base", has(side, "foot") ? "toe" : "foot");
  }
  if (has("", "spine") && has("", "spine1"))
    turn("", "spine2", "spine3"), turn("", "spine1", "spine2");
  turn("", "spine", "spine1");
  turn("", "chest", has("", "upper_chest") ? "spine2" : "spine3");
  turn("", "upper_chest", "spine3");
}

/// Words live as long as the program: names are few. "-" for what no layout has.
std::string_view word_of_layout(const CalledJoint& joint) {
  static const std::vector<std::string> kWords = [] {
    std::vector<std::string> out = {"pelvis", "spine1", "spine2", "spine3", "neck", "head", "nose"};
    for (const char* side : {"left_", "right_"})
      for (const char* word : {"hip", "knee", "ankle", "toe", "small_toe", "heel", "foot", "collar",
                               "shoulder", "elbow", "wrist", "hand", "index", "pinky", "ear"})
        out.push_back(std::string(side) + word);
    return out;
  }();
  const auto at = std::find(kWords.begin(), kWords.end(), joint.side + joint.word);
  return at == kWords.end() ? std::string_view("-") : std::string_view(*at);
}

}  // namespace

JointLayout named_layout(const std::vector<std::string>& names) {
  JointLayout out{"named", "joints called by names", {}, names.size()};
  std::vector<CalledJoint> joints;
  const std::vector<std::string> bare = undecorated(names);
  for (size_t i = 0; i < names.size(); ++i) joints.push_back(called(bare[i], names[i]));
  settle(joints);
  for (size_t i = 0; i < joints.size(); ++i) {
    std::string_view word = word_of_layout(joints[i]);
    if (std::find(out.joints.begin(), out.joints.end(), word) != out.joints.end()) word = "-";
    out.joints.push_back(word);
    if (word == "-") out.unknown.push_back(names[i]);
  }
  return out;
}

}  // namespace restage::joints_detail
