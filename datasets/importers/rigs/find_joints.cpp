#include "datasets/importers/rigs/find_joints.h"

#include <algorithm>
#include <optional>
#include <tuple>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using BoneParts = std::initializer_list<BonePart>;

bool is(const BoneWords& words, BoneParts parts) {
  return std::find(parts.begin(), parts.end(), words.part) != parts.end();
}

/// What the bones of a limb are called, and which joints they are: from the trunk outwards.
struct LimbWords {
  const char* name;
  std::array<int, 3> joints;  ///< of the left side
  BonePart upper, lower, either;
  std::array<BonePart, 2> ends;  ///< the surer first
  BonePart root;                 ///< the upper bone where nothing else is
};
constexpr LimbWords kArm = {"arm",
                            {16, 18, 20},
                            BonePart::upper_arm,
                            BonePart::forearm,
                            BonePart::arm,
                            {BonePart::hand, BonePart::palm},
                            BonePart::shoulder};
constexpr LimbWords kLeg = {"leg",          {1, 4, 7},     BonePart::thigh,
                            BonePart::shin, BonePart::leg, {BonePart::ankle, BonePart::foot},
                            BonePart::hip};

/// The bones of a limb, from the trunk outwards.
struct FoundLimb {
  int root = -1;  ///< collar; -1: none
  int upper = -1, lower = -1, end = -1;
  int cost = 0;
  int lacks = 0;      ///< 0: nothing; 1: upper, 2: lower, 3: end (then nothing else is known)
  int stranger = -1;  ///< a bone within it that is neither known nor a helper
};

class Finder {
 public:
  Finder(const BoneTree& tree, int top)
      : tree_(tree), skeleton_(tree.skeleton), words_(tree.words), top_(top) {}

  FoundJoints find() {
    out_.bones.fill(-1);
    for (const int side : {0, 1}) {
      if (const FoundLimb leg = take_limb(side, kLeg); leg.lacks == 0)
        out_.bones[10 + side] = toe_of(leg.end, side);
      if (const FoundLimb arm = take_limb(side, kArm); arm.lacks == 0)
        out_.bones[13 + side] = arm.root;
    }
    find_head();
    if (out_.missing.empty()) find_trunk();
    std::sort(out_.missing.begin(), out_.missing.end());
    return out_;
  }

  Bones complete(const Bones& listed, const std::array<bool, kJoints>& open) {
    out_.bones = listed;
    const int chest = chest_of(tree_, listed), pelvis = listed[kPelvis];
    if (chest == pelvis || !hangs_on(skeleton_, chest, pelvis)) return listed;
    complete_spine(chest, open);
    if (open[kNeck] && hangs_on(skeleton_, listed[kHead], chest)) find_neck(chest);
    const int left = nameless_collar(0, chest), right = nameless_collar(1, chest);
    if (open[13] && open[14] && left >= 0 && right >= 0)
      out_.bones[13] = left, out_.bones[14] = right;
    return out_.bones;
  }

 private:
  struct Segment {
    int joint;
    bool named;  ///< some bone is called so
  };

  bool inside(int b) const { return top_ < 0 || hangs_on(skeleton_, b, top_); }
  int parent(int b) const { return skeleton_.parents[b]; }
  int size() const { return static_cast<int>(words_.size()); }
  bool may_be(int b, int side) const { return words_[b].side == side && !words_[b].helper; }
  void lacks(int joint, const std::string& why = "") {
    out_.missing.push_back(joint);
    if (out_.why.empty()) out_.why = why;
  }

  /// The plainest bone of a path that is called so, the highest of equals; -1: there is none.
  int plainest(const std::vector<int>& path, BonePart part) const {
    int best = -1;
    for (const int b : path)
      if (words_[b].part == part && (best < 0 || words_[b].cost < words_[best].cost)) best = b;
    return best;
  }
  int plainest(const std::vector<int>& path, BonePart sure, BonePart otherwise) const {
    const int out = plainest(path, sure);
    return out >= 0 ? out : plainest(path, otherwise);
  }
  /// The collar on a path; of several none that lies where its parent does.
  int collar_of(const std::vector<int>& path) const {
    std::vector<int> apart;
    for (const int b : path)
      if (!skeleton_.offsets[b].isZero()) apart.push_back(b);
    const int out = plainest(apart, BonePart::collar, BonePart::shoulder);
    return out >= 0 ? out : plainest(path, BonePart::collar, BonePart::shoulder);
  }
  static std::vector<int> below(const std::vector<int>& path, int bone) {
    return {std::find(path.begin(), path.end(), bone) + 1, path.end()};
  }
  static std::vector<int> above(const std::vector<int>& path, int bone) {
    return {path.begin(), std::find(path.begin(), path.end(), bone)};
  }
  /// From the trunk to `end`, both included: bones of this side that are no helpers.
  std::vector<int> path_to(int end, int side) const {
    std::vector<int> out;
    for (int b = end; b >= 0; b = parent(b))
      if (may_be(b, side)) out.push_back(b);
    std::reverse(out.begin(), out.end());
    return out;
  }

