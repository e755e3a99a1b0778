// The built-in bodies: closed human surfaces with smooth weights, functions of a seed.
#include "datasets/builtin/bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/parallel.h"

namespace restage {
namespace {

const std::vector<Body>& some_bodies() {
  static const std::vector<Body> bodies = builtin_bodies(11, 8, 2, 2);
  return bodies;
}

std::map<std::pair<int, int>, int> directed_edges(const Mesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const Triangle& f : mesh.faces)
    for (int k = 0; k < 3; ++k) ++edges[{f[k], f[(k + 1) % 3]}];
  return edges;
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& f : mesh.faces) {
    const Vec3 a = mesh.vertices[f[0]].cast<double>(), b = mesh.vertices[f[1]].cast<double>();
    sum += a.dot(b.cross(mesh.vertices[f[2]].cast<double>())) / 6;
  }
  return sum;
}

// How often the surface winds around a point: 1 inside, 0 outside (sum of solid angles).
double winding(const Mesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const Triangle& f : mesh.faces) {
    const Vec3 a = mesh.vertices[f[0]].cast<double>() - p,
               b = mesh.vertices[f[1]].cast<double>() - p;
    const Vec3 c = mesh.vertices[f[2]].cast<double>() - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * 3.14159265358979323846);
}

bool same(const Body& a, const Body& b) {
  return a.id == b.id && a.rest.vertices == b.rest.vertices && a.rest.faces == b.rest.faces &&
         a.joints == b.joints && a.weights == b.weights;
}

TEST(BuiltinBodies, SurfaceIsOneClosedOrientedSphere) {
  for (const Body& body : some_bodies()) {
    const auto edges = directed_edges(body.rest);
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1) << body.id;
      ASSERT_EQ(edges.count({edge.second, edge.first}), 1u) << body.id;
    }
    const auto v = static_cast<long>(body.rest.vertices.size());
    const auto f = static_cast<long>(body.rest.faces.size());
    EXPECT_EQ(v - 3 * f / 2 + f, 2) << body.id;
    std::vector<int> part(body.rest.vertices.size());  // union of edges
    for (size_t i = 0; i < part.size(); ++i) part[i] = static_cast<int>(i);
    const auto root = [&](int i) {
      while (part[i] != i) i = part[i] = part[part[i]];
      return i;
    };
    for (const auto& [edge, count] : edges) part[root(edge.first)] = root(edge.second);
    for (size_t i = 0; i < part.size(); ++i)
      ASSERT_EQ(root(static_cast<int>(i)), root(0)) << body.id;
  }
}

TEST(BuiltinBodies, SizesAreHuman) {
  for (const Body& body : some_bodies()) {
    EXPECT_GE(body.rest.vertices.size(), 4000u);
    EXPECT_LE(body.rest.vertices.size(), 7500u);
    float lo = 1e9f, hi = -1e9f;
    for (const Point& p : body.rest.vertices) {
      ASSERT_TRUE(p.allFinite());
      lo = std::min(lo, p.y());
      hi = std::max(hi, p.y());
    }
    EXPECT_NEAR(lo, 0, 1e-6);
    EXPECT_GE(hi, 1.449);
    EXPECT_LE(hi, 2.001);
    const double litres = 1000 * volume(body.rest) / std::pow(hi / 1.7, 3);
    EXPECT_GT(litres, 35) << body.id;  // 0.035 m^3 is 35 kg at 1.70 m
    EXPECT_LT(litres, 130) << body.id;
  }
}

TEST(BuiltinBodies, JointsLieInsideAndMirror) {
  for (const size_t i : {0, 3, 8, 11}) {
    const Body& body = some_bodies()[i];
    for (int j = 0; j < kJoints; ++j) {
      EXPECT_NEAR(winding(body.rest, body.joints[j]), 1, 1e-3) << body.id << " joint " << j;
      const Vec3 mirrored = body.joints[kMirror[j]].cwiseProduct(Vec3(-1, 1, 1));
      EXPECT_LT((body.joints[j] - mirrored).norm(), 1e-12);
    }
    // T-pose: left is +x, arms level, the feet point forward.
    EXPECT_GT(body.joints[20].x(), body.joints[18].x());
    EXPECT_GT(body.joints[18].x(), body.joints[16].x());
    EXPECT_NEAR(body.joints[20].y(), body.joints[16].y(), 1e-9);
    EXPECT_GT(body.joints[10].z(), body.joints[7].z() + 0.05);
    // Outside: between the legs, beside the chest under the arm.
    const double knee = body.joints[4].y();
    EXPECT_NEAR(winding(body.rest, {0, knee, 0}), 0, 1e-3);
    EXPECT_NEAR(winding(body.rest, {body.joints[18].x(), body.joints[9].y(), 0}), 0, 1e-3);
  }
}

