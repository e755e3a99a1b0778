// What the name of a bone says: which side, which part of the body, and whether it is only a helper
// (a twist bone, a finger, a control). Names are cut into words, so that "mixamorig:LeftUpLeg",
// "thigh.L", "b_l_upleg" and "LThigh_012" all say "thigh, left".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace restage {

enum class BonePart : uint8_t {
  none,
  pelvis,
  hip,  ///< "hips" without a side is the pelvis, with one a joint of the thigh
  spine,
  neck,
  head,
  collar,
  shoulder,  ///< the collar, or the upper arm where nothing else is
  upper_arm,
  arm,  ///< the upper arm, or the forearm below a bone that is called upper arm
  forearm,
  hand,
  palm,  ///< the hand where nothing else is
  thigh,
  leg,  ///< the thigh above a shin, or the shin below a thigh
  shin,
  ankle,
  foot,
  toe
};

struct BoneWords {
  enum Side : int8_t { middle = -1, left = 0, right = 1 };
  Side side = middle;
  BonePart part = BonePart::none;  ///< the last word that names a part: "foot_toe" is a toe
  bool helper = false;             ///< twist, IK, control, end, finger, face, cloth, weapon ...
  bool end = false;                ///< a helper at the end of a bone: "LeftArm_end"
  /// Finger or toe, of which the name does not tell (Spanish "dedo"); a helper until bone_tree()
  /// sees where the bone hangs.
  bool digit = false;
  int number = -1;       ///< the digits after the part; -1: none
  int last_number = -1;  ///< the last digits of the name; -1: none
  /// How far the name is from a plain one: unknown words, further parts, a number.
  int cost = 0;
};

/// By the words of one of bone_dictionaries(). Accents count for nothing.
BoneWords bone_words(std::string_view name, size_t language = 0);

/// The name of the same bone on the other side, in lower case; "" of a name without a side.
std::string other_side(std::string_view name);

/// Names without what they are decorated with: what stands before a ':' or '|', beginnings and
/// endings that three quarters of them share ("Skeleton_001_", "_jnt"), and numbers that three
/// quarters of them end with (".001", "_017"). A word that may tell bones apart (a side, "ctrl",
/// "end") is decoration only if nine tenths share it and no two bones would then have one name.
/// What is nothing but decoration stays.
std::vector<std::string> undecorated(const std::vector<std::string>& names);

}  // namespace restage