  FoundLimb weighed(FoundLimb limb) const {
    limb.cost = words_[limb.upper].cost + words_[limb.lower].cost + words_[limb.end].cost;
    const int last = hangs_on(skeleton_, limb.end, limb.lower) ? limb.end : limb.lower;
    for (int b = parent(last); b != limb.upper; b = parent(b))
      if (words_[b].part == BonePart::none && !words_[b].helper) limb.stranger = b;
    return limb;
  }

  /// Of a limb whose bones are only counted ("arm1", "arm2") the second; of more than two the one
  /// where it bends in the zero pose. -1: nothing says which, or one part is far longer than the
  /// other (then the first is a collar).
  int counted(const std::vector<int>& path, int end, BonePart either) const {
    std::vector<int> all;
    for (const int b : path)
      if (words_[b].part == either) all.push_back(b);
    for (size_t i = 1; i < all.size(); ++i)
      if (words_[all[i]].last_number <= words_[all[i - 1]].last_number) return -1;
    const int out = all.size() == 2 ? all[1] : bend_of(all, end);
    if (out < 0) return -1;
    const double upper = between(all[0], out).norm(), lower = between(out, end).norm();
    return std::max(upper, lower) < 2 * std::min(upper, lower) ? out : -1;
  }

  /// The only bone of a row at which it bends; -1: none, several, or not clearly.
  int bend_of(const std::vector<int>& row, int end) const {
    constexpr double kBent = 0.05, kStraight = 0.01;  // sines
    int out = -1;
    for (size_t i = 1; i < row.size(); ++i) {
      const Vec3 from = between(row[i - 1], row[i]);
      const Vec3 to = between(row[i], i + 1 < row.size() ? row[i + 1] : end);
      const double bend = from.cross(to).norm() / std::max(from.norm() * to.norm(), 1e-12);
      if (bend > kStraight && (bend < kBent || out >= 0)) return -1;
      if (bend > kBent) out = row[i];
    }
    return out;
  }

  /// Where a counted limb ends: "arm_end" above the hand, else `end` itself.
  int tip_above(int end, BonePart either) const {
    for (int b = end; b >= 0; b = parent(b))
      if (words_[b].end && words_[b].part == either) return b;
    return end;
  }

  /// The limb that ends in `end`: a bone of this side that is called hand or foot, or what lies at
  /// the end of a limb whose bones are only counted ("arm_end").
  FoundLimb limb_to(int end, int side, const LimbWords& limb) const {
    const std::vector<int> path = path_to(end, side);
    FoundLimb out;
    out.lower = plainest(path, limb.lower);
    if (out.lower < 0)
      if (const int strong = plainest(path, limb.upper); strong >= 0)
        out.lower = plainest(below(path, strong), limb.either);
    const bool by_number = out.lower < 0;
    const int tip = tip_above(end, limb.either);
    if (by_number) out.lower = counted(path, tip, limb.either);
    if (out.lower < 0) return out.lacks = 2, out;
    out.end = plainest(below(path, out.lower), limb.ends[0], limb.ends[1]);
    if (by_number && words_[tip].end) out.end = tip;
    if (out.end < 0) return out.lacks = 3, out;
    const std::vector<int> rest = above(path, out.lower);
    out.upper = plainest(rest, limb.upper, limb.either);
    if (out.upper < 0) out.upper = plainest(rest, BonePart::hip);
    if (out.upper < 0)  // of shoulders the lowest
      for (const int b : rest)
        if (words_[b].part == BonePart::shoulder) out.upper = b;
    if (out.upper < 0) return out.lacks = 1, out;
    out.root = collar_of(above(path, out.upper));
    return weighed(out);
  }

