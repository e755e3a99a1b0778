#include "infer/unpose.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/words.h"
#include "infer/surface.h"
#include "nn/geometry/normals.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

constexpr int kViews = 16;
constexpr size_t kPoints = 8192;
constexpr double kStandsInT = 15;  // degrees

/// Where the limbs of a T-pose point: arms by its definition, legs as those of MakeHuman's bodies,
/// which differ by one or two degrees. A trunk is known less well.
struct LimbInT {
  size_t from, to;
  Vec3 way;
  bool known;
  const char* name;
};
const std::vector<LimbInT>& limbs() {
  static const std::vector<LimbInT> all = [] {
    std::vector<LimbInT> out{{kPelvis, kNeck, Vec3::UnitY(), false, "trunk"}};
    for (const size_t side : {0, 1}) {
      const double out_of = side == 0 ? 1 : -1;
      const char *arm = side == 0 ? "left arm" : "right arm",
                 *leg = side == 0 ? "left leg" : "right leg";
      out.push_back({kLeftShoulder + side, kLeftElbow + side, Vec3(out_of, 0, 0), true, arm});
      out.push_back({kLeftElbow + side, kLeftWrist + side, Vec3(out_of, 0, 0), true, arm});
      out.push_back({kLeftHip + side, kLeftKnee + side,
                     Vec3(0.097 * out_of, -0.992, 0.080).normalized(), true, leg});
      out.push_back({kLeftKnee + side, kLeftAnkle + side,
                     Vec3(0.099 * out_of, -0.994, -0.052).normalized(), true, leg});
      out.push_back({kLeftAnkle + side, kLeftFoot + side,
                     Vec3(0.022 * out_of, -0.461, 0.887).normalized(), true, leg});
    }
    return out;
  }();
  return all;
}

double farthest(const Joints& joints) {
  double out = 0;
  for (const LimbInT& limb : limbs()) {
    const Vec3 way = (joints[limb.to] - joints[limb.from]).normalized();
    out = std::max(out, std::acos(std::clamp(way.dot(limb.way), -1.0, 1.0)) * 180 / M_PI);
  }
  return out;
}

[[noreturn]] void refuse(const std::string& where, size_t joint) {
  const char* name = "trunk";
  for (const LimbInT& limb : limbs())
    if (limb.to == joint || limb.from == joint) name = limb.name;
  throw InputError(where,
                   cat("is not in T-pose, and its ", name, " cannot be made out in its pose"),
                   "give the target in T-pose or A-pose, whole, with arms and legs apart");
}

/// What the extractor is not sure of is no ground for a T-pose.
void check_sure(const SeenJoints& seen, const std::string& where) {
  constexpr double kUnsure = 0.06;  // metres
  const auto& u = *seen.uncertainty;
  const auto worst = std::max_element(u.begin(), u.end());
  if (*worst > kUnsure) refuse(where, static_cast<size_t>(worst - u.begin()));
}

/// In T-pose the extractor sees best. Joints that it then sees elsewhere tell of parts that went
/// with a wrong limb, where hands or legs touched something (experiments/studies/any_pose).
void check_seen_again(SkeletonModel& skeleton, const Unposed& found, const std::string& where,
                      const RngKey& key) {
  constexpr double kMoved = 0.04;  // metres
  const Joints again =
      extract_joints(skeleton, surface_points(found.mesh, kPoints, key), where, key,
                     {.samples = kViews, .around = kRestPoses, .any_size = true});
  double most = kMoved;
  size_t worst = kJoints;
  for (size_t j = 1; j < kJoints; ++j)
    if (const double off = ((again[j] - again[0]) - (found.rest[j] - found.rest[0])).norm();
        off > most)
      most = off, worst = j;
  if (worst < kJoints) refuse(where, worst);
}

