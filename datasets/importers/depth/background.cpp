#include "datasets/importers/depth/background.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "autograd/base/format.h"
#include "datasets/doctor/parts.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr size_t kLookedAgain = 3000;  // points, as find_walls()
constexpr double kUpwards = 0.7;       // cosine to the camera's up
constexpr double kSameFloor = 0.998;   // cosine: 3.6 degrees
constexpr size_t kFewestLooks = 8;     // frames that tell what moves
constexpr double kFarShare = 0.8;  // of the depths of a pixel that are nearer than its usual one
constexpr double kRestingNear = 0.05;    // metres
constexpr double kRestingShare = 0.03;   // of the depth
constexpr double kRestingGrowth = 0.01;  // times the squared depth, a metre
constexpr float kPieceCell = 0.1f;       // metres: what is nearer to each other is a piece
constexpr float kStands = 1.1f, kStandsWide = 1.3f;  // metres high; times its height
constexpr double kLivingShare = 0.08;  // of a piece's points before what is usual there

double angle_cosine(const FlatPlane& a, const FlatPlane& b) { return a.normal.dot(b.normal); }

/// The piece of each point: filled cubes that touch each other.
std::vector<size_t> pieces_of(const Points& points, const std::vector<size_t>& which) {
  std::map<std::array<int, 3>, size_t> cubes;
  std::vector<size_t> cube;
  for (const size_t i : which) {
    const Point p = (points[i] / kPieceCell).array().floor().min(1e8f).max(-1e8f);
    const std::array<int, 3> at = {static_cast<int>(p.x()), static_cast<int>(p.y()),
                                   static_cast<int>(p.z())};
    cube.push_back(cubes.try_emplace(at, cubes.size()).first->second);
  }
  Pieces pieces(cubes.size());
  for (const auto& [at, number] : cubes)
    for (int k = 14; k < 27; ++k) {  // half of the neighbours: the others ask for this one
      const auto next = cubes.find({at[0] + k / 9 - 1, at[1] + k / 3 % 3 - 1, at[2] + k % 3 - 1});
      if (next != cubes.end()) pieces.join(number, next->second);
    }
  for (size_t& c : cube) c = pieces.of(c);
  return cube;
}

}  // namespace

void Background::take_floor(const std::vector<Wall>& walls) {
  const auto best = std::max_element(walls.begin(), walls.end(), [](const Wall& a, const Wall& b) {
    return a.plane.normal.y() < b.plane.normal.y();
  });
  if (best != walls.end() && best->plane.normal.y() > kUpwards) floors_.push_back(best->plane);
}

void Background::look(const PicturePoints& frame) {
  ++looks_;
  for (size_t i = 0; i < frame.cell.size(); ++i) seen_[frame.cell[i]].push_back(frame.depth[i]);
  take_floor(find_walls(frame.points));
}

void Background::settle() {
  for (size_t c = 0; c < seen_.size(); ++c) {
    std::vector<float>& depths = seen_[c];
    if (2 * depths.size() < looks_) continue;  // usually nothing: everything is before it
    const size_t at = std::min(depths.size() - 1,
                               static_cast<size_t>(kFarShare * static_cast<double>(depths.size())));
    std::nth_element(depths.begin(), depths.begin() + static_cast<ptrdiff_t>(at), depths.end());
    far_[c] = depths[at];
  }
  seen_.clear();
  if (floors_.empty() || 3 * floors_.size() < looks_) return;
  // The floor of the middle height; where others lie across it, the camera moves.
  std::nth_element(floors_.begin(), floors_.begin() + std::ssize(floors_) / 2, floors_.end(),
                   [](const FlatPlane& a, const FlatPlane& b) { return a.offset < b.offset; });
  const FlatPlane middle = floors_[floors_.size() / 2];
  const auto alike = std::count_if(floors_.begin(), floors_.end(), [&](const FlatPlane& other) {
    return angle_cosine(middle, other) > kSameFloor;
  });
  if (4 * alike >= 3 * std::ssize(floors_)) floor_ = middle;
}

bool Background::is_resting(const PicturePoints& frame, size_t i) const {
  const double far = far_[frame.cell[i]];
  return far > 0 && frame.depth[i] > far - std::max({kRestingNear, kRestingShare * far,
                                                     kRestingGrowth * far * far});
}

