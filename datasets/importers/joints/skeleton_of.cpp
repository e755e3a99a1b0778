#include "datasets/importers/joints/skeleton_of.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "datasets/builtin/body_shape.h"
#include "datasets/doctor/shape.h"
#include "datasets/importers/motions/rest_pose.h"
#include "nn/geometry/joint_definition.h"

namespace restage::joints_detail {
namespace {

/// Median distance of two joints; 0 where no frame knows both.
double distance(const std::vector<MappedFrame>& frames, int a, int b) {
  std::vector<double> out;
  for (const MappedFrame& frame : frames) {
    const auto &x = frame.joints[static_cast<size_t>(a)], &y = frame.joints[static_cast<size_t>(b)];
    if (x && y) out.push_back((*x - *y).norm());
  }
  return out.empty() ? 0 : median(std::move(out));
}

bool is_limb(size_t joint) {
  return std::any_of(t_pose_limbs().begin(), t_pose_limbs().end(),
                     [&](const Limb& limb) { return static_cast<size_t>(limb.to) == joint; });
}

/// The mean of MakeHuman's bodies in T-pose, in the order of kMiddleAndLeft; the pelvis at 0, the
/// length of the trunk 1.
constexpr double kMakeHuman[kMiddleAndLeft.size()][3] = {
    {0.0000, 0.0000, 0.0000},  {0.2358, -0.0279, -0.0194}, {0.0000, 0.1762, -0.0825},
    {0.3196, -0.8881, 0.0501}, {0.0000, 0.3219, -0.0530},  {0.4107, -1.8013, 0.0028},
    {0.0000, 0.4838, -0.0606}, {0.4173, -1.9395, 0.2702},  {0.0000, 1.1836, 0.0005},
    {0.0506, 1.0219, 0.0319},  {0.0000, 1.3950, 0.0765},   {0.3868, 0.9711, 0.0219},
    {0.9310, 0.9711, 0.0219},  {1.4566, 0.9711, 0.0219}};

Joints makehuman_body() {
  Joints out;
  for (size_t i = 0; i < kMiddleAndLeft.size(); ++i) {
    const Vec3 x(kMakeHuman[i][0], kMakeHuman[i][1], kMakeHuman[i][2]);
    const auto j = static_cast<size_t>(kMiddleAndLeft[i]);
    out[j] = x;
    if (kMirror[j] != static_cast<int>(j))
      out[static_cast<size_t>(kMirror[j])] = Vec3(-x.x(), x.y(), x.z());
  }
  return out;
}

/// Joints that lie fast about another, left and right first.
constexpr std::array<size_t, 3> kOfPelvis = {kLeftHip, kRightHip, kSpine1},
                                kOfChest = {kLeftCollar, kRightCollar, kNeck};

/// How the children of a joint lie to each other: the cosines between them, where they are known.
std::vector<double> angles_of(const SeenFrame& frame, size_t parent,
                              const std::array<size_t, 3>& children) {
  std::vector<double> out;
  for (size_t a = 0; a < 3; ++a) {
    const auto &p = frame[parent], &x = frame[children[a]], &y = frame[children[(a + 1) % 3]];
    if (p && x && y) out.push_back((*x - *p).normalized().dot((*y - *p).normalized()));
  }
  return out;
}

/// Where hips, spine and collars lie differs between kinds of bodies (docs/joints.md): the T-pose
/// of the kind that these joints are likest.
Joints likest_body(const std::vector<MappedFrame>& frames) {
  const Joints makehuman = makehuman_body();
  const std::array<Joints, 3> kinds = {
      makehuman, JointConversion("makehuman", "smpl", "")(makehuman), shape_joints({})};
  Joints best = makehuman;
  double least = -1;
  for (const Joints& kind : kinds) {
    SeenFrame as_seen;
    for (size_t j = 0; j < kJoints; ++j) as_seen[j] = kind[j];
    double off = 0;
    for (const MappedFrame& frame : frames)
      for (const auto& [parent, children] :
           {std::pair(size_t{kPelvis}, kOfPelvis), std::pair(size_t{kSpine3}, kOfChest)}) {
        const auto seen = angles_of(frame.joints, parent, children),
                   usual = angles_of(as_seen, parent, children);
        if (seen.size() == usual.size())
          for (size_t i = 0; i < seen.size(); ++i) off += std::abs(seen[i] - usual[i]);
      }
    if (least < 0 || off < least) least = off, best = kind;
  }
  return best;
}

/// An average body as large as this one: its trunk, legs, arms and widths have the lengths that are
/// seen.
Joints average_body(const std::vector<MappedFrame>& frames) {
  Joints out = likest_body(frames);
  const Vec3 pelvis = out[kPelvis];
  for (Vec3& x : out) x -= pelvis;
  const auto middle = [&](int a, int b) {
    return Vec3(0.5 * (out[static_cast<size_t>(a)] + out[static_cast<size_t>(b)]));
  };
  std::vector<double> trunks;
  for (const MappedFrame& frame : frames) trunks.push_back(trunk_length(frame.joints));
  // The longest that it often is: a bent trunk is shorter.
  std::sort(trunks.begin(), trunks.end());
  const double trunk = trunks[trunks.size() * 4 / 5];
  const double own = (middle(kLeftShoulder, kRightShoulder) - middle(kLeftHip, kRightHip)).norm();
  for (Vec3& x : out) x *= trunk / own;
  // Hips and shoulders as wide as they are seen.
  const auto widen = [&](int left, int right, std::initializer_list<int> with) {
    const double seen = distance(frames, left, right);
    const double now = (out[static_cast<size_t>(left)] - out[static_cast<size_t>(right)]).norm();
    if (!(seen > 0)) return;
    for (const int j : with) out[static_cast<size_t>(j)].x() *= seen / now;
  };
  widen(kLeftHip, kRightHip, {kLeftHip, kRightHip});
  widen(kLeftShoulder, kRightShoulder, {kLeftShoulder, kRightShoulder, kLeftCollar, kRightCollar});
  return out;
}

/// Mean of a bone as seen from its parent's turn; zero where it is never known.
Vec3 mean_offset(const std::vector<MappedFrame>& frames, const std::vector<Rotations>& turns,
                 size_t parent, size_t child) {
  Vec3 sum = Vec3::Zero();
  size_t n = 0;
  for (size_t f = 0; f < frames.size(); ++f) {
    const auto &a = frames[f].joints[parent], &b = frames[f].joints[child];
    if (!a || !b) continue;
    sum += turns[f][parent].transpose() * (*b - *a);
    ++n;
  }
  return n == 0 ? sum : Vec3(sum / static_cast<double>(n));
}

bool is_rigid(size_t joint) {
  return std::find(kOfPelvis.begin(), kOfPelvis.end(), joint) != kOfPelvis.end() ||
         std::find(kOfChest.begin(), kOfChest.end(), joint) != kOfChest.end();
}

/// The children of joints that carry several, as the joint itself sees them: a rigid figure whose
/// shape all frames agree on, turned as that of the likest body (`offsets`) is.
void rigid_children(const std::vector<MappedFrame>& frames, std::vector<Rotations> turns,
                    size_t parent, const std::array<size_t, 3>& children, Joints& offsets) {
  constexpr int kRounds = 8;
  std::vector<size_t> known;
  for (const size_t c : children)
    if (distance(frames, static_cast<int>(parent), static_cast<int>(c)) > 0) known.push_back(c);
  // Hips alone lie nearly on a line with the pelvis.
  if (known.size() < 2 || (parent == kPelvis && known.size() < 3)) return;
  std::vector<Vec3> usual;
  for (const size_t c : known) usual.push_back(offsets[c]);
  for (int round = 0; round < kRounds; ++round) {
    for (size_t f = 0; f < frames.size(); ++f) {
      std::vector<Vec3> from, to;
      for (const size_t c : known)
        if (frames[f].joints[parent] && frames[f].joints[c]) {
          from.push_back(offsets[c]);
          to.push_back(*frames[f].joints[c] - *frames[f].joints[parent]);
        }
      if (from.size() > 1) turns[f][parent] = turn_between(from, to, turns[f][parent]);
    }
    for (const size_t c : known) offsets[c] = mean_offset(frames, turns, parent, c);
  }
  std::vector<Vec3> found;
  for (const size_t c : known) found.push_back(offsets[c]);
  const Mat3 straight = turn_between(found, usual, Mat3::Identity());
  for (const size_t c : known) offsets[c] = straight * offsets[c];
}

}  // namespace

Mat3 turn_between(const std::vector<Vec3>& from, const std::vector<Vec3>& to, const Mat3& guess) {
  constexpr double kGuess = 1e-6;  // decides only what the directions leave open
  Mat3 sum = Mat3::Zero();
  double size = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    sum += to[i] * from[i].transpose();
    size += from[i].squaredNorm();
  }
  sum += kGuess * std::max(size, 1e-12) * guess;
  const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 flip = Mat3::Identity();
  flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * flip * svd.matrixV().transpose();
}

