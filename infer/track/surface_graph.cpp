#include "infer/track/surface_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "autograd/base/error.h"

namespace restage {
namespace {

// Metres by which two places are farther apart if other joints move them.
constexpr double kOtherJoints = 0.2;
constexpr size_t kNodeNeighbours = 6;
constexpr double kHandHold = 8, kHeadHold = 4;

using Place = Eigen::Matrix<double, 3 + kJoints, 1>;

std::vector<Place> places_of(const Body& body) {
  std::vector<Place> out(body.rest.vertices.size());
  for (size_t v = 0; v < out.size(); ++v)
    out[v] << body.rest.vertices[v].cast<double>(),
        kOtherJoints * body.weights.row(static_cast<Eigen::Index>(v)).transpose().cast<double>();
  return out;
}

/// Farthest point sampling.
std::vector<int32_t> spread(const std::vector<Place>& places, size_t count) {
  std::vector<int32_t> out;
  std::vector<double> away(places.size(), std::numeric_limits<double>::infinity());
  size_t next = 0;
  while (out.size() < std::min(count, places.size())) {
    out.push_back(static_cast<int32_t>(next));
    for (size_t v = 0; v < places.size(); ++v)
      away[v] = std::min(away[v], (places[v] - places[next]).squaredNorm());
    next = static_cast<size_t>(std::max_element(away.begin(), away.end()) - away.begin());
    if (!(away[next] > 0)) break;
  }
  return out;
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& f : mesh.faces) {
    const auto at = [&](size_t k) -> Vec3 { return mesh.vertices[f[k]].cast<double>(); };
    sum += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  return sum;
}

}  // namespace

SurfaceGraph make_surface_graph(const Body& body, size_t nodes, const std::string& where) {
  SurfaceGraph out;
  if (body.rest.faces.empty())
    throw InputError(where, "has no faces, and a surface is fitted by them", "give a mesh");
  out.area = area_of(body.rest);
  if (!(out.area > 0 && std::isfinite(out.area)))
    throw InputError(where, "has faces without area", "give a mesh with a surface");
  const std::vector<Place> places = places_of(body);
  out.nodes = spread(places, nodes);
  const size_t count = out.nodes.size();
  if (count <= std::max(SurfaceGraph::kLinks, kNodeNeighbours))
    throw InputError(where, "has too few vertices in different places", "give a finer mesh");
  std::set<std::array<int32_t, 2>> edges;
  std::vector<double> away(count);
  std::vector<int32_t> order(count);
  const auto near = [&](size_t vertex, size_t wanted) {
    for (size_t i = 0; i < count; ++i)
      away[i] = (places[vertex] - places[static_cast<size_t>(out.nodes[i])]).norm();
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(
        order.begin(), order.begin() + static_cast<std::ptrdiff_t>(wanted), order.end(),
        [&](int32_t a, int32_t b) { return away[a] != away[b] ? away[a] < away[b] : a < b; });
  };
  for (size_t v = 0; v < places.size(); ++v) {
    near(v, SurfaceGraph::kLinks + 1);
    const double reach = away[order[SurfaceGraph::kLinks]];
    SurfaceGraph::Link& link = out.links.emplace_back();
    double sum = 0;
    for (size_t k = 0; k < SurfaceGraph::kLinks; ++k) {
      const double left = reach > 0 ? 1 - away[order[k]] / reach : 1;
      link.node[k] = order[k];
      link.weight[k] = left * left + 1e-9;
      sum += link.weight[k];
    }
    for (double& w : link.weight) w /= sum;
  }
  for (size_t i = 0; i < count; ++i) {
    near(static_cast<size_t>(out.nodes[i]), kNodeNeighbours + 1);
    for (size_t k = 1; k <= kNodeNeighbours; ++k)
      edges.insert({std::min(order[k], static_cast<int32_t>(i)),
                    std::max(order[k], static_cast<int32_t>(i))});
    const auto row = body.weights.row(out.nodes[i]);
    out.hold.push_back(1 + kHandHold * double{row[kLeftWrist] + row[kRightWrist]} +
                       kHeadHold * double{row[kHead]});
  }
  for (const auto& edge : edges)
    if (edge[0] != edge[1]) out.edges.push_back(edge);
  return out;
}

}  // namespace restage
