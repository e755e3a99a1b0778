#include "datasets/importers/rigs/gltf_rig.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "autograd/base/format.h"
#include "datasets/importers/rigs/carriers.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kStraight = 5 * kDegree;  // arms nearer than this to the T-pose stay

double angle_of(const Mat3& rotation) { return Eigen::AngleAxisd(rotation).angle(); }

// ---- bind pose ---------------------------------------------------------------------------------

struct Offset {
  double degrees = 0, length = 0;
};

/// How far the nodes of a skin rest from where `mesh` puts their bind pose.
Offset rest_offset(const std::vector<GltfBone>& bones, const GltfTransforms& rest,
                   const Eigen::Affine3d& mesh) {
  Offset out;
  for (const GltfBone& bone : bones) {
    const Eigen::Affine3d bound = mesh * bone.inverse_bind.inverse();
    const Eigen::Affine3d& node = rest[bone.node];
    if (!(std::abs(node.linear().determinant()) > 1e-30)) continue;
    const Mat3 turn = rotation_of(node.linear() * bound.linear().inverse());
    out.degrees = std::max(out.degrees, angle_of(turn) / kDegree);
    out.length = std::max(out.length, (node.translation() - bound.translation()).norm());
  }
  return out;
}

double extent(const std::vector<GltfBone>& bones, const GltfTransforms& rest) {
  Eigen::AlignedBox3d box;
  for (const GltfBone& bone : bones) box.extend(rest[bone.node].translation().eval());
  return box.sizes().norm();
}

/// From the space of a skin's vertices to the world, in its bind pose. `bones`: of that skin.
Eigen::Affine3d bind_space(const Gltf& file, const std::vector<GltfBone>& bones,
                           const GltfTransforms& rest, ImportReport& report) {
  const GltfBone& top =
      *std::min_element(bones.begin(), bones.end(),
                        [](const GltfBone& a, const GltfBone& b) { return a.node < b.node; });
  const Eigen::Affine3d by_root = rest[top.node] * top.inverse_bind;
  const Offset off = rest_offset(bones, rest, by_root);
  if (off.degrees < 0.5 && off.length <= 0.01 * extent(bones, rest)) return by_root;
  report.remark(
      format("the nodes rest in another pose than the skin was made in (up to %.0f degrees): the "
             "skin's is taken",
             off.degrees));
  // Where the root itself rests turned, it does not say how the mesh stands. Makers store vertices
  // in the space of the node that wears the mesh, of the bones' parent, or in the world (Blender):
  // the one of the root's scale that the root tilts least from.
  std::vector<Eigen::Affine3d> spaces;
  if (const int wearer = file.skin_nodes[top.skin]; wearer >= 0) spaces.push_back(rest[wearer]);
  if (const int above = file.nodes[top.node].parent; above >= 0) spaces.push_back(rest[above]);
  spaces.push_back(Eigen::Affine3d::Identity());
  const Eigen::Affine3d* best = &by_root;
  double least = 180;
  for (const Eigen::Affine3d& space : spaces) {
    const double ratio =
        space.linear().determinant() / std::max(std::abs(by_root.linear().determinant()), 1e-300);
    if (!(std::abs(std::cbrt(ratio) - 1) < 0.01)) continue;
    const Mat3 turn = rotation_of(by_root.linear()) * rotation_of(space.linear()).transpose();
    const double tilt = angle_between(turn * Vec3::UnitY(), Vec3::UnitY()) / kDegree;
    if (tilt > least - 1) continue;  // nearly alike: the first
    least = tilt;
    best = &space;
  }
  return *best;
}

