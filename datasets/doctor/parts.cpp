#include "datasets/doctor/parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nanoflann.hpp>
#include <numeric>
#include <set>

#include "datasets/doctor/orientation_model.h"
#include "datasets/doctor/planes.h"
#include "datasets/doctor/shape.h"

namespace restage {
namespace {

constexpr size_t kMostJudged = 20000;
constexpr float kEven = 0.08f;  // times the size (3 cm of a person): one point a cube is judged
constexpr size_t kLonelyNeighbours = 4;  // a point's loneliness is the distance to this one
constexpr float kLonely = 3.5f;          // times the typical distance: a stray point
constexpr float kLinked = 2.5f;          // times the typical distance: of one piece
constexpr float kApart = 0.4f;           // times the size (0.4 m of a person): not the same person
constexpr double kSmallPiece = 0.012;    // part of all points; fewer are stray

struct Cloud {
  const Points& points;
  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t i, size_t axis) const { return points[i][static_cast<int>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud,
                                                 3, uint32_t>;

/// Distance of each point to its kLonelyNeighbours-th neighbour.
std::vector<float> loneliness(const Tree& tree, const Points& points) {
  std::vector<float> out(points.size());
  std::array<uint32_t, kLonelyNeighbours + 1> index;
  std::array<float, kLonelyNeighbours + 1> squared;
  for (size_t i = 0; i < points.size(); ++i) {
    const size_t n = tree.knnSearch(points[i].data(), index.size(), index.data(), squared.data());
    out[i] = n > 0 ? std::sqrt(squared[n - 1]) : 0;
  }
  return out;
}

struct Neighbourhood {
  const Points& points;
  Cloud cloud{points};
  Tree tree{3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)};

  /// Calls `visit(j)` for all points within `radius` of p.
  template <class Visit>
  void near(const Point& p, float radius, Visit&& visit) const {
    std::vector<std::pair<uint32_t, float>> found;
    nanoflann::SearchParams params;
    params.sorted = false;
    tree.radiusSearch(p.data(), radius * radius, found, params);
    for (const auto& [j, squared] : found) visit(static_cast<size_t>(j));
  }
  std::pair<size_t, float> nearest(const Point& p) const {
    uint32_t index = 0;
    float squared = std::numeric_limits<float>::infinity();
    tree.knnSearch(p.data(), 1, &index, &squared);
    return {index, std::sqrt(squared)};
  }
};

/// Puts the person's piece in front of pieces that are ordered by size.
void follow(const Points& points, const Point& before, std::vector<std::vector<size_t>>& pieces) {
  const auto away = [&](const std::vector<size_t>& piece) {
    Point middle = Point::Zero();
    for (const size_t i : piece) middle += points[i] / static_cast<float>(piece.size());
    return (middle - before).norm();
  };
  size_t best = 0;
  for (size_t k = 1; k < pieces.size() && 2 * pieces[k].size() >= pieces[0].size(); ++k)
    if (away(pieces[k]) < away(pieces[best])) best = k;
  std::swap(pieces[0], pieces[best]);
}

/// The same for the points that are judged.
Parts judge(const Points& points, const std::optional<Point>& before) {
  Parts out;
  out.part.assign(points.size(), Part::person);
  const Neighbourhood all{points};
  const std::vector<float> lonely = loneliness(all.tree, points);
  out.spacing = median(lonely);
  const auto spacing = static_cast<float>(out.spacing);
  if (!(spacing > 0)) return out;
  for (size_t i = 0; i < points.size(); ++i)
    if (lonely[i] > kLonely * spacing) out.part[i] = Part::stray;

  Pieces pieces(points.size());
  for (size_t i = 0; i < points.size(); ++i)
    if (out.part[i] != Part::stray)
      all.near(points[i], kLinked * spacing, [&](size_t j) {
        if (out.part[j] != Part::stray) pieces.join(i, j);
      });
  std::map<size_t, std::vector<size_t>> members;
  for (size_t i = 0; i < points.size(); ++i)
    if (out.part[i] != Part::stray) members[pieces.of(i)].push_back(i);
  std::vector<std::vector<size_t>> ordered;
  for (auto& [root, indices] : members) ordered.push_back(std::move(indices));
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  if (ordered.empty()) return out;
  if (before) follow(points, *before, ordered);

  // What lies near the person, or near what does, is of the person.
  Points person, all_pieces;
  for (const size_t i : ordered[0]) person.push_back(points[i]);
  for (const auto& piece : ordered)
    for (const size_t i : piece) all_pieces.push_back(points[i]);
  const float apart =
      std::max(kApart * doctor_detail::normalised(all_pieces).size, kLinked * spacing);
  std::vector<bool> joined(ordered.size());
  joined[0] = true;
  const auto gap_of = [&](const std::vector<size_t>& piece, const Neighbourhood& to) {
    float gap = std::numeric_limits<float>::infinity();
    for (const size_t i : piece) gap = std::min(gap, to.nearest(points[i]).second);
    return gap;
  };
  const auto small = static_cast<size_t>(kSmallPiece * static_cast<double>(points.size())) + 1;
  for (Points latest = person; !latest.empty();) {  // only what was joined last can join more
    const Neighbourhood near{latest};
    Points next;
    for (size_t k = 1; k < ordered.size(); ++k) {
      if (joined[k] || !(gap_of(ordered[k], near) < apart)) continue;
      joined[k] = true;
      if (ordered[k].size() > small) ++out.pieces;
      for (const size_t i : ordered[k]) next.push_back(points[i]);
    }
    person.insert(person.end(), next.begin(), next.end());
    latest = std::move(next);
  }
  const Neighbourhood near{person};
  out.gap = std::numeric_limits<double>::infinity();
  for (size_t k = 1; k < ordered.size(); ++k) {
    if (joined[k]) continue;
    const bool stray = ordered[k].size() <= small;
    for (const size_t i : ordered[k]) out.part[i] = stray ? Part::stray : Part::other;
    if (stray) continue;
    out.largest_other = std::max(out.largest_other, ordered[k].size());
    out.gap = std::min(out.gap, static_cast<double>(gap_of(ordered[k], near)));
  }
  if (out.largest_other == 0) out.gap = 0;
  return out;
}

/// One point of each cube about the middle: meshes have hundreds of vertices in a hand and few on a
/// back, and what is stray is told by distances that are usual everywhere.
std::vector<size_t> evenly_spread(const Points& points) {
  const doctor_detail::NormalisedCloud cloud = doctor_detail::normalised(points);
  const float edge = kEven * cloud.size;
  std::vector<size_t> out;
  std::set<std::array<int64_t, 3>> taken;
  for (size_t i = 0; i < points.size(); ++i) {
    const Point p = edge > 0 ? Point((points[i] - cloud.middle) / edge) : Point::Zero();
    std::array<int64_t, 3> cube;  // rounded, not cut: turning the axes round changes nothing
    for (int axis = 0; axis < 3; ++axis)
      cube[axis] = std::llround(std::clamp(p[axis], -1e9f, 1e9f));
    if (!(edge > 0) || taken.insert(cube).second) out.push_back(i);
  }
  if (out.size() <= kMostJudged) return out;
  for (size_t k = 0; k < kMostJudged; ++k) out[k] = out[k * out.size() / kMostJudged];
  out.resize(kMostJudged);
  return out;
}

/// Of points without a floor and walls.
Parts find_pieces(const Points& points, const std::optional<Point>& before) {
  if (points.empty()) return {};
  const std::vector<size_t> judged = evenly_spread(points);
  Points some;
  for (const size_t i : judged) some.push_back(points[i]);
  Parts out = judge(some, before);
  out.judged = judged;
  if (judged.size() < points.size()) out.part = parts_at(points, some, out);
  out.stray = static_cast<size_t>(std::count(out.part.begin(), out.part.end(), Part::stray));
  out.other = static_cast<size_t>(std::count(out.part.begin(), out.part.end(), Part::other));
  return out;
}

}  // namespace

Pieces::Pieces(size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), size_t{0}); }

size_t Pieces::of(size_t i) {
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

std::vector<Part> parts_at(const Points& others, const Points& points, const Parts& parts) {
  std::vector<Part> out;
  if (points.empty()) return out;
  const Neighbourhood near{points};
  for (const Point& p : others) {
    const auto [i, distance] = near.nearest(p);
    out.push_back(distance > kLonely * parts.spacing ? Part::stray : parts.part[i]);
  }
  return out;
}

Parts find_parts(const Points& points, const std::optional<Point>& before) {
  const Planes planes = find_planes(points);
  if (!planes.any()) return find_pieces(points, before);
  std::vector<size_t> number;
  Points rest;
  for (size_t i = 0; i < points.size(); ++i)
    if (!planes.on[i]) number.push_back(i), rest.push_back(points[i]);
  Parts out = find_pieces(rest, before);
  std::vector<Part> part(points.size(), Part::other);
  for (size_t i = 0; i < rest.size(); ++i) part[number[i]] = out.part[i];
  for (size_t& i : out.judged) i = number[i];
  out.part = std::move(part);
  out.flat = planes.points;
  out.planes = planes.planes;
  return out;
}

}  // namespace restage
