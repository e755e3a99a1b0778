#include "datasets/builtin/bodies.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/parallel.h"
#include "datasets/builtin/body_shape.h"
#include "datasets/builtin/body_weights.h"
#include "datasets/builtin/shape_space.h"
#include "datasets/builtin/surface_nets.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

struct Stretch {
  double end, spacing;  // grid lines every `spacing` up to `end`
};

std::vector<double> lines(double start, const std::vector<Stretch>& stretches) {
  std::vector<double> out = {start};
  for (const Stretch& s : stretches) {
    const int steps = std::max(1, static_cast<int>(std::lround((s.end - out.back()) / s.spacing)));
    const double from = out.back();
    for (int i = 1; i <= steps; ++i) out.push_back(from + (s.end - from) * i / steps);
  }
  return out;
}

// Fine where there is detail: hands, face, feet. Symmetric in x, with a line at 0.
// `coarse`: a factor of all distances between lines.
GridLines grid_of(const BodyShape& s, double coarse) {
  const double wrist = wrist_x(s), arm = map_height(s, .805), chin = map_height(s, .86);
  GridLines g;
  const std::vector<double> half = lines(0, {{.056, .0090 * coarse},
                                             {shoulder_x(s), .0129 * coarse},
                                             {wrist - .02, .0185 * coarse},
                                             {wrist + .14 * s.hands, .0087 * coarse}});
  for (size_t i = half.size(); i-- > 1;) g[0].push_back(-half[i]);
  g[0].insert(g[0].end(), half.begin(), half.end());
  g[1] = lines(-.025, {{.055, .0101 * coarse},
                       {map_height(s, .45), .0213 * coarse},
                       {arm - .045, .0168 * coarse},
                       {arm + .035, .0095 * coarse},
                       {chin, .0106 * coarse},
                       {1.02, .0087 * coarse}});
  g[2] = lines(-.19, {{.23, .0114 * coarse}});
  return g;
}

// Evens out the triangles: slides vertices towards their neighbours' mean and back to the surface.
void relax(const ImplicitSurface& surface, double longest, SurfaceMesh& mesh) {
  const auto neighbours = vertex_neighbours(mesh.vertices.size(), mesh.faces);
  std::vector<Vec3> next(mesh.vertices.size());
  for (int round = 0; round < 4; ++round) {
    for (size_t v = 0; v < next.size(); ++v) {
      Vec3 mean = Vec3::Zero();
      for (const int32_t u : neighbours[v]) mean += mesh.vertices[u];
      const Vec3 p = mesh.vertices[v] +
                     0.5 * (mean / static_cast<double>(neighbours[v].size()) - mesh.vertices[v]);
      const Vec3 g = surface.gradient(p);
      const double d = surface(p), slope = std::max(g.squaredNorm(), 0.25);
      Vec3 move = -d / slope * g;
      if (move.norm() > longest) move *= longest / move.norm();
      next[v] = p + move;
    }
    mesh.vertices.swap(next);
  }
}

SurfaceMesh mesh_of(const BodyShape& shape, const ImplicitSurface& surface, double coarse = 1) {
  SurfaceMesh mesh =
      surface_nets([&](const Vec3& p) { return surface(p); }, grid_of(shape, coarse));
  relax(surface, .01, mesh);
  return mesh;
}

/// The average body's mesh.
struct AverageMesh {
  explicit AverageMesh(double coarse)
      : mesh(mesh_of(shape, shape_surface(shape), coarse)), weights(shape_weights(shape, mesh)) {}
  BodyShape shape;
  SurfaceMesh mesh;
  Weights weights;
};

/// The same on another body: every vertex goes with the joints that carry it, and then to the
/// surface.
SurfaceMesh average_mesh_on(const AverageMesh& average, const BodyShape& shape,
                            const ImplicitSurface& surface) {
  SurfaceMesh mesh = average.mesh;
  const Weights& weights = average.weights;
  const Joints from = shape_joints(average.shape), to = shape_joints(shape);
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    Vec3 move = Vec3::Zero();
    for (size_t j = 0; j < kJoints; ++j)
      move +=
          static_cast<double>(weights(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(j))) *
          (to[j] - from[j]);
    mesh.vertices[v] += move;
  }
  relax(surface, .03, mesh);
  return mesh;
}

