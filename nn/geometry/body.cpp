#include "nn/geometry/body.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "autograd/base/error.h"
#include "nn/geometry/skinning.h"

namespace restage {
namespace {

using Mat3f = Eigen::Matrix3f;
using Vec4f = Eigen::Vector4f;

/// Joints whose bone direction is known on both sides, and the joint at the bone's far end.
constexpr int kLimbs[8][2] = {{1, 4},   {2, 5},   {4, 7},   {5, 8},
                              {16, 18}, {17, 19}, {18, 20}, {19, 21}};

/// Left hip-knee plus knee-ankle: trajectories are scaled by this side, as the reference tool does.
double left_leg(const Joints& x) { return (x[1] - x[4]).norm() + (x[4] - x[7]).norm(); }

/// How each joint moves the rest surface, as unit dual quaternions, and which of each pair must
/// change sign to blend the short way.
struct DualTransforms {
  std::array<Vec4f, kJoints> real, dual;  // x, y, z, w
  float sign[kJoints][kJoints];
};

DualTransforms dual_transforms(const Body& body, const PosedSkeleton& posed) {
  DualTransforms out;
  for (int j = 0; j < kJoints; ++j) {
    const Quat q(posed.global[j]);
    const Vec3 t = posed.joints[j] - posed.global[j] * body.joints[j];
    const Quat d = Quat(0.0, t.x(), t.y(), t.z()) * q;
    out.real[j] = q.normalized().coeffs().cast<float>();
    out.dual[j] = (0.5 * d.coeffs()).cast<float>();
  }
  for (int a = 0; a < kJoints; ++a)
    for (int b = 0; b < kJoints; ++b)
      out.sign[a][b] = out.real[a].dot(out.real[b]) < 0.0f ? -1.0f : 1.0f;
  return out;
}

/// A muscle along one bone. It swells on one side, about `centre` (0 near, 1 far joint).
struct Muscle {
  Point origin, axis, side;  ///< near joint, unit bone direction, unit swelling side (rest pose)
  float length = 0, centre = 0;
  float height = 0;  ///< largest displacement in this pose, metres
};
constexpr float kHalfWidth = 0.45f;  // of a muscle, as a fraction of its bone's length

/// At most two muscles move with one joint: one of the hinge below it, one of its own ball joint.
struct JointMuscles {
  int count = 0;
  std::array<Muscle, 2> muscle;
};
using Muscles = std::array<JointMuscles, kJoints>;

/// Heights are fractions of the bone's length at full swelling.
struct Hinge {
  int near, joint, far;
  double upper_height, upper_centre, lower_height, lower_centre;
};
constexpr Hinge kHinges[] = {{16, 18, 20, 0.10, 0.58, 0.07, 0.28},  // biceps, forearm
                             {17, 19, 21, 0.10, 0.58, 0.07, 0.28},
                             {1, 4, 7, 0.075, 0.60, 0.085, 0.32},  // back of the thigh, calf
                             {2, 5, 8, 0.075, 0.60, 0.085, 0.32}};

/// A joint whose bone may swing anywhere; the muscle over it swells on the side swung away from.
struct Ball {
  int parent, joint, far;
  double height, centre;
};
constexpr Ball kBalls[] = {{13, 16, 18, 0.09, 0.10},  // shoulder
                           {14, 17, 19, 0.09, 0.10},
                           {0, 1, 4, 0.07, 0.08},  // buttock
                           {0, 2, 5, 0.07, 0.08}};

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Share of the full height at a joint angle: 0 at rest, half at 60 degrees, 1 from 120 on; smooth.
double swell(double angle) {
  return 0.5 * (1.0 - std::cos(1.5 * std::clamp(angle, 0.0, 2.0 * M_PI / 3.0)));
}

void add_muscle(JointMuscles& out, const Vec3& origin, const Vec3& bone, const Vec3& towards,
                double height, double centre) {
  const double length = bone.norm();
  const Vec3 axis = bone / length;
  const Vec3 side = towards - axis * axis.dot(towards);
  if (!(side.norm() > 1e-6 * towards.norm())) return;
  Muscle& m = out.muscle[out.count++];
  m.origin = origin.cast<float>();
  m.axis = axis.cast<float>();
  m.side = side.normalized().cast<float>();
  m.length = static_cast<float>(length);
  m.centre = static_cast<float>(centre);
  m.height = static_cast<float>(height * length);
}

void add_hinge(const Hinge& hinge, const Body& body, const PosedSkeleton& posed, Muscles& out) {
  const Vec3 upper = body.joints[hinge.joint] - body.joints[hinge.near];
  const Vec3 lower = body.joints[hinge.far] - body.joints[hinge.joint];
  if (!(upper.norm() > 1e-6) || !(lower.norm() > 1e-6)) return;
  const Vec3 upper_now = posed.global[hinge.near] * upper;
  const Vec3 lower_now = posed.global[hinge.joint] * lower;
  const double full = swell(angle_between(upper_now, lower_now) - angle_between(upper, lower));
  if (full < 1e-6) return;
  // The flexor side of a bone is where the other bone has moved to, seen from this bone.
  add_muscle(out[hinge.near], body.joints[hinge.near], upper,
             posed.global[hinge.near].transpose() * lower_now, full * hinge.upper_height,
             hinge.upper_centre);
  add_muscle(out[hinge.joint], body.joints[hinge.joint], lower,
             -(posed.global[hinge.joint].transpose() * upper_now), full * hinge.lower_height,
             hinge.lower_centre);
}

void add_ball(const Ball& ball, const Body& body, const PosedSkeleton& posed, Muscles& out) {
  const Vec3 bone = body.joints[ball.far] - body.joints[ball.joint];
  if (!(bone.norm() > 1e-6)) return;
  const Vec3 unmoved = posed.global[ball.parent] * bone, now = posed.global[ball.joint] * bone;
  const double full = swell(angle_between(unmoved, now));
  if (full < 1e-6) return;
  add_muscle(out[ball.joint], body.joints[ball.joint], bone,
             posed.global[ball.joint].transpose() * unmoved, full * ball.height, ball.centre);
}

Muscles flexed_muscles(const Body& body, const PosedSkeleton& posed) {
  Muscles out;
  for (const Hinge& hinge : kHinges) add_hinge(hinge, body, posed, out);
  for (const Ball& ball : kBalls) add_ball(ball, body, posed, out);
  return out;
}

/// Displacement of a rest point by one muscle: radial, smooth, zero off the muscle.
Point swelling(const Muscle& m, const Point& x) {
  const Point from = x - m.origin;
  const float along = m.axis.dot(from);
  const float u = (along / m.length - m.centre) / kHalfWidth;
  if (!(u > -1.0f && u < 1.0f)) return Point::Zero();
  const Point radial = from - along * m.axis;
  const float on_side = radial.dot(m.side);
  if (!(on_side > 0.0f)) return Point::Zero();
  const float r2 = std::max(radial.squaredNorm(), 1e-10f);
  const float bump = (1.0f - u * u) * (1.0f - u * u);
  // on_side^2 / r^2 is the squared cosine to the flexor side; / r again makes `radial` a direction.
  return radial * (m.height * bump * on_side * on_side / (r2 * std::sqrt(r2)));
}

Point skin_point(const Point& rest, const float* weights, const DualTransforms& transforms,
                 const Muscles& muscles) {
  int strongest = 0;
  for (int j = 1; j < kJoints; ++j)
    if (weights[j] > weights[strongest]) strongest = j;
  const float* sign = transforms.sign[strongest];
  Vec4f real = Vec4f::Zero(), dual = Vec4f::Zero();
  Point x = rest;
  for (int j = 0; j < kJoints; ++j) {
    const float w = weights[j];
    if (w == 0.0f) continue;
    const float signed_w = w * sign[j];
    real += signed_w * transforms.real[j];
    dual += signed_w * transforms.dual[j];
    for (int k = 0; k < muscles[j].count; ++k) x += w * swelling(muscles[j].muscle[k], rest);
  }
  const float norm = real.norm();
  if (!(norm > 0.0f)) return rest;  // a vertex without weights stays
  const float inverse = 1.0f / norm;
  real *= inverse;
  dual *= inverse;
  const Point r = real.head<3>(), d = dual.head<3>();
  const Point turned = x + 2.0f * r.cross(r.cross(x) + real.w() * x);
  return turned + 2.0f * (real.w() * d - dual.w() * r + r.cross(d));
}

void check_body(const Body& body, const char* who) {
  if (static_cast<size_t>(body.weights.rows()) != body.rest.vertices.size())
    throw ShapeError(std::string(who) + ": body '" + body.id + "' has " +
                     std::to_string(body.rest.vertices.size()) + " vertices but " +
                     std::to_string(body.weights.rows()) + " rows of weights");
  if (body.blend_shapes &&
      static_cast<size_t>(body.blend_shapes->directions.rows()) != 3 * body.rest.vertices.size())
    throw ShapeError(std::string(who) + ": body '" + body.id + "' has " +
                     std::to_string(body.rest.vertices.size()) + " vertices but blend shapes of " +
                     std::to_string(body.blend_shapes->directions.rows() / 3));
}

/// The local rotations less the identity, as blend shapes count them.
Eigen::Matrix<float, PoseBlendShapes::kFeatures, 1> pose_features(const Pose& pose) {
  Eigen::Matrix<float, PoseBlendShapes::kFeatures, 1> out;
  for (int j = 1; j < kJoints; ++j)
    for (int k = 0; k < 9; ++k)
      out[9 * (j - 1) + k] = static_cast<float>(pose.local[j](k / 3, k % 3) - (k % 4 == 0 ? 1 : 0));
  return out;
}

}  // namespace

Pose pose_on(const Motion& motion, const Body& body, size_t frame) {
  if (frame >= motion.global.size() || frame >= motion.hips.size())
    throw ShapeError("pose_on: frame " + std::to_string(frame) + " of motion '" + motion.id +
                     "', which has " + std::to_string(motion.frames()));
  const Joints& rest = body.joints;
  Rotations global;
  for (int j = 0; j < kJoints; ++j)
    global[j] = motion.global[frame][j].cast<double>().normalized().toRotationMatrix();
  for (const auto& limb : kLimbs) {
    const int j = limb[0], k = limb[1];
    const Vec3 ours = rest[k] - rest[j], theirs = motion.rest[k] - motion.rest[j];
    if (ours.norm() > 1e-9 && theirs.norm() > 1e-9)
      global[j] = global[j] * shortest_arc(ours, theirs);
  }
  const double source_leg = left_leg(motion.rest);
  const double scale = source_leg > 1e-9 ? left_leg(rest) / source_leg : 1.0;
  Pose pose;
  pose.local = to_local(global);
  pose.root = scale * motion.hips[frame].cast<double>() +
              global[0] * (rest[0] - 0.5 * (rest[1] + rest[2])) +
              Vec3(0.0, 0.5 * (rest[10].y() + rest[11].y()), 0.0);
  return pose;
}

Points pose_surface(const Body& body, const Pose& pose, const std::vector<int32_t>* pick) {
  check_body(body, "pose_surface");
  const PosedSkeleton posed = forward_kinematics(body.joints, pose);
  const Points& rest = body.rest.vertices;
  Points out(pick ? pick->size() : rest.size());
  const auto each = [&](auto&& place) {
    for (size_t i = 0; i < out.size(); ++i) {
      const size_t v = pick ? static_cast<size_t>((*pick)[i]) : i;
      if (v >= rest.size())
        throw ShapeError("pose_surface: vertex " + std::to_string((*pick)[i]) + " of body '" +
                         body.id + "', which has " + std::to_string(rest.size()));
      out[i] = place(v, body.weights.data() + v * kJoints);
    }
  };
  if (body.blend_shapes) {
    const auto& directions = body.blend_shapes->directions;
    const auto features = pose_features(pose);
    each([&](size_t v, const float* weights) {
      const Point moved = directions.middleRows<3>(3 * v) * features;
      return Point(
          blend((rest[v] + moved).cast<double>(), weights, body.joints, posed).cast<float>());
    });
  } else {
    const DualTransforms transforms = dual_transforms(body, posed);
    const Muscles muscles = flexed_muscles(body, posed);
    each([&](size_t v, const float* weights) {
      return skin_point(rest[v], weights, transforms, muscles);
    });
  }
  return out;
}

Points linear_blend_skinning(const Body& body, const Pose& pose) {
  check_body(body, "linear_blend_skinning");
  const PosedSkeleton posed = forward_kinematics(body.joints, pose);
  Points out;
  for (size_t v = 0; v < body.rest.vertices.size(); ++v)
    out.push_back(blend(body.rest.vertices[v].cast<double>(), body.weights.data() + v * kJoints,
                        body.joints, posed)
                      .cast<float>());
  return out;
}

}  // namespace restage
