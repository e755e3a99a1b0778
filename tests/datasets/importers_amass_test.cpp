// AMASS motions and their kin, on models of a few dozen vertices: against SMPL's own formula.
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
using ImportersAmass = FileTest;

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

TEST_F(ImportersAmass, BothLayoutsEqualTheModelsFormulaAt30Fps) {
  for (const SmplFamily family : {SmplFamily::smplh, SmplFamily::smplx})
    for (const double fps : {120.0, 60.0, 100.0, 30.0}) {
      const TinySmpl tiny{family};
      const bool x = family == SmplFamily::smplx;
      const TinyClip clip{.family = family,
                          .frames = static_cast<int64_t>(fps) + 1,
                          .fps = fps,
                          .rate_key = x ? "mocap_frame_rate" : "mocap_framerate",
                          .type = x};
      BodyModels models(dir.write("model.npz", tiny.file()));
      MotionOptions options;
      options.id = "walk";
      options.subject = "ann";
      options.split = "test";
      ImportReport report;
      const Motion motion =
          import_amass(Npz(dir.write("walk_poses.npz", clip.file())), models, options, report);
      EXPECT_EQ(motion.id + " " + motion.subject + " " + motion.split, "walk ann test");
      ASSERT_EQ(motion.frames(), 31u) << fps;
      EXPECT_LT(motion.rest[0].norm(), 1e-12);
      // The same up to one height: the clip's floor goes to 0.
      double floor = 0;
      for (size_t f = 0; f < motion.frames(); ++f) {
        const Joints wanted = smpl_joints(clip, tiny, static_cast<double>(f) / kFps);
        const Joints got = testing::motion_joints(motion, f);
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

TEST_F(ImportersAmass, AGenderThatIsAPythonObjectIsNotStated) {
  BodyModels models(dir.write("neutral.npz", TinySmpl().file()));
  const std::string object = npy_of(npy_header("|O", {}), "a pickle");
  dir.write("clip.npz", npz(with(TinyClip().arrays(), "gender", object)));
  ImportReport report;
  import_amass(Npz(dir / "clip.npz"), models, {}, report);
  EXPECT_HAS(fact(report, "gender"), "not stated");
  ASSERT_EQ(report.remarks.size(), 1u);
  EXPECT_HAS(report.remarks[0], "gender counts as not stated");
}

TEST_F(ImportersAmass, OptionsOverrideAndDoubtsAreRemarked) {
  const TinyClip clip{.fps = 59.99,
                      .betas = {0.5, -1, 0.25, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}};
  const Npz file(dir.write("a.npz", clip.file()));
  BodyModels models(dir.write("male.npz", TinySmpl().file()));
  ImportReport plain, report;
  EXPECT_EQ(import_amass(file, models, {}, plain).frames(), 61u);  // 59.99 means 60
  MotionOptions other;
  other.rest.up = Axis::y;
  other.fps = 30;
  EXPECT_EQ(import_amass(file, models, other, report).frames(), 121u);
  EXPECT_HAS(fact(report, "body model"), "4 of 16 betas");
  EXPECT_HAS(fact(report, "up"), "(up)");
  ASSERT_EQ(report.remarks.size(), 2u);
  EXPECT_HAS(report.remarks[0], "fitted with a female body");
  EXPECT_HAS(report.remarks[1], "not upright");
}

TEST_F(ImportersAmass, TheModelIsFoundByFamilyAndGender) {
  const std::string h = TinySmpl().file();
  dir.write("models/smplh/female/model.npz", h);
  dir.write("models/smplh/male/model.npz", h);
  dir.write("models/smplx/SMPLX_NEUTRAL.npz", TinySmpl{SmplFamily::smplx}.file());
  dir.write("models/dmpls/male/model.npz", npz({{"x", npy<double>({1}, {1})}}));
  BodyModels models(dir / "models");
  std::vector<std::string> remarks;
  for (const char* gender : {"female", "male"})
    EXPECT_EQ(models.find(SmplFamily::smplh, gender, "c", remarks).path(),
              dir / "models/smplh/" + gender + "/model.npz");
  for (const char* gender : {"neutral", ""})
    EXPECT_EQ(models.find(SmplFamily::smplx, gender, "c", remarks).family(), SmplFamily::smplx);
  EXPECT_TRUE(remarks.empty());
  EXPECT_HAS(error_of([&] { models.find(SmplFamily::smplh, "neutral", "c", remarks); }),
             "neutral body, whose model");
  BodyModels one(dir / "models/smplx/SMPLX_NEUTRAL.npz");
  EXPECT_HAS(error_of([&] { one.find(SmplFamily::smplh, "male", "c", remarks); }), "body_model");
  BodyModels stand_in(dir.write("plain.npz", TinySmpl{SmplFamily::smpl}.file()));
  EXPECT_EQ(stand_in.find(SmplFamily::smplh, "male", "c", remarks).family(), SmplFamily::smpl);
  EXPECT_EQ(remarks.size(), 1u);
  for (const auto& [path, says] : {std::pair{"models/dmpls", "holds no SMPL"},
                                   {"models/dmpls/male/model.npz", "is no body model"},
                                   {"nothing.npz", "cannot be read"}})
    EXPECT_HAS(error_of([&, path = path] { BodyModels(dir / path); }), says);
}

TEST_F(ImportersAmass, WhatIsWrongIsSaid) {
  BodyModels models(dir.write("model.npz", TinySmpl().file()));
  const auto refused = [&](const Arrays& arrays) {
    dir.write("c.npz", npz(arrays));
    ImportReport report;
    return error_of([&] { import_amass(Npz(dir / "c.npz"), models, {}, report); });
  };
  const WrongArray wrong[] = {
      {"mocap_framerate", "", "with fps"},
      {"mocap_framerate", npy<double>({}, {0}), "no frame rate"},
      {"mocap_framerate", npy_text("fast"), "no frame rate"},
      {"poses", doubles({121, 69}, 0), "[121, 69]"},
      {"poses", doubles({121, 52, 4}, 0), "a quaternion that is no rotation"},
      {"poses", doubles({121, 52, 3, 3}, 0), "no rotation"},
      {"poses", doubles({156}, 0), "[156]"},
      {"poses", doubles({0, 156}, 0), "0 frames"},
      {"poses", doubles({121, 156}, NAN), "finite"},
      {"trans", doubles({120, 3}, 0), "[121, 3]"},
      {"trans", doubles({3, 121}, 0), "[121, 3]"},
      {"trans", doubles({363}, 0), "[121, 3]"},
      {"trans", doubles({121, 3}, INFINITY), "finite"},
      {"betas", doubles({2, 4}, 0), "one person"},
      {"betas", doubles({4}, NAN), "NaN"}};
  for (const auto& [name, bytes, says] : wrong)
    EXPECT_HAS(refused(with(TinyClip().arrays(), name, bytes)), says) << name;
  // Found by the fuzzer: text of the file in a message that is one short line.
  Arrays odd = TinyClip().arrays();
  odd.emplace_back("surface_model_type", npy_text("smpl\nh" + std::string(500, 'x')));
  EXPECT_HAS(refused(odd), "for the model smpl?hxxx");
  EXPECT_HAS(refused(TinyClip{SmplFamily::smplx}.arrays()), "whose shapes are others");
}

/// The clip's rotations and places in the frame of a camera that looks on: y down, z away.
Arrays seen_by_a_camera(const TinyClip& clip, int64_t body_joints, bool matrices) {
  const Mat3 camera = (Mat3() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();  // z up to y down
  std::vector<double> orient, body, trans;
  const auto add = [&](const Mat3& turn, std::vector<double>& out) {
    const Eigen::AngleAxisd a(turn);
    const Vec3 vector = a.angle() * a.axis();
    for (int i = 0; i < (matrices ? 9 : 3); ++i)
      out.push_back(matrices ? turn(i / 3, i % 3) : vector[i]);
  };
  const Vec3 rest = TinySmpl{SmplFamily::smpl}.shaped(clip.betas)[0];
  for (int64_t f = 0; f < clip.frames; ++f) {
    const double t = static_cast<double>(f) / clip.fps;
    add(camera * clip.root(t), orient);
    for (int64_t j = 1; j <= body_joints; ++j) {
      const Vec3 a = j < kJoints ? clip.turn(static_cast<int>(j), t) : Vec3::Zero();
      add(a.norm() > 0 ? Mat3(Eigen::AngleAxisd(a.norm(), a.normalized())) : Mat3(Mat3::Identity()),
          body);
    }
    const Vec3 at = camera * (clip.trans(t) + rest) - rest;
    trans.insert(trans.end(), {at.x(), at.y(), at.z()});
  }
  const int64_t n = clip.frames;
  const std::vector<int64_t> one = matrices ? std::vector<int64_t>{n, 1, 3, 3}
                                            : std::vector<int64_t>{n, 3},
                             all = matrices ? std::vector<int64_t>{n, body_joints, 3, 3}
                                            : std::vector<int64_t>{n, 3 * body_joints};
  return {{"smpl_global_orient", npy<double>(one, orient)},
          {"smpl_body_pose", npy<double>(all, body)},
          {"cam_trans", npy<double>({n, 3}, trans)},
          {"smpl_betas", npy<double>({1, std::ssize(clip.betas)}, clip.betas)}};
}

TEST_F(ImportersAmass, EstimatorsNamesAndShapesGiveTheSameMotion) {
  const TinyClip clip{.frames = 31, .fps = 30};
  BodyModels models(dir.write("model.npz", TinySmpl{SmplFamily::smpl}.file()));
  ImportReport ignored;
  // AMASS's own layout, 72 and 66 columns wide.
  const auto narrow = [&](int64_t columns) {
    const Npz wide(dir.write("wide.npz", npz(clip.arrays())));
    const NpyArray poses = wide.array("poses");
    std::vector<double> kept;
    for (int64_t f = 0; f < clip.frames; ++f)
      for (int64_t c = 0; c < columns; ++c) kept.push_back(poses[f * poses.shape()[1] + c]);
    return with(clip.arrays(), "poses", npy<double>({clip.frames, columns}, kept));
  };
  const Motion wanted =
      import_amass(Npz(dir.write("a.npz", npz(clip.arrays()))), models, {}, ignored);
  const auto expect_same = [&](const Arrays& arrays, const std::string& name) {
    ImportReport report;
    const Npz file(dir.write("b.npz", npz(arrays)));
    EXPECT_TRUE(is_amass_motion(file)) << name;
    const Motion motion = import_amass(file, models, {}, report);
    ASSERT_EQ(motion.frames(), wanted.frames()) << name;
    const Joints first = testing::motion_joints(motion, 0),
                 first_wanted = testing::motion_joints(wanted, 0);
    for (size_t f = 0; f < wanted.frames(); ++f) {
      const Joints got = testing::motion_joints(motion, f),
                   want = testing::motion_joints(wanted, f);
      for (size_t j = 0; j < kJoints; ++j)  // wherever the world's origin is
        EXPECT_LT(((got[j] - first[0]) - (want[j] - first_wanted[0])).norm(), 1e-5)
            << name << " " << f << " " << j;
    }
    return;
  };
  expect_same(narrow(72), "72 columns");
  expect_same(narrow(66), "66 columns");
  // The three numbers of a rotation before the joints.
  const auto numbers_first = [&](int64_t joints) {
    const Npz flat(dir.write("flat.npz", npz(narrow(3 * joints))));
    const NpyArray poses = flat.array("poses");
    std::vector<double> turned;
    for (int64_t f = 0; f < clip.frames; ++f)
      for (int64_t i = 0; i < 3; ++i)
        for (int64_t j = 0; j < joints; ++j) turned.push_back(poses[(f * joints + j) * 3 + i]);
    return with(clip.arrays(), "poses", npy<double>({clip.frames, 3, joints}, turned));
  };
  expect_same(numbers_first(24), "[F, 3, 24]");
  expect_same(numbers_first(22), "[F, 3, 22]");
  expect_same(seen_by_a_camera(clip, 23, false), "ROMP, HMR");
  expect_same(seen_by_a_camera(clip, 21, false), "21 joints");
  expect_same(seen_by_a_camera(clip, 23, true), "matrices");
  // Nothing is taken for granted without a word, and what is lacking is named.
  ImportReport report;
  import_amass(Npz(dir.write("c.npz", npz(seen_by_a_camera(clip, 23, false)))), models, {}, report);
  EXPECT_HAS(fact(report, "up"), "-y, where the head is");
  EXPECT_HAS(remarks(report), "30 frames a second are taken for granted");
  EXPECT_HAS(error_of([&] {
               const Npz file(dir.write(
                   "d.npz", npz(with(seen_by_a_camera(clip, 23, false), "cam_trans", ""))));
               import_amass(file, models, {}, report);
             }),
             "add trans [F, 3]");
}

/// The clip in AMASS's layout, 72 columns wide, in a world that is turned by `world`; everything
/// moved by `from`.
Arrays in_world(const TinyClip& clip, const Mat3& world, const Vec3& from = Vec3::Zero()) {
  const Vec3 rest = TinySmpl{SmplFamily::smpl}.shaped(clip.betas)[0];
  std::vector<double> poses, trans;
  for (int64_t f = 0; f < clip.frames; ++f) {
    const double t = static_cast<double>(f) / clip.fps;
    const Eigen::AngleAxisd root(Mat3(world * clip.root(t)));
    for (int j = 0; j < 24; ++j) {
      const Vec3 a = j == 0        ? Vec3(root.angle() * root.axis())
                     : j < kJoints ? clip.turn(j, t)
                                   : Vec3::Zero();
      poses.insert(poses.end(), a.data(), a.data() + 3);
    }
    const Vec3 at = world * (clip.trans(t) + rest) - rest + from;
    trans.insert(trans.end(), at.data(), at.data() + 3);
  }
  return with(with(clip.arrays(), "poses", npy<double>({clip.frames, 72}, poses)), "trans",
              npy<double>({clip.frames, 3}, trans));
}

/// AMASS's layout says nothing of the axis that is up: the root of somebody who stands does.
TEST_F(ImportersAmass, TheRootTellsWhichAxisIsUp) {
  const TinyClip clip{.frames = 31, .fps = 30};
  BodyModels models(dir.write("model.npz", TinySmpl{SmplFamily::smpl}.file()));
  const auto imported = [&](const Arrays& arrays, ImportReport& report) {
    return import_amass(Npz(dir.write("a.npz", npz(arrays))), models, {}, report);
  };
  ImportReport amass;
  const Motion wanted = imported(in_world(clip, Mat3::Identity()), amass);
  EXPECT_EQ(fact(amass, "up"), "z (AMASS), turned to y");
  for (const Axis up : {Axis::y, Axis::minus_y}) {
    const Mat3 world = upright(up).transpose() * upright(Axis::z);
    ImportReport report;
    const Motion motion = imported(in_world(clip, world), report);
    EXPECT_HAS(fact(report, "up"), to_string(up) + ", where the root turns the body's up");
    EXPECT_EQ(remarks(report).find("upright"), std::string::npos) << remarks(report);
    ASSERT_EQ(motion.frames(), wanted.frames());
    const Vec3 first = testing::motion_joints(motion, 0)[0],
               first_wanted = testing::motion_joints(wanted, 0)[0];
    for (size_t f = 0; f < wanted.frames(); ++f)
      for (size_t j = 0; j < kJoints; ++j) {
        const Vec3 got = testing::motion_joints(motion, f)[j] - first,
                   want = testing::motion_joints(wanted, f)[j] - first_wanted;
        EXPECT_LT((got - want).norm(), 1e-5) << to_string(up) << " " << f << " " << j;
      }
    MotionOptions given;
    given.rest.up = Axis::z;
    ImportReport overruled;
    import_amass(Npz(dir / "a.npz"), models, given, overruled);
    EXPECT_HAS(fact(overruled, "up"), "z (up)");
  }
}

/// Somebody who lies on AMASS's floor has a root like somebody who stands with y up, and somebody
/// who lies along x, or turns over, shows no other axis.
TEST_F(ImportersAmass, WhoLiesOnTheFloorKeepsZUp) {
  const TinyClip clip{.frames = 4, .fps = 30};
  BodyModels models(dir.write("model.npz", TinySmpl{SmplFamily::smpl}.file()));
  const Mat3 supine = upright(Axis::z);                                        // the head to +y
  const Mat3 along_x = upright(Axis::minus_x).transpose() * upright(Axis::z);  // to -x
  for (const Mat3& world : {supine, along_x}) {
    double lowest = 1e9;  // puts it 5 cm above the floor, 2 m from the origin
    Arrays lies = in_world(clip, world);
    ImportReport report;
    MotionOptions given;
    given.rest.up = Axis::z;
    const Motion raw = import_amass(Npz(dir.write("a.npz", npz(lies))), models, given, report);
    for (size_t f = 0; f < raw.frames(); ++f)
      for (const Vec3& joint : testing::motion_joints(raw, f)) lowest = std::min(lowest, joint.y());
    const double floor = std::stod(fact(report, "floor"));
    lies = in_world(clip, world, Vec3(0, 2, 0.05 - floor - lowest));
    ImportReport found;
    import_amass(Npz(dir.write("b.npz", npz(lies))), models, {}, found);
    EXPECT_EQ(fact(found, "up"), "z (AMASS), turned to y");
    EXPECT_HAS(remarks(found), "up y");
  }
}

/// The clip with its path in other units, as such files have it.
Arrays with_path(const TinyClip& clip, double unit, const Vec3& from = Vec3::Zero()) {
  std::vector<double> trans;
  for (int64_t f = 0; f < clip.frames; ++f) {
    const Vec3 at = clip.trans(static_cast<double>(f) / clip.fps) + from;
    for (int axis = 0; axis < 3; ++axis) trans.push_back(unit * at[axis]);
  }
  return with(clip.arrays(), "trans", npy<double>({clip.frames, 3}, trans));
}

TEST_F(ImportersAmass, APathThatIsNotInMetresIsSaid) {
  const TinyClip clip{.frames = 61, .fps = 60};
  BodyModels models(dir.write("female.npz", TinySmpl().file()));
  ImportReport report;
  const Vec3 standing(0, 0, 1);
  const auto import = [&](const Arrays& arrays, const MotionOptions& options = {}) {
    report = {};
    return import_amass(Npz(dir.write("a.npz", npz(arrays))), models, options, report);
  };
  const Motion wanted = import(with_path(clip, 1, standing));
  const std::pair<double, const char*> units[] = {{100, "give scale 0.01 if they are centimetres"},
                                                  {1000, "give scale 0.001 if they are milli"}};
  for (const auto& [unit, says] : units) {
    const Arrays arrays = with_path(clip, unit, standing);
    EXPECT_HAS(error_of([&] { import(arrays); }), says);
    MotionOptions options;
    options.scale = 1 / unit;
    const Motion motion = import(arrays, options);
    EXPECT_HAS(fact(report, "scale of trans"), "(scale)");
    for (size_t f = 0; f < wanted.frames(); ++f)
      EXPECT_LT(
          (testing::motion_joints(motion, f)[0] - testing::motion_joints(wanted, f)[0]).norm(),
          1e-5);
    options.scale = 0;
    options.force = true;
    import(arrays, options);
    // AIST++ says itself by what to divide.
    const Motion said = import(with(arrays, "smpl_scaling", npy<double>({1}, {unit})));
    EXPECT_HAS(fact(report, "scale of trans"), "AIST++");
    EXPECT_LT((testing::motion_joints(said, 9)[0] - testing::motion_joints(wanted, 9)[0]).norm(),
              1e-5);
  }
  import(with(clip.arrays(), "scale", npy<double>({}, {2.5})));
  EXPECT_HAS(remarks(report), "an array 'scale', which is not applied");
  EXPECT_HAS(error_of([&] {
               import(with(clip.arrays(), "smpl_scaling", npy<double>({2}, {1, 0})));
             }),
             "no number to divide");
}

TEST_F(ImportersAmass, RotationsInDegreesAreSaid) {
  const TinyClip clip{.frames = 31, .fps = 30};
  BodyModels models(dir.write("female.npz", TinySmpl().file()));
  const Npz file(dir.write("a.npz", clip.file()));
  const NpyArray poses = file.array("poses");
  const auto times = [&](double factor) {
    std::vector<double> values;
    for (int64_t i = 0; i < poses.size(); ++i) values.push_back(factor * poses[i]);
    return Npz(
        dir.write("b.npz", npz(with(clip.arrays(), "poses", npy<double>(poses.shape(), values)))));
  };
  ImportReport report;
  const double degrees = 180 / std::acos(-1.0);
  EXPECT_HAS(error_of([&] { import_amass(times(degrees), models, {}, report); }),
             "these seem to be degrees; turn them into radians (numpy.deg2rad)");
  MotionOptions forced;
  forced.force = true;
  import_amass(times(degrees), models, forced, report);
  EXPECT_HAS(remarks(report), "more than a whole turn");
}

TEST_F(ImportersAmass, RotationMatricesOfAllJointsAndMissingParts) {
  const TinyClip clip{.frames = 31, .fps = 30};
  BodyModels models(dir.write("model.npz", TinySmpl{SmplFamily::smpl}.file()));
  std::vector<double> turns;
  for (int64_t f = 0; f < clip.frames; ++f)
    for (int joint = 0; joint < 24; ++joint) {
      const Mat3 turn = joint == 0 ? clip.root(0) : Mat3::Identity();
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) turns.push_back(turn(r, c));
    }
  const std::string place = npy<double>({clip.frames, 3}, std::vector<double>(93, 0));
  ImportReport report;
  for (const char* name : {"pred_rotmat", "rotmat", "pose_rotmat", "smpl_poses_rotmat"}) {
    const Npz file(dir.write(
        "a.npz", npz({{name, npy<double>({clip.frames, 24, 3, 3}, turns)}, {"trans", place}})));
    ASSERT_TRUE(is_amass_motion(file)) << name;
    EXPECT_EQ(import_amass(file, models, {}, report).frames(), 31u) << name;
  }
  {  // all numbers of a frame in one row
    const Npz file(dir.write("a.npz", npz({{"poses", npy<double>({clip.frames, 216}, turns)},
                                           {"mocap_framerate", npy<double>({}, {30})},
                                           {"trans", place}})));
    EXPECT_EQ(import_amass(file, models, {}, report).frames(), 31u);
  }
  for (const auto& [shape, says] : std::vector<std::pair<std::vector<int64_t>, const char*>>{
           {{31, 144}, "6 numbers that are no rotation"},
           {{31, 96}, "a quaternion that is no rotation"},
           {{31, 3, 17}, "rotations are axis-angle numbers"}}) {
    int64_t size = 1;
    for (const int64_t n : shape) size *= n;
    const Npz file(dir.write(
        "a.npz",
        npz({{"poses", npy<double>(shape, std::vector<double>(static_cast<size_t>(size), 0))},
             {"mocap_framerate", npy<double>({}, {30})},
             {"trans", place}})));
    EXPECT_HAS(error_of([&] { import_amass(file, models, {}, report); }), says) << says;
  }
  dir.write("b.npz", npz({{"root_orient", place}, {"trans", place}}));
  ImportOptions options;
  options.body_model = dir / "model.npz";
  EXPECT_HAS(error_of([&] { import_data(dir / "b.npz", dir / "o.h5", options); }), "add pose_body");
}

TEST_F(ImportersAmass, AShapeForEachFrameOrNone) {
  const TinyClip clip{.frames = 31, .fps = 30};
  BodyModels models(dir.write("model.npz", TinySmpl().file()));
  std::vector<double> betas;
  for (int64_t f = 0; f < clip.frames; ++f)
    betas.insert(betas.end(), clip.betas.begin(), clip.betas.end());
  const auto rest_of = [&](const std::string& bytes, ImportReport& report) {
    const Npz file(dir.write("a.npz", npz(with(clip.arrays(), "betas", bytes))));
    return import_amass(file, models, {}, report).rest;
  };
  ImportReport one, many, none;
  const Joints wanted = rest_of(npy<double>({std::ssize(clip.betas)}, clip.betas), one);
  const Joints got = rest_of(npy<double>({clip.frames, std::ssize(clip.betas)}, betas), many);
  for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((got[j] - wanted[j]).norm(), 1e-9);
  rest_of("", none);
  EXPECT_HAS(remarks(none), "the mean person");
}

// ---- the command's function --------------------------------------------------------------------

TEST_F(ImportersAmass, ATreeOfClipsNamesSubjectsAndListsWhatIsUnusable) {
  TinyClip clip;
  dir.write("tree/ACCAD/Female1/walk_poses.npz", clip.file());
  clip.rate_key = "mocap_frame_rate";
  dir.write("tree/CMU/07/07_10_stageii.npz", clip.file());
  dir.write("tree/CMU/07/07_2_poses.npz", clip.file());
  const std::string shape = npz({{"betas", doubles({16}, 0)}, {"gender", npy_text("male")}});
  dir.write("tree/CMU/07/shape.npz", shape);
  dir.write("tree/CMU/07/neutral_stagei.npz", shape);
  dir.write("tree/CMU/07/broken_poses.npz", clip.file().substr(0, 4000));
  dir.write("tree/notes/other.npz", npz({{"x", npy<double>({1}, {1})}}));
  dir.write("tree/notes/readme.txt", "hello");
  ImportOptions options;
  EXPECT_HAS(error_of([&] { import_data(dir / "tree", dir / "o.h5", options); }), "body_model");
  options.body_model = dir.write("model.npz", TinySmpl().file());
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
  std::vector<std::string> names;  // in natural order
  for (const Motion& m : read_motions(dir / "o.h5", "validation"))
    names.push_back(m.subject + " " + m.id);
  EXPECT_EQ(names, (Names{"ACCAD/Female1 ACCAD_Female1_walk", "CMU/07 CMU_07_07_2",
                          "CMU/07 CMU_07_07_10"}));
  EXPECT_EQ(inspect(dir / "o.h5").license, "AMASS");
  // One file: the subject is its folder, and what is wrong is an error.
  import_data(dir / "tree/CMU/07/07_2_poses.npz", dir / "p.h5", options);
  EXPECT_EQ(read_motions(dir / "p.h5")[0].subject, "07");
  EXPECT_HAS(error_of([&] { import_data(dir / "tree/CMU/07/shape.npz", dir / "q.h5", options); }),
             "betas");
  EXPECT_FALSE(std::filesystem::exists(dir / "q.h5"));
}

}  // namespace
}  // namespace restage