  /// A limb whose end hangs elsewhere, as the goal of its maker's IK: `end` is the only one of its
  /// name that no limb has, the lower bone carries none, and the end is as far from the lower bone
  /// as a person's.
  FoundLimb limb_apart(int side, const LimbWords& limb) const {
    FoundLimb out;
    out.lacks = 3;
    const auto only = [&](const auto& fits) {
      int found = -1;
      for (int b = 0; b < size(); ++b)
        if (may_be(b, side) && inside(b) && fits(b)) {
          if (found >= 0 && hangs_on(skeleton_, b, found)) continue;  // a mesh on its bone
          if (found >= 0) return -2;
          found = b;
        }
      return found;
    };
    const int called = only([&](int b) { return words_[b].part == limb.lower; });
    const int strong = only([&](int b) { return words_[b].part == limb.upper; });
    const int lower = called != -1 || strong < 0 ? called : only([&](int b) {
      return words_[b].part == limb.either && hangs_on(skeleton_, b, strong);
    });
    if (lower < 0) return out;
    int end = -1;
    for (const BonePart part : limb.ends)
      if (end == -1) end = only([&](int b) { return words_[b].part == part; });
    if (end < 0 || hangs_on(skeleton_, end, lower)) return out;
    FoundLimb found;
    const std::vector<int> rest = above(path_to(lower, side), lower);
    found.lower = lower;
    found.end = end;
    found.upper = plainest(rest, limb.upper, limb.either);
    if (found.upper < 0 || hangs_on(skeleton_, end, found.upper)) return out;
    constexpr double kMost = 2;
    const double upper_length = (place(found.upper) - place(lower)).norm(),
                 lower_length = (place(lower) - place(end)).norm();
    if (std::max(upper_length, lower_length) > kMost * std::min(upper_length, lower_length))
      return out;
    found.root = collar_of(above(rest, found.upper));
    return weighed(found);
  }

  bool may_end(int b, int side, const LimbWords& limb) const {
    if (words_[b].side != side || !inside(b)) return false;
    return words_[b].helper ? words_[b].end && words_[b].part == limb.either
                            : is(words_[b], {limb.ends[0], limb.ends[1]});
  }

  /// The plainest limb. Of one that is nowhere whole the part that is missing where most of it is;
  /// 3 if nothing is there.
  FoundLimb best_limb(int side, const LimbWords& words, bool& ambiguous) const {
    std::optional<FoundLimb> best;
    FoundLimb broken;
    broken.lacks = 3;
    for (int b = 0; b < size(); ++b) {
      if (!may_end(b, side, words)) continue;
      const FoundLimb limb = limb_to(b, side, words);
      if (limb.lacks != 0) {
        broken.lacks = std::min(broken.lacks, limb.lacks);
        continue;
      }
      if (!best || limb.cost < best->cost) {
        best = limb;
        ambiguous = false;
      } else if (limb.cost == best->cost) {
        ambiguous |= limb.upper != best->upper || limb.lower != best->lower;
      }
    }
    if (best) return *best;
    const FoundLimb apart = limb_apart(side, words);
    return apart.lacks == 0 ? apart : broken;
  }

  FoundLimb take_limb(int side, const LimbWords& words) {
    bool ambiguous = false;
    const FoundLimb limb = best_limb(side, words, ambiguous);
    const bool called = has(side, {words.upper});
    take(limb, ambiguous, cat(side == 0 ? "left " : "right ", words.name),
         {Segment{words.joints[0] + side, called || has(side, {words.either, words.root})},
          Segment{words.joints[1] + side,
                  has(side, {words.lower}) || (called && has(side, {words.either}))},
          Segment{words.joints[2] + side, has(side, {words.ends[0], words.ends[1]})}});
    return limb;
  }

  bool has(int side, BoneParts parts) const {
    for (int b = 0; b < size(); ++b)
      if (may_be(b, side) && is(words_[b], parts) && inside(b)) return true;
    return false;
  }

