#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/shape_space.h"
#include "datasets/sampling/surface.h"
#include "infer/track/journal.h"
#include "infer/track/surface_distance.h"
#include "infer/track/template_fit.h"
#include "infer/track/texture_fit.h"

namespace restage {
namespace {

/// Five people of one mesh about a sixth.
const ShapeSpace& small_space() {
  static const ShapeSpace made = [] {
    ShapeSpace out;
    out.average = builtin_body(3, "train", 0, true);
    for (int k = 1; k < 6; ++k) {
      const Body other = builtin_body(3, "train", k, true);
      Points& vertices = out.vertices.emplace_back();
      for (size_t v = 0; v < other.rest.vertices.size(); ++v)
        vertices.push_back(0.5f * (other.rest.vertices[v] - out.average.rest.vertices[v]));
      Joints& joints = out.joints.emplace_back();
      for (size_t j = 0; j < joints.size(); ++j)
        joints[j] = 0.5 * (other.joints[j] - out.average.joints[j]);
    }
    return out;
  }();
  return made;
}

const std::vector<double> kShape = {0.7, -0.4, 0.3, 0.2, -0.3};

Vec3 belly_of(const Body& body) { return body.joints[kSpine2] + Vec3(0, 0, 0.1); }

/// Somebody of the space with a belly that stands out by 4 cm, as no one of the space has it.
Body dressed_one() {
  Body out = small_space().at(kShape);
  const Vec3 belly = belly_of(out);
  for (Point& p : out.rest.vertices) {
    const double away = (p.cast<double>() - belly).norm();
    p.z() += static_cast<float>(0.04 * std::exp(-away * away / (2 * 0.08 * 0.08)));
  }
  return out;
}

Mat3 by(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

TemplateView view_of(const Body& body, int number) {
  const double t = 0.3 * number;
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.local[kPelvis] = by(t, Vec3::UnitY());
  pose.local[kLeftShoulder] = by(-1.1 + t, Vec3::UnitZ());
  pose.local[kRightShoulder] = by(1.0 - t, Vec3::UnitZ());
  pose.local[kLeftHip] = by(-0.3 * t, Vec3::UnitX());
  pose.root = body.joints[kPelvis] + Vec3(t, 0, 0.1);
  TemplateView out;
  const SurfaceSamples drawn =
      SurfaceSampler(body).draw(RngKey{70, 0}.fold(uint64_t(number)), 8000);
  out.cloud = drawn.on_pose(body, pose);
  add_noise(RngKey{71, 0}.fold(uint64_t(number)), 0.002, out.cloud);
  out.source = "view";
  out.seen = forward_kinematics(body.joints, pose).joints;
  out.pose = pose;
  for (size_t j = 1; j < kJoints; ++j)
    out.pose.local[j] = by(0.05, Vec3(std::sin(j), std::cos(j), 0.3).normalized()) * pose.local[j];
  return out;
}

/// Of points of the whole surface, or of those within `around` of the belly.
MiddleAndMost distance_at_rest(const Body& from, const Body& to, double around = 9) {
  const Points drawn = SurfaceSampler(from).draw(RngKey{9, 0}, 20000).on_rest(from);
  std::vector<Vec3> points, vertices;
  // Where the floor is says nothing of the shape.
  const Vec3 apart = to.joints[kPelvis] - from.joints[kPelvis];
  for (const Point& p : drawn)
    if ((p.cast<double>() - belly_of(from)).norm() < around)
      points.push_back(p.cast<double>() + apart);
  for (const Point& p : to.rest.vertices) vertices.push_back(p.cast<double>());
  return middle_and_most(SurfaceDistance(to.rest)(points, vertices));
}

TEST(TrackTemplate, FindsTheShapeAndWhatTheShapesLack) {
  const Body person = dressed_one();
  std::vector<TemplateView> views;
  for (int k = 0; k < 5; ++k) views.push_back(view_of(person, k));
  int rounds = 0;
  const Body found =
      fit_template(small_space(), views, "scans", [&](const std::string&) { ++rounds; });
  EXPECT_EQ(rounds, 10);
  const MiddleAndMost whole = distance_at_rest(person, found),
                      belly = distance_at_rest(person, found, 0.1);
  const Body naked = small_space().at(kShape);
  EXPECT_LT(whole.median, 0.003);
  EXPECT_LT(whole.p95, 0.010);
  EXPECT_LT(3 * whole.median, distance_at_rest(person, small_space().average).median);
  // Offsets are held back, so something of the belly is missing.
  EXPECT_LT(belly.median, 0.6 * distance_at_rest(person, naked, 0.1).median);
  EXPECT_EQ(found.rest.faces, small_space().average.rest.faces);
  EXPECT_THROW(fit_template(small_space(), {}, "scans", [](const std::string&) {}), InputError);
}

TEST(TrackTemplate, OurSpaceIsClosedAndFine) {
  const ShapeSpace space = builtin_shape_space();
  EXPECT_GE(space.average.rest.vertices.size(), 8000u);
  EXPECT_LE(space.average.rest.vertices.size(), 15000u);
  std::map<std::array<int32_t, 2>, int> edges;
  for (const Triangle& f : space.average.rest.faces)
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(++edges[(std::array<int32_t, 2>{f[k], f[(k + 1) % 3]})], 1);
    }
  for (const auto& [edge, count] : edges)
    EXPECT_EQ(edges.count({edge[1], edge[0]}), 1u) << edge[0] << " " << edge[1];
  std::vector<double> taller(space.size(), 0.0);
  taller[0] = 1;
  const auto top = [](const Body& body) {
    float out = 0;
    for (const Point& p : body.rest.vertices) out = std::max(out, p.y());
    return double{out};
  };
  EXPECT_NEAR(top(space.at(taller)) - top(space.average), 0.08, 0.01);
}

TEST(TrackAtlas, NoTexelBelongsToTwoFaces) {
  constexpr int kSize = 512;
  const Mesh mesh = builtin_body(1, "test", 0).rest;
  const Atlas atlas = make_atlas(mesh, {}, kSize);
  ASSERT_EQ(atlas.corners.size(), mesh.faces.size());
  for (const Eigen::Vector2f& p : atlas.places) {
    EXPECT_TRUE((p.array() >= 0).all() && (p.array() <= 1).all());
  }
  std::vector<int> claims(kSize * kSize, 0);
  size_t covered = 0;
  for (const auto& corners : atlas.corners) {
    std::array<Eigen::Vector2d, 3> at;
    for (size_t k = 0; k < 3; ++k)
      at[k] = kSize * atlas.places[static_cast<size_t>(corners[k])].cast<double>();
    const auto side = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                         const Eigen::Vector2d& p) {
      return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
    };
    const double area = side(at[0], at[1], at[2]);
    EXPECT_GT(area, -1e-3) << "a face is mirrored";
    const Eigen::Vector2d low = at[0].cwiseMin(at[1]).cwiseMin(at[2]),
                          high = at[0].cwiseMax(at[1]).cwiseMax(at[2]);
    for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y)
      for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x) {
        const Eigen::Vector2d p(x + 0.5, y + 0.5);
        if (std::min({side(at[0], at[1], p), side(at[1], at[2], p), side(at[2], at[0], p)}) < 1e-3)
          continue;
        ++claims[static_cast<size_t>(y) * kSize + static_cast<size_t>(x)];
        ++covered;
      }
  }
  EXPECT_EQ(std::count_if(claims.begin(), claims.end(), [](int n) { return n > 1; }), 0);
  EXPECT_GT(covered, claims.size() / 8);  // of few and small charts the margins take much
  size_t drawn = 0;
  for (const int32_t f : atlas_faces(atlas, kSize)) drawn += f >= 0;
  EXPECT_NEAR(static_cast<double>(drawn), static_cast<double>(covered), 0.01 * kSize * kSize);
}

