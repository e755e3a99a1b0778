#include "datasets/importers/motions/body_rotations.h"

#include <algorithm>
#include <cmath>

#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr int64_t kMaxFrames = int64_t{1} << 22;  // 9.7 hours at 120 fps
constexpr const char* kAsPublished = "give the file as it was published";

/// Which numbers a rotation has.
enum class Form { axis_angle, matrix };

/// One array and how it is to be read.
struct RotationArray {
  NpyArray array;
  Form form = Form::axis_angle;
  int64_t frames = 0, joints = 0;
  bool numbers_first = false;  ///< [F, 3, J]
  int64_t width() const { return form == Form::matrix ? 9 : 3; }
  /// Number i of a joint.
  int64_t at(int64_t frame, int64_t joint, int64_t i) const {
    return frame * joints * width() + (numbers_first ? i * joints + joint : joint * width() + i);
  }
};

[[noreturn]] void misshapen(const NpyArray& array, const std::string& fix) {
  throw InputError(array.where(), "has the shape " + shape_text(array.shape()), fix);
}

/// Numbers of joints of a body model.
bool is_known(int64_t joints) {
  return joints == 22 || joints == 24 || joints == 52 || joints == 55;
}

/// [F, 3, J] has the three numbers before the joints: certain where J is a body's number of joints.
bool are_numbers_first(const NpyArray& array, bool whole) {
  const std::vector<int64_t>& shape = array.shape();
  if (shape.size() != 3 || shape[1] != 3 || shape[2] == 3) return false;
  if (!is_known(shape[2] + (whole ? 0 : 1)) && shape[2] != 1)
    misshapen(array, "rotations are axis-angle numbers, [F, 3 J] or [F, J, 3]");
  return true;
}

/// [F, 9 J] of a number of joints that [F, 3 J] is not.
bool are_flat_matrices(const std::vector<int64_t>& shape, bool whole) {
  const int64_t root = whole ? 0 : 1;
  return shape.size() == 2 && shape[1] % 9 == 0 && !is_known(shape[1] / 3 + root) &&
         (is_known(shape[1] / 9 + root) || (!whole && shape[1] == 9));
}

/// InputError for [F, 4 J] and [F, 6 J].
void refuse_other_forms(const NpyArray& array, int64_t last, bool whole) {
  const int64_t root = whole ? 0 : 1;
  const std::vector<int64_t>& shape = array.shape();
  for (const int64_t width : {4, 6}) {
    const bool flat = shape.size() == 2 && last % width == 0 && is_known(last / width + root) &&
                      !(last % 3 == 0 && is_known(last / 3 + root));
    if (flat || (shape.size() > 2 && last == width))
      misshapen(array, cat("turn its ", width == 4 ? "quaternions" : "6D rotations",
                           " into axis-angle numbers [F, 3 J] first"));
  }
}

/// `whole`: of all joints of a body.
RotationArray open_rotations(const Npz& file, const std::string& name, bool whole) {
  RotationArray out{file.array(name)};
  const std::vector<int64_t>& shape = out.array.shape();
  if (out.array.is_text() || shape.size() < 2)
    misshapen(out.array, "rotations are axis-angle numbers, [F, 3 J] or [F, J, 3]");
  const bool squares = shape.size() > 2 && shape.back() == 3 && shape[shape.size() - 2] == 3;
  const bool one_frame = squares && shape.size() == 3 && whole && is_known(shape[0]);
  out.frames = one_frame ? 1 : shape[0];
  if (out.frames == 0 || out.frames > kMaxFrames)
    throw InputError(out.array.where(), cat("has ", out.frames, " frames"),
                     cat("give 1 to ", kMaxFrames));
  const int64_t last = shape.back();
  refuse_other_forms(out.array, last, whole);
  out.numbers_first = !one_frame && are_numbers_first(out.array, whole);
  const int64_t row = out.array.size() / out.frames;
  const bool matrices =
      squares || (shape.size() > 2 && last == 9) || are_flat_matrices(shape, whole);
  out.form = matrices ? Form::matrix : Form::axis_angle;
  if (row == 0 || row % out.width() != 0)
    misshapen(out.array, "rotations are axis-angle numbers, [F, 3 J] or [F, J, 3]");
  out.joints = row / out.width();
  return out;
}

