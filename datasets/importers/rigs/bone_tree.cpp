#include "datasets/importers/rigs/bone_tree.h"

#include <algorithm>

namespace restage {
namespace {

bool is_foot(BonePart part) {
  return part == BonePart::ankle || part == BonePart::foot || part == BonePart::toe;
}

}  // namespace

BoneTree bone_tree(const SourceSkeleton& skeleton, const std::vector<std::string>& plain,
                   size_t language) {
  BoneTree out{skeleton, {}};
  for (const std::string& name : plain) out.words.push_back(bone_words(name, language));
  for (size_t b = 0; b < plain.size(); ++b) {  // a parent comes before its children
    if (!out.words[b].digit) continue;
    int above = skeleton.parents[b];
    while (above >= 0 && out.words[above].part == BonePart::none) above = skeleton.parents[above];
    if (above < 0 || !is_foot(out.words[above].part)) continue;
    BoneWords& toe = out.words[b];
    toe.part = BonePart::toe;
    toe.helper = false;
    if (toe.number < 0) toe.number = toe.last_number;
    if (toe.side == BoneWords::middle) toe.side = out.words[above].side;
  }
  return out;
}

bool hangs_on(const SourceSkeleton& skeleton, int bone, int above) {
  while (bone > above) bone = skeleton.parents[bone];  // a parent comes before its children
  return bone == above;
}

int carrier_of(const SourceSkeleton& skeleton, int a, int b) {
  if (b < 0) return -1;
  while (a >= 0 && !hangs_on(skeleton, b, a)) a = skeleton.parents[a];
  return a;
}

std::vector<int> find_people(const BoneTree& tree) {
  const auto& words = tree.words;
  const auto& parents = tree.skeleton.parents;
  std::vector<uint8_t> below(words.size()), inner(words.size());
  constexpr uint8_t kAll = 31;
  std::vector<int> out;
  for (size_t b = words.size(); b-- > 0;) {
    const BoneWords& w = words[b];
    const int side = w.side;
    if (!w.helper && w.part == BonePart::head && w.side == BoneWords::middle) below[b] |= 1;
    if (!w.helper && side >= 0 && w.part == BonePart::hand) below[b] |= 2 << side;
    const bool foot = w.part == BonePart::foot || w.part == BonePart::ankle;
    if (!w.helper && side >= 0 && foot) below[b] |= 8 << side;
    const bool person = below[b] == kAll && !inner[b];
    if (person) out.push_back(static_cast<int>(b));
    if (parents[b] < 0) continue;
    below[parents[b]] |= below[b];
    inner[parents[b]] |= person || inner[b];
  }
  std::reverse(out.begin(), out.end());
  return out;
}

int chest_of(const BoneTree& tree, const Bones& bones) {
  const auto arm = [&](int side) {
    return bones[13 + side] >= 0 ? bones[13 + side] : bones[16 + side];
  };
  int out = arm(0) < 0 ? -1 : carrier_of(tree.skeleton, arm(0), arm(1));
  // 3ds Max hangs the collars on the neck.
  while (out >= 0 && tree.words[out].part == BonePart::neck) out = tree.skeleton.parents[out];
  return out;
}

}  // namespace restage