  void take(const FoundLimb& limb, bool ambiguous, const std::string& what,
            const std::array<Segment, 3>& segments) {
    if (limb.lacks == 0 && !ambiguous && limb.stranger >= 0)
      return lacks(segments[0].joint,
                   cat("in the ", what, " the bone ", text::quote(skeleton_.names[limb.stranger]),
                       " is of no known name"));
    if (limb.lacks == 0 && !ambiguous) {
      out_.bones[segments[0].joint] = limb.upper;
      out_.bones[segments[1].joint] = limb.lower;
      out_.bones[segments[2].joint] = limb.end;
      if (!hangs_on(skeleton_, limb.end, limb.lower)) apart_.push_back(limb.end);
      return;
    }
    bool all = true;
    for (const auto& [joint, named] : segments) {
      if (!named) lacks(joint);
      all = all && named;
    }
    if (all)
      lacks(segments[static_cast<size_t>(std::max(limb.lacks, 1)) - 1].joint,
            ambiguous ? "two of its limbs may be the " + what
                      : "the bones of the " + what + " do not hang on each other");
  }

  int depth(int b) const {
    int out = 0;
    for (; b >= 0; b = parent(b)) ++out;
    return out;
  }

  /// Below the ankle: a toe, or, below what is called ankle, a foot. -1: none.
  int toe_of(int ankle, int side) const {
    int best = -1;
    const auto better = [&](int a, int b) {
      const auto rank = [&](int x) {
        return std::make_tuple(words_[x].part != BonePart::toe, words_[x].cost, depth(x),
                               words_[x].number);
      };
      return rank(a) < rank(b);
    };
    for (int b = 0; b < size(); ++b) {
      if (b == ankle || !may_be(b, side) || !hangs_on(skeleton_, b, ankle)) continue;
      const bool is_ankle = words_[ankle].part == BonePart::ankle || words_[ankle].end;
      const bool foot = is_ankle && words_[b].part == BonePart::foot;
      if ((words_[b].part == BonePart::toe || foot) && (best < 0 || better(b, best))) best = b;
    }
    return best;
  }

  void find_head() {
    int best = -1;
    bool two = false;
    for (int b = 0; b < size(); ++b) {
      if (words_[b].part != BonePart::head || !may_be(b, BoneWords::middle) || !inside(b)) continue;
      if (best >= 0 && hangs_on(skeleton_, b, best)) {
        if (words_[b].cost < words_[best].cost) best = b;
        continue;
      }
      if (best < 0 || words_[b].cost < words_[best].cost) {
        best = b;
        two = false;
      } else if (words_[b].cost == words_[best].cost) {
        two = true;
      }
    }
    if (best < 0) best = last_of_spine();
    out_.bones[kHead] = best;
    const char* why = two                    ? "two of its bones may be the head"
                      : out_.missing.empty() ? "a skeleton without one needs it at the neck's end"
                                             : "";
    if (best < 0 || two) lacks(kHead, why);
  }

  /// The head of a skeleton that only counts the bones of its trunk, as Rigify's does ("spine" to
  /// "spine.006"): the last of two or more in a row above the chest. -1: there is none.
  int last_of_spine() const {
    const int chest = chest_of(tree_, out_.bones);
    int last = chest, count = 0;
    for (int b = chest + 1; chest >= 0 && b < size(); ++b) {
      const BoneWords& words = words_[b];
      if (words.side != BoneWords::middle || words.helper || !hangs_on(skeleton_, b, chest))
        continue;
      if (words.part == BonePart::none) return -1;  // it may be the head
      if (words.part != BonePart::spine) continue;
      if (!hangs_on(skeleton_, b, last)) return -1;
      last = b;
      ++count;
    }
    return count > 1 ? last : -1;
  }

  /// The bone of the pelvis. `all` carries legs and chest.
  int find_pelvis(int all) const {
    const int legs = carrier_of(skeleton_, out_.bones[1], out_.bones[2]);
    const auto named = [&](int b) {
      return b >= 0 && words_[b].side == BoneWords::middle && !words_[b].helper &&
             is(words_[b], {BonePart::pelvis, BonePart::hip});
    };
    if (named(all)) return all;
    if (legs != all && named(legs)) return legs;
    // 3ds Max hangs the legs on the first spine bone, which hangs on the pelvis.
    for (int b = parent(all); b >= 0; b = parent(b))
      if (named(b)) return b;
    // A pelvis that stands beside the legs, or beside the spine, on a bone that is only a root.
    int beside = -1, count = 0;
    for (int b = all + 1; b < size(); ++b)
      if (parent(b) == all && named(b)) beside = b, ++count;
    if (count == 1 && words_[all].part == BonePart::none)
      return is_among_hips(all) && hangs_on(skeleton_, chest_of(tree_, out_.bones), beside)
                 ? all
                 : beside;
    const bool carries = legs != all && words_[all].part == BonePart::none &&
                         words_[legs].side == BoneWords::middle && !words_[legs].helper;
    return carries ? legs : all;
  }