PointColour colour_at(const Point& p) {
  return {0.5f + 0.4f * std::sin(3 * p.x()), 0.5f + 0.4f * std::cos(4 * p.y()), 0.3f};
}

TEST(TrackTexture, ColoursAreTheMedianAndHolesTakeWhatIsBeside) {
  constexpr int kSize = 256;
  const Body body = builtin_body(1, "test", 0);
  const Atlas atlas = make_atlas(body.rest, {}, kSize);
  TextureFit fit(body.rest, atlas, kSize);
  std::vector<Vec3> vertices;
  for (const Point& p : body.rest.vertices) vertices.push_back(p.cast<double>());
  EXPECT_EQ(fit.seen(), 0);
  const float waist = static_cast<float>(body.joints[kPelvis].y());
  for (int view = 0; view < 3; ++view) {
    std::vector<Vec3> points;
    std::vector<PointColour> colours;
    const Points drawn =
        SurfaceSampler(body).draw(RngKey{5, 0}.fold(uint64_t(view)), 40000).on_rest(body);
    for (const Point& p : drawn) {
      if (std::abs(p.y() - waist) < 0.03f) continue;  // a belt that nobody sees
      points.push_back(p.cast<double>());
      // One of three clouds has a wrong colour everywhere.
      colours.push_back(view == 1 ? PointColour{1, 1, 1} : colour_at(p));
    }
    fit.add(vertices, points, colours);
  }
  EXPECT_GT(fit.seen(), 0.85);
  EXPECT_LT(fit.seen(), 0.99);
  const Image picture = fit.picture();
  const std::vector<int32_t> faces = atlas_faces(atlas, kSize);
  std::vector<double> off;
  for (size_t at = 0; at < faces.size(); ++at) {
    if (faces[at] < 0) continue;
    const Triangle& f = body.rest.faces[static_cast<size_t>(faces[at])];
    Point middle = Point::Zero();
    for (const int32_t v : f) middle += body.rest.vertices[static_cast<size_t>(v)] / 3;
    const PointColour wanted = colour_at(middle);
    for (size_t c = 0; c < 3; ++c)
      off.push_back(std::abs(static_cast<double>(picture.rgb[3 * at + c]) / 255 -
                             static_cast<double>(wanted[c])));
  }
  const MiddleAndMost error = middle_and_most(off);
  EXPECT_LT(error.median, 0.02);
  EXPECT_LT(error.p95, 0.10);
}

