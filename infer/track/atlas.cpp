#include "infer/track/atlas.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace restage {
namespace {

constexpr int kGutter = 3;             // texels between charts
constexpr int kSmoothings = 8;         // rounds in which faces take their neighbours' side
constexpr double kLeastFacing = 0.35;  // cosine between a face and the side that it may take
constexpr double kLeastForced = 0.1;   // the same of a face in a small chart
constexpr size_t kSmallChart = 24;     // faces

using Flat = Eigen::Vector2d;
using Neighbours = std::vector<std::array<int32_t, 3>>;

Vec3 facing(int side) { return (side % 2 == 0 ? 1 : -1) * Vec3::Unit(side / 2); }

/// Right and up of a side's picture, so that nothing is mirrored.
Flat flat(int side, const Vec3& p) {
  const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
  return side % 2 == 0 ? Flat(p[u], p[v]) : Flat(p[v], p[u]);
}

/// Of each face those across its edges; -1: none.
Neighbours neighbours_of(const std::vector<Triangle>& faces) {
  std::map<std::array<int32_t, 2>, std::array<int32_t, 2>> edges;
  Neighbours out(faces.size(), {-1, -1, -1});
  for (size_t f = 0; f < faces.size(); ++f)
    for (size_t k = 0; k < 3; ++k) {
      const int32_t a = faces[f][k], b = faces[f][(k + 1) % 3];
      const auto [at, added] = edges.try_emplace(
          {std::min(a, b), std::max(a, b)},
          std::array<int32_t, 2>{static_cast<int32_t>(f), static_cast<int32_t>(k)});
      if (added) continue;
      const auto [other, edge] = at->second;
      out[f][k] = other;
      out[static_cast<size_t>(other)][static_cast<size_t>(edge)] = static_cast<int32_t>(f);
    }
  return out;
}

std::vector<Vec3> face_normals(const Mesh& mesh) {
  std::vector<Vec3> out;
  for (const Triangle& f : mesh.faces) {
    const auto at = [&](size_t k) -> Vec3 { return mesh.vertices[f[k]].cast<double>(); };
    out.push_back((at(1) - at(0)).cross(at(2) - at(0)).normalized());
  }
  return out;
}

/// Which of six sides each face is seen from.
class Sides {
 public:
  Sides(const std::vector<Vec3>& normals, const Neighbours& near, std::vector<int> parts)
      : normals_(normals), near_(near), part_(std::move(parts)) {
    for (const Vec3& n : normals) {
      int best = 0;
      for (int side = 1; side < 6; ++side)
        if (n.dot(facing(side)) > n.dot(facing(best)) + 1e-9) best = side;
      side_.push_back(best);
    }
    for (int round = 0; round < kSmoothings; ++round) smooth();
    for (int round = 0; round < kSmoothings; ++round) dissolve();
  }
  const std::vector<int>& of_faces() const { return side_; }

  /// Faces of one side and part that hang together.
  std::vector<std::vector<size_t>> charts() const {
    std::vector<std::vector<size_t>> out;
    std::vector<bool> taken(side_.size());
    for (size_t first = 0; first < side_.size(); ++first) {
      if (taken[first]) continue;
      std::vector<size_t>& chart = out.emplace_back(1, first);
      taken[first] = true;
      for (size_t i = 0; i < chart.size(); ++i)
        for (const int32_t g : near_[chart[i]])
          if (g >= 0 && !taken[static_cast<size_t>(g)] &&
              side_[static_cast<size_t>(g)] == side_[first] &&
              part_[static_cast<size_t>(g)] == part_[first])
            taken[static_cast<size_t>(g)] = true, chart.push_back(static_cast<size_t>(g));
    }
    return out;
  }

