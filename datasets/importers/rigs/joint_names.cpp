// name_joints(): which bones of a file are which of the 22 joints (profiles/README.md).
#include <algorithm>
#include <map>
#include <optional>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "datasets/importers/motions/source_motion.h"
#include "datasets/importers/rigs/asked_joints.h"
#include "datasets/importers/rigs/bone_dictionary.h"
#include "datasets/importers/rigs/find_joints.h"
#include "datasets/importers/rigs/place_joints.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/encoding.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

/// Those that cannot be placed.
constexpr int kRequired[] = {0, 1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21};

constexpr std::array<int, 6> kLegJoints = {1, 2, 4, 5, 7, 8}, kArmJoints = {16, 17, 18, 19, 20, 21};

constexpr const char* kNameThem =
    "say which bone is which joint in a file, and give it with {bones} names.yaml "
    "(docs/formats.md)";

/// In lower case, "Bip01 L Thigh" as "bip01_l_thigh" (BVH files cannot hold blanks in names).
std::string plain_name(std::string_view bone) {
  std::string out = lower_case(bone);
  std::replace(out.begin(), out.end(), ' ', '_');
  return out;
}

/// Without what separates words, which exporters exchange or leave out ("DEF-spine_006").
std::string squeezed(std::string_view bone) {
  std::string out = plain_name(bone);
  std::erase_if(out, [](char c) { return c == '_' || c == '.' || c == '-'; });
  return out;
}

/// Bones by name. Those of a file of one's own stand as they are in the skeleton's, without their
/// namespace, without decoration, or without separators, in this order; a family's are compared
/// without decoration.
class BoneNames {
 public:
  BoneNames(const SourceSkeleton& skeleton, const std::vector<std::string>& plain,
            bool as_written) {
    for (size_t b = 0; b < plain.size(); ++b) {
      const auto at = static_cast<int>(b);
      const std::string& name = skeleton.names[b];
      if (name.empty()) continue;
      if (as_written) {
        index_[0].emplace(plain_name(name), at);
        index_[1].emplace(plain_name(name.substr(name.rfind(':') + 1)), at);  // npos + 1 is 0
      }
      index_[2].emplace(plain_name(plain[b]), at);
      index_[3].emplace(squeezed(plain[b]), at);
    }
  }

  /// The first bone of this name, -1 if there is none.
  int find(const std::string& name) const {
    const auto [first, last] = all_of(name);
    return first == last ? -1 : first->second;
  }
  int find(const std::vector<std::string>& any) const {
    for (const std::string& name : any)
      if (const int at = find(name); at >= 0) return at;
    return -1;
  }
  bool is_twice(const std::string& name) const {
    const auto [first, last] = all_of(name);
    return std::distance(first, last) > 1;
  }
  std::vector<std::string> all() const {
    std::vector<std::string> out;
    for (const auto& entry : index_[2]) out.push_back(entry.first);
    return out;
  }

 private:
  using Index = std::multimap<std::string, int>;
  std::pair<Index::const_iterator, Index::const_iterator> all_of(const std::string& name) const {
    for (size_t i = 0; i < 3; ++i)
      if (const auto found = index_[i].equal_range(plain_name(name)); found.first != found.second)
        return found;
    return index_[3].equal_range(squeezed(name));
  }

  std::array<Index, 4> index_;
};

Bones bones_of(const Profile& profile, const BoneNames& names) {
  Bones out;
  for (size_t j = 0; j < kJoints; ++j) out[j] = names.find(profile.bones[j]);
  return out;
}

bool is_whole(const Bones& bones) {
  return std::all_of(std::begin(kRequired), std::end(kRequired),
                     [&](int j) { return bones[j] >= 0; });
}

int last_spine(const Bones& bones) {
  for (const int j : {kSpine3, kSpine2, kSpine1})
    if (bones[j] >= 0) return bones[j];
  return -1;
}

// ---- known families ----------------------------------------------------------------------------

