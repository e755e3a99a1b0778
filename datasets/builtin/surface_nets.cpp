#include "datasets/builtin/surface_nets.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

constexpr int kBlock = 4;

struct Samples {
  std::array<int, 3> n;
  std::vector<double> value;
  size_t at(int x, int y, int z) const { return (static_cast<size_t>(z) * n[1] + y) * n[0] + x; }
};

Vec3 node(const GridLines& g, int x, int y, int z) { return {g[0][x], g[1][y], g[2][z]}; }

// Blocks far from the surface take the value at their middle.
void sample_block(const std::function<double(const Vec3&)>& field, const GridLines& g,
                  const std::array<int, 3>& lo, Samples& out) {
  std::array<int, 3> hi;
  for (int i = 0; i < 3; ++i) hi[i] = std::min(lo[i] + kBlock, out.n[i]);
  const Vec3 a = node(g, lo[0], lo[1], lo[2]), b = node(g, hi[0] - 1, hi[1] - 1, hi[2] - 1);
  const double middle = field(0.5 * (a + b));
  const bool far = std::abs(middle) > 1.7 * 0.5 * (b - a).norm();
  for (int z = lo[2]; z < hi[2]; ++z)
    for (int y = lo[1]; y < hi[1]; ++y)
      for (int x = lo[0]; x < hi[0]; ++x)
        out.value[out.at(x, y, z)] = far ? middle : field(node(g, x, y, z));
}

Samples sample(const std::function<double(const Vec3&)>& field, const GridLines& g) {
  Samples s;
  for (int i = 0; i < 3; ++i) s.n[i] = static_cast<int>(g[i].size());
  s.value.resize(g[0].size() * g[1].size() * g[2].size());
  for (int z = 0; z < s.n[2]; z += kBlock)
    for (int y = 0; y < s.n[1]; y += kBlock)
      for (int x = 0; x < s.n[0]; x += kBlock) sample_block(field, g, {x, y, z}, s);
  return s;
}

// Bit k: corner k of the cell lies inside.
int corners_inside(const Samples& s, int x, int y, int z) {
  int inside = 0;
  for (int k = 0; k < 8; ++k)
    inside |= (s.value[s.at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))] < 0) << k;
  return inside;
}

// Calls f(x, y, z) for all cells that the surface passes.
template <class F>
void for_surface_cells(const Samples& s, F&& f) {
  for (int z = 0; z + 1 < s.n[2]; ++z)
    for (int y = 0; y + 1 < s.n[1]; ++y)
      for (int x = 0; x + 1 < s.n[0]; ++x)
        if (const int inside = corners_inside(s, x, y, z); inside != 0 && inside != 255) f(x, y, z);
}

// Fills one outside node if the nodes of this cell have diagonal contact; true when it did.
bool repair_cell(Samples& s, int x, int y, int z) {
  std::array<size_t, 8> c;
  for (int k = 0; k < 8; ++k) c[k] = s.at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
  const int inside = corners_inside(s, x, y, z);
  const auto in = [&](int k) { return (inside >> k & 1) != 0; };
  const auto fill = [&](int k, int l) {  // the one nearer to the surface
    double &a = s.value[c[k]], &b = s.value[c[l]];
    (a <= b ? a : b) = -1e-4;
    return true;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, o = side << axis;
      if (in(o) == in(o + u + v) && in(o + u) == in(o + v) && in(o) != in(o + u))
        return in(o) ? fill(o + u, o + v) : fill(o, o + u + v);
    }
  for (int k = 0; k < 4; ++k) {  // only two opposite corners inside, or only two outside
    const int pair = (1 << k) | (1 << (7 - k));
    if (inside == pair) return fill(k ^ 1, k ^ 4);
    if (inside == 255 - pair) return fill(k, 7 - k);
  }
  return false;
}

