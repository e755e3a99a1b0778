#include "nn/geometry/part_surfaces.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

constexpr int kNone = -1;

/// The axis goes from joint `from` to joint `to`, or has an end of its own; joint `turns` turns the
/// part, and `joints` move its vertices.
struct PartJoints {
  int from, to, turns;
  std::array<int, 4> joints;
};
constexpr std::array<PartJoints, kParts> kPartJoints{{
    {kPelvis, kSpine2, kSpine1, {kPelvis, kSpine1, kNone, kNone}},
    {kSpine2, kNeck, kSpine3, {kSpine2, kSpine3, kLeftCollar, kRightCollar}},
    {kHead, kNone, kHead, {kNeck, kHead, kNone, kNone}},
    {kLeftHip, kLeftKnee, kLeftHip, {kLeftHip, kNone, kNone, kNone}},
    {kRightHip, kRightKnee, kRightHip, {kRightHip, kNone, kNone, kNone}},
    {kLeftKnee, kLeftAnkle, kLeftKnee, {kLeftKnee, kNone, kNone, kNone}},
    {kRightKnee, kRightAnkle, kRightKnee, {kRightKnee, kNone, kNone, kNone}},
    {kLeftAnkle, kNone, kLeftAnkle, {kLeftAnkle, kLeftFoot, kNone, kNone}},
    {kRightAnkle, kNone, kRightAnkle, {kRightAnkle, kRightFoot, kNone, kNone}},
    {kLeftShoulder, kLeftElbow, kLeftShoulder, {kLeftShoulder, kNone, kNone, kNone}},
    {kRightShoulder, kRightElbow, kRightShoulder, {kRightShoulder, kNone, kNone, kNone}},
    {kLeftElbow, kLeftWrist, kLeftElbow, {kLeftElbow, kNone, kNone, kNone}},
    {kRightElbow, kRightWrist, kRightElbow, {kRightElbow, kNone, kNone, kNone}},
    {kLeftWrist, kNone, kLeftWrist, {kLeftWrist, kNone, kNone, kNone}},
    {kRightWrist, kNone, kRightWrist, {kRightWrist, kNone, kNone, kNone}},
}};

size_t number(BodyPart part) { return static_cast<size_t>(part); }
const PartJoints& joints_of(BodyPart part) { return kPartJoints[number(part)]; }
size_t index(int joint) { return static_cast<size_t>(joint); }
BodyPart hand(int side) { return side == 0 ? BodyPart::left_hand : BodyPart::right_hand; }

PosedSkeleton resting(const Joints& rest) {
  PosedSkeleton out;
  out.global.fill(Mat3::Identity());
  out.joints = rest;
  return out;
}

/// The part of each vertex.
std::vector<BodyPart> parts_of(const SkinWeights& weights) {
  std::array<int, kJoints> part{};
  for (int p = 0; p < kParts; ++p)
    for (const int j : kPartJoints[static_cast<size_t>(p)].joints)
      if (j != kNone) part[index(j)] = p;
  std::vector<BodyPart> out;
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    std::array<float, kParts> share{};
    for (int j = 0; j < kJoints; ++j) share[index(part[index(j)])] += weights(v, j);
    out.push_back(
        static_cast<BodyPart>(std::max_element(share.begin(), share.end()) - share.begin()));
  }
  return out;
}