/// Whether the bones that a family's names pick hang together as they must: limbs in a row, the
/// pelvis is what carries legs and spine, and the last of the spine is what carries the arms.
bool hang_together(const BoneTree& tree, const Bones& bones) {
  const auto on = [&](int j, int above) {
    return bones[j] < 0 || bones[above] < 0 || hangs_on(tree.skeleton, bones[j], bones[above]);
  };
  // Of a rig whose makers hung the limbs on its root the upper arms hang beside the collars.
  const auto beside = [&](int j) {
    const int collar = bones[kParents[j]];
    if (j < 16 || j > 17 || collar < 0) return false;
    const int above = tree.skeleton.parents[bones[j]];
    return above == tree.skeleton.parents[collar] && hangs_on(tree.skeleton, bones[0], above);
  };
  for (const int side : {0, 1})
    for (const int j : {4, 7, 10, 16, 18, 20})
      if (!on(j + side, kParents[j + side]) && !beside(j + side)) return false;
  if (!on(kSpine2, kSpine1) || !on(kSpine3, kSpine2) || !on(kSpine3, kSpine1)) return false;
  const int chest = chest_of(tree, bones);
  if (chest == bones[0] || !hangs_on(tree.skeleton, chest, bones[0]))
    return hangs_on(tree.skeleton, bones[0], chest);  // limbs that hang on nothing, or on the root
  const int legs = carrier_of(tree.skeleton, bones[1], bones[2]);
  const int all = carrier_of(tree.skeleton, legs, chest);
  const bool carries =  // 3ds Max hangs the legs on the first spine bone
      bones[0] == all || (all == bones[kSpine1] && hangs_on(tree.skeleton, all, bones[0]));
  return carries && last_spine(bones) == chest && on(15, 0);
}

/// How many bones lie between two of a path, but helpers and those that `counts` says no to.
template <class Counts>
int between(const BoneTree& tree, int above, int below, const Counts& counts) {
  int out = 0;
  if (!hangs_on(tree.skeleton, below, above)) return 0;
  for (int b = tree.skeleton.parents[below]; b >= 0 && b != above; b = tree.skeleton.parents[b])
    out += !tree.words[b].helper && counts(b);
  return out;
}

/// Whether the family would place a joint where a bone lies that it does not know: an odd one
/// beside its good ones, or another make's spine.
bool leaves_out(const BoneTree& tree, const Profile& profile, const BoneNames& names,
                const Bones& bones) {
  const int chest = chest_of(tree, bones);
  if (!hangs_on(tree.skeleton, chest, bones[0])) return false;  // limbs that hang on nothing
  const auto named = [&](int j) { return bones[j] >= 0; };
  const auto is_unknown = [&](int b) {
    return std::find(bones.begin(), bones.end(), b) == bones.end() &&
           std::none_of(profile.unused.begin(), profile.unused.end(),
                        [&](const std::string& name) { return names.find(name) == b; });
  };
  const auto any = [](int) { return true; };
  const auto no_neck = [&](int b) { return tree.words[b].part != BonePart::neck; };
  const bool whole = named(kSpine1) && named(kSpine2) && named(kSpine3);
  if (!whole && between(tree, bones[0], chest, is_unknown) > 0) return true;
  if (!named(12) && between(tree, chest, bones[15], any) > 0) return true;
  for (const int side : {0, 1}) {
    if (!named(13 + side) && between(tree, chest, bones[16 + side], no_neck) > 0) return true;
    if (!named(10 + side))
      for (size_t b = 0; b < tree.words.size(); ++b)
        if (tree.words[b].part == BonePart::toe && !tree.words[b].helper &&
            hangs_on(tree.skeleton, static_cast<int>(b), bones[7 + side]))
          return true;
  }
  return false;
}