Joints find_skeleton(const std::vector<MappedFrame>& frames, const std::vector<Rotations>& turns) {
  constexpr double kPrior = 15, kMost = 30;  // frames by which the likest body's direction counts
  const Joints average = average_body(frames);
  Joints offsets;
  for (size_t j = 0; j < kJoints; ++j)
    offsets[j] =
        j == 0 ? Vec3::Zero() : Vec3(average[j] - average[static_cast<size_t>(kParents[j])]);
  const Joints usual = offsets;
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    const double length = distance(frames, kParents[j], static_cast<int>(j));
    if (!(length > 0)) continue;
    Vec3 direction = usual[j].normalized();
    if (!is_limb(j) && !is_rigid(j))
      direction =
          (kPrior * length * direction +
           std::min(kMost, static_cast<double>(frames.size())) * mean_offset(frames, turns, p, j))
              .normalized();
    offsets[j] = length * direction;
  }
  rigid_children(frames, turns, kPelvis, kOfPelvis, offsets);
  rigid_children(frames, turns, kSpine3, kOfChest, offsets);
  Joints out;
  out[0].setZero();
  for (size_t j = 1; j < kJoints; ++j) out[j] = out[static_cast<size_t>(kParents[j])] + offsets[j];
  return out;
}

}  // namespace restage::joints_detail
