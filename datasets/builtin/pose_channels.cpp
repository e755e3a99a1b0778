#include "datasets/builtin/pose_channels.h"

#include <cmath>

namespace restage {
namespace {

constexpr double kRadians = 3.14159265358979323846 / 180;

Mat3 rx(double degrees) { return Eigen::AngleAxisd(degrees * kRadians, Vec3::UnitX()).matrix(); }
Mat3 ry(double degrees) { return Eigen::AngleAxisd(degrees * kRadians, Vec3::UnitY()).matrix(); }
Mat3 rz(double degrees) { return Eigen::AngleAxisd(degrees * kRadians, Vec3::UnitZ()).matrix(); }

struct Range {
  double lo, hi;
};
constexpr Range kTrunkRanges[kLeft] = {{-1e9, 1e9}, {-60, 80}, {-50, 50}, {-35, 90}, {-40, 40},
                                       {-60, 60},   {-50, 55}, {-40, 40}, {-80, 80}};
constexpr Range kSideRanges[kSideChannels] = {
    {-10, 35}, {-20, 30},  {-60, 180}, {-125, 85}, {-80, 90}, {0, 145},  {-85, 85}, {-75, 75},
    {-30, 30}, {-35, 125}, {-30, 80},  {-40, 50},  {0, 145},  {-50, 30}, {-25, 25}, {-35, 55}};

// Identity well inside the range; the last 15 % of each end are squeezed smoothly.
double ease(double x, const Range& r) {
  const double soft = 0.15 * (r.hi - r.lo);
  if (x > r.hi - soft) return r.hi - soft * std::exp(-(x - (r.hi - soft)) / soft);
  if (x < r.lo + soft) return r.lo + soft * std::exp((x - (r.lo + soft)) / soft);
  return x;
}

void mirror_rotation(Mat3& m) {  // reflection across the plane x = 0
  for (const int i : {1, 2}) m(0, i) = -m(0, i), m(i, 0) = -m(i, 0);
}

// Rotations of the left limbs; the right side mirrors them.
void side_rotations(const double* s, std::array<Mat3, 8>& out) {
  out[1] = rx(-s[kArmFlex]) * rz(s[kArmSide]) * rx(s[kArmTwist]);
  const double up = out[1](1, 0);  // the collar follows the arm: 25 degrees overhead, -9 hanging
  out[0] = rz(s[kShrug] + up * (17 + 8 * up)) * ry(-s[kCollarForward]);
  out[2] = ry(-s[kElbow]) * rx(s[kPronate]);
  out[3] = rz(-s[kWristBend]) * ry(-s[kWristTilt]);
  out[4] = rx(-s[kHipFlex]) * rz(s[kHipSide]) * ry(s[kHipTwist]);
  out[5] = rx(s[kKnee]);
  out[6] = rx(-s[kAnkle]) * rz(s[kAnkleRoll]);
  out[7] = rx(-s[kToes]);
}

}  // namespace

Angles neutral_angles() {
  Angles a{};
  for (int side = 0; side < 2; ++side) {
    a[channel(side, kArmSide)] = -76;
    a[channel(side, kArmFlex)] = 3;
    a[channel(side, kElbow)] = 14;
    a[channel(side, kHipSide)] = 2;
    a[channel(side, kHipTwist)] = 6;
    a[channel(side, kKnee)] = 2;
  }
  return a;
}

Angles mirrored(const Angles& a) {
  Angles b = a;
  for (const int c : {kYaw, kRoll, kSpineSide, kSpineTwist, kNeckSide, kNeckTurn}) b[c] = -a[c];
  for (int c = 0; c < kSideChannels; ++c) {
    b[channel(0, static_cast<SideChannel>(c))] = a[channel(1, static_cast<SideChannel>(c))];
    b[channel(1, static_cast<SideChannel>(c))] = a[channel(0, static_cast<SideChannel>(c))];
  }
  return b;
}

Angles limit(const Angles& a) {
  Angles b = a;
  for (int c = 1; c < kLeft; ++c) b[c] = ease(a[c], kTrunkRanges[c]);
  for (int c = kLeft; c < kChannels; ++c)
    b[c] = ease(a[c], kSideRanges[(c - kLeft) % kSideChannels]);
  return b;
}

Rotations channel_rotations(const Angles& a) {
  Rotations r;
  r[0] = ry(a[kYaw]) * rx(a[kPitch]) * rz(a[kRoll]);
  const double third = 1.0 / 3;
  const Mat3 spine =
      ry(a[kSpineTwist] * third) * rx(a[kSpineBend] * third) * rz(a[kSpineSide] * third);
  for (const int j : {3, 6, 9}) r[j] = spine;
  const Mat3 neck = ry(a[kNeckTurn] / 2) * rx(a[kNeckNod] / 2) * rz(a[kNeckSide] / 2);
  for (const int j : {12, 15}) r[j] = neck;
  constexpr int kSide[8] = {13, 16, 18, 20, 1, 4, 7, 10};
  for (int side = 0; side < 2; ++side) {
    std::array<Mat3, 8> limb;
    side_rotations(a.data() + channel(side, kShrug), limb);
    for (int k = 0; k < 8; ++k) {
      if (side == 1) mirror_rotation(limb[k]);
      r[side == 0 ? kSide[k] : kMirror[kSide[k]]] = limb[k];
    }
  }
  return r;
}

}  // namespace restage