/// The built-in profile whose names are there and hang together, with its bones: the one of which
/// most are there.
struct Family {
  const Profile* profile = nullptr;
  Bones bones{};
};
Family find_family(const BoneTree& tree, const BoneNames& names) {
  Family out;
  int most = 0;
  for (const Profile& profile : builtin_profiles()) {
    const Bones bones = bones_of(profile, names);
    const auto count = static_cast<int>(
        std::count_if(bones.begin(), bones.end(), [](int bone) { return bone >= 0; }));
    if (count > most && is_whole(bones) && hang_together(tree, bones) &&
        !leaves_out(tree, profile, names, bones)) {
      out = {&profile, bones};
      most = count;
    }
  }
  // What carries collars and neck is spine3, unless the family says where spine3 is.
  if (out.profile && out.bones[kSpine3] < 0 && !out.profile->places[kSpine3])
    std::swap(out.bones[kSpine3], out.bones[kSpine2]);
  return out;
}

// ---- refusals ----------------------------------------------------------------------------------

constexpr size_t kLongList = 100;  // bytes of names in a message, which is one line

/// Names in another encoding can be neither found nor given: said before anything else.
void check_encoding(const SourceSkeleton& skeleton, const std::string& where) {
  if (std::all_of(skeleton.names.begin(), skeleton.names.end(), text::is_utf8)) return;
  std::string known, from = "LATIN1", otherwise;
  switch (text::encoding_of(skeleton.names)) {
    case text::Encoding::shift_jis:
      known = "; by their bytes they are Shift-JIS (Japanese)";
      from = "SHIFT_JIS";
      break;
    case text::Encoding::latin1:
      known = "; by their bytes they are Latin-1 (Western European)";
      break;
    case text::Encoding::unsure:
      known =
          "; by their bytes they may be Latin-1 (Western European), Shift-JIS (Japanese) or "
          "another";
      otherwise = " (or -f SHIFT_JIS, GBK, EUC-KR, CP1251: whichever makes them readable)";
  }
  throw InputError(where, cat("the names of its bones are not UTF-8 text", known),
                   cat("save it as UTF-8: iconv -f ", from, " -t UTF-8 OLD > NEW", otherwise));
}

/// The bone that carries the only person; -1: nothing tells. InputError for two.
int only_person(const BoneTree& tree, const std::string& where) {
  const std::vector<int> people = find_people(tree);
  if (people.size() < 2) return people.empty() ? -1 : people[0];
  std::vector<std::string> tops;
  for (const int top : people) tops.push_back(text::quote(tree.skeleton.names[top]));
  throw InputError(where,
                   cat("holds ", people.size(), " characters (their bones hang on ",
                       cut_list(tops, kLongList), "), and each needs a file of its own"),
                   "export them one by one");
}

[[noreturn]] void throw_unlike_profile(const Profile& profile, const Bones& bones,
                                       const BoneNames& names, const std::string& where) {
  std::vector<std::string> lacks, with_joints;
  for (const int j : kRequired) {
    if (bones[j] >= 0) continue;
    lacks.push_back(profile.bones[j][0]);
    with_joints.push_back(cat(lacks.back(), " (the ", kJointNames[j], ")"));
  }
  if (!profile.list.empty())
    throw InputError(where, cat(profile.list, " lacks ", cut_list(with_joints, kLongList)),
                     profile.mend);
  std::string text = cut_list(lacks, kLongList);
  if (const std::string close = nearest(lower_case(lacks[0]), names.all()); !close.empty())
    text += cat(" (", lacks[0], ": is it ", text::quote(close), "?)");
  throw InputError(where, cat("lacks bones of the profile ", profile.name, ": ", text),
                   "correct the names there, or leave {bones} out");
}

/// The bones that carry the joint's limb, for each side; of others the joint itself.
std::vector<int> limb_of(int joint) {
  for (const std::vector<int>& limb : {std::vector{1, 4, 7}, {2, 5, 8}, {16, 18, 20}, {17, 19, 21}})
    if (std::find(limb.begin(), limb.end(), joint) != limb.end()) return limb;
  return {joint};
}

