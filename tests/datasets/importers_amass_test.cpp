// SMPL models and AMASS motions, on models of a few dozen vertices: against SMPL's own formula.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "datasets/importers/amass.h"
#include "datasets/importers/import.h"
#include "datasets/schema.h"
#include "tests/datasets/schema_support.h"
#include "tests/datasets/smpl_support.h"

namespace restage {
namespace {

using test::error_of;
using test::npy;
using test::npz;
using test::TempDir;
using test::TinyClip;
using test::TinySmpl;
using test::write_bytes;

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

constexpr SmplFamily kFamilies[] = {SmplFamily::smpl, SmplFamily::smplh, SmplFamily::smplx};

std::string fact(const ImportReport& report, const std::string& name) {
  for (const auto& [key, value] : report.facts)
    if (key == name) return value;
  return "";
}

template <class Arrays>
void replace(Arrays& arrays, const std::string& name, const std::string& bytes) {
  for (auto& [key, value] : arrays)
    if (key == name) value = bytes;
}

template <class Arrays>
void remove(Arrays& arrays, const std::string& name) {
  std::erase_if(arrays, [&](const auto& array) { return array.first == name; });
}

// ---- models ------------------------------------------------------------------------------------

TEST(ImportersSmpl, ShapesAndJointsAreExact) {
  const TempDir dir;
  for (const SmplFamily family : kFamilies) {
    TinySmpl tiny;
    tiny.family = family;
    write_bytes(dir / "model.npz", tiny.file());
    const SmplModel model(dir / "model.npz");
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

TEST(ImportersSmpl, HandsJawAndEyesCountForTheirJoints) {
  const TempDir dir;
  for (const SmplFamily family : kFamilies) {
    TinySmpl tiny;
    tiny.family = family;
    write_bytes(dir / "model.npz", tiny.file());
    const Body body = SmplModel(dir / "model.npz").body({});
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
TEST(ImportersSmpl, PosedSurfacesAreTheModels) {
  const TempDir dir;
  for (const SmplFamily family : kFamilies) {
    TinySmpl tiny;
    tiny.family = family;
    write_bytes(dir / "model.npz", tiny.file());
    ImportOptions options;
    options.betas = {"zeros", dir / "one.npz"};
    write_bytes(dir / "one.npz", npz({{"betas", npy<double>({4}, {1, -1, 0.5, 2})}}));
    import_data(dir / "model.npz", dir / "bodies.h5", options);
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

TEST(ImportersSmpl, BlendShapesThatDoNotFitAreRefused) {
  const TempDir dir;
  const auto refused = [&](const std::string& bytes) {
    auto arrays = TinySmpl().arrays();
    replace(arrays, "posedirs", bytes);
    write_bytes(dir / "m.npz", npz(arrays));
    return error_of([&] { import_data(dir / "m.npz", dir / "x.h5"); });
  };
  EXPECT_HAS(refused(npy<double>({58, 3}, std::vector<double>(174, 0))), "not [58, 3, 459]");
  EXPECT_HAS(refused(npy<float>({58, 3, 459}, std::vector<float>(58 * 3 * 459, NAN))), "metres");
  auto arrays = TinySmpl().arrays();
  remove(arrays, "posedirs");
  write_bytes(dir / "m.npz", npz(arrays));
  import_data(dir / "m.npz", dir / "x.h5");
  EXPECT_EQ(read_bodies(dir / "x.h5")[0].blend_shapes, nullptr);
}

TEST(ImportersSmpl, ExpressionsAreNoShapes) {
  const TempDir dir;
  TinySmpl tiny;
  tiny.family = SmplFamily::smplx;
  tiny.shapes = 16;  // cut to its shapes, as many as AMASS's people have
  write_bytes(dir / "model.npz", tiny.file());
  EXPECT_EQ(SmplModel(dir / "model.npz").shapes(), 16u);
  tiny.shapes = 20;
  write_bytes(dir / "model.npz", tiny.file());
  const SmplModel model(dir / "model.npz");
  EXPECT_EQ(model.shapes(), 10u);
  Betas many(20, 0.5);
  EXPECT_LT((model.joints(many)[5] - tiny.shaped(Betas(10, 0.5))[5]).norm(), 1e-12);
}

TEST(ImportersSmpl, WhatIsWrongIsSaid) {
  const TempDir dir;
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    auto arrays = TinySmpl().arrays();
    if (bytes.empty())
      remove(arrays, name);
    else
      replace(arrays, name, bytes);
    write_bytes(dir / "m.npz", npz(arrays));
    return error_of([&] { SmplModel(dir / "m.npz"); });
  };
  const std::vector<double> ones(52 * 58, 1.0), nan(58 * 3, NAN);
  for (const char* name :
       {"v_template", "shapedirs", "J_regressor", "weights", "kintree_table", "f"})
    EXPECT_HAS(refused(name, ""), std::string("'") + name + "'");
  EXPECT_HAS(refused("v_template", npy<double>({58, 3}, nan)), "NaN");
  EXPECT_HAS(refused("v_template", npy<double>({174}, std::vector<double>(174, 1))), "not [V, 3]");
  EXPECT_HAS(refused("v_template", npy<double>({58, 3}, std::vector<double>(174, 1e3))), "metres");
  EXPECT_HAS(refused("v_template", npy<double>({58, 3}, std::vector<double>(174, 1))), "y up");
  EXPECT_HAS(refused("shapedirs", npy<double>({58, 3}, std::vector<double>(174, 1))), "[58, 3, B]");
  EXPECT_HAS(refused("J_regressor", test::npy_of(test::npy_header("|O", {}), "x")), "pickle");
  EXPECT_HAS(refused("J_regressor", npy<double>({58, 52}, ones)), "not [52, 58]");
  EXPECT_HAS(refused("weights", npy<double>({58, 52}, std::vector<double>(58 * 52, 0))),
             "no weight");
  EXPECT_HAS(refused("weights", npy<double>({58, 52}, std::vector<double>(58 * 52, -1))),
             "negative");
  EXPECT_HAS(refused("kintree_table", npy<uint32_t>({2, 52}, std::vector<uint32_t>(104, 0))),
             "another parent");
  EXPECT_HAS(refused("kintree_table", npy<uint32_t>({2, 3}, std::vector<uint32_t>(6, 0))),
             "[2, 52]");
  EXPECT_HAS(refused("f", npy<uint32_t>({1, 3}, {0, 1, 58})), "does not exist");
  write_bytes(dir / "n.npz", npz({{"x", npy<double>({1}, {1})}}));
  EXPECT_HAS(error_of([&] { SmplModel(dir / "n.npz"); }), "(it has 'x')");
}

// ---- motions -----------------------------------------------------------------------------------

/// SMPL's own formula in the file's world, z up: where joint j is at time t.
Joints smpl_joints(const TinyClip& clip, const TinySmpl& model, double t) {
  const std::vector<Vec3> shaped = model.shaped(clip.betas);
  Joints rest, out;
  std::copy_n(shaped.begin(), kJoints, rest.begin());
  Rotations global;
  for (size_t j = 0; j < kJoints; ++j) {
    const Vec3 a = clip.turn(static_cast<int>(j), t);
    const Mat3 local = j == 0 ? clip.root(t)
                              : Eigen::AngleAxisd(a.norm(), a.norm() > 0 ? Vec3(a.normalized())
                                                                         : Vec3(Vec3::UnitX()))
                                    .toRotationMatrix();
    if (j == 0) {
      global[0] = local;
      out[0] = rest[0] + clip.trans(t);
      continue;
    }
    const auto p = static_cast<size_t>(kParents[j]);
    global[j] = global[p] * local;
    out[j] = out[p] + global[p] * (rest[j] - rest[p]);
  }
  return out;
}

/// The same from an imported motion.
Joints motion_joints(const Motion& motion, size_t frame) {
  Pose pose;
  Rotations global;
  for (size_t j = 0; j < kJoints; ++j)
    global[j] = motion.global[frame][j].cast<double>().toRotationMatrix();
  pose.local = to_local(global);
  Joints out = forward_kinematics(motion.rest, pose).joints;
  const Vec3 move = motion.hips[frame].cast<double>() - 0.5 * (out[1] + out[2]);
  for (Vec3& x : out) x += move;
  return out;
}

TEST(ImportersAmass, BothLayoutsEqualTheModelsFormulaAt30Fps) {
  const TempDir dir;
  for (const SmplFamily family : {SmplFamily::smplh, SmplFamily::smplx})
    for (const double fps : {120.0, 60.0, 100.0, 30.0}) {
      TinySmpl tiny;
      tiny.family = family;
      write_bytes(dir / "model.npz", tiny.file());
      TinyClip clip;
      clip.family = family;
      clip.fps = fps;
      clip.frames = static_cast<int64_t>(fps) + 1;
      clip.type = family == SmplFamily::smplx;
      clip.rate_key = clip.type ? "mocap_frame_rate" : "mocap_framerate";
      write_bytes(dir / "walk_poses.npz", clip.file());
      BodyModels models(dir / "model.npz");
      AmassOptions options;
      options.id = "walk";
      options.subject = "ann";
      options.split = "test";
      ImportReport report;
      const Motion motion = import_amass(Npz(dir / "walk_poses.npz"), models, options, report);
      EXPECT_EQ(motion.id, "walk");
      EXPECT_EQ(motion.subject, "ann");
      EXPECT_EQ(motion.split, "test");
      ASSERT_EQ(motion.frames(), 31u) << fps;
      EXPECT_LT(motion.rest[0].norm(), 1e-12);
      // The same up to one height: the clip's floor goes to 0.
      double floor = 0;
      for (size_t f = 0; f < motion.frames(); ++f) {
        const Joints wanted = smpl_joints(clip, tiny, static_cast<double>(f) / kFps);
        const Joints got = motion_joints(motion, f);
        if (f == 0) floor = wanted[0].z() - got[0].y();
        for (size_t j = 0; j < kJoints; ++j) {
          const Vec3 y_up(wanted[j].x(), wanted[j].z() - floor, -wanted[j].y());
          EXPECT_LT((got[j] - y_up).norm(), 2e-6) << fps << " " << f << " " << j;
        }
      }
      EXPECT_HAS(fact(report, "layout"), to_string(family));
      EXPECT_HAS(fact(report, "rate"), clip.rate_key);
      EXPECT_HAS(fact(report, "rate"), fps == 30 ? "kept" : "30 fps, 31 frames");
      EXPECT_HAS(fact(report, "gender"), "female");
      EXPECT_HAS(fact(report, "body model"), "4 of 4 betas");
      EXPECT_TRUE(report.remarks.empty()) << report.remarks[0];
    }
}

TEST(ImportersAmass, AGenderThatIsAPythonObjectIsNotStated) {
  const TempDir dir;
  write_bytes(dir / "neutral.npz", TinySmpl().file());
  BodyModels models(dir / "neutral.npz");
  auto arrays = TinyClip().arrays();
  for (auto& [name, bytes] : arrays)
    if (name == "gender") bytes = test::npy_of(test::npy_header("|O", {}), "a pickle");
  write_bytes(dir / "clip.npz", npz(arrays));
  ImportReport report;
  import_amass(Npz(dir / "clip.npz"), models, {}, report);
  EXPECT_HAS(fact(report, "gender"), "not stated");
  ASSERT_EQ(report.remarks.size(), 1u);
  EXPECT_HAS(report.remarks[0], "gender counts as not stated");
}

TEST(ImportersAmass, OptionsOverrideAndDoubtsAreRemarked) {
  const TempDir dir;
  write_bytes(dir / "male.npz", TinySmpl().file());
  TinyClip clip;
  clip.fps = 59.99;
  clip.betas.resize(16, 0);
  write_bytes(dir / "a.npz", clip.file());
  BodyModels models(dir / "male.npz");
  const auto import = [&](const AmassOptions& options) {
    ImportReport report;
    const Motion motion = import_amass(Npz(dir / "a.npz"), models, options, report);
    return std::pair(motion.frames(), report);
  };
  EXPECT_EQ(import({}).first, 61u);  // 59.99 means 60
  AmassOptions other;
  other.up = Axis::y;
  other.fps = 30;
  const auto [frames, report] = import(other);
  EXPECT_EQ(frames, 121u);
  EXPECT_HAS(fact(report, "body model"), "4 of 16 betas");
  EXPECT_HAS(fact(report, "up"), "--up");
  ASSERT_EQ(report.remarks.size(), 2u);
  EXPECT_HAS(report.remarks[0], "fitted with a female body");
  EXPECT_HAS(report.remarks[1], "not upright");
}

TEST(ImportersAmass, TheModelIsFoundByFamilyAndGender) {
  const TempDir dir;
  const auto folder = [&](const std::string& name) {
    std::filesystem::create_directories(dir / name);
    return dir / name;
  };
  TinySmpl h, x;
  x.family = SmplFamily::smplx;
  write_bytes(folder("models/smplh/female") + "/model.npz", h.file());
  write_bytes(folder("models/smplh/male") + "/model.npz", h.file());
  write_bytes(folder("models/smplx") + "/SMPLX_NEUTRAL.npz", x.file());
  write_bytes(folder("models/dmpls/male") + "/model.npz", npz({{"x", npy<double>({1}, {1})}}));
  BodyModels models(dir / "models");
  std::vector<std::string> remarks;
  EXPECT_EQ(models.find(SmplFamily::smplh, "female", "c", remarks).path(),
            dir / "models/smplh/female/model.npz");
  EXPECT_EQ(models.find(SmplFamily::smplh, "male", "c", remarks).path(),
            dir / "models/smplh/male/model.npz");
  EXPECT_EQ(models.find(SmplFamily::smplx, "neutral", "c", remarks).family(), SmplFamily::smplx);
  EXPECT_EQ(models.find(SmplFamily::smplx, "", "c", remarks).family(), SmplFamily::smplx);
  EXPECT_TRUE(remarks.empty());
  EXPECT_HAS(error_of([&] { models.find(SmplFamily::smplh, "neutral", "c", remarks); }),
             "neutral body, whose model");
  BodyModels one(dir / "models/smplx/SMPLX_NEUTRAL.npz");
  EXPECT_HAS(error_of([&] { one.find(SmplFamily::smplh, "male", "c", remarks); }), "--body-model");
  TinySmpl plain;
  plain.family = SmplFamily::smpl;
  write_bytes(dir / "plain.npz", plain.file());
  BodyModels stand_in(dir / "plain.npz");
  EXPECT_EQ(stand_in.find(SmplFamily::smplh, "male", "c", remarks).family(), SmplFamily::smpl);
  EXPECT_EQ(remarks.size(), 1u);
  EXPECT_HAS(error_of([&] { BodyModels(dir / "models/dmpls"); }), "holds no SMPL");
  EXPECT_HAS(error_of([&] { BodyModels(dir / "models/dmpls/male/model.npz"); }),
             "is no body model");
  EXPECT_HAS(error_of([&] { BodyModels(dir / "nothing.npz"); }), "cannot be read");
}

TEST(ImportersAmass, WhatIsWrongIsSaid) {
  const TempDir dir;
  write_bytes(dir / "model.npz", TinySmpl().file());
  BodyModels models(dir / "model.npz");
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    auto arrays = TinyClip().arrays();
    if (bytes.empty())
      remove(arrays, name);
    else
      replace(arrays, name, bytes);
    write_bytes(dir / "c.npz", npz(arrays));
    ImportReport report;
    return error_of([&] { import_amass(Npz(dir / "c.npz"), models, {}, report); });
  };
  EXPECT_HAS(refused("mocap_framerate", ""), "--fps");
  EXPECT_HAS(refused("mocap_framerate", npy<double>({}, {0})), "no frame rate");
  EXPECT_HAS(refused("mocap_framerate", test::npy_text("fast")), "no frame rate");
  EXPECT_HAS(refused("poses", npy<double>({1, 72}, std::vector<double>(72, 0))), "[1, 72]");
  EXPECT_HAS(refused("poses", npy<double>({156}, std::vector<double>(156, 0))), "[156]");
  EXPECT_HAS(refused("poses", npy<double>({0, 156}, {})), "0 frames");
  EXPECT_HAS(refused("poses", npy<double>({121, 156}, std::vector<double>(121 * 156, NAN))),
             "finite");
  EXPECT_HAS(refused("trans", npy<double>({120, 3}, std::vector<double>(360, 0))), "[121, 3]");
  EXPECT_HAS(refused("trans", npy<double>({121, 3}, std::vector<double>(363, INFINITY))), "finite");
  EXPECT_HAS(refused("betas", npy<double>({2, 4}, std::vector<double>(8, 0))), "one person");
  EXPECT_HAS(refused("betas", npy<double>({4}, std::vector<double>(4, NAN))), "NaN");
  EXPECT_HAS(refused("betas", ""), "'betas'");
  // Found by the fuzzer: text of the file in a message that is one short line.
  auto odd = TinyClip().arrays();
  odd.emplace_back("surface_model_type", test::npy_text("smpl\nh" + std::string(500, 'x')));
  write_bytes(dir / "c.npz", npz(odd));
  ImportReport unused;
  const std::string said = error_of([&] { import_amass(Npz(dir / "c.npz"), models, {}, unused); });
  EXPECT_HAS(said, "for the model smpl?hxxx");
  EXPECT_EQ(said.find('\n'), std::string::npos);
  EXPECT_LT(said.size(), 390u);
  std::vector<std::pair<std::string, std::string>> many;
  for (int i = 0; i < 9; ++i)
    many.emplace_back(std::string(60, static_cast<char>('a' + i)), npy<double>({1}, {1}));
  write_bytes(dir / "many.npz", npz(many));
  EXPECT_LT(error_of([&] { SmplModel(dir / "many.npz"); }).size(), 390u);
  TinyClip other;
  other.family = SmplFamily::smplx;
  write_bytes(dir / "c.npz", other.file());
  ImportReport report;
  EXPECT_HAS(error_of([&] { import_amass(Npz(dir / "c.npz"), models, {}, report); }),
             "whose shapes are others");
}

// ---- the command's function --------------------------------------------------------------------

TEST(ImportersAmass, ATreeOfClipsNamesSubjectsAndListsWhatIsUnusable) {
  const TempDir dir;
  write_bytes(dir / "model.npz", TinySmpl().file());
  for (const char* name : {"tree/ACCAD/Female1", "tree/CMU/07", "tree/notes"})
    std::filesystem::create_directories(dir / name);
  TinyClip clip;
  write_bytes(dir / "tree/ACCAD/Female1/walk_poses.npz", clip.file());
  clip.rate_key = "mocap_frame_rate";
  write_bytes(dir / "tree/CMU/07/07_10_stageii.npz", clip.file());
  write_bytes(dir / "tree/CMU/07/07_2_poses.npz", clip.file());
  const std::string shape = npz({{"betas", npy<double>({16}, std::vector<double>(16, 0))},
                                 {"gender", test::npy_text("male")}});
  write_bytes(dir / "tree/CMU/07/shape.npz", shape);
  write_bytes(dir / "tree/CMU/07/neutral_stagei.npz", shape);
  write_bytes(dir / "tree/CMU/07/broken_poses.npz", clip.file().substr(0, 4000));
  write_bytes(dir / "tree/notes/other.npz", npz({{"x", npy<double>({1}, {1})}}));
  write_bytes(dir / "tree/notes/readme.txt", "hello");
  ImportOptions options;
  EXPECT_HAS(error_of([&] { import_data(dir / "tree", dir / "o.h5", options); }), "--body-model");
  options.body_model = dir / "model.npz";
  options.motion.split = "validation";
  options.license = "AMASS";
  const ImportSummary summary = import_data(dir / "tree", dir / "o.h5", options);
  EXPECT_EQ(summary.motions, 3u);
  EXPECT_EQ(summary.frames, 93u);
  EXPECT_EQ(summary.shapes, 2u);
  EXPECT_EQ(summary.reports.size(), 3u);
  ASSERT_EQ(summary.skipped.size(), 2u);
  EXPECT_HAS(summary.skipped[0], "broken_poses.npz");
  EXPECT_HAS(summary.skipped[1], "other.npz: holds no motion (it has 'x')");
  EXPECT_TRUE(verify(dir / "o.h5").empty());
  const std::vector<Motion> motions = read_motions(dir / "o.h5", "validation");
  ASSERT_EQ(motions.size(), 3u);
  EXPECT_EQ(motions[0].id, "ACCAD_Female1_walk");
  EXPECT_EQ(motions[0].subject, "ACCAD/Female1");
  EXPECT_EQ(motions[1].id, "CMU_07_07_2");  // natural order
  EXPECT_EQ(motions[2].id, "CMU_07_07_10");
  EXPECT_EQ(motions[2].subject, "CMU/07");
  EXPECT_EQ(inspect(dir / "o.h5").license, "AMASS");
  // One file: the subject is its folder, and what is wrong is an error.
  import_data(dir / "tree/CMU/07/07_2_poses.npz", dir / "p.h5", options);
  EXPECT_EQ(read_motions(dir / "p.h5")[0].subject, "07");
  EXPECT_HAS(error_of([&] { import_data(dir / "tree/CMU/07/shape.npz", dir / "q.h5", options); }),
             "--betas");
  EXPECT_FALSE(std::filesystem::exists(dir / "q.h5"));
}

TEST(ImportersSmpl, ImportGivesBodies) {
  const TempDir dir;
  TinySmpl tiny;
  write_bytes(dir / "SMPLH_NEUTRAL.npz", tiny.file());
  write_bytes(dir / "ann.npz", npz({{"betas", npy<double>({4}, {1, 0, -1, 0})}}));
  write_bytes(dir / "crowd.npy", npy<double>({2, 6}, {1, 2, 3, 4, 5, 6, 0, 0, 0, 0, 0, 1}));
  ImportOptions options;
  options.betas = {"zeros", dir / "ann.npz", dir / "crowd.npy"};
  options.motion.split = "test";
  const ImportSummary summary = import_data(dir / "SMPLH_NEUTRAL.npz", dir / "o.h5", options);
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
  options.betas = {dir / "SMPLH_NEUTRAL.npz"};
  EXPECT_HAS(error_of([&] { import_data(dir / "SMPLH_NEUTRAL.npz", dir / "p.h5", options); }),
             "'betas'");
  EXPECT_HAS(error_of([&] { import_data(dir / "ann.npz", dir / "p.h5", options); }), "--betas");
}

}  // namespace
}  // namespace restage