  /// Whether a bone that carries legs and chest lies where a pelvis does.
  bool is_among_hips(int all) const {
    constexpr double kNear = 0.4;  // of a leg
    const Vec3 hips = 0.5 * (place(out_.bones[1]) + place(out_.bones[2]));
    const double leg = length(1, 4) + length(4, 7);
    return (place(all) - hips).norm() < kNear * leg;
  }

  /// From below `under` up to the chest.
  std::vector<int> spine_to(int chest, int under) const {
    std::vector<int> out;
    for (int b = chest; b != under; b = parent(b))
      if (b == chest || !words_[b].helper || words_[b].part == BonePart::spine)
        out.insert(out.begin(), b);
    return apart(out);
  }

  /// Of bones of the spine in one place in the zero pose the plainest, of equals the highest, and
  /// none on the pelvis: such bones fold up (Second Life) or only gather others (GTA's spine root).
  /// The last, which is the chest, stays.
  std::vector<int> apart(const std::vector<int>& spine) const {
    constexpr double kNear = 0.01;  // of the spine's length
    const int pelvis = out_.bones[kPelvis];
    const auto distance = [&](int a, int b) { return (place(a) - place(b)).norm(); };
    std::vector<int> out;
    for (const int b : spine) {
      const double near = kNear * distance(pelvis, spine.back());
      const auto takes_its_place = [&](int other) {
        if (other == b || !(distance(other, b) < near) || b == spine.back()) return false;
        return other == spine.back() || words_[other].cost < words_[b].cost ||
               (words_[other].cost == words_[b].cost && other > b);
      };
      const bool on_pelvis = b != spine.back() && distance(pelvis, b) < near;
      if (!on_pelvis && std::none_of(spine.begin(), spine.end(), takes_its_place)) out.push_back(b);
    }
    return out;
  }

  /// Puts the bones of the spine that lie where the list leaves out joints.
  void complete_spine(int chest, const std::array<bool, kJoints>& open) {
    Bones& bones = out_.bones;
    const std::vector<int> spine = spine_to(chest, bones[kPelvis]);
    if (open[kSpine1] && spine[0] != bones[kSpine2] && spine[0] != bones[kSpine3])
      bones[kSpine1] = spine[0];
    if (open[kSpine3] && chest == bones[kSpine2]) {
      std::swap(bones[kSpine2], bones[kSpine3]);
    } else if (open[kSpine3] && chest != bones[kSpine1]) {
      bones[kSpine3] = chest;
    }
    if (bones[kSpine2] >= 0 || bones[kSpine1] < 0 || bones[kSpine3] != chest) return;
    const std::vector<int> inner(std::find(spine.begin(), spine.end(), bones[kSpine1]),
                                 spine.end());
    if (open[kSpine2] && inner.size() > 2) bones[kSpine2] = inner[inner.size() / 2];
  }

  void find_trunk() {
    const int chest = chest_of(tree_, out_.bones);
    const int all =
        carrier_of(skeleton_, carrier_of(skeleton_, out_.bones[1], out_.bones[2]), chest);
    if (all < 0 || !inside(all) || !hangs_on(skeleton_, out_.bones[kHead], all))
      return lacks(kPelvis, "no bone carries its legs, arms and head");
    const int pelvis = find_pelvis(all);
    const int below = hangs_on(skeleton_, chest, pelvis) ? pelvis : all;
    out_.bones[kPelvis] = pelvis;
    const std::vector<int> spine = spine_to(chest, below);
    if (spine.empty()) return lacks(kSpine1, "no bone lies between its pelvis and its arms");
    // Of many the first, the middle one, and the last, which carries the arms.
    out_.bones[kSpine1] = spine[0];
    if (spine.size() > 1) out_.bones[kSpine3] = spine.back();
    if (spine.size() > 2) out_.bones[kSpine2] = spine[spine.size() / 2];
    find_neck(chest);
    for (const int side : {0, 1})
      if (out_.bones[13 + side] < 0) out_.bones[13 + side] = nameless_collar(side, chest);
    check_sides(all);
    check_lengths();
  }