GltfTransforms bind_pose(const Gltf& file, ImportReport& report) {
  const GltfTransforms rest = gltf_rest(file);
  std::vector<std::vector<GltfBone>> skins(file.skin_nodes.size());
  for (const GltfBone& bone : file.bones)
    if (bone.skin >= 0) skins[bone.skin].push_back(bone);
  std::stable_sort(skins.begin(), skins.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  GltfTransforms out(rest.size());
  std::vector<bool> known(rest.size());
  for (const auto& bones : skins) {
    if (bones.empty()) continue;
    // A skin that shares a joint with one that is placed already hangs on it.
    const auto shared = std::find_if(bones.begin(), bones.end(),
                                     [&](const GltfBone& bone) { return known[bone.node]; });
    const Eigen::Affine3d space = shared != bones.end() ? out[shared->node] * shared->inverse_bind
                                                        : bind_space(file, bones, rest, report);
    for (const GltfBone& bone : bones) {
      const auto n = static_cast<size_t>(bone.node);
      if (!known[n]) out[n] = space * bone.inverse_bind.inverse();
      known[n] = true;
    }
  }
  for (size_t n = 0; n < out.size(); ++n) {
    if (known[n]) continue;
    const int p = file.nodes[n].parent;
    out[n] = p < 0 ? file.nodes[n].local() : out[p] * file.nodes[n].local();
  }
  return out;
}

// ---- names -------------------------------------------------------------------------------------

/// Nodes that may be bones: joints of skins, those of VRM's list, and what hangs on them; all, if
/// there are no skins.
std::vector<int> bone_nodes(const Gltf& file) {
  std::vector<bool> is(file.nodes.size());
  bool skins = false;
  for (const GltfBone& bone : file.bones)
    if (bone.skin >= 0) skins = is[bone.node] = true;
  for (const auto& [name, node] : file.humanoid) is[static_cast<size_t>(node)] = true;
  std::vector<int> out;
  for (size_t n = 0; n < is.size(); ++n) {
    const int p = file.nodes[n].parent;
    if (!skins || (p >= 0 && is[p])) is[n] = true;
    if (is[n]) out.push_back(static_cast<int>(n));
  }
  return out;
}

/// Whether bones go by VRM's list of them; a profile that is asked for goes by the nodes' names.
bool by_list(const Gltf& file, const Profile* profile) {
  return !file.humanoid.empty() && (profile == nullptr || profile->name == "vrm");
}

/// The zero pose of SourceSkeleton is the bind pose, all axes along the world's. Joint 0 is the
/// world, joint i + 1 is nodes[i].
SourceSkeleton skeleton_of(const Gltf& file, const std::vector<int>& nodes,
                           const GltfTransforms& bind, bool by_vrm_list) {
  SourceSkeleton out;
  std::vector<int> place(file.nodes.size(), 0);
  out.add("", -1, Vec3::Zero());
  for (const int n : nodes) {
    const GltfNode& node = file.nodes[n];
    const int parent = node.parent < 0 ? 0 : place[node.parent];
    const Vec3 from = parent == 0 ? Vec3(Vec3::Zero()) : bind[node.parent].translation();
    place[n] = static_cast<int>(out.size());
    out.add(node.name, parent, bind[n].translation() - from);
  }
  if (!by_vrm_list) return out;
  // A VRM file says which bone is which; what its nodes are called is its author's business.
  for (std::string& name : out.names) name.clear();
  for (const auto& [name, n] : file.humanoid)
    if (const int at = place[n]; at > 0) out.names[at] = name;
  return out;
}

/// The profile that VRM's list of bones is read with.
const Profile& vrm_profile() {
  static const Profile out = [] {
    Profile vrm = find_profile("vrm");
    vrm.list = "VRM's list of bones (humanBones)";
    vrm.mend =
        "assign them to the humanoid in the program that exports VRM, or say which node is which "
        "joint with {bones} names.yaml (docs/formats.md)";
    return vrm;
  }();
  return out;
}

NamedJoints rig_names(const Gltf& file, const std::vector<int>& nodes, const GltfTransforms& bind,
                      const Profile* profile) {
  const bool listed = by_list(file, profile);
  // A skin is one person's, whoever says which bone is which.
  if (!file.skin_nodes.empty()) check_one_person(skeleton_of(file, nodes, bind, false), file.path);
  return name_joints(skeleton_of(file, nodes, bind, listed), file.path,
                     listed ? &vrm_profile() : profile);
}

// ---- units and axes ----------------------------------------------------------------------------

double find_scale(const Joints& joints, double given, ImportReport& report) {
  const double leg = leg_length(joints);
  double scale = given;
  std::string how = "as given";
  if (scale <= 0) {
    const LegUnit* unit = unit_of_leg(leg);
    scale = leg >= 0.1 && leg < 4       ? 1.0
            : unit                      ? unit->metres
            : leg >= 140 && leg < 400   ? 0.01
            : leg >= 1400 && leg < 4000 ? 0.001
                                        : 0.0;
    if (scale == 0)
      throw InputError(
          report.file, "a leg of " + format("%.3g", leg) + " units is no person's in metres",
          "export it in metres (where a command has {scale}, that says the unit, too)");
    how = scale == 1.0 ? "the format's" : unit_name(scale) + " by the leg";
  }
  report.fact("units", format("%g m (%s; the leg has %.3g)", scale, how.c_str(), leg));
  return scale;
}

/// The quarter turns that bring the body upright.
Mat3 find_up(const Joints& joints, Axis given, ImportReport& report) {
  const bool found = given == Axis::automatic;
  const Axis up = found ? axis_near(joints[15] - 0.5 * (joints[7] + joints[8])) : given;
  report.fact("up", to_string(up) + (found ? " (from ankles to head)" : " (as given)"));
  return upright(up);
}

/// The turn about y that brings the left side to +x: quarters, if it is within 10 degrees of one.
Mat3 find_front(const Joints& upright, ImportReport& report) {
  const Vec3 left = (upright[1] - upright[2]) + (upright[16] - upright[17]);
  double yaw = std::atan2(left.z(), left.x());
  const Mat3 out = turn_in_quarters(yaw);
  const double degrees = std::round(yaw / kDegree) + 0.0;  // no -0
  report.fact("facing", format("turned by %.0f degrees to face +z", degrees));
  return out;
}

void check_standing(const Joints& joints, const Gltf& file) {
  const bool skin = !file.skin_nodes.empty();
  const auto check = [&](const Limb& limb, double most) {
    const Vec3 bone = joints[limb.to] - joints[limb.from];
    if (!(bone.norm() > 1e-4) || angle_between(bone, limb.wanted) > most * kDegree)
      throw InputError(file.path,
                       cat(skin ? "the skin was not made standing: "
                                : "its nodes do not rest "
                                  "standing: ",
                           kJointNames[limb.from], " to ", kJointNames[limb.to],
                           " does not point as in a T-pose or an A-pose"),
                       "export it with the rest pose of its rig");
  };
  for (const Limb& limb : t_pose_limbs()) check(limb, limb.from < 16 ? 60 : 120);
  check({0, 15, Vec3::UnitY()}, 60);
}

// ---- T-pose ------------------------------------------------------------------------------------

bool is_middle_finger(const std::string& node) {
  const std::string name = lower_case(node);
  return name.find("middle") != std::string::npos || name.find("finger3") != std::string::npos;
}

/// The first node of the middle finger below `hand`, or -1.
int middle_finger(const Gltf& file, int hand) {
  std::vector<bool> below(file.nodes.size());
  below[hand] = true;
  for (size_t n = static_cast<size_t>(hand) + 1; n < below.size(); ++n) {
    const int p = file.nodes[n].parent;
    if (p < 0 || !below[p]) continue;
    below[n] = true;
    if (is_middle_finger(file.nodes[n].name)) return static_cast<int>(n);
    for (const auto& [name, node] : file.humanoid)
      if (node == static_cast<int>(n) && is_middle_finger(name)) return node;
  }
  return -1;
}

/// World rotations of upper arms, forearms and hands onto the shoulders' line, as the joints show
/// them; a limb without one keeps its parent's (hands) or its own place (everything else).
std::array<std::optional<Mat3>, kJoints> arm_turns(const Gltf& file, const GltfRig& rig,
                                                   const Joints& joints, ImportReport& report) {
  std::array<std::optional<Mat3>, kJoints> out;
  std::vector<std::string> words;
  for (const int side : {0, 1}) {
    const int shoulder = 16 + side, elbow = shoulder + 2, wrist = shoulder + 4;
    const Vec3 x = rig.turn.transpose() * Vec3(side == 0 ? 1.0 : -1.0, 0, 0);
    const int finger = middle_finger(file, rig.node[wrist]);
    const Vec3 knuckle = finger >= 0 ? rig.bind[finger].translation() : joints[wrist];
    const auto turn = [&](int joint, const Vec3& bone, const char* name) {
      const double angle = angle_between(bone, x);
      const bool off = angle > kStraight;
      out[joint] = off ? shortest_arc(bone, x) : Mat3(Mat3::Identity());
      if (off)
        words.push_back(
            format("%s %s %.1f degrees", side == 0 ? "left" : "right", name, angle / kDegree));
    };
    turn(shoulder, joints[elbow] - joints[shoulder], "upper arm");
    turn(elbow, joints[wrist] - joints[elbow], "forearm");
    if (finger >= 0) turn(wrist, knuckle - joints[wrist], "hand");
  }
  report.fact("rest pose", words.empty()
                               ? "T-pose"
                               : "turned onto the T-pose by shortest arcs: " + joined(words));
  return out;
}

/// Every node turns with the nearest of the 22 joints above it that turns.
GltfTransforms turned(const Gltf& file, const GltfRig& rig,
                      const std::array<std::optional<Mat3>, kJoints>& turns) {
  std::vector<Mat3> by(file.nodes.size(), Mat3::Identity());
  GltfTransforms out(file.nodes.size());
  for (const int node : rig.order) {
    const auto n = static_cast<size_t>(node);
    const int p = rig.carrier[n];
    if (p >= 0) by[n] = by[p];
    for (size_t j = 0; j < kJoints; ++j)
      if (rig.node[j] == static_cast<int>(n) && turns[j]) by[n] = *turns[j];
    out[n].linear() = by[n] * rig.bind[n].linear();
    const Vec3 at = rig.bind[n].translation();
    out[n].translation() =
        p < 0 ? at : Vec3(out[p].translation() + by[p] * (at - rig.bind[p].translation()));
  }
  return out;
}

void find_nodes(const Gltf& file, GltfRig& rig, const NamedJoints& names,
                const std::vector<int>& nodes, ImportReport& report) {
  const JointMap& map = names.map;
  rig.hips = nodes[static_cast<size_t>(names.hips) - 1];
  std::vector<int> owner(file.nodes.size(), -1);
  std::vector<std::string> words;
  for (size_t j = 0; j < kJoints; ++j) {
    if (map[j].joint == 0)
      throw InputError(file.path, "its joints hang on no common bone", "export the whole skeleton");
    rig.node[j] = nodes[static_cast<size_t>(map[j].joint) - 1];
    rig.offset[j] = map[j].offset;
    int& owned = owner[rig.node[j]];
    if (owned < 0 || map[j].offset.isZero()) owned = static_cast<int>(j);
    words.push_back(cat(kJointNames[j], " = ", text::quote(file.nodes[rig.node[j]].name),
                        map[j].offset.isZero() ? "" : " (beside it)"));
  }
  report.fact("joints", joined(words));
  rig.joint.assign(file.nodes.size(), 0);
  for (size_t n = 0; n < owner.size(); ++n)
    rig.joint[n] = owner[n] >= 0              ? owner[n]
                   : file.nodes[n].parent < 0 ? 0
                                              : rig.joint[file.nodes[n].parent];
  find_carriers(file, rig, owner, report);
}

/// A skin on other bones than the person's is somebody else's (a horse's): one body of both would
/// be wrong without a word.
void check_skins(const Gltf& file, const GltfRig& rig) {
  std::vector<bool> joint(file.nodes.size()), own(file.nodes.size());
  for (const GltfBone& bone : file.bones)
    if (bone.skin >= 0) joint[bone.node] = true;
  int top = rig.node[0];
  for (int n = top; n >= 0; n = file.nodes[n].parent)
    if (joint[n]) top = n;
  for (int n = top; n >= 0; n = file.nodes[n].parent) own[n] = true;
  for (size_t n = static_cast<size_t>(top) + 1; n < own.size(); ++n)  // parents come first
    if (const int p = file.nodes[n].parent; p >= top && own[p]) own[n] = true;
  std::vector<const GltfBone*> first(file.skin_nodes.size());  // of each skin
  std::vector<bool> persons(file.skin_nodes.size());
  for (const GltfBone& bone : file.bones) {
    if (bone.skin < 0) continue;
    if (first[bone.skin] == nullptr) first[bone.skin] = &bone;
    if (own[bone.node]) persons[bone.skin] = true;
  }
  for (size_t s = 0; s < persons.size(); ++s)
    if (!persons[s] && file.skin_nodes[s] >= 0 && first[s] != nullptr)
      throw InputError(file.path,
                       "holds a skin on bones that are not the person's (" +
                           text::quote(file.nodes[first[s]->node].name) + " ...)",
                       "export the person alone");
}

/// A node that is scaled more along one axis than along another stretches what turns below it.
void say_uneven_scale(const Gltf& file, const GltfRig& rig, ImportReport& report) {
  constexpr double kUneven = 1.02;
  const GltfTransforms rest = gltf_rest(file);
  for (size_t j = 0; j < kJoints; ++j) {
    const auto n = static_cast<size_t>(rig.node[j]);
    const Vec3 sizes = rest[n].linear().jacobiSvd().singularValues();
    if (sizes.x() < kUneven * sizes.z()) continue;
    report.remarks.push_back(cat(
        "bone ", text::quote(file.nodes[n].name), " is scaled unevenly (",
        format("%.0f %% more along one axis", 100 * (sizes.x() / sizes.z() - 1)),
        "): what hangs on it changes its length as it turns; apply the scale in the program that "
        "exported it (Blender: Object > Apply > Scale)"));
    return;
  }
}

}  // namespace