/// Where the axis of a part without a second joint ends, from its beginning: the middle of what
/// lies farthest in its direction. Of a head half the way up: its axis is its middle.
Vec3 own_end(BodyPart part, const Joints& rest, const Points& points) {
  const Vec3 begin = rest[index(joints_of(part).from)];
  Vec3 way = part == BodyPart::head ? Vec3(Vec3::UnitY()) : Vec3(Vec3::UnitZ());
  for (const int side : {0, 1})
    if (part == hand(side)) way = begin - rest[index(kLeftElbow + side)];
  if (!(way.norm() > 1e-9) || points.empty()) return Vec3::Zero();
  way.normalize();
  std::vector<std::pair<double, Vec3>> order;
  for (const Point& p : points) {
    const Vec3 from = p.cast<double>() - begin;
    order.emplace_back(way.dot(from), from);
  }
  std::sort(order.begin(), order.end(),
            [](const auto& a, const auto& b) { return a.first > b.first; });
  const size_t few = std::max<size_t>(1, order.size() / 20);
  Vec3 mean = Vec3::Zero();
  for (size_t i = 0; i < few; ++i) mean += order[i].second / static_cast<double>(few);
  if (part == BodyPart::head) mean *= 0.5;
  return way.dot(mean) > 0 ? mean : Vec3(Vec3::Zero());
}

}  // namespace

PartSurfaces::PartSurfaces(const Mesh& mesh, const Joints& rest, const SkinWeights& weights) {
  const std::vector<BodyPart> parts = parts_of(weights);
  std::array<Points, kParts> points;
  for (size_t v = 0; v < parts.size(); ++v) points[number(parts[v])].push_back(mesh.vertices[v]);
  const PosedSkeleton posed = resting(rest);
  for (int p = 0; p < kParts; ++p) {
    const auto part = static_cast<BodyPart>(p);
    Shape& shape = shapes_[number(part)];
    shape.end = own_end(part, rest, points[number(part)]);
    if (part == BodyPart::left_foot || part == BodyPart::right_foot) shape.front = Vec3::UnitY();
    measure(part, posed, points[number(part)]);
  }
}

PartSurfaces::Axis PartSurfaces::axis(BodyPart part, const PosedSkeleton& posed,
                                      double size) const {
  const PartJoints& at = joints_of(part);
  const Shape& shape = shapes_[number(part)];
  const Mat3& turn = posed.global[index(at.turns)];
  Axis out;
  out.begin = posed.joints[index(at.from)];
  const Vec3 along = at.to == kNone ? Vec3(size * (turn * shape.end))
                                    : Vec3(posed.joints[index(at.to)] - out.begin);
  out.length = along.norm();
  out.way = out.length > 1e-9 ? Vec3(along / out.length) : Vec3(turn * Vec3::UnitY());
  const Vec3 front = turn * shape.front;
  out.front = front - out.way.dot(front) * out.way;
  if (!(out.front.norm() > 1e-6)) out.front = out.way.unitOrthogonal();
  out.front.normalize();
  out.side = out.way.cross(out.front);
  return out;
}

PartSurfaces::Found PartSurfaces::find(const Axis& axis, const Vec3& point) {
  const Vec3 from = point - axis.begin;
  const double t = axis.way.dot(from), on = std::clamp(t, 0.0, axis.length);
  Found out;
  out.out = from - on * axis.way;
  out.from_axis = out.out.norm();
  out.out = out.from_axis > 1e-9 ? Vec3(out.out / out.from_axis) : axis.front;
  const double front = axis.front.dot(out.out), side = axis.side.dot(out.out);
  out.place.around = std::atan2(side, front);
  const double beyond = std::atan2(std::abs(t - on), out.from_axis * std::hypot(front, side));
  if (t < 0)
    out.place.along = -beyond / (M_PI / 2);
  else if (t > axis.length)
    out.place.along = 1 + beyond / (M_PI / 2);
  else
    out.place.along = axis.length > 1e-9 ? on / axis.length : 0;
  return out;
}

/// Of the points of one place the upper quartile counts: eyes and layers of cloth lie under others.
void PartSurfaces::measure(BodyPart part, const PosedSkeleton& rest, const Points& points) {
  const Axis about = axis(part, rest, 1);
  std::array<std::array<std::vector<double>, kAround>, kAlong> seen;
  for (const Point& p : points) {
    const Found f = find(about, p.cast<double>());
    const auto i = static_cast<size_t>(std::lround((f.place.along + 1) / 3 * (kAlong - 1)));
    const auto k =
        static_cast<size_t>(std::lround(f.place.around / (2 * M_PI) * kAround) + kAround) % kAround;
    seen[i][k].push_back(f.from_axis);
  }
  fill(&shapes_[number(part)], seen);
}