/// What is missing, in the words of the side that is there: "left_hip (is it 'LeftUpLegg'?)".
std::vector<std::string> words_for(const BoneTree& tree, const FoundJoints& found,
                                   const std::vector<std::string>& plain) {
  std::vector<std::string> lower, out;
  for (const std::string& name : plain) lower.push_back(lower_case(name));
  std::vector<int> missing;
  std::map<int, std::string> expected;
  for (const int j : found.missing) {
    bool told = false;
    for (const int k : limb_of(j)) {
      const int twin = found.bones[kMirror[k]];
      if (j == 0 || j == 15 || twin < 0 || found.bones[k] >= 0) continue;
      const std::string name = other_side(plain[twin]);
      if (name.empty() || std::find(lower.begin(), lower.end(), name) != lower.end()) continue;
      expected[k] = name;
      missing.push_back(k);
      told = true;
    }
    if (!told) missing.push_back(j);
  }
  std::sort(missing.begin(), missing.end());
  missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
  for (const int j : missing) {
    std::string word(kJointNames[j]);
    if (const auto at = expected.find(j); at != expected.end())
      if (const auto close = nearest(at->second, lower); !close.empty()) {
        const auto bone = std::find(lower.begin(), lower.end(), close) - lower.begin();
        word += cat(" (is it ", text::quote(tree.skeleton.names[static_cast<size_t>(bone)]), "?)");
      }
    out.push_back(word);
  }
  return out;
}

[[noreturn]] void throw_not_found(const BoneTree& tree, const FoundJoints& found,
                                  const std::vector<std::string>& plain, const std::string& where) {
  const bool any = std::any_of(tree.words.begin(), tree.words.end(), [](const BoneWords& words) {
    return words.part != BonePart::none && !words.helper;
  });
  const auto lacks = [&](int j) {
    return std::count(found.missing.begin(), found.missing.end(), j) > 0;
  };
  const bool no_legs =
      std::all_of(kLegJoints.begin(), kLegJoints.end(), lacks) &&
      std::none_of(kArmJoints.begin(), kArmJoints.end(), lacks) &&
      std::none_of(tree.words.begin(), tree.words.end(), [](const BoneWords& words) {
        return words.part == BonePart::thigh || words.part == BonePart::shin ||
               words.part == BonePart::leg || words.part == BonePart::ankle ||
               words.part == BonePart::foot;
      });
  if (any && no_legs)
    throw UnknownSkeleton(
        where, cat("is half a body: none of its ", tree.skeleton.size(), " bones is of a leg"),
        "record the whole body, or give it legs in Blender, at rest");
  std::string what;
  if (!any) {
    std::vector<std::string> some;
    size_t named = 0;
    for (const std::string& name : tree.skeleton.names)
      if (!name.empty() && ++named <= 3) some.push_back(text::quote(name));
    what = some.empty() ? "its bones have no names"
                        : cat("none of its ", named, " bones is named like a person's (",
                              cut_list(some, kLongList), named > 3 ? " ...)" : ")");
  } else {
    what = cat("of the joints of a person these were not found among its bones: ",
               cut_list(words_for(tree, found, plain), kLongList), found.why.empty() ? "" : "; ",
               found.why);
  }
  throw UnknownSkeleton(where, what, kNameThem);
}

/// The bones that a profile names which was asked for. InputError for those that the file lacks, or
/// has twice.
Bones asked_bones(const Profile& profile, const SourceSkeleton& skeleton, const BoneNames& names,
                  const std::string& where) {
  const Bones bones = bones_of(profile, names);
  if (!is_whole(bones)) {
    check_encoding(skeleton, where);
    throw_unlike_profile(profile, bones, names, where);
  }
  for (size_t j = 0; j < kJoints; ++j)
    for (const std::string& name : profile.bones[j])
      if (bones[j] >= 0 && names.find(name) == bones[j] && names.is_twice(name))
        throw InputError(where, cat("two of its bones are called ", text::quote(name)),
                         "rename one, or export one character only");
  check_asked(skeleton, bones, where,
              profile.mend.empty() ? "correct the names in the file of {bones}" : profile.mend);
  return bones;
}