/// A surface that has to stretch far went with two limbs at once.
void check_whole(const Mesh& stood, const Unposed& found, const std::string& where) {
  constexpr double kTimes = 3, kMost = 0.1;  // of its length, and metres
  double most = kMost;
  Point torn;
  for (const Triangle& t : stood.faces)
    for (size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<size_t>(t[k]), b = static_cast<size_t>(t[(k + 1) % 3]);
      const double before = (stood.vertices[a] - stood.vertices[b]).norm(),
                   after = (found.mesh.vertices[a] - found.mesh.vertices[b]).norm();
      if (after < kTimes * before || after - before < most) continue;
      most = after - before;
      torn = 0.5f * (stood.vertices[a] + stood.vertices[b]);
    }
  if (most == kMost) return;
  size_t nearest = 1;
  const auto away = [&](size_t j) {
    return (found.from[j].inverse() * found.rest[j] - torn.cast<double>()).norm();
  };
  for (size_t j = 2; j < kJoints; ++j)
    if (away(j) < away(nearest)) nearest = j;
  refuse(where, nearest);
}

/// The joint that moves a place of a part most.
int joint_at(BodyPart part, const PlaceOnPart& place) {
  const double along = place.along;
  switch (part) {
    case BodyPart::belly:
      return along < 0.5 ? kPelvis : kSpine1;
    case BodyPart::chest:
      return along < 0.5 ? kSpine2 : kSpine3;
    case BodyPart::head:
      return along < 0 ? kNeck : kHead;
    case BodyPart::left_thigh:
      return kLeftHip;
    case BodyPart::right_thigh:
      return kRightHip;
    case BodyPart::left_shin:
      return kLeftKnee;
    case BodyPart::right_shin:
      return kRightKnee;
    case BodyPart::left_foot:
      return along < 0.7 ? kLeftAnkle : kLeftFoot;
    case BodyPart::right_foot:
      return along < 0.7 ? kRightAnkle : kRightFoot;
    case BodyPart::left_upper_arm:
      return kLeftShoulder;
    case BodyPart::right_upper_arm:
      return kRightShoulder;
    case BodyPart::left_forearm:
      return kLeftElbow;
    case BodyPart::right_forearm:
      return kRightElbow;
    case BodyPart::left_hand:
      return kLeftWrist;
    case BodyPart::right_hand:
      return kRightWrist;
  }
  return kPelvis;
}

/// Which way the surface faces at each vertex; nothing for a cloud.
std::vector<Vec3> outward(const Mesh& mesh) {
  if (mesh.faces.empty()) return {};
  double volume = 0;
  for (const Triangle& t : mesh.faces) {
    const auto at = [&](size_t k) {
      return Vec3(mesh.vertices[static_cast<size_t>(t[k])].cast<double>());
    };
    volume += at(0).dot(at(1).cross(at(2)));
  }
  std::vector<Vec3> out = vertex_normals<Vec3>(mesh.vertices, mesh.faces, Vec3::Zero());
  if (volume < 0)
    for (Vec3& n : out) n = -n;
  return out;
}

/// Every row becomes the mean of its own and of its neighbours' on the surface.
void spread(const Mesh& mesh, SkinWeights* weights) {
  constexpr int kTimes = 40;
  for (int time = 0; time < kTimes; ++time) {
    SkinWeights sum = *weights;
    for (const Triangle& t : mesh.faces)
      for (int k = 0; k < 3; ++k) {
        sum.row(t[static_cast<size_t>(k)]) += weights->row(t[static_cast<size_t>((k + 1) % 3)]);
        sum.row(t[static_cast<size_t>((k + 1) % 3)]) += weights->row(t[static_cast<size_t>(k)]);
      }
    for (Eigen::Index v = 0; v < sum.rows(); ++v) weights->row(v) = sum.row(v) / sum.row(v).sum();
  }
}

