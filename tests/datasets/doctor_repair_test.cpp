// What the doctor mends, and points that are too far away to be read.
#include <gtest/gtest.h>

#include <fstream>

#include "autograd/base/error.h"
#include "datasets/builtin/bodies.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/readers/precision.h"
#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

const Mesh& somebody() {
  static const Mesh mesh = builtin_body(0, "test", 0).rest;
  return mesh;
}

/// Both as one mesh, `a` first.
Mesh together(Mesh a, const Mesh& b, const Point& by) {
  const auto first = static_cast<int32_t>(a.vertices.size());
  for (const Point& p : b.vertices) a.vertices.push_back(p + by);
  for (const Triangle& f : b.faces) a.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  return a;
}

Mesh plate(float size) {
  return {{{0, 0, 0}, {size, 0, 0}, {size, 0, size}, {0, 0, size}}, {{0, 1, 2}, {0, 2, 3}}};
}

/// Mended where it stands.
Mesh mended_here(const Mesh& mesh) { return mended(mesh, Diagnosis{}); }

TEST(DoctorRepair, ASurfaceAloneStaysAsItIs) {
  const Mesh out = mended_here(somebody());
  EXPECT_EQ(out.vertices, somebody().vertices);
  EXPECT_EQ(out.faces, somebody().faces);
}

TEST(DoctorRepair, WholePiecesThatAreNotThePersonAreLeftOut) {
  const Mesh both = together(plate(0.7f), somebody(), Point(3, 0, 0));
  const Mesh out = mended_here(both);
  EXPECT_EQ(out.faces, somebody().faces) << "in their order, with new numbers";
  ASSERT_EQ(out.vertices.size(), somebody().vertices.size());
  EXPECT_EQ(out.vertices[0], both.vertices[4]);
}

TEST(DoctorRepair, SeamsHoldASurfaceTogetherAndTinyPiecesGoWithTheirPlace) {
  // As exporters write it: every triangle with vertices of its own.
  Mesh soup;
  for (const Triangle& f : somebody().faces)
    for (const int32_t v : f) soup.vertices.push_back(somebody().vertices[static_cast<size_t>(v)]);
  for (int32_t i = 0; i < static_cast<int32_t>(soup.vertices.size()); i += 3)
    soup.faces.push_back({i, i + 1, i + 2});
  EXPECT_EQ(mended_here(soup).faces.size(), soup.faces.size());
  // Too small for a sample of the surface: on the skin it stays, far from it it goes.
  const Point skin = somebody().vertices[10];
  EXPECT_EQ(mended_here(together(somebody(), plate(1e-4f), skin)).faces.size(),
            somebody().faces.size() + 2);
  EXPECT_EQ(mended_here(together(somebody(), plate(1e-4f), Point(2, 1, 2))).faces.size(),
            somebody().faces.size());
}

TEST(DoctorRepair, OfEqualPointsTheFirstStays) {
  Mesh cloud{somebody().vertices, {}};
  cloud.vertices.push_back(cloud.vertices[3]);
  cloud.vertices.insert(cloud.vertices.begin(), cloud.vertices[5]);
  const Mesh out = mended_here(cloud);
  ASSERT_EQ(out.vertices.size(), somebody().vertices.size());
  EXPECT_EQ(out.vertices[0], somebody().vertices[5]);
}

TEST(DoctorRepair, TransformsFollowEachOther) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Similarity first{0.01, turn, Vec3(3, -4, 5)}, then{2, turn.transpose(), Vec3(1, 2, -3)};
  const Vec3 p(7, 8, 9);
  EXPECT_TRUE(then.after(first)(p).isApprox(then(first(p)), 1e-12));
}

TEST(Precision, FarPointsAreRefusedOrReadRelativeToThem) {
  EXPECT_FALSE(is_blurred(somebody().vertices));
  EXPECT_FALSE(is_blurred({}));
  EXPECT_FALSE(is_blurred({Point(5e6f, 0, 0), Point(5e6f, 0, 0)})) << "one place";
  EXPECT_FALSE(is_blurred({Point(5e6f, 0, 0), Point(0, 5e6f, 0)})) << "as large as far";
  EXPECT_TRUE(is_blurred({Point(5e6f, 0, 0), Point(5e6f, 2, 0)}));
  EXPECT_EQ(rounding_step({Point(5e6f, 0, 0)}), 0.5);

  const test::TempDir dir;
  const std::string path = dir / "far.obj";
  std::ofstream(path) << "v 5000000.125 0 1\nv 5000000.25 1.5 1\nv 5000001 0 0.5\n";
  EXPECT_THROW(read_mesh(path), InputError);
  Vec3 origin;
  size_t left_out = 0;
  const Mesh mesh = read_mesh(path, left_out, origin);
  EXPECT_EQ(mesh.vertices[1].x() + origin.x(), 5000000.25);
  EXPECT_EQ(mesh.vertices[1].y() + origin.y(), 1.5);
  write_obj(dir / "near.obj", somebody());
  read_mesh(dir / "near.obj", left_out, origin);
  EXPECT_TRUE(origin.isZero(0));
}

}  // namespace
}  // namespace restage