 private:
  /// The side of most neighbours, where the face looks that way.
  int wanted(size_t f, double least) const {
    std::array<int, 6> votes{};
    for (const int32_t g : near_[f])
      if (g >= 0) ++votes[static_cast<size_t>(side_[static_cast<size_t>(g)])];
    int best = side_[f];
    for (int side = 0; side < 6; ++side)
      if (votes[static_cast<size_t>(side)] > votes[static_cast<size_t>(best)] &&
          normals_[f].dot(facing(side)) > least)
        best = side;
    return best;
  }
  void smooth() {
    std::vector<int> next = side_;
    for (size_t f = 0; f < side_.size(); ++f) next[f] = wanted(f, kLeastFacing);
    side_ = next;
  }
  void dissolve() {
    for (const std::vector<size_t>& chart : charts()) {
      if (chart.size() >= kSmallChart) continue;
      for (const size_t f : chart)
        for (const int32_t g : near_[f]) {
          if (g < 0) continue;
          const int side = side_[static_cast<size_t>(g)];
          if (side != side_[f] && normals_[f].dot(facing(side)) > kLeastForced) {
            side_[f] = side;
            break;
          }
        }
    }
  }

  const std::vector<Vec3>& normals_;
  const Neighbours& near_;
  std::vector<int> part_, side_;  ///< of each face
};

/// Calls visit(x, y) for every texel whose middle lies in the triangle.
template <class Visit>
void for_texels(const std::array<Flat, 3>& at, const Visit& visit) {
  const auto cross = [](const Flat& a, const Flat& b) { return a.x() * b.y() - a.y() * b.x(); };
  const double area = cross(at[1] - at[0], at[2] - at[0]);
  if (!(std::abs(area) > 1e-12)) return;
  const auto low = at[0].cwiseMin(at[1]).cwiseMin(at[2]).eval();
  const auto high = at[0].cwiseMax(at[1]).cwiseMax(at[2]).eval();
  for (int y = static_cast<int>(std::ceil(low.y() - 0.5)); y + 0.5 < high.y(); ++y)
    for (int x = static_cast<int>(std::ceil(low.x() - 0.5)); x + 0.5 < high.x(); ++x) {
      const Flat p(x + 0.5, y + 0.5);
      bool inside = true;
      for (size_t k = 0; k < 3; ++k)
        inside = inside && cross(at[(k + 1) % 3] - at[k], p - at[k]) / area > 0;
      if (inside) visit(x, y);
    }
}

struct Chart {
  std::vector<size_t> faces;
  int side;
  bool turned = false;  ///< by a quarter: charts are wider than high
  Flat low = Flat::Zero(), size = Flat::Zero();
};

class AtlasMaker {
 public:
  AtlasMaker(const Mesh& mesh, const std::vector<int>& parts, int size) : mesh_(mesh), size_(size) {
    const Neighbours near = neighbours_of(mesh.faces);
    const std::vector<Vec3> normals = face_normals(mesh);
    std::vector<int> of_faces;
    for (const Triangle& f : mesh.faces)
      of_faces.push_back(parts.empty() ? 0 : parts[static_cast<size_t>(f[0])]);
    const Sides sides(normals, near, std::move(of_faces));
    for (const std::vector<size_t>& faces : sides.charts()) add(faces, sides.of_faces()[faces[0]]);
  }

  Atlas make() {
    double low = 0, high = size_;  // texels a metre: what fits, what does not
    for (int step = 0; step < 24; ++step) {
      const double middle = 0.5 * (low + high);
      (pack(middle) ? low : high) = middle;
    }
    // Charts that cover themselves at this scale are parted; the parts need some room more.
    while (part(low))
      while (!pack(low)) low *= 0.98;
    pack(low);
    return places(low);
  }

 private:
  void add(std::vector<size_t> faces, int side) {
    Chart chart{std::move(faces), side};
    measure(&chart);
    chart.turned = chart.size.y() > chart.size.x();
    if (chart.turned) measure(&chart);
    charts_.push_back(std::move(chart));
  }

  void measure(Chart* chart) const {
    chart->low.setConstant(1e9);
    chart->size.setConstant(-1e9);
    for (const size_t f : chart->faces)
      for (const Flat& p : corners(f, *chart)) {
        chart->low = chart->low.cwiseMin(p);
        chart->size = chart->size.cwiseMax(p);
      }
    chart->size -= chart->low;
  }