/// With what the profile neither names nor places.
Bones completed(const BoneTree& tree, const Profile& profile, const Bones& bones) {
  std::array<bool, kJoints> open{};
  for (size_t j = 0; j < kJoints; ++j) open[j] = bones[j] < 0 && !profile.places[j];
  return complete_joints(tree, bones, open);
}

/// A skeleton read with the words of one language.
struct Reading {
  BoneTree tree;
  FoundJoints found;
};

/// With those of the first language in which it is a whole person; else of the one in which least
/// is missing.
Reading best_reading(const SourceSkeleton& skeleton, const std::vector<std::string>& plain,
                     const std::string& where) {
  std::optional<Reading> best;
  for (size_t language = 0; language < bone_dictionaries().size(); ++language) {
    BoneTree tree = bone_tree(skeleton, plain, language);
    FoundJoints found = find_joints(tree, only_person(tree, where));
    if (!best || found.missing.size() < best->found.missing.size())
      best.emplace(Reading{std::move(tree), std::move(found)});
    if (best->found.missing.empty()) break;
  }
  return std::move(*best);
}

/// The profile of bones that were found without one.
const Profile& no_profile() {
  static const Profile out = [] {
    Profile p;
    p.title = "found by parts of names and by how the bones hang together";
    return p;
  }();
  return out;
}

/// A bone that carries the hips from far away, as a root on the ground does, turns with the pelvis
/// but is not where one is: the joint is placed over the middle of the hips, as people have it.
void place_among_hips(const SourceSkeleton& skeleton, JointMap& map) {
  constexpr double kFar = 0.4, kAbove = 0.1;  // of a leg
  const std::vector<Vec3> zero = zero_positions(skeleton);
  const auto at = [&](size_t j) -> Vec3 {
    return zero[static_cast<size_t>(map[j].joint)] + map[j].offset;
  };
  const double leg =
      (at(kLeftHip) - at(kLeftKnee)).norm() + (at(kLeftKnee) - at(kLeftAnkle)).norm();
  const Vec3 hips = 0.5 * (at(kLeftHip) + at(kRightHip)), away = at(kPelvis) - hips;
  if (away.norm() < kFar * leg) return;
  const Vec3 up = (at(kSpine3) - hips).normalized();
  map[kPelvis].offset += kAbove * leg * up - away;
}

/// The pelvis turns with the lowest bone that carries both legs, if that hangs on it: the first of
/// the spine in 3ds Max, Daz's `pelvis` below `hip`. Where the legs hang beside it, on a bone that
/// carries both and lies nearer to it than the knees do, that one is moved.
NamedJoints turned_with_legs(const SourceSkeleton& skeleton, NamedJoints names) {
  SourceJoint& pelvis = names.map[kPelvis];
  names.hips = pelvis.joint;
  const int legs = carrier_of(skeleton, names.map[kLeftHip].joint, names.map[kRightHip].joint);
  const std::vector<Vec3> zero = zero_positions(skeleton);
  const auto take = [&](int bone) {
    pelvis.offset += zero[static_cast<size_t>(pelvis.joint)] - zero[static_cast<size_t>(bone)];
    pelvis.joint = bone;
  };
  if (legs > pelvis.joint && hangs_on(skeleton, legs, pelvis.joint)) {
    take(legs);
  } else if (legs > 0 && legs != pelvis.joint && hangs_on(skeleton, pelvis.joint, legs)) {
    const auto away = [&](int bone) {
      return (zero[static_cast<size_t>(bone)] - zero[static_cast<size_t>(names.hips)]).norm();
    };
    if (away(legs) <
        std::min(away(names.map[kLeftKnee].joint), away(names.map[kRightKnee].joint))) {
      take(legs);
      names.hips = legs;
    }
  }
  place_among_hips(skeleton, names.map);
  return names;
}

