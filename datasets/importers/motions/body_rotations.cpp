#include "datasets/importers/motions/body_rotations.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr int64_t kMaxFrames = int64_t{1} << 22;  // 9.7 hours at 120 fps
constexpr const char* kAsPublished = "give the file as it was published";

/// Which numbers a rotation has.
enum class Form { axis_angle, quaternion, six, matrix };

/// Where the numbers of a quaternion or of six stand.
struct Order {
  bool w_last = false;
  /// Of six numbers: two columns one after the other, in turn, or two rows.
  enum class Six { columns, in_turn, rows } six = Six::columns;
};

/// One array and how it is to be read.
struct RotationArray {
  NpyArray array;
  Form form = Form::axis_angle;
  int64_t frames = 0, joints = 0;
  bool numbers_first = false;  ///< [F, 3, J]
  Order order = {};
  int64_t width() const {
    constexpr int64_t kWidths[] = {3, 4, 6, 9};
    return kWidths[static_cast<size_t>(form)];
  }
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

/// Of [F, w J], how many numbers w a joint has: 3 where that makes a body's number of joints.
int64_t flat_width(const std::vector<int64_t>& shape, bool whole) {
  const int64_t root = whole ? 0 : 1, last = shape.back();
  if (last % 3 == 0 && is_known(last / 3 + root)) return 3;
  for (const int64_t width : {9, 6, 4})
    if (last % width == 0 && (is_known(last / width + root) || (!whole && last == width)))
      return width;
  return 3;
}

Form form_of(const std::vector<int64_t>& shape, bool whole) {
  const int64_t last = shape.back();
  const bool squares = shape.size() > 2 && last == 3 && shape[shape.size() - 2] == 3;
  const int64_t width = squares                                                     ? 9
                        : shape.size() > 2 && (last == 4 || last == 6 || last == 9) ? last
                        : shape.size() == 3 && shape[1] > 1 && last == 3            ? 3
                                                                         : flat_width(shape, whole);
  return width == 9   ? Form::matrix
         : width == 6 ? Form::six
         : width == 4 ? Form::quaternion
                      : Form::axis_angle;
}

/// `whole`: of all joints of a body.
RotationArray open_rotations(const ArraySource& file, const std::string& name, bool whole) {
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
  out.numbers_first = !one_frame && are_numbers_first(out.array, whole);
  const int64_t row = out.array.size() / out.frames;
  out.form = out.numbers_first ? Form::axis_angle : form_of(shape, whole);
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

Quat of_matrix(const Mat3& matrix, const RotationArray& from, int64_t frame) {
  if (!((matrix * matrix.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 0.05) ||
      !(matrix.determinant() > 0))
    throw InputError(from.array.where(),
                     cat("holds a matrix that is no rotation, in frame ", frame), kAsPublished);
  return Quat(matrix).normalized();
}

/// Networks give numbers whose columns are made orthogonal; a length of almost nothing is none.
Quat of_six(const double* x, const RotationArray& from, int64_t frame) {
  const bool in_turn = from.order.six == Order::Six::in_turn;
  Vec3 a = in_turn ? Vec3(x[0], x[2], x[4]) : Vec3(x[0], x[1], x[2]);
  Vec3 b = in_turn ? Vec3(x[1], x[3], x[5]) : Vec3(x[3], x[4], x[5]);
  a.normalize();
  b = (b - a.dot(b) * a).eval();
  if (!(b.norm() > 1e-6))
    throw InputError(from.array.where(),
                     cat("holds 6 numbers that are no rotation, in frame ", frame), kAsPublished);
  b.normalize();
  Mat3 out;
  out << a, b, a.cross(b);
  if (from.order.six == Order::Six::rows) out.transposeInPlace();
  return of_matrix(out, from, frame);
}

Quat of_four(const double* x, const RotationArray& from, int64_t frame) {
  const Quat out = from.order.w_last ? Quat(x[3], x[0], x[1], x[2]) : Quat(x[0], x[1], x[2], x[3]);
  if (!(std::abs(out.norm() - 1) < 0.05))
    throw InputError(from.array.where(),
                     cat("holds a quaternion that is no rotation, in frame ", frame), kAsPublished);
  return out.normalized();
}

void read_numbers(const RotationArray& from, int64_t frame, int64_t joint, double* numbers) {
  for (int64_t i = 0; i < from.width(); ++i) {
    numbers[i] = from.array[from.at(frame, joint, i)];
    if (!(std::abs(numbers[i]) < 1e5))
      throw InputError(from.array.where(), "holds a number that is not finite or too large",
                       kAsPublished);
  }
}

/// `largest` grows to the angle of axis-angle numbers.
Quat rotation_at(const RotationArray& from, int64_t frame, int64_t joint, double& largest) {
  double numbers[9];
  read_numbers(from, frame, joint, numbers);
  if (from.form == Form::quaternion) return of_four(numbers, from, frame);
  if (from.form == Form::six) return of_six(numbers, from, frame);
  if (from.form == Form::axis_angle) {
    const Vec3 turn(numbers[0], numbers[1], numbers[2]);
    largest = std::max(largest, turn.norm());
    return rotation(turn);
  }
  return of_matrix(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers), from,
                   frame);
}

// ---- the order of a rotation's numbers ---------------------------------------------------------

constexpr int64_t kLooks = 200;  // frames that are looked at

/// How far a body's knees bend back and its elbows forward, summed over frames: negative where
/// turns are taken the wrong way round. `first`: the joint that the array begins with.
double bend(const RotationArray& from, int64_t first) {
  double out = 0, ignored = 0;
  const int64_t step = std::max<int64_t>(1, from.frames / kLooks);
  for (int64_t f = 0; f < from.frames; f += step)
    for (const auto& [joint, axis, sign] :
         {std::tuple(4, 0, 1), {5, 0, 1}, {18, 1, -1}, {19, 1, 1}}) {
      const Eigen::AngleAxisd turn(rotation_at(from, f, joint - first, ignored));
      out += sign * turn.angle() * turn.axis()[axis];
    }
  return out;
}

/// Whether the columns of six numbers stand in turn: where that makes them orthogonal.
bool stand_in_turn(const RotationArray& from) {
  double in_turn = 0, one_by_one = 0, x[9];
  const int64_t step = std::max<int64_t>(1, from.frames / kLooks);
  for (int64_t f = 0; f < from.frames; f += step)
    for (int64_t j = 0; j < from.joints; ++j) {
      read_numbers(from, f, j, x);
      in_turn += std::abs(x[0] * x[1] + x[2] * x[3] + x[4] * x[5]) +
                 std::abs(x[0] * x[0] + x[2] * x[2] + x[4] * x[4] - 1);
      one_by_one += std::abs(x[0] * x[3] + x[1] * x[4] + x[2] * x[5]) +
                    std::abs(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - 1);
    }
  return in_turn < one_by_one;
}

/// Whether w is the last of four numbers: of small turns it is the largest.
bool is_w_last(const RotationArray& from) {
  double first = 0, last = 0, x[9];
  const int64_t step = std::max<int64_t>(1, from.frames / kLooks);
  for (int64_t f = 0; f < from.frames; f += step)
    for (int64_t j = 0; j < from.joints; ++j) {
      read_numbers(from, f, j, x);
      first += std::abs(x[0]);
      last += std::abs(x[3]);
    }
  return last > first;
}

/// `first`: the joint that the array, which is of a body, begins with.
Order order_of(RotationArray from, int64_t first) {
  if (from.form == Form::quaternion) from.order.w_last = is_w_last(from);
  if (from.form != Form::six) return from.order;
  if (stand_in_turn(from)) {
    from.order.six = Order::Six::in_turn;
    return from.order;
  }
  const double columns = bend(from, first);
  from.order.six = Order::Six::rows;
  if (columns > bend(from, first)) from.order.six = Order::Six::columns;
  return from.order;
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
  std::string how = from.numbers_first ? "[frames, axis-angle numbers, joints]" : "";
  if (from.form == Form::quaternion) how = from.order.w_last ? "x y z w" : "w x y z";
  if (from.form == Form::six)
    how = from.order.six == Order::Six::rows      ? "two rows of a matrix"
          : from.order.six == Order::Six::in_turn ? "two columns of a matrix, in turn"
                                                  : "two columns of a matrix";
  return name + " " + shape_text(from.array.shape()) + (how.empty() ? "" : ", taken for " + how);
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

int64_t rotated_joints(const std::vector<int64_t>& shape) {
  if (shape.empty()) return 0;
  const auto joints_if = [](int64_t n) { return n == 1 || is_known(n) || is_known(n + 1) ? n : 0; };
  const int64_t last = shape.back();
  if (shape.size() > 2 && last == 3 && shape[shape.size() - 2] == 3)
    return shape.size() == 3
               ? joints_if(is_known(shape[0]) || is_known(shape[0] + 1) ? shape[0] : 1)
               : joints_if(shape[shape.size() - 3]);
  if (shape.size() > 2 && (last == 3 || last == 4 || last == 6 || last == 9))
    return joints_if(shape[shape.size() - 2]);
  for (const int64_t width : {3, 9, 6, 4})
    if (last % width == 0 && joints_if(last / width) != 0) return last / width;
  return 0;
}

BodyRotations read_body_rotations(const ArraySource& file, const BodyParameters& names,
                                  bool with_hands) {
  // AMASS keeps its parts beside the whole; of others the parts have the plainer names.
  const bool parts = !names.orient.empty() && !names.body.empty();
  if (names.poses == "poses" || !parts) {
    RotationArray poses = open_rotations(file, names.poses, true);
    if (is_known(poses.joints)) poses.order = order_of(poses, 0);
    BodyRotations out = empty(poses.frames, poses.joints, poses.array, named(names.poses, poses));
    add_joints(poses, 0, out);
    if (with_hands) add_hands(poses, out);
    return out;
  }
  RotationArray root = open_rotations(file, names.orient, false),
                body = open_rotations(file, names.body, false);
  if (root.joints != 1) misshapen(root.array, "the root has one rotation a frame");
  if (root.frames != body.frames)
    misshapen(root.array, cat("it needs as many frames as ", names.body, ": ", body.frames));
  if (is_known(body.joints + 1)) body.order = order_of(body, 1);
  if (root.form == body.form) root.order = body.order;
  BodyRotations out = empty(body.frames, body.joints + 1, body.array,
                            cat(named(names.orient, root), ", ", named(names.body, body)));
  add_joints(root, 0, out);
  add_joints(body, 1, out);
  return out;
}

}  // namespace restage
