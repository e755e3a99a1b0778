// place_joints(): where joints go that a skeleton lacks.
#include "datasets/importers/rigs/place_joints.h"

#include <algorithm>
#include <optional>

#include "autograd/base/error.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

/// Places joints that the source lacks, in the frame of one that it has.
class Placer {
 public:
  Placer(const BoneTree& tree, const BoneFinder& names, const Profile& profile, const Bones& bones,
         const std::string& where)
      : tree_(tree),
        skeleton_(tree.skeleton),
        names_(names),
        profile_(profile),
        where_(where),
        zero_(zero_positions(tree.skeleton)) {
    for (size_t j = 0; j < kJoints; ++j) out_.map[j].joint = bones[j];
  }

  NamedJoints place() {
    out_.profile = &profile_;
    if (lacks(kNeck) && !by_profile(kNeck)) put_between(kNeck, last_spine(), at(kHead), 0.75);
    spine();
    for (const int side : {0, 1}) {
      const int collar = 13 + side, shoulder = 16 + side, foot = 10 + side, ankle = 7 + side;
      if (lacks(collar) && !by_profile(collar))
        put(collar, kSpine3, at(kNeck) + 0.2 * (at(shoulder) - at(kNeck)));
      if (lacks(foot) && !by_profile(foot)) put(foot, ankle, toe_of(ankle));
    }
    std::sort(out_.placed.begin(), out_.placed.end());
    return out_;
  }

 private:
  bool lacks(int j) const { return joint(j).joint < 0; }
  const SourceJoint& joint(int j) const { return out_.map[j]; }
  Vec3 at(int j) const { return zero_[joint(j).joint] + joint(j).offset; }
  int last_spine() const {
    for (const int j : {kSpine3, kSpine2, kSpine1})
      if (!lacks(j)) return j;
    return 0;
  }

  /// Joint j turns with the bone of `like` and rests at `where`.
  void put(int j, int like, const Vec3& where) {
    SourceJoint& to = out_.map[j];
    to.joint = joint(like).joint;
    to.offset = where - zero_[to.joint];
    out_.placed.push_back(j);
  }
  void put_between(int j, int from, const Vec3& to, double share) {
    put(j, from, at(from) + share * (to - at(from)));
  }

  /// One of the 22 joints (if it has its place already) or a bone of the file, by name.
  std::optional<SourceJoint> named(const std::string& name) const {
    const auto j = std::find(kJointNames.begin(), kJointNames.end(), name) - kJointNames.begin();
    if (j < kJoints && !lacks(static_cast<int>(j))) return joint(static_cast<int>(j));
    const int bone = names_(name);
    return bone < 0 ? std::nullopt : std::optional(SourceJoint{bone, Vec3::Zero()});
  }
  bool by_profile(int j) {
    const auto& place = profile_.places[j];
    if (!place) return false;
    const auto with = named(place->with), from = named(place->from), to = named(place->to);
    if (!with || !from || !to) return false;
    const auto rest = [&](const SourceJoint& s) -> Vec3 { return zero_[s.joint] + s.offset; };
    SourceJoint& target = out_.map[j];
    target.joint = with->joint;
    target.offset = rest(*from) + place->share * (rest(*to) - rest(*from)) - zero_[with->joint];
    out_.placed.push_back(j);
    return true;
  }

  void spine() {
    const Vec3 neck = at(kNeck);
    if (lacks(kSpine1) && !by_profile(kSpine1)) put_between(kSpine1, 0, neck, 0.25);
    if (lacks(kSpine2) && !by_profile(kSpine2)) {
      // Two joints (or one, if spine3 is there) on the way from spine1 up.
      if (lacks(kSpine3)) {
        put_between(kSpine3, kSpine1, neck, 2.0 / 3);
        put_between(kSpine2, kSpine1, neck, 1.0 / 3);
      } else {
        put_between(kSpine2, kSpine1, at(kSpine3), 0.5);
      }
    }
    if (lacks(kSpine3) && !by_profile(kSpine3)) put_between(kSpine3, kSpine2, neck, 0.35);
  }

  /// The ankle's End Site, else its first child that is no helper, else where a toe is of a person
  /// who stands as the zero pose does.
  Vec3 toe_of(int ankle) const {
    const size_t source = static_cast<size_t>(joint(ankle).joint);
    if (skeleton_.has_end[source] && !skeleton_.ends[source].isZero())
      return at(ankle) + skeleton_.ends[source];
    for (size_t j = 0; j < skeleton_.size(); ++j)
      if (skeleton_.parents[j] == static_cast<int>(source) && !tree_.words[j].helper &&
          !skeleton_.offsets[j].isZero())
        return zero_[j];
    const Vec3 shin = at(ankle) - at(ankle - 3), thigh = at(ankle - 3) - at(ankle - 6);
    const Vec3 up = at(kHead) - 0.5 * (at(7) + at(8)), hips = at(1) - at(2);
    const Vec3 front = hips.cross(up);
    const double straight = (shin + thigh).norm() / (shin.norm() + thigh.norm());
    if (!(straight > 0.9 && up.norm() > 1.1 * (shin.norm() + thigh.norm()) && front.norm() > 1e-9))
      throw InputError(
          where_,
          "bone " + text::quote(skeleton_.names[source]) + " has neither a toe nor an end site",
          "add one, so that the foot's direction is known");
    constexpr double kForward = 0.3, kDown = 0.15;  // of the shin's length
    return at(ankle) + shin.norm() * (kForward * front.normalized() - kDown * up.normalized());
  }

  const BoneTree& tree_;
  const SourceSkeleton& skeleton_;
  const BoneFinder& names_;
  const Profile& profile_;
  const std::string& where_;
  const std::vector<Vec3> zero_;
  NamedJoints out_;
};

}  // namespace

NamedJoints place_joints(const BoneTree& tree, const BoneFinder& names, const Profile& profile,
                         const Bones& bones, const std::string& where) {
  return Placer(tree, names, profile, bones, where).place();
}

}  // namespace restage