RngKey body_key(uint64_t seed, const std::string& split, int index) {
  return RngKey{seed, 0}.fold("builtin.body").fold(split).fold(static_cast<uint64_t>(index));
}

Body body_of(const BodyShape& shape, SurfaceMesh mesh) {
  Body body;
  body.weights = shape_weights(shape, mesh);
  double lo = 1e9, hi = -1e9;
  for (const Vec3& v : mesh.vertices) {
    lo = std::min(lo, v.y());
    hi = std::max(hi, v.y());
  }
  const double scale = shape.height / (hi - lo);
  const auto place = [&](const Vec3& p) { return Vec3(scale * (p - Vec3(0, lo, 0))); };
  for (const Vec3& v : mesh.vertices) body.rest.vertices.push_back(place(v).cast<float>());
  body.rest.faces = std::move(mesh.faces);
  body.joints = shape_joints(shape);
  body.definition = "builtin";
  for (Vec3& j : body.joints) j = place(j);
  return body;
}

}  // namespace

Body builtin_body(uint64_t seed, const std::string& split, int index, bool one_mesh) {
  if (split != "train" && split != "validation" && split != "test")
    throw InputError("builtin bodies", "unknown split \"" + split + "\"",
                     "use train, validation or test");
  if (index < 0)
    throw InputError("builtin bodies", cat("negative body number ", index), "count from 0");
  const BodyShape shape = draw_body_shape(body_key(seed, split, index));
  const ImplicitSurface surface = shape_surface(shape);
  const auto same_mesh = [&] {
    static const AverageMesh average(1);
    return average_mesh_on(average, shape, surface);
  };
  Body body = body_of(shape, one_mesh ? same_mesh() : mesh_of(shape, surface));
  body.id = cat("builtin_", split, "_", index);
  body.split = split;
  return body;
}

Body builtin_average_body() {
  const BodyShape average;
  return body_of(average, mesh_of(average, shape_surface(average)));
}

ShapeSpace builtin_shape_space() {
  constexpr double kCoarse = 0.7;
  const AverageMesh average(kCoarse);
  using Shape = BodyShape;
  constexpr std::pair<double Shape::*, double> kSteps[] = {
      {&Shape::height, .08},    {&Shape::sex, .3},    {&Shape::fat, .35},  {&Shape::muscle, .25},
      {&Shape::legs, .05},      {&Shape::arms, .05},  {&Shape::hips, .07}, {&Shape::head, .05},
      {&Shape::shoulders, .07}, {&Shape::hands, .05}, {&Shape::feet, .05}};
  constexpr size_t kDirections = std::size(kSteps);
  ShapeSpace out;
  out.average = body_of(average.shape, average.mesh);
  out.vertices.resize(kDirections);
  out.joints.resize(kDirections);
  parallel_for(kDirections, 1, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      const auto stepped = [&](double sign) {
        Shape shape;
        shape.*kSteps[k].first += sign * kSteps[k].second;
        return body_of(shape, average_mesh_on(average, shape, shape_surface(shape)));
      };
      const Body more = stepped(1), less = stepped(-1);
      for (size_t v = 0; v < more.rest.vertices.size(); ++v)
        out.vertices[k].push_back(0.5f * (more.rest.vertices[v] - less.rest.vertices[v]));
      for (size_t j = 0; j < kJoints; ++j)
        out.joints[k][j] = 0.5 * (more.joints[j] - less.joints[j]);
    }
  });
  return out;
}

std::vector<Body> builtin_bodies(uint64_t seed, int train, int validation, int test,
                                 bool one_mesh) {
  if (train < 0 || validation < 0 || test < 0)
    throw InputError("builtin bodies", "a negative count", "ask for 0 or more bodies per split");
  std::vector<Body> out(static_cast<size_t>(train) + validation + test);
  parallel_for(out.size(), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      if (i < train)
        out[i] = builtin_body(seed, "train", static_cast<int>(i), one_mesh);
      else if (i < train + validation)
        out[i] = builtin_body(seed, "validation", static_cast<int>(i - train), one_mesh);
      else
        out[i] = builtin_body(seed, "test", static_cast<int>(i - train - validation), one_mesh);
    }
  });
  return out;
}

Joints builtin_rest_joints() {
  const BodyShape average;
  Joints joints = shape_joints(average);
  for (Vec3& j : joints) j *= average.height;
  return joints;
}

}  // namespace restage