  std::array<Flat, 3> corners(size_t f, const Chart& chart) const {
    std::array<Flat, 3> out;
    for (size_t k = 0; k < 3; ++k) {
      const Flat p = flat(chart.side, mesh_.vertices[mesh_.faces[f][k]].cast<double>());
      out[k] = chart.turned ? Flat(p.y(), -p.x()) : p;
    }
    return out;
  }

  /// Rows of charts, the highest first.
  bool pack(double scale) {
    std::vector<size_t> order(charts_.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return charts_[a].size.y() > charts_[b].size.y(); });
    origin_.assign(charts_.size(), Flat::Zero());
    double x = kGutter, y = kGutter, row = 0;
    for (const size_t c : order) {
      const double wide = std::ceil(scale * charts_[c].size.x()) + kGutter,
                   tall = std::ceil(scale * charts_[c].size.y()) + kGutter;
      if (x + wide > size_) x = kGutter, y += row, row = 0;
      if (x + wide > size_ || y + tall > size_) return false;
      origin_[c] = Flat(x, y);
      x += wide;
      row = std::max(row, tall);
    }
    return true;
  }

  Flat placed(size_t c, const Flat& p, double scale) const {
    return origin_[c] + scale * (p - charts_[c].low);
  }

  /// Faces that lie over others of their chart go to charts of their own. Whether there were any.
  bool part(double scale) {
    const size_t before = charts_.size();
    for (size_t c = 0; c < charts_.size(); ++c) {
      std::map<std::array<int, 2>, bool> taken;
      std::vector<size_t> kept, over;
      for (const size_t f : charts_[c].faces) {
        std::array<Flat, 3> at = corners(f, charts_[c]);
        for (Flat& p : at) p = scale * (p - charts_[c].low);
        bool free = true;
        for_texels(at, [&](int x, int y) { free = free && !taken[{x, y}]; });
        if (free) for_texels(at, [&](int x, int y) { taken[{x, y}] = true; });
        (free ? kept : over).push_back(f);
      }
      if (over.empty()) continue;
      const int side = charts_[c].side;
      charts_[c].faces = std::move(kept);
      add(std::move(over), side);
    }
    return charts_.size() != before;
  }

  Atlas places(double scale) const {
    Atlas out;
    out.corners.resize(mesh_.faces.size());
    for (size_t c = 0; c < charts_.size(); ++c) {
      std::map<int32_t, int32_t> numbers;
      for (const size_t f : charts_[c].faces) {
        const auto at = corners(f, charts_[c]);
        for (size_t k = 0; k < 3; ++k) {
          const auto [number, added] =
              numbers.try_emplace(mesh_.faces[f][k], static_cast<int32_t>(out.places.size()));
          if (added) out.places.push_back((placed(c, at[k], scale) / size_).cast<float>());
          out.corners[f][k] = number->second;
        }
      }
    }
    return out;
  }

  const Mesh& mesh_;
  const double size_;
  std::vector<Chart> charts_;
  std::vector<Flat> origin_;
};

}  // namespace

Atlas make_atlas(const Mesh& mesh, const std::vector<int>& parts, int size) {
  return AtlasMaker(mesh, parts, size).make();
}

std::vector<int32_t> atlas_faces(const Atlas& atlas, int size) {
  std::vector<int32_t> out(static_cast<size_t>(size) * static_cast<size_t>(size), -1);
  for (size_t f = 0; f < atlas.corners.size(); ++f) {
    std::array<Flat, 3> at;
    for (size_t k = 0; k < 3; ++k) {
      const Flat p = atlas.places[static_cast<size_t>(atlas.corners[f][k])].cast<double>();
      at[k] = size * Flat(p.x(), 1 - p.y());
    }
    for_texels(at, [&](int x, int y) {
      if (x >= 0 && y >= 0 && x < size && y < size)
        out[static_cast<size_t>(y) * static_cast<size_t>(size) + static_cast<size_t>(x)] =
            static_cast<int32_t>(f);
    });
  }
  return out;
}

}  // namespace restage