void make_well_composed(Samples& s) {
  for (bool changed = true; changed;) {  // ends: every change turns an outside node inside
    changed = false;
    for_surface_cells(s, [&](int x, int y, int z) {
      while (repair_cell(s, x, y, z)) changed = true;
    });
  }
}

// Mean of the crossings of the edges of a cell that the surface passes.
Vec3 cell_vertex(const Samples& s, const GridLines& g, int x, int y, int z) {
  Vec3 sum = Vec3::Zero();
  int crossings = 0;
  for (int k = 0; k < 8; ++k)
    for (int axis = 0; axis < 3; ++axis) {
      if (k >> axis & 1) continue;
      const int l = k | 1 << axis;
      const std::array<int, 3> a = {x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)};
      const std::array<int, 3> b = {x + (l & 1), y + (l >> 1 & 1), z + (l >> 2)};
      const double va = s.value[s.at(a[0], a[1], a[2])], vb = s.value[s.at(b[0], b[1], b[2])];
      if ((va < 0) == (vb < 0)) continue;
      const double t = va / (va - vb);
      sum += (1 - t) * node(g, a[0], a[1], a[2]) + t * node(g, b[0], b[1], b[2]);
      ++crossings;
    }
  return sum / crossings;
}

void add_quad(SurfaceMesh& mesh, std::array<int32_t, 4> q, bool flip) {
  if (flip) std::swap(q[1], q[3]);
  const auto length = [&](int a, int b) {
    return (mesh.vertices[q[a]] - mesh.vertices[q[b]]).squaredNorm();
  };
  if (length(0, 2) <= length(1, 3)) {
    mesh.faces.push_back({q[0], q[1], q[2]});
    mesh.faces.push_back({q[0], q[2], q[3]});
  } else {
    mesh.faces.push_back({q[0], q[1], q[3]});
    mesh.faces.push_back({q[1], q[2], q[3]});
  }
}

}  // namespace

SurfaceMesh surface_nets(const std::function<double(const Vec3&)>& field, const GridLines& grid) {
  Samples s = sample(field, grid);
  make_well_composed(s);
  SurfaceMesh mesh;
  std::vector<int32_t> cell(s.value.size(), -1);
  for_surface_cells(s, [&](int x, int y, int z) {
    cell[s.at(x, y, z)] = static_cast<int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(cell_vertex(s, grid, x, y, z));
  });
  for (int z = 1; z + 1 < s.n[2]; ++z)  // an edge with a change of sign is the middle of a quad
    for (int y = 1; y + 1 < s.n[1]; ++y)
      for (int x = 1; x + 1 < s.n[0]; ++x)
        for (int axis = 0; axis < 3; ++axis) {
          const std::array<int, 3> o = {x, y, z};
          std::array<int, 3> e = o, u = {0, 0, 0}, v = {0, 0, 0};
          ++e[axis];
          u[(axis + 1) % 3] = 1;
          v[(axis + 2) % 3] = 1;
          const bool a = s.value[s.at(x, y, z)] < 0, b = s.value[s.at(e[0], e[1], e[2])] < 0;
          if (a == b) continue;
          const auto id = [&](int du, int dv) {
            return cell[s.at(x - du * u[0] - dv * v[0], y - du * u[1] - dv * v[1],
                             z - du * u[2] - dv * v[2])];
          };
          add_quad(mesh, {id(1, 1), id(0, 1), id(0, 0), id(1, 0)}, b);
        }
  return mesh;
}

std::vector<std::vector<int32_t>> vertex_neighbours(size_t vertices,
                                                    const std::vector<Triangle>& faces) {
  std::vector<std::vector<int32_t>> out(vertices);
  for (const Triangle& f : faces)
    for (int k = 0; k < 3; ++k) out[f[k]].push_back(f[(k + 1) % 3]);
  for (auto& list : out) std::sort(list.begin(), list.end());
  return out;  // closed and oriented: every edge appears once in each direction
}

}  // namespace restage