GltfRig find_rig(const Gltf& file, const MotionOptions& options, ImportReport& report) {
  const std::optional<Profile> asked = asked_profile(options);
  const Profile* const profile = asked ? &*asked : nullptr;
  GltfRig rig;
  rig.bind = bind_pose(file, report);
  const std::vector<int> nodes = bone_nodes(file);
  const NamedJoints names = rig_names(file, nodes, rig.bind, profile);
  if (by_list(file, profile))
    report.fact("names", "VRM's list of bones, not the nodes' names");
  else
    report.fact("names",
                names.profile->title +
                    (names.profile->name.empty() ? "" : " (profile " + names.profile->name + ")"));
  find_nodes(file, rig, names, nodes, report);
  check_skins(file, rig);
  Joints joints;
  for (size_t j = 0; j < kJoints; ++j)
    joints[j] = rig.bind[rig.node[j]].translation() + rig.offset[j];
  rig.scale = find_scale(joints, options.scale, report);
  rig.turn = find_up(joints, options.rest.up, report);
  Joints upright;
  for (size_t j = 0; j < kJoints; ++j) upright[j] = rig.to_ours(joints[j]);
  const Mat3 front = find_front(upright, report);
  for (Vec3& x : upright) x = front * x;
  rig.turn = front * rig.turn;
  check_standing(upright, file);
  const auto turns = arm_turns(file, rig, joints, report);
  rig.t_pose = turned(file, rig, turns);
  say_uneven_scale(file, rig, report);
  for (size_t j = 0; j < kJoints; ++j) {
    const auto n = static_cast<size_t>(rig.node[j]);
    if (!(std::abs(rig.bind[n].linear().determinant()) > 1e-30))
      throw InputError(file.path, "bone " + text::quote(file.nodes[n].name) + " has no size",
                       "export it with scales other than 0");
    rig.offset[j] = rig.t_pose[n].linear() * rig.bind[n].linear().inverse() * rig.offset[j];
  }
  return rig;
}