NamedJoints name_known(const SourceSkeleton& skeleton, const std::string& where,
                       const Profile* profile) {
  const std::vector<std::string> plain = undecorated(skeleton.names);
  const BoneNames names(skeleton, plain, profile != nullptr);
  const auto placed = [&](const BoneTree& tree, const Profile& by, const Bones& bones) {
    const auto by_name = [&](const std::string& name) { return names.find(name); };
    return turned_with_legs(skeleton, place_joints(tree, by_name, by, bones, where));
  };
  const BoneTree tree = bone_tree(skeleton, plain, 0);
  if (profile) {
    const Bones bones = asked_bones(*profile, skeleton, names, where);
    return placed(tree, *profile, completed(tree, *profile, bones));
  }
  only_person(tree, where);  // refuses two
  if (const Family family = find_family(tree, names); family.profile)
    return placed(tree, *family.profile, family.bones);
  const Reading reading = best_reading(skeleton, plain, where);
  if (!reading.found.missing.empty()) {
    check_encoding(skeleton, where);
    throw_not_found(reading.tree, reading.found, plain, where);
  }
  return placed(reading.tree, no_profile(), reading.found.bones);
}

/// Where the head is of a skeleton without a bone for it: the end of its neck.
struct NeckEnd {
  int neck = -1;  ///< -1: there is none, or the head has a bone
  Vec3 end = Vec3::Zero();
};

/// Nothing where a word of any language may be the head's, or several necks end.
NeckEnd neck_end(const SourceSkeleton& skeleton, const std::vector<std::string>& plain) {
  NeckEnd out;
  const BoneTree tree = bone_tree(skeleton, plain, 0);
  for (size_t language = 0; language < bone_dictionaries().size(); ++language)
    for (const BoneWords& words : bone_tree(skeleton, plain, language).words)
      if (words.part == BonePart::head && !words.end) return {};
  for (size_t b = 0; b < skeleton.size(); ++b) {
    const BoneWords& words = tree.words[b];
    if (words.part != BonePart::neck || words.side != BoneWords::middle) continue;
    const int above = skeleton.parents[b];
    const bool is_end =
        words.end && above >= 0 && tree.words[static_cast<size_t>(above)].part == BonePart::neck;
    const bool has_end = !words.helper && skeleton.has_end[b] && !skeleton.ends[b].isZero();
    if (!is_end && !has_end) continue;
    if (out.neck >= 0) return {};
    out = is_end ? NeckEnd{above, skeleton.offsets[b]}
                 : NeckEnd{static_cast<int>(b), skeleton.ends[b]};
  }
  return out;
}

}  // namespace

void check_one_person(const SourceSkeleton& skeleton, const std::string& where) {
  const std::vector<std::string> plain = undecorated(skeleton.names);
  for (size_t language = 0; language < bone_dictionaries().size(); ++language)
    only_person(bone_tree(skeleton, plain, language), where);
}

NamedJoints name_joints(const SourceSkeleton& given, const std::string& where,
                        const Profile* profile) {
  SourceSkeleton skeleton = given;
  const NeckEnd head = profile == nullptr ? neck_end(given, undecorated(given.names)) : NeckEnd{};
  if (head.neck >= 0) skeleton.add("Head", head.neck, head.end);
  NamedJoints out = name_known(skeleton, where, profile);
  if (head.neck < 0) return out;
  for (SourceJoint& joint : out.map)
    if (joint.joint == std::ssize(given.names)) joint = {head.neck, Vec3(head.end + joint.offset)};
  out.placed.insert(std::upper_bound(out.placed.begin(), out.placed.end(), int{kHead}), kHead);
  return out;
}

}  // namespace restage