  /// Between chest and head: what is called neck, else what lies there, but helpers.
  void find_neck(int chest) {
    int named = -1, any = -1;
    for (int b = parent(out_.bones[kHead]); b >= 0 && b != chest; b = parent(b)) {
      if (words_[b].part == BonePart::neck) named = b;
      if (!words_[b].helper) any = b;
    }
    out_.bones[kNeck] = named >= 0 ? named : any;
  }

  /// The only bone between chest and upper arm, whatever it is called; -1: none or several.
  int nameless_collar(int side, int chest) const {
    int out = -1, count = 0;
    for (int b = parent(out_.bones[16 + side]); b >= 0 && b != chest; b = parent(b))
      if (!words_[b].helper && words_[b].part != BonePart::neck) out = b, ++count;
    return count == 1 ? out : -1;
  }

  /// Bones from `top` down to `bone`, without helpers.
  int steps(int bone, int top) const {
    int out = 0;
    for (int b = bone; b >= 0 && b != top; b = parent(b)) out += !words_[b].helper;
    return out;
  }

  /// A person's sides are built alike. Where they are not, one of two bones was not understood.
  void check_sides(int top) {
    const auto plain_cost = [&](int b) { return words_[b].cost - (words_[b].number > 0); };
    for (const int j : {1, 4, 7, 10, 13, 16, 18, 20}) {
      const int left = out_.bones[j], right = out_.bones[j + 1];
      if (j == 10 && (left < 0 || right < 0)) continue;  // a toe may be the ankle's end
      const auto is_apart = [&](int b) { return std::count(apart_.begin(), apart_.end(), b) > 0; };
      if (is_apart(left) || is_apart(right)) continue;  // found where it lies
      if (j == 10 && (is_apart(out_.bones[7]) || is_apart(out_.bones[8]))) continue;
      bool alike = (left < 0) == (right < 0) && steps(left, top) == steps(right, top);
      if (alike && j == 10)
        alike = plain_cost(left) == plain_cost(right) &&
                (words_[left].number < 0 || words_[right].number < 0 ||
                 words_[left].number == words_[right].number);
      if (alike) continue;
      const auto name = [&](int b) { return b < 0 ? "none" : text::quote(skeleton_.names[b]); };
      return lacks(j, cat("its sides are not built alike: ", kJointNames[j], " may be ", name(left),
                          ", ", kJointNames[j + 1], " ", name(right)));
    }
  }

  Vec3 place(int bone) const {  // in the zero pose
    Vec3 out = Vec3::Zero();
    for (int b = bone; b >= 0; b = parent(b)) out += skeleton_.offsets[b];
    return out;
  }
  /// From a bone to another, in the zero pose.
  Vec3 between(int from, int to) const { return place(to) - place(from); }
  double length(int from, int to) const { return between(out_.bones[from], out_.bones[to]).norm(); }

  /// A limb with a part many times as long as its other part, or as the other side's, was not
  /// understood. A length of 0 is one that position channels say.
  void check_lengths() {
    constexpr double kMost = 5;
    const auto unlike = [&](double a, double b) {
      return std::min(a, b) > 0 && std::max(a, b) > kMost * std::min(a, b);
    };
    for (const auto& [a, b, c] : {std::array{1, 4, 7}, std::array{16, 18, 20}}) {
      const double left = length(a, b), right = length(a + 1, b + 1);
      if (unlike(left, length(b, c)) || unlike(right, length(b + 1, c + 1)) || unlike(left, right))
        lacks(b, "the lengths of its limbs are no person's");
    }
  }

  const BoneTree& tree_;
  const SourceSkeleton& skeleton_;
  const std::vector<BoneWords>& words_;
  const int top_;
  FoundJoints out_;
  std::vector<int> apart_;  // ends of limbs that hang elsewhere
};

}  // namespace

FoundJoints find_joints(const BoneTree& tree, int top) { return Finder(tree, top).find(); }

Bones complete_joints(const BoneTree& tree, const Bones& listed,
                      const std::array<bool, kJoints>& open) {
  return Finder(tree, -1).complete(listed, open);
}

}  // namespace restage