Mat3 rotation_of(const Mat3& given) {
  // Of a mirror the rotation behind a point reflection, the same way for all nodes below it.
  const Mat3 m = given.determinant() < 0 ? Mat3(-given) : given;
  const Mat3 unscaled = m / std::cbrt(std::max(std::abs(m.determinant()), 1e-300));
  if ((unscaled.transpose() * unscaled - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-9 &&
      unscaled.determinant() > 0)
    return unscaled;
  return Eigen::Affine3d(Eigen::Translation3d(0, 0, 0) * m).rotation();
}

SkinWeights joint_weights(const Gltf& file, const GltfRig& rig) {
  SkinWeights out;
  out.setZero(static_cast<Eigen::Index>(file.vertices.size()), kJoints);
  for (size_t v = 0; v < file.vertices.size(); ++v) {
    auto row = out.row(static_cast<Eigen::Index>(v));
    for (uint32_t i = file.first_influence[v]; i < file.first_influence[v + 1]; ++i) {
      const GltfBone& bone = file.bones[file.influences[i].bone];
      row[rig.joint[bone.node]] += file.influences[i].weight;
    }
  }
  return out;
}

Vec3 put_on_floor(Mesh& mesh, const Vec3& pelvis) {
  float floor = mesh.vertices[0].y();
  for (const Point& p : mesh.vertices) floor = std::min(floor, p.y());
  const Vec3 origin(pelvis.x(), double{floor}, pelvis.z());
  for (Point& p : mesh.vertices) p = (p.cast<double>() - origin).cast<float>();
  return origin;
}

Joints t_pose_joints(const GltfRig& rig) {
  Joints out;
  for (size_t j = 0; j < kJoints; ++j)
    out[j] = rig.to_ours(rig.t_pose[rig.node[j]].translation() + rig.offset[j]);
  return out;
}

PosedSkeleton rig_pose(const GltfRig& rig, const GltfTransforms& world) {
  PosedSkeleton out;
  for (size_t j = 0; j < kJoints; ++j) {
    const auto n = static_cast<size_t>(rig.node[j]);
    const Mat3 from_t = world[n].linear() * rig.t_pose[n].linear().inverse();
    out.global[j] = rig.turn * rotation_of(from_t) * rig.turn.transpose();
    out.joints[j] = rig.to_ours(world[n].translation() + from_t * rig.offset[j]);
  }
  return out;
}

}  // namespace restage