TEST(BuiltinBodies, TheNoseShowsTheFace) {
  for (const Body& body : some_bodies()) {
    Point front(0, 0, -1);
    for (const Point& p : body.rest.vertices)
      if (p.y() > body.joints[15].y() && p.z() > front.z()) front = p;
    EXPECT_LT(std::abs(front.x()), 0.012) << body.id;
    EXPECT_GT(front.z(), body.joints[15].z() + 0.09) << body.id;
  }
}

TEST(BuiltinBodies, WeightsAreSmoothAndSumToOne) {
  for (const Body& body : some_bodies()) {
    ASSERT_EQ(static_cast<size_t>(body.weights.rows()), body.rest.vertices.size());
    for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
      EXPECT_NEAR(body.weights.row(v).sum(), 1, 1e-5);
      EXPECT_GE(body.weights.row(v).minCoeff(), 0);
      EXPECT_LE((body.weights.row(v).array() > 0).count(), 4);
    }
    float roughest = 0;
    for (const Triangle& f : body.rest.faces)
      for (int k = 0; k < 3; ++k)
        roughest = std::max(
            roughest,
            (body.weights.row(f[k]) - body.weights.row(f[(k + 1) % 3])).lpNorm<Eigen::Infinity>());
    EXPECT_LT(roughest, 0.45f) << body.id;
    for (int j = 0; j < kJoints; ++j)
      EXPECT_GT(body.weights.col(j).maxCoeff(), 0.6f) << body.id << " joint " << j;
  }
}

TEST(BuiltinBodies, NothingBleedsAcrossSides) {
  for (const Body& body : some_bodies())
    for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
      const Point& p = body.rest.vertices[v];
      const auto w = body.weights.row(static_cast<Eigen::Index>(v));
      if (p.x() > 0.03f) {
        const float other = w[2] + w[5] + w[8] + w[11] + w[14] + w[17] + w[19] + w[21];
        EXPECT_LT(other, 0.05f) << body.id << " at " << p.transpose();
      }
      if (p.y() < body.joints[4].y()) {
        EXPECT_LT(w[0] + w[3], 0.01f);
      }
      if (p.y() < body.joints[6].y()) {
        EXPECT_LT(w[16] + w[17] + w[18] + w[19], 0.01f);
      }
    }
}

TEST(BuiltinBodies, AreFunctionsOfSeedSplitAndNumber) {
  const std::vector<Body>& bodies = some_bodies();
  EXPECT_TRUE(same(bodies[3], builtin_body(11, "train", 3)));
  EXPECT_TRUE(same(bodies[9], builtin_body(11, "validation", 1)));
  EXPECT_TRUE(same(bodies[10], builtin_body(11, "test", 0)));
  EXPECT_NE(bodies[0].rest.vertices, builtin_body(12, "train", 0).rest.vertices);
  std::set<std::string> ids;
  std::set<double> heads;
  for (const Body& body : bodies) {
    ids.insert(body.id);
    heads.insert(body.joints[15].y());
  }
  EXPECT_EQ(ids.size(), bodies.size());
  EXPECT_EQ(heads.size(), bodies.size());
}

TEST(BuiltinBodies, ThreadsDoNotChangeBits) {
  const int before = threads();
  set_threads(1);
  const std::vector<Body> one = builtin_bodies(5, 2, 0, 1);
  set_threads(3);
  const std::vector<Body> three = builtin_bodies(5, 2, 0, 1);
  set_threads(before);
  for (size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(same(one[i], three[i]));
}

TEST(BuiltinBodies, RefuseBadRequests) {
  EXPECT_THROW(builtin_body(1, "exam", 0), InputError);
  EXPECT_THROW(builtin_body(1, "train", -1), InputError);
  EXPECT_THROW(builtin_bodies(1, -1, 0, 0), InputError);
  EXPECT_TRUE(builtin_bodies(1, 0, 0, 0).empty());
}

}  // namespace
}  // namespace restage