Quat rotation(const Vec3& axis_angle) {
  const double angle = axis_angle.norm();
  if (angle < 1e-12) return Quat::Identity();
  return Quat(Eigen::AngleAxisd(angle, axis_angle / angle));
}

/// `largest` grows to the angle of axis-angle numbers.
Quat rotation_at(const RotationArray& from, int64_t frame, int64_t joint, double& largest) {
  double numbers[9];
  for (int64_t i = 0; i < from.width(); ++i) {
    numbers[i] = from.array[from.at(frame, joint, i)];
    if (!(std::abs(numbers[i]) < 1e5))
      throw InputError(from.array.where(), "holds a number that is not finite or too large",
                       kAsPublished);
  }
  if (from.form == Form::axis_angle) {
    const Vec3 turn(numbers[0], numbers[1], numbers[2]);
    largest = std::max(largest, turn.norm());
    return rotation(turn);
  }
  const Mat3 matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers);
  if (!((matrix * matrix.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 0.05) ||
      !(matrix.determinant() > 0))
    throw InputError(from.array.where(),
                     cat("holds a matrix that is no rotation, in frame ", frame), kAsPublished);
  return Quat(matrix).normalized();
}

void add_joints(const RotationArray& from, int64_t first, BodyRotations& out) {
  const int64_t count = std::min<int64_t>(from.joints, kJoints - first);
  for (int64_t f = 0; f < from.frames; ++f)
    for (int64_t j = 0; j < count; ++j)
      out.local[static_cast<size_t>(f)][static_cast<size_t>(first + j)] =
          rotation_at(from, f, j, out.largest);
}

/// The last 30 joints of SMPL-H and SMPL-X.
void add_hands(const RotationArray& from, BodyRotations& out) {
  if (from.joints != 52 && from.joints != 55) return;
  double largest = 0;  // of fingers: says nothing of the body's units
  for (int64_t f = 0; f < from.frames; ++f) {
    std::vector<Quat>& hands = out.hands.emplace_back();
    for (int64_t j = from.joints - 30; j < from.joints; ++j)
      hands.push_back(rotation_at(from, f, j, largest));
  }
}

std::string named(const std::string& name, const RotationArray& from) {
  return name + " " + shape_text(from.array.shape()) +
         (from.numbers_first ? ", taken for [frames, axis-angle numbers, joints]" : "");
}

BodyRotations empty(int64_t frames, int64_t joints, const NpyArray& where,
                    const std::string& layout) {
  if (is_known(joints)) {
    BodyRotations out;
    out.local.assign(static_cast<size_t>(frames), std::vector<Quat>(kJoints, Quat::Identity()));
    out.joints = joints;
    out.layout = layout;
    return out;
  }
  throw InputError(where.where(),
                   cat("has the shape ", shape_text(where.shape()), ", ", joints, " joints in all"),
                   "AMASS has [F, 156] (SMPL-H) and [F, 165] (SMPL-X); [F, 72] (SMPL) and [F, 66] "
                   "are read, too");
}

}  // namespace

BodyRotations read_body_rotations(const Npz& file, const BodyParameters& names, bool with_hands) {
  // AMASS keeps its parts beside the whole; of others the parts have the plainer names.
  const bool parts = !names.orient.empty() && !names.body.empty();
  if (names.poses == "poses" || !parts) {
    const RotationArray poses = open_rotations(file, names.poses, true);
    BodyRotations out = empty(poses.frames, poses.joints, poses.array, named(names.poses, poses));
    add_joints(poses, 0, out);
    if (with_hands) add_hands(poses, out);
    return out;
  }
  const RotationArray root = open_rotations(file, names.orient, false),
                      body = open_rotations(file, names.body, false);
  if (root.joints != 1) misshapen(root.array, "the root has one rotation a frame");
  if (root.frames != body.frames)
    misshapen(root.array, cat("it needs as many frames as ", names.body, ": ", body.frames));
  BodyRotations out = empty(body.frames, body.joints + 1, body.array,
                            cat(named(names.orient, root), ", ", named(names.body, body)));
  add_joints(root, 0, out);
  add_joints(body, 1, out);
  return out;
}

}  // namespace restage