/// The parts of a mesh in any pose: each vertex belongs to the part of an average person in that
/// pose whose surface is nearest and faces the same way, as its neighbours do.
SkinWeights parts_of(const Mesh& mesh, const SeenJoints& seen, const PartSurfaces& average) {
  constexpr double kTurned = 0.06;  // metres that a surface is farther which faces away
  SkinWeights out = SkinWeights::Zero(static_cast<Eigen::Index>(mesh.vertices.size()), kJoints);
  PosedSkeleton posed;
  posed.joints = seen.joints;
  posed.global = *seen.turns;
  const double size = leg_length(seen.joints);
  const std::vector<Vec3> normals = outward(mesh);
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    double least = 1e9;
    int joint = kPelvis;
    for (int p = 0; p < kParts; ++p) {
      const auto part = static_cast<BodyPart>(p);
      const NearPart near = average.locate(part, posed, mesh.vertices[v].cast<double>(), size);
      double far = std::abs(near.over);
      if (!normals.empty()) far += kTurned * (1 - normals[v].dot(near.out));
      if (far < least) least = far, joint = joint_at(part, near.place);
    }
    out(static_cast<Eigen::Index>(v), joint) = 1;
  }
  if (!mesh.faces.empty()) spread(mesh, &out);
  return out;
}

/// The joints in T-pose and what takes each joint's points there. Of limbs whose place in a T-pose
/// is known the seen turns count only about the bone.
void take_back(const SeenJoints& seen, Unposed* out) {
  Rotations back;
  for (size_t j = 0; j < kJoints; ++j) back[j] = (*seen.turns)[j].transpose();
  for (const LimbInT& limb : limbs())
    if (limb.known)
      back[limb.from] =
          shortest_arc(back[limb.from] * (seen.joints[limb.to] - seen.joints[limb.from]),
                       limb.way) *
          back[limb.from];
  out->rest[0] = Vec3::Zero();
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    out->rest[j] = out->rest[p] + back[p] * (seen.joints[j] - seen.joints[p]);
  }
  for (size_t j = 0; j < kJoints; ++j) {
    out->from[j].setIdentity();
    out->from[j].linear() = back[j];
    out->from[j].translation() = out->rest[j] - out->from[j].linear() * seen.joints[j];
  }
}

void move_vertices(const Mesh& mesh, const SkinWeights& weights, Unposed* out) {
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3 p = mesh.vertices[v].cast<double>();
    Vec3 sum = Vec3::Zero();
    for (size_t j = 0; j < kJoints; ++j)
      if (const double w = weights(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(j));
          w != 0)
        sum += w * (out->from[j] * p);
    out->mesh.vertices[v] = sum.cast<float>();
  }
}

void stand_on_floor(Unposed* out) {
  float lowest = out->mesh.vertices[0].y();
  for (const Point& p : out->mesh.vertices) lowest = std::min(lowest, p.y());
  for (Point& p : out->mesh.vertices) p.y() -= lowest;
  for (size_t j = 0; j < kJoints; ++j) {
    out->rest[j].y() -= lowest;
    out->from[j].translation().y() -= lowest;
  }
}

}  // namespace

std::optional<Unposed> unpose(const Bundle& weights, const std::string& weights_name,
                              const Mesh& mesh, const std::string& where,
                              const PartSurfaces& average, uint64_t seed) {
  constexpr int kSkins = 2;
  auto* skeleton = weights.find_as<SkeletonModel>("skeleton");
  if (skeleton == nullptr || weights.find("deformation.weights") == nullptr) return {};
  const RngKey key = RngKey{seed, 0}.fold("unpose");
  const LookOptions look{.samples = kViews, .any_size = true, .any_way_up = true};
  const SeenJoints seen = JointExtractor(*skeleton, look)(
      surface_points(mesh, kPoints, key.fold("surface")), where, key);
  Unposed out;
  out.farthest = farthest(seen.joints);
  if (out.farthest <= kStandsInT || !seen.turns || !seen.uncertainty) return {};
  check_sure(seen, where);
  out.mesh = mesh;
  take_back(seen, &out);
  move_vertices(mesh, parts_of(mesh, seen, average), &out);
  for (int skin = 0; skin < kSkins; ++skin)
    move_vertices(mesh, Surface(weights, weights_name, out.mesh, out.rest).weights(), &out);
  stand_on_floor(&out);
  check_whole(mesh, out, where);
  check_seen_again(*skeleton, out, where, key.fold("again"));
  return out;
}

}  // namespace restage
