// SMPL models of a few dozen vertices: against SMPL's own formula.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "datasets/importers/import.h"
#include "datasets/importers/motions/amass.h"
#include "datasets/schema.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/smpl_support.h"
#include "tests/datasets/wrong_arrays.h"

namespace restage {
namespace {

using namespace test;
using ImportersSmpl = FileTest;

constexpr SmplFamily kFamilies[] = {SmplFamily::smpl, SmplFamily::smplh, SmplFamily::smplx};

TEST_F(ImportersSmpl, ShapesAndJointsAreExact) {
  for (const SmplFamily family : kFamilies) {
    const TinySmpl tiny{family};
    const SmplModel model(dir.write("model.npz", tiny.file()));
    EXPECT_EQ(model.family(), family);
    EXPECT_EQ(model.shapes(), 4u);
    for (const Betas& betas : {Betas{}, Betas{1, -2}, Betas{0.5, 0.25, -1, 3}}) {
      const std::vector<Vec3> expected = tiny.shaped(betas);
      double floor = -expected[0].y();
      for (const Vec3& x : expected) floor = std::max(floor, -x.y());
      const Body body = model.body(betas);
      ASSERT_EQ(body.rest.vertices.size(), tiny.vertices());
      for (size_t v = 0; v < expected.size(); ++v)
        EXPECT_LT((body.rest.vertices[v].cast<double>() - expected[v] - Vec3(0, floor, 0)).norm(),
                  1e-6);
      const Joints joints = model.joints(betas);
      for (size_t j = 0; j < kJoints; ++j) {
        EXPECT_LT((joints[j] - expected[j]).norm(), 1e-12);
        EXPECT_LT((body.joints[j] - expected[j] - Vec3(0, floor, 0)).norm(), 1e-12);
      }
      EXPECT_EQ(body.rest.faces.size(), 2u);
    }
  }
}

TEST_F(ImportersSmpl, HandsJawAndEyesCountForTheirJoints) {
  for (const SmplFamily family : kFamilies) {
    const TinySmpl tiny{family};
    const Body body = SmplModel(dir.write("model.npz", tiny.file())).body({});
    const std::vector<int> parents = tiny.parents();
    for (size_t v = 0; v < tiny.joints(); ++v) {
      int joint = static_cast<int>(v);
      while (joint >= kJoints) joint = parents[static_cast<size_t>(joint)];
      EXPECT_EQ(body.weights(static_cast<Eigen::Index>(v), joint), 1.0f) << v;
    }
    const auto last = static_cast<Eigen::Index>(tiny.vertices() - 1);
    EXPECT_EQ(body.weights(last, 0), 0.25f);
    EXPECT_EQ(body.weights(last, 21), 0.75f);
    EXPECT_NEAR(body.weights.rowwise().sum().maxCoeff(), 1, 1e-6);
  }
}

/// SMPL's equations over all of the model's joints, hands at rest, beside what the body does with
/// the first 22 through a file.
TEST_F(ImportersSmpl, PosedSurfacesAreTheModels) {
  for (const SmplFamily family : kFamilies) {
    const TinySmpl tiny{family};
    ImportOptions options;
    options.betas = {"zeros",
                     dir.write("one.npz", npz({{"betas", npy<double>({4}, {1, -1, 0.5, 2})}}))};
    import_data(dir.write("model.npz", tiny.file()), dir / "bodies.h5", options);
    const std::vector<Body> bodies = read_bodies(dir / "bodies.h5");
    ASSERT_EQ(bodies.size(), 2u);
    EXPECT_EQ(bodies[0].blend_shapes, bodies[1].blend_shapes);  // read and kept once
    const Body& body = bodies[1];

    Pose pose;
    pose.root = Vec3(0.3, 1, -2);
    for (int j = 0; j < kJoints; ++j)
      pose.local[j] = Eigen::AngleAxisd(0.2 + 0.05 * j, Vec3(j % 3 - 1, 1, j % 2).normalized())
                          .toRotationMatrix();
    const std::vector<int> parents = tiny.parents();
    std::vector<Mat3> local(tiny.joints(), Mat3::Identity());
    for (size_t j = 0; j < kJoints; ++j) local[j] = pose.local[j];
    const std::vector<Vec3> rest = tiny.shaped({1, -1, 0.5, 2});
    std::vector<Mat3> turn(tiny.joints());
    std::vector<Vec3> at(tiny.joints());
    for (size_t j = 0; j < tiny.joints(); ++j) {
      const auto p = static_cast<size_t>(std::max(parents[j], 0));
      turn[j] = j == 0 ? local[0] : Mat3(turn[p] * local[j]);
      at[j] = j == 0 ? pose.root : Vec3(at[p] + turn[p] * (rest[j] - rest[p]));
    }
    const Points posed = pose_surface(body, pose);
    double blended = 0;
    for (size_t v = 0; v < tiny.vertices(); ++v) {
      Vec3 bent = rest[v];
      for (int axis = 0; axis < 3; ++axis)
        for (size_t k = 0; k < 9 * (tiny.joints() - 1); ++k)
          bent[axis] += tiny.bend(v, static_cast<size_t>(axis), k) *
                        (local[k / 9 + 1](static_cast<int>(k % 9 / 3), static_cast<int>(k % 3)) -
                         (k % 9 % 4 == 0 ? 1 : 0));
      Vec3 expected = Vec3::Zero();
      for (size_t j = 0; j < tiny.joints(); ++j)
        expected += tiny.weight(v, j) * (at[j] + turn[j] * (bent - rest[j]));
      EXPECT_LT((posed[v].cast<double>() - expected).norm(), 1e-5) << v;
      blended += (bent - rest[v]).norm();
    }
    EXPECT_GT(blended / static_cast<double>(tiny.vertices()), 0.01);
    const std::vector<int32_t> pick = {3, 0};
    EXPECT_EQ(pose_surface(body, pose, &pick)[0], posed[3]);
  }
}

TEST_F(ImportersSmpl, BlendShapesThatDoNotFitAreRefused) {
  const auto import = [&](const std::string& posedirs) {
    import_data(dir.write("m.npz", npz(with(TinySmpl().arrays(), "posedirs", posedirs))),
                dir / "x.h5");
  };
  EXPECT_HAS(error_of([&] { import(doubles({58, 3}, 0)); }), "not [58, 3, 459]");
  EXPECT_HAS(error_of([&] { import(doubles({58, 3, 459}, NAN)); }), "metres");
  import("");
  EXPECT_EQ(read_bodies(dir / "x.h5")[0].blend_shapes, nullptr);
}

TEST_F(ImportersSmpl, ExpressionsAreNoShapes) {
  // A file cut to its shapes has as many as AMASS's people, 16; a whole one has 20 columns.
  const SmplModel cut(dir.write("cut.npz", TinySmpl{SmplFamily::smplx, 16}.file()));
  EXPECT_EQ(cut.shapes(), 16u);
  const TinySmpl tiny{SmplFamily::smplx, 20};
  const SmplModel model(dir.write("model.npz", tiny.file()));
  EXPECT_EQ(model.shapes(), 10u);
  EXPECT_LT((model.joints(Betas(20, 0.5))[5] - tiny.shaped(Betas(10, 0.5))[5]).norm(), 1e-12);
}

TEST_F(ImportersSmpl, WhatIsWrongIsSaid) {
  const WrongArray wrong[] = {
      {"v_template", "", "'v_template'"},
      {"shapedirs", "", "'shapedirs'"},
      {"J_regressor", "", "'J_regressor'"},
      {"weights", "", "'weights'"},
      {"kintree_table", "", "'kintree_table'"},
      {"f", "", "'f'"},
      {"v_template", doubles({58, 3}, NAN), "NaN"},
      {"v_template", doubles({174}, 1), "not [V, 3]"},
      {"v_template", doubles({58, 3}, 1e3), "metres"},
      {"v_template", doubles({58, 3}, 1), "y up"},
      {"shapedirs", doubles({58, 3}, 1), "[58, 3, B]"},
      {"J_regressor", npy_of(npy_header("|O", {}), "x"), "pickle"},
      {"J_regressor", doubles({58, 52}, 1), "not [52, 58]"},
      {"weights", doubles({58, 52}, 0), "no weight"},
      {"weights", doubles({58, 52}, -1), "negative"},
      {"kintree_table", npy<uint32_t>({2, 52}, std::vector<uint32_t>(104, 0)), "another parent"},
      {"kintree_table", npy<uint32_t>({2, 3}, std::vector<uint32_t>(6, 0)), "[2, 52]"},
      {"f", npy<uint32_t>({1, 3}, {0, 1, 58}), "does not exist"}};
  for (const auto& [name, bytes, says] : wrong) {
    const std::string path = dir.write("m.npz", npz(with(TinySmpl().arrays(), name, bytes)));
    EXPECT_HAS(error_of([&] { SmplModel{path}; }), says) << name;
  }
  dir.write("n.npz", npz({{"x", npy<double>({1}, {1})}}));
  EXPECT_HAS(error_of([&] { SmplModel(dir / "n.npz"); }), "(it has 'x')");
  Arrays many;  // all their names do not make the line too long
  for (int i = 0; i < 9; ++i)
    many.emplace_back(std::string(60, static_cast<char>('a' + i)), npy<double>({1}, {1}));
  dir.write("many.npz", npz(many));
  error_of([&] { SmplModel(dir / "many.npz"); });
}

TEST_F(ImportersSmpl, ImportGivesBodies) {
  const TinySmpl tiny;
  const std::string model = dir.write("SMPLH_NEUTRAL.npz", tiny.file());
  ImportOptions options;
  options.betas = {
      "zeros", dir.write("ann.npz", npz({{"betas", npy<double>({4}, {1, 0, -1, 0})}})),
      dir.write("crowd.npy", npy<double>({2, 6}, {1, 2, 3, 4, 5, 6, 0, 0, 0, 0, 0, 1}))};
  options.motion.split = "test";
  const ImportSummary summary = import_data(model, dir / "o.h5", options);
  EXPECT_EQ(summary.bodies, 4u);
  ASSERT_EQ(summary.reports.size(), 3u);
  EXPECT_HAS(summary.reports[2].remarks.at(0), "left out");
  EXPECT_TRUE(verify(dir / "o.h5").empty());
  const std::vector<Body> bodies = read_bodies(dir / "o.h5", "test");
  ASSERT_EQ(bodies.size(), 4u);
  EXPECT_EQ(bodies[0].id, "SMPLH_NEUTRAL_zeros");
  EXPECT_EQ(bodies[1].id, "SMPLH_NEUTRAL_ann");
  EXPECT_EQ(bodies[3].id, "SMPLH_NEUTRAL_crowd_1");
  const std::vector<Vec3> ann = tiny.shaped({1, 0, -1, 0});
  EXPECT_LT((bodies[1].joints[4] - bodies[1].joints[0] - (ann[4] - ann[0])).norm(), 1e-12);
  EXPECT_EQ(bodies[3].rest.vertices, bodies[0].rest.vertices);  // betas beyond the model's
  options.betas = {model};
  EXPECT_HAS(error_of([&] { import_data(model, dir / "p.h5", options); }), "'betas'");
  EXPECT_HAS(error_of([&] { import_data(dir / "ann.npz", dir / "p.h5", options); }), "betas");
}

}  // namespace
}  // namespace restage
