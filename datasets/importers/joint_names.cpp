// map_joints(): the known sets of joint names, and where missing joints are put.
#include <algorithm>
#include <cctype>
#include <map>

#include "autograd/base/error.h"
#include "datasets/importers/source_motion.h"

namespace restage {
namespace {

enum : int { kSpine1 = 3, kSpine2 = 6, kSpine3 = 9, kNeck = 12, kHead = 15 };

/// Names of one family of skeletons in the order of kJointNames. An empty name, or one that a file
/// lacks, is placed by rule; the joints of `kRequired` cannot be.
struct Profile {
  const char* title;
  std::array<const char*, kJoints> names;
  const char* chest_end;  ///< spine3, if missing, lies on the way from spine2 to this joint
  double chest_fraction;  ///< how far
};
constexpr int kRequired[] = {0, 1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21};

// clang-format off
const Profile kProfiles[] = {
    {"Daz",
     {"hip", "lThigh", "rThigh", "abdomen", "lShin", "rShin", "chest", "lFoot", "rFoot", "", "lToe", "rToe",
      "neck", "lCollar", "rCollar", "head", "lShldr", "rShldr", "lForeArm", "rForeArm", "lHand", "rHand"},
     "neck", 0.35},
    {"ASF",
     {"root", "lfemur", "rfemur", "upperback", "ltibia", "rtibia", "thorax", "lfoot", "rfoot", "", "ltoes",
      "rtoes", "upperneck", "lclavicle", "rclavicle", "head", "lhumerus", "rhumerus", "lradius", "rradius",
      "lhand", "rhand"},
     "lowerneck", 0.5},
    {"CMU",  // the ASF skeleton under other names: LeftHand is its wrist bone, LeftFingerBase its hand
     {"Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine1", "LeftFoot", "RightFoot", "",
      "LeftToeBase", "RightToeBase", "Neck1", "LeftShoulder", "RightShoulder", "Head", "LeftArm", "RightArm",
      "LeftForeArm", "RightForeArm", "LeftFingerBase", "RightFingerBase"},
     "Neck", 0.5},
    {"Mixamo",
     {"Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine1", "LeftFoot", "RightFoot",
      "Spine2", "LeftToeBase", "RightToeBase", "Neck", "LeftShoulder", "RightShoulder", "Head", "LeftArm",
      "RightArm", "LeftForeArm", "RightForeArm", "LeftHand", "RightHand"},
     "Neck", 0.35},
    {"classic BVH",
     {"Hips", "LeftHip", "RightHip", "Chest", "LeftKnee", "RightKnee", "Chest2", "LeftAnkle", "RightAnkle",
      "Chest3", "LeftToe", "RightToe", "Neck", "LeftCollar", "RightCollar", "Head", "LeftShoulder",
      "RightShoulder", "LeftElbow", "RightElbow", "LeftWrist", "RightWrist"},
     "Neck", 0.35},
    {"MakeHuman",
     {"Root", "UpLeg_L", "UpLeg_R", "Spine1", "LoLeg_L", "LoLeg_R", "Spine2", "Foot_L", "Foot_R", "Spine3",
      "Toe_L", "Toe_R", "Neck", "Clavicle_L", "Clavicle_R", "Head", "UpArm_L", "UpArm_R", "LoArm_L", "LoArm_R",
      "Hand_L", "Hand_R"},
     "Neck", 0.35},
    {"MakeHuman default rig",
     {"root", "upperleg01.L", "upperleg01.R", "spine04", "lowerleg01.L", "lowerleg01.R", "spine03", "foot.L",
      "foot.R", "spine02", "toe1-1.L", "toe1-1.R", "neck01", "clavicle.L", "clavicle.R", "head", "upperarm01.L",
      "upperarm01.R", "lowerarm01.L", "lowerarm01.R", "wrist.L", "wrist.R"},
     "neck01", 0.35},
    {"VRM",
     {"hips", "leftUpperLeg", "rightUpperLeg", "spine", "leftLowerLeg", "rightLowerLeg", "chest", "leftFoot",
      "rightFoot", "upperChest", "leftToes", "rightToes", "neck", "leftShoulder", "rightShoulder", "head",
      "leftUpperArm", "rightUpperArm", "leftLowerArm", "rightLowerArm", "leftHand", "rightHand"},
     "neck", 0.35},
    {"Unreal 5",
     {"pelvis", "thigh_l", "thigh_r", "spine_01", "calf_l", "calf_r", "spine_03", "foot_l", "foot_r", "spine_05",
      "ball_l", "ball_r", "neck_01", "clavicle_l", "clavicle_r", "head", "upperarm_l", "upperarm_r", "lowerarm_l",
      "lowerarm_r", "hand_l", "hand_r"},
     "neck_01", 0.35},
    {"game engine",
     {"pelvis", "thigh_l", "thigh_r", "spine_01", "calf_l", "calf_r", "spine_02", "foot_l", "foot_r", "spine_03",
      "ball_l", "ball_r", "neck_01", "clavicle_l", "clavicle_r", "head", "upperarm_l", "upperarm_r", "lowerarm_l",
      "lowerarm_r", "hand_l", "hand_r"},
     "neck_01", 0.35},
    {"SMPL",
     {"Pelvis", "L_Hip", "R_Hip", "Spine1", "L_Knee", "R_Knee", "Spine2", "L_Ankle", "R_Ankle", "Spine3", "L_Foot",
      "R_Foot", "Neck", "L_Collar", "R_Collar", "Head", "L_Shoulder", "R_Shoulder", "L_Elbow", "R_Elbow",
      "L_Wrist", "R_Wrist"},
     "Neck", 0.35},
    {"restage",
     {"pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
      "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
      "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist"},
     "neck", 0.35},
};
// clang-format on

/// Without a namespace ("mixamorig:Hips") and in lower case.
std::string plain_name(const std::string& name) {
  const size_t colon = name.rfind(':');
  std::string out = colon == std::string::npos ? name : name.substr(colon + 1);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

using NameIndex = std::map<std::string, int>;

int find(const NameIndex& index, const char* name) {
  const auto at = index.find(plain_name(name));
  return *name == '\0' || at == index.end() ? -1 : at->second;
}

struct Found {
  const Profile* profile = nullptr;
  std::array<int, kJoints> joints{};
  std::vector<const char*> missing;  ///< of the required ones
  int count = 0;
};

Found match(const Profile& profile, const NameIndex& index) {
  Found out;
  out.profile = &profile;
  for (int j = 0; j < kJoints; ++j) {
    out.joints[j] = find(index, profile.names[j]);
    out.count += out.joints[j] >= 0;
  }
  for (const int j : kRequired)
    if (out.joints[j] < 0) out.missing.push_back(profile.names[j]);
  return out;
}

/// The profile that misses least, then finds most, then comes first.
Found best_match(const SourceSkeleton& skeleton, const std::string& where) {
  NameIndex index;
  for (size_t j = 0; j < skeleton.size(); ++j)
    index.emplace(plain_name(skeleton.names[j]), static_cast<int>(j));
  Found best;
  for (const Profile& profile : kProfiles) {
    Found found = match(profile, index);
    if (best.profile == nullptr || found.missing.size() < best.missing.size() ||
        (found.missing.size() == best.missing.size() && found.count > best.count))
      best = std::move(found);
  }
  if (best.missing.empty()) return best;
  std::string names;
  for (const char* name : best.missing) names += (names.empty() ? "" : ", ") + std::string(name);
  throw InputError(where,
                   "joint names fit no known skeleton; of the nearest (" +
                       std::string(best.profile->title) + ") it lacks " + names,
                   "rename the joints like Daz, ASF, CMU, Mixamo, MakeHuman or SMPL ones");
}

/// Places joints that the source lacks, in the frame of one that it has.
class Placer {
 public:
  Placer(const SourceSkeleton& skeleton, const Found& found) {
    zero_.resize(skeleton.size());
    for (size_t j = 0; j < skeleton.size(); ++j) {
      const int p = skeleton.parents[j];
      zero_[j] = p < 0 ? Vec3::Zero() : Vec3(zero_[static_cast<size_t>(p)] + skeleton.offsets[j]);
    }
    for (int j = 0; j < kJoints; ++j) map_[j].joint = found.joints[j];
  }

  bool lacks(int j) const { return map_[j].joint < 0; }
  Vec3 at(int j) const { return zero_[static_cast<size_t>(map_[j].joint)] + map_[j].offset; }
  Vec3 source(int joint) const { return zero_[static_cast<size_t>(joint)]; }
  const JointMap& map() const { return map_; }

  /// Joint j turns with the source joint of `like` and rests at `where`.
  void put(int j, int like, const Vec3& where) {
    map_[j].joint = map_[like].joint;
    map_[j].offset = where - zero_[static_cast<size_t>(map_[like].joint)];
  }
  void put_between(int j, int from, const Vec3& to, double fraction) {
    put(j, from, at(from) + fraction * (to - at(from)));
  }

 private:
  std::vector<Vec3> zero_;
  JointMap map_;
};

void place_spine(Placer& placer, const Profile& profile, int chest_end) {
  const int last = !placer.lacks(kSpine3)   ? kSpine3
                   : !placer.lacks(kSpine2) ? kSpine2
                   : !placer.lacks(kSpine1) ? kSpine1
                                            : 0;
  if (placer.lacks(kNeck)) placer.put_between(kNeck, last, placer.at(kHead), 0.75);
  const Vec3 neck = placer.at(kNeck);
  if (placer.lacks(kSpine1)) placer.put_between(kSpine1, 0, neck, 0.25);
  if (placer.lacks(kSpine2)) {
    // Two joints (or one, if spine3 is there) on the way from spine1 up.
    const Vec3 top = placer.lacks(kSpine3) ? neck : placer.at(kSpine3);
    placer.put_between(kSpine2, kSpine1, top, placer.lacks(kSpine3) ? 1.0 / 3 : 0.5);
    if (placer.lacks(kSpine3)) placer.put_between(kSpine3, kSpine1, neck, 2.0 / 3);
  }
  if (placer.lacks(kSpine3))
    placer.put_between(kSpine3, kSpine2, chest_end >= 0 ? placer.source(chest_end) : neck,
                       profile.chest_fraction);
}

void place_foot(Placer& placer, const SourceSkeleton& skeleton, int foot, int ankle,
                const std::string& where) {
  const size_t source = static_cast<size_t>(placer.map()[ankle].joint);
  if (skeleton.has_end[source]) {
    placer.put(foot, ankle, placer.at(ankle) + skeleton.ends[source]);
    return;
  }
  for (size_t j = 0; j < skeleton.size(); ++j)
    if (skeleton.parents[j] == static_cast<int>(source)) {
      placer.put(foot, ankle, placer.source(static_cast<int>(j)));
      return;
    }
  throw InputError(where, "joint " + skeleton.names[source] + " has neither a toe nor an end site",
                   "add one, so that the foot's direction is known");
}

}  // namespace

JointMap map_joints(const SourceSkeleton& skeleton, const std::string& where) {
  const Found found = best_match(skeleton, where);
  NameIndex index;
  for (size_t j = 0; j < skeleton.size(); ++j)
    index.emplace(plain_name(skeleton.names[j]), static_cast<int>(j));
  Placer placer(skeleton, found);
  place_spine(placer, *found.profile, find(index, found.profile->chest_end));
  for (const int side : {0, 1}) {
    const int collar = 13 + side, shoulder = 16 + side, foot = 10 + side, ankle = 7 + side;
    if (placer.lacks(collar)) {
      const Vec3 neck = placer.at(kNeck);
      placer.put(collar, kSpine3, neck + 0.2 * (placer.at(shoulder) - neck));
    }
    if (placer.lacks(foot)) place_foot(placer, skeleton, foot, ankle, where);
  }
  return placer.map();
}

}  // namespace restage