void Background::drop_low(const PicturePoints& frame, std::vector<size_t>& left) const {
  const Vec3 up = floor_ ? floor_->normal : Vec3::UnitY();
  const Vec3 right = up.unitOrthogonal(), ahead = up.cross(right);
  const std::vector<size_t> piece = pieces_of(frame.points, left);
  std::map<size_t, Box> boxes;  // x: right, y: up, z: ahead
  for (size_t k = 0; k < left.size(); ++k) {
    const Vec3 p = frame.points[left[k]].cast<double>();
    boxes[piece[k]].extend(Vec3(right.dot(p), up.dot(p), ahead.dot(p)).cast<float>());
  }
  const auto may_stand = [&](size_t k) {
    const Point size = boxes[piece[k]].sizes();
    return size.y() > kStands && std::hypot(size.x(), size.z()) < kStandsWide * size.y();
  };
  std::vector<size_t> out;
  for (size_t k = 0; k < left.size(); ++k)
    if (may_stand(k)) out.push_back(left[k]);
  if (!out.empty()) left = std::move(out);
}

void Background::drop_resting(const PicturePoints& frame, std::vector<size_t>& left) const {
  const std::vector<size_t> piece = pieces_of(frame.points, left);
  std::map<size_t, std::array<size_t, 2>> count;  // of each piece: points, living ones
  for (size_t k = 0; k < left.size(); ++k) {
    auto& [points, living] = count[piece[k]];
    ++points;
    living += !is_resting(frame, left[k]);
  }
  const auto lives = [](const std::array<size_t, 2>& one) {
    return static_cast<double>(one[1]) >= kLivingShare * static_cast<double>(one[0]);
  };
  size_t largest = 0, largest_living = 0;
  for (const auto& [root, one] : count) {
    largest = std::max(largest, one[0]);
    if (lives(one)) largest_living = std::max(largest_living, one[0]);
  }
  // Where all that lives is a few stray points, who is there stands still.
  if (looks_ < kFewestLooks || 8 * largest_living < largest) return drop_low(frame, left);
  std::vector<size_t> out;
  for (size_t k = 0; k < left.size(); ++k)
    if (lives(count[piece[k]])) out.push_back(left[k]);
  left = std::move(out);
}

Points Background::person_in(const PicturePoints& frame) {
  const Points& points = frame.points;
  std::vector<Wall> walls = find_walls(points);
  // What a frame alone does not show clearly the one before did, if the camera stands still.
  for (const Wall& old : walls_) {
    if (std::any_of(walls.begin(), walls.end(), [&](const Wall& wall) {
          return angle_cosine(old.plane, wall.plane) > kSameFloor;
        }))
      continue;
    const size_t n = std::min(points.size(), kLookedAgain);
    size_t on = 0;
    for (size_t i = 0; i < n; ++i) on += old.has(points[i * points.size() / n]);
    if (2 * on > old.points) walls.push_back(old);
  }
  std::vector<size_t> left;
  for (size_t i = 0; i < points.size(); ++i)
    if (std::none_of(walls.begin(), walls.end(),
                     [&](const Wall& wall) { return wall.has(points[i]); }))
      left.push_back(i);
  walls_ = std::move(walls);
  all_ += points.size();
  flat_ += points.size() - left.size();
  const size_t before = left.size();
  drop_resting(frame, left);
  resting_ += before - left.size();
  Points rest, out;
  for (const size_t i : left) rest.push_back(points[i]);
  const Parts parts = find_parts(rest, middle_);
  Point sum = Point::Zero();
  for (size_t i = 0; i < rest.size(); ++i)
    if (parts.part[i] == Part::person) out.push_back(rest[i]), sum += rest[i];
  apart_ += rest.size() - out.size();
  if (!out.empty()) middle_ = sum / static_cast<float>(out.size());
  return out;
}

void Background::restart() {
  middle_.reset();
  walls_.clear();
  all_ = flat_ = resting_ = apart_ = 0;
}

std::string Background::removed() const {
  const auto share = [&](size_t n) {
    return 100 * static_cast<double>(n) / static_cast<double>(std::max<size_t>(1, all_));
  };
  return format(
      "%.0f %% on floors and walls, %.0f %% on furniture, %.0f %% "
      "apart from the person",
      share(flat_), share(resting_), share(apart_));
}

}  // namespace restage
