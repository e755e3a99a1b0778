#include "datasets/sampling/thin_mesh.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <set>

#include "nn/geometry/embedded_mesh.h"

namespace restage {
namespace {

/// Of each vertex the kept one that is nearest along edges; -1: none can be reached.
std::vector<int32_t> owners(const Mesh& mesh, const std::vector<int32_t>& kept) {
  std::vector<std::vector<int32_t>> beside(mesh.vertices.size());
  for (const Triangle& f : mesh.faces)
    for (size_t c = 0; c < 3; ++c) {
      beside[static_cast<size_t>(f[c])].push_back(f[(c + 1) % 3]);
      beside[static_cast<size_t>(f[(c + 1) % 3])].push_back(f[c]);
    }
  struct Reached {
    float distance;
    int32_t vertex, owner;
    bool operator>(const Reached& o) const {
      return std::tie(distance, vertex, owner) > std::tie(o.distance, o.vertex, o.owner);
    }
  };
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  for (size_t k = 0; k < kept.size(); ++k) open.push({0, kept[k], static_cast<int32_t>(k)});
  std::vector<int32_t> out(mesh.vertices.size(), -1);
  while (!open.empty()) {
    const Reached at = open.top();
    open.pop();
    int32_t& owner = out[static_cast<size_t>(at.vertex)];
    if (owner >= 0) continue;
    owner = at.owner;
    for (const int32_t next : beside[static_cast<size_t>(at.vertex)])
      if (out[static_cast<size_t>(next)] < 0)
        open.push({at.distance + (mesh.vertices[static_cast<size_t>(next)] -
                                  mesh.vertices[static_cast<size_t>(at.vertex)])
                                     .norm(),
                   next, at.owner});
  }
  return out;
}

}  // namespace

ThinMesh thin_mesh(const Mesh& mesh, size_t vertices) {
  ThinMesh out;
  if (vertices == 0 || vertices >= mesh.vertices.size()) {
    out.kept.resize(mesh.vertices.size());
    std::iota(out.kept.begin(), out.kept.end(), 0);
    out.faces = mesh.faces;
    return out;
  }
  out.kept = evenly_spread(mesh.vertices, vertices);
  const std::vector<int32_t> owner = owners(mesh, out.kept);
  std::set<Triangle> known;  // each set of corners once
  for (const Triangle& f : mesh.faces) {
    Triangle face;
    for (size_t c = 0; c < 3; ++c) face[c] = owner[static_cast<size_t>(f[c])];
    if (face[0] < 0 || face[0] == face[1] || face[1] == face[2] || face[0] == face[2]) continue;
    Triangle corners = face;
    std::sort(corners.begin(), corners.end());
    if (known.insert(corners).second) out.faces.push_back(face);
  }
  return out;
}

Body thin_body(const Body& body, const ThinMesh& thin) {
  Body out = body;
  out.rest.faces = thin.faces;
  out.rest.vertices.clear();
  out.weights.resize(std::ssize(thin.kept), kJoints);
  for (const int32_t v : thin.kept) {
    out.weights.row(std::ssize(out.rest.vertices)) = body.weights.row(v);
    out.rest.vertices.push_back(body.rest.vertices[static_cast<size_t>(v)]);
  }
  return out;
}

}  // namespace restage
