// name_joints(): bones of a file as the 22 joints, and where missing joints are put.
#include <algorithm>
#include <map>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "datasets/importers/source_motion.h"
#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

enum : int { kSpine1 = 3, kSpine2 = 6, kSpine3 = 9, kNeck = 12, kHead = 15 };

/// Those that cannot be placed.
constexpr int kRequired[] = {0, 1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21};

/// In lower case, "Bip01 L Thigh" as "bip01_l_thigh" (BVH files cannot hold blanks in names).
std::string plain_name(std::string_view bone) {
  std::string out = lower_case(bone);
  std::replace(out.begin(), out.end(), ' ', '_');
  return out;
}

/// Bones by plain name, without a namespace ("mixamorig:Hips") and, as a second name, without a
/// prefix that three quarters of them share ("Model_Hips").
class BoneNames {
 public:
  explicit BoneNames(const SourceSkeleton& skeleton) {
    std::map<std::string, size_t> prefixes;
    std::vector<std::string> plain;
    for (const std::string& name : skeleton.names) {
      plain.push_back(plain_name(name.substr(name.rfind(':') + 1)));  // npos + 1 is 0
      const size_t end = plain.back().find('_');
      if (end != std::string::npos) ++prefixes[plain.back().substr(0, end + 1)];
    }
    for (size_t j = 0; j < plain.size(); ++j) index_.emplace(plain[j], static_cast<int>(j));
    for (const auto& [prefix, count] : prefixes)
      if (4 * count >= 3 * plain.size())
        for (size_t j = 0; j < plain.size(); ++j)
          if (plain[j].starts_with(prefix))
            index_.emplace(plain[j].substr(prefix.size()), static_cast<int>(j));
  }

  int find(const std::string& bone) const {
    const auto at = index_.find(plain_name(bone));
    return at == index_.end() ? -1 : at->second;
  }
  int find(const std::vector<std::string>& any) const {
    for (const std::string& bone : any)
      if (const int at = find(bone); at >= 0) return at;
    return -1;
  }
  std::vector<std::string> all() const {
    std::vector<std::string> out;
    for (const auto& entry : index_) out.push_back(entry.first);
    return out;
  }

 private:
  std::map<std::string, int> index_;
};

struct Found {
  const Profile* profile = nullptr;
  std::array<int, kJoints> joints{};
  std::vector<std::string> missing;  ///< of the required ones
  int count = 0;                     ///< how many of the 22 are there
  int fitting = 0;                   ///< collars that hang from spine3
};

Found match(const Profile& profile, const BoneNames& names, const SourceSkeleton& skeleton) {
  Found out;
  out.profile = &profile;
  for (size_t j = 0; j < kJoints; ++j) {
    out.joints[j] = names.find(profile.bones[j]);
    out.count += out.joints[j] >= 0;
  }
  for (const int j : kRequired)
    if (out.joints[j] < 0) out.missing.push_back(profile.bones[j][0]);
  for (const size_t collar : {13, 14})
    out.fitting += out.joints[collar] >= 0 && out.joints[kSpine3] >= 0 &&
                   skeleton.parents[out.joints[collar]] == out.joints[kSpine3];
  return out;
}

bool better(const Found& a, const Found& b) {
  if (a.missing.size() != b.missing.size()) return a.missing.size() < b.missing.size();
  return a.count != b.count ? a.count > b.count : a.fitting > b.fitting;
}

[[noreturn]] void throw_missing(const Found& best, const BoneNames& names, bool chosen,
                                const std::string& where) {
  std::string lacks;
  for (const std::string& bone : best.missing) {
    if (lacks.size() > 80) {
      lacks += ", ...";
      break;
    }
    lacks += (lacks.empty() ? "" : ", ") + bone;
  }
  const std::string close = nearest(lower_case(best.missing[0]), names.all());
  if (!close.empty()) lacks += " (" + best.missing[0] + ": is it '" + close.substr(0, 40) + "'?)";
  throw InputError(where,
                   chosen ? "lacks bones of the profile " + best.profile->name + ": " + lacks
                          : "its bones fit no known skeleton; of the nearest (" +
                                best.profile->title + ") it lacks " + lacks,
                   "write a profile for it and give it with --profile, or rename the bones");
}

Found best_match(const SourceSkeleton& skeleton, const BoneNames& names, const Profile* chosen,
                 const std::string& where) {
  Found best;
  if (chosen) best = match(*chosen, names, skeleton);
  if (!chosen)
    for (const Profile& profile : builtin_profiles()) {
      Found found = match(profile, names, skeleton);
      if (best.profile == nullptr || better(found, best)) best = std::move(found);
    }
  if (!best.missing.empty()) throw_missing(best, names, chosen != nullptr, where);
  return best;
}

/// Places joints that the source lacks, in the frame of one that it has.
class Placer {
 public:
  Placer(const SourceSkeleton& skeleton, const BoneNames& names, const Found& found,
         const std::string& where)
      : skeleton_(skeleton),
        names_(names),
        found_(found),
        where_(where),
        zero_(zero_positions(skeleton)) {
    for (size_t j = 0; j < kJoints; ++j) out_.map[j].joint = found.joints[j];
  }

  NamedJoints place() {
    out_.profile = found_.profile;
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
    const int bone = names_.find(name);
    return bone < 0 ? std::nullopt : std::optional(SourceJoint{bone, Vec3::Zero()});
  }
  bool by_profile(int j) {
    const auto& place = found_.profile->places[j];
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

  Vec3 toe_of(int ankle) const {
    const size_t source = static_cast<size_t>(joint(ankle).joint);
    if (skeleton_.has_end[source]) return at(ankle) + skeleton_.ends[source];
    for (size_t j = 0; j < skeleton_.size(); ++j)
      if (skeleton_.parents[j] == static_cast<int>(source)) return zero_[j];
    throw InputError(where_,
                     "joint " + skeleton_.names[source] + " has neither a toe nor an end site",
                     "add one, so that the foot's direction is known");
  }

  const SourceSkeleton& skeleton_;
  const BoneNames& names_;
  const Found& found_;
  const std::string& where_;
  const std::vector<Vec3> zero_;
  NamedJoints out_;
};

}  // namespace

NamedJoints name_joints(const SourceSkeleton& skeleton, const std::string& where,
                        const Profile* profile) {
  const BoneNames names(skeleton);
  const Found found = best_match(skeleton, names, profile, where);
  return Placer(skeleton, names, found, where).place();
}

}  // namespace restage
