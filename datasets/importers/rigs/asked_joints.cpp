#include "datasets/importers/rigs/asked_joints.h"

#include "datasets/importers/motions/source_motion.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

/// 0 to 3: left and right leg, left and right arm; -1: trunk and head.
int limb_index(int joint) {
  constexpr int kOf[kJoints] = {-1, 0,  1, -1, 0,  1, -1, 0, 1, -1, 0,
                                1,  -1, 2, 3,  -1, 2, 3,  2, 3, 2,  3};
  return kOf[joint];
}

/// The joints of limbs below hips and shoulders, of the left side: each has one above it.
constexpr int kLower[] = {4, 7, 10, 18, 20};
bool is_below(int joint) {
  for (const int j : kLower)
    if (joint == j || joint == kMirror[j]) return true;
  return false;
}

class Asked {
 public:
  Asked(const SourceSkeleton& skeleton, const Bones& bones, const std::string& where,
        const std::string& mend)
      : skeleton_(skeleton), bones_(bones), where_(where), mend_(mend) {}

  void check() const {
    for (int j = 0; j < kJoints; ++j)
      for (int k = 0; k < j; ++k)
        if (named(j) && bones_[j] == bones_[k])
          refuse(cat("its bone ", quoted(j), " is named for two joints, ", kJointNames[k], " and ",
                     kJointNames[j]));
    for (int j = 0; j < kJoints; ++j)
      for (int k = 0; k < kJoints; ++k) check_pair(j, k);
    for (const int j : kLower) {
      for (const int lower : {j, kMirror[j]}) check_branch(lower);
      check_crossing(j);
    }
  }

 private:
  bool named(int j) const { return bones_[j] >= 0; }
  bool hangs(int j, int above) const { return hangs_on(skeleton_, bones_[j], bones_[above]); }
  std::string quoted(int j) const {
    return text::quote(skeleton_.names[static_cast<size_t>(bones_[j])]);
  }
  std::string bone_for(int j) const {
    return cat("the bone for ", kJointNames[j], ", ", quoted(j));
  }
  [[noreturn]] void refuse(const std::string& what) const { throw InputError(where_, what, mend_); }

  /// No bone hangs on another limb than its own, or on what is below it in its own; no limb hangs
  /// on the head.
  void check_pair(int j, int k) const {
    if (j == k || !named(j) || !named(k) || !hangs(j, k)) return;
    const int limb = limb_index(j), other = limb_index(k);
    const bool in_order =
        other < 0 ? k != kHead || limb < 0 : limb == other && j > k;  // numbers grow outwards
    if (!in_order) refuse(cat(bone_for(j), ", hangs on ", bone_for(k)));
  }

  /// A lower joint that does not hang on the one above it may hang beside it, but not where another
  /// part of the body hangs.
  void check_branch(int j) const {
    const int above = kParents[j];
    if (!named(j) || !named(above) || hangs(j, above)) return;
    const int both = carrier_of(skeleton_, bones_[above], bones_[j]);
    for (int b = skeleton_.parents[bones_[j]]; b != both; b = skeleton_.parents[b])
      for (int k = 0; k < kJoints; ++k)
        if (named(k) && !is_below(k) && hangs_on(skeleton_, bones_[k], b))
          refuse(
              cat(bone_for(j), ", hangs beside ", bone_for(k), ", and not on ", bone_for(above)));
  }

  /// Left and right of a lower joint, if one of them does not hang on the joint above it.
  void check_crossing(int left) const {
    constexpr double kSurely = 1.02;
    const int right = kMirror[left], above = kParents[left], other = kMirror[above];
    if (!named(left) || !named(right) || !named(above) || !named(other)) return;
    if (hangs(left, above) && hangs(right, other)) return;
    const std::vector<Vec3> zero = zero_positions(skeleton_);
    const auto length = [&](int j, int k) { return (zero[bones_[j]] - zero[bones_[k]]).norm(); };
    const double as_named = length(left, above) + length(right, other);
    const double crossed = length(left, other) + length(right, above);
    if (as_named > kSurely * crossed)
      refuse(cat(bone_for(left), ", lies by ", bone_for(other), ", and ", quoted(right), " by ",
                 quoted(above), ": left and right are exchanged"));
  }

  const SourceSkeleton& skeleton_;
  const Bones& bones_;
  const std::string& where_;
  const std::string& mend_;
};

}  // namespace

void check_asked(const SourceSkeleton& skeleton, const Bones& bones, const std::string& where,
                 const std::string& mend) {
  Asked(skeleton, bones, where, mend).check();
}

}  // namespace restage
