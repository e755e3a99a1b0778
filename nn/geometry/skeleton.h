// The 22-joint skeleton (spec of the method, section 1.2) and kinematics on plain Eigen values.
// Tensor versions that the networks differentiate through are ops (autograd/ops/rotation.h).
// Units: metres, y up, +z forward, +x the body's left. Matrices act on column vectors.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <string_view>
#include <type_traits>

namespace restage {

inline constexpr int kJoints = 22;
inline constexpr double kFps = 30.0;  ///< the project's frame rate

/// The indices of the joints.
inline constexpr int kPelvis = 0, kLeftHip = 1, kRightHip = 2, kSpine1 = 3, kLeftKnee = 4,
                     kRightKnee = 5, kSpine2 = 6, kLeftAnkle = 7, kRightAnkle = 8, kSpine3 = 9,
                     kLeftFoot = 10, kRightFoot = 11, kNeck = 12, kLeftCollar = 13,
                     kRightCollar = 14, kHead = 15, kLeftShoulder = 16, kRightShoulder = 17,
                     kLeftElbow = 18, kRightElbow = 19, kLeftWrist = 20, kRightWrist = 21;

inline constexpr std::array<int, kJoints> kParents = {-1, 0, 0, 0, 1,  2,  3,  4,  5,  6,  7,
                                                      8,  9, 9, 9, 12, 13, 14, 16, 17, 18, 19};
inline constexpr std::array<std::string_view, kJoints> kJointNames = {
    "pelvis",     "left_hip",    "right_hip",    "spine1",     "left_knee",     "right_knee",
    "spine2",     "left_ankle",  "right_ankle",  "spine3",     "left_foot",     "right_foot",
    "neck",       "left_collar", "right_collar", "head",       "left_shoulder", "right_shoulder",
    "left_elbow", "right_elbow", "left_wrist",   "right_wrist"};
/// Joint that takes this one's place in a mirrored body.
inline constexpr std::array<int, kJoints> kMirror = {0,  2,  1,  3,  5,  4,  6,  8,  7,  9,  11,
                                                     10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20};

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;
using Joints = std::array<Vec3, kJoints>;     ///< positions
using Rotations = std::array<Mat3, kJoints>;  ///< local or global, said where used
/// Of each joint, what takes points from one pose to another.
using JointMoves = std::array<Eigen::Isometry3d, kJoints>;

/// The nine numbers at `x` as they lie in tensors, row by row.
template <class T>
auto matrix_at(T* x) {
  using Rows = Eigen::Matrix<std::remove_const_t<T>, 3, 3, Eigen::RowMajor>;
  return Eigen::Map<std::conditional_t<std::is_const_v<T>, const Rows, Rows>>(x);
}

struct Pose {
  Rotations local;           ///< local rotations, root = global orientation
  Vec3 root = Vec3::Zero();  ///< world position of the pelvis
};

/// The pose a share `t` of the way from `a` to `b`: every local rotation turns the shortest way,
/// the pelvis goes straight.
Pose between(const Pose& a, const Pose& b, double t);

struct PosedSkeleton {
  Rotations global;
  Joints joints;
};

/// Forward kinematics (spec 3.5): P_0 = root, P_j = P_p + G_p (rest_j - rest_p), G_j = G_p R_j.
PosedSkeleton forward_kinematics(const Joints& rest, const Pose& pose);
/// Global to local rotations and back.
Rotations to_local(const Rotations& global);
Rotations to_global(const Rotations& local);
/// As files hold them: unit quaternions w x y z, w not negative.
std::array<std::array<double, 4>, kJoints> quaternions(const Rotations& rotations);
/// Hip-knee plus knee-ankle, mean of both sides (spec 3.3), metres.
double leg_length(const Joints& joints);
/// Angle between the trunks of two poses, from the pelvis to the neck, radians.
double trunk_turn(const Joints& a, const Joints& b);
/// Who is tilted by more, is shown to extractors with the trunk upright; radians.
inline constexpr double kTiltedTrunk = 35 * M_PI / 180;
/// The least turn that lets the trunk point up; exactly the identity where it is not tilted.
Mat3 standing_turn(const Joints& joints);
/// Angle about y by which a posed body faces away from +z (spec 3.3: across = left minus right
/// shoulder plus left minus right hip), radians; 0 if it cannot be told.
double heading_angle(const Joints& joints);
/// The heading of somebody seen frame by frame at kFps. Steady: the average of the last 0.2 s or so
/// (exponential), since noise of the joints would turn what is seen from frame to frame.
class Heading {
 public:
  explicit Heading(bool steady) : steady_(steady) {}
  double operator()(const Joints& joints);

 private:
  bool steady_;
  Vec3 across_ = Vec3::Zero();
};
/// Rotation by `angle` about y.
Mat3 turn_about_y(double angle);
/// Smallest rotation that takes direction a onto direction b (half turn about any axis if
/// opposite).
Mat3 shortest_arc(const Vec3& a, const Vec3& b);

}  // namespace restage