/// Places without points, such as the inside of a joint, are as their neighbours.
void PartSurfaces::fill(Shape* shape,
                        const std::array<std::array<std::vector<double>, kAround>, kAlong>& seen) {
  std::array<std::array<bool, kAround>, kAlong> known{};
  for (size_t i = 0; i < kAlong; ++i)
    for (size_t k = 0; k < kAround; ++k) {
      std::vector<double> all = seen[i][k];
      if (all.empty()) continue;
      const auto quartile = all.begin() + static_cast<std::ptrdiff_t>(3 * (all.size() - 1) / 4);
      std::nth_element(all.begin(), quartile, all.end());
      shape->radius[i][k] = *quartile;
      known[i][k] = true;
    }
  for (bool more = true; more;) {
    more = false;
    const auto before = known;
    const auto radius = shape->radius;
    for (size_t i = 0; i < kAlong; ++i)
      for (size_t k = 0; k < kAround; ++k) {
        if (before[i][k]) continue;
        double sum = 0, count = 0;
        const auto add = [&](size_t row, size_t column) {
          if (!before[row][column]) return;
          sum += radius[row][column];
          ++count;
        };
        add(i, (k + 1) % kAround);
        add(i, (k + kAround - 1) % kAround);
        if (i > 0) add(i - 1, k);
        if (i + 1 < kAlong) add(i + 1, k);
        if (count == 0) continue;
        shape->radius[i][k] = sum / count;
        known[i][k] = more = true;
      }
  }
}

double PartSurfaces::radius(BodyPart part, const PlaceOnPart& place) const {
  const Shape& shape = shapes_[number(part)];
  const double row = std::clamp((place.along + 1) / 3 * (kAlong - 1), 0.0, kAlong - 1.0);
  const double column = (place.around / (2 * M_PI) + 2) * kAround;
  const size_t i = std::min(static_cast<size_t>(row), static_cast<size_t>(kAlong - 2));
  const size_t k = static_cast<size_t>(column) % kAround, next = (k + 1) % kAround;
  const double s = row - static_cast<double>(i), t = column - std::floor(column);
  const auto at = [&](size_t r) {
    return (1 - t) * shape.radius[r][k] + t * shape.radius[r][next];
  };
  return (1 - s) * at(i) + s * at(i + 1);
}

NearPart PartSurfaces::locate(BodyPart part, const PosedSkeleton& posed, const Vec3& point,
                              double size) const {
  const Found f = find(axis(part, posed, size), point);
  return {f.place, f.from_axis - size * radius(part, f.place), f.out};
}

Vec3 PartSurfaces::point(BodyPart part, const PosedSkeleton& posed, const PlaceOnPart& place,
                         double over, double size) const {
  const Axis about = axis(part, posed, size);
  const double on = std::clamp(place.along, 0.0, 1.0), beyond = place.along - on;
  const Vec3 across = std::cos(place.around) * about.front + std::sin(place.around) * about.side;
  const double angle = beyond * M_PI / 2;
  const Vec3 out = std::cos(angle) * across + std::sin(angle) * about.way;
  return about.begin + on * about.length * about.way + (over + size * radius(part, place)) * out;
}

Vec3 PartSurfaces::on_hand(int side, const PosedSkeleton& posed, double share, double size) const {
  const Axis about = axis(hand(side), posed, size);
  return about.begin + share * about.length * about.way;
}

double PartSurfaces::hand_radius(int side, const PosedSkeleton& posed, double share,
                                 const Vec3& out, double size) const {
  const Axis about = axis(hand(side), posed, size);
  const Found f = find(about, about.begin + share * about.length * about.way + 1e-3 * out);
  return size * radius(hand(side), f.place);
}

}  // namespace restage