TEST(TrackJournal, KeepsWhatItWasToldToKeep) {
  const std::string folder = ::testing::TempDir() + "/track_journal";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  JournalFrame frame;
  frame.pose.local.fill(by(0.3, Vec3::UnitX()));
  frame.pose.root = Vec3(1, 2, 3);
  frame.confidence = 0.25;
  frame.points = {{1, 2, 3}, {4, 5, 6}};
  {
    TrackJournal journal(folder, 2);
    EXPECT_EQ(journal.frames(), 0);
    journal.append(frame);
    frame.filled = true;
    frame.distance = MiddleAndMost{0.001, 0.004};
    frame.confidence.reset();
    journal.append(frame);
    journal.keep("state");
    journal.append(frame);  // is lost with the process
  }
  TrackJournal again(folder, 2);
  EXPECT_EQ(again.frames(), 2);
  EXPECT_EQ(again.state(), "state");
  const JournalFrame first = again.read(0), second = again.read(1);
  EXPECT_EQ(first.confidence, 0.25);
  EXPECT_FALSE(first.filled || first.distance || second.confidence);
  EXPECT_TRUE(second.filled);
  ASSERT_TRUE(second.distance);
  EXPECT_EQ(second.distance->p95, 0.004);
  EXPECT_EQ(second.points, frame.points);
  EXPECT_EQ(second.pose.local[4], frame.pose.local[4]);
  EXPECT_EQ(second.pose.root, frame.pose.root);
  EXPECT_THROW(TrackJournal(folder, 200), InputError);  // of a larger mesh
}

}  // namespace
}  // namespace restage
