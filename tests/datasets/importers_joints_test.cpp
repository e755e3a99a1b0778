// Joints without rotations: orders, files, and the motion that is found in them.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "autograd/base/format.h"
#include "autograd/base/rng.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/importers/joints/solve.h"
#include "datasets/readers/arrays/npy.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

using namespace test;

class ImportersJointsTest : public FileTest {
 protected:
  /// Where a test motion's joints are, frame by frame.
  static std::vector<PosedSkeleton> walk(size_t frames = 40) {
    static const Motion motion = builtin_motion(3, "test", 1);
    const Joints rest = builtin_rest_joints();
    std::vector<PosedSkeleton> out;
    for (size_t f = 0; f < std::min(frames, motion.frames()); ++f) {
      Rotations global;
      for (size_t j = 0; j < kJoints; ++j)
        global[j] = motion.global[f][j].cast<double>().normalized().toRotationMatrix();
      const Vec3 hips = motion.hips[f].cast<double>();
      const Vec3 root = hips + global[0] * (rest[0] - 0.5 * (rest[1] + rest[2]));
      out.push_back(forward_kinematics(rest, {to_local(global), root}));
    }
    return out;
  }
  /// The same in the order of a layout, NaN where we have no such joint; `place` moves each.
  static std::vector<double> numbers(
      const std::string& layout, const std::vector<PosedSkeleton>& poses,
      const std::function<Vec3(const Vec3&)>& place = [](const Vec3& x) { return x; }) {
    const JointLayout& order = joint_layout(layout);
    std::vector<double> out;
    for (const PosedSkeleton& pose : poses)
      for (size_t i = 0; i < order.count; ++i) {
        Vec3 x = Vec3::Constant(std::nan(""));
        for (size_t j = 0; j < kJoints; ++j)
          if (i < order.joints.size() && order.joints[i] == kJointNames[j])
            x = place(pose.joints[j]);
        out.insert(out.end(), {x.x(), x.y(), x.z()});
      }
    return out;
  }
  std::string npy_file(const std::string& layout, const std::vector<PosedSkeleton>& poses) const {
    const auto count = static_cast<int64_t>(joint_layout(layout).count);
    return dir.write("joints.npy",
                     npy<double>({std::ssize(poses), count, 3}, numbers(layout, poses)));
  }
  static JointRecording found(const std::string& path, const JointFileOptions& options = {}) {
    auto out = find_joint_recording(path, options);
    if (!out) throw std::runtime_error("no joints in " + path);
    return *out;
  }
  static Motion solved(const std::string& path, MotionOptions options = {},
                       ImportReport* report = nullptr) {
    ImportReport mine;
    ImportReport& to = report ? *report : mine;
    to.file = path;
    JointFileOptions how;
    how.layout = options.layout;
    return solve_joints(found(path, how), options, to).motion;
  }
  static PosedSkeleton posed(const Motion& motion, size_t f) {
    Rotations global;
    for (size_t j = 0; j < kJoints; ++j)
      global[j] = motion.global[f][j].cast<double>().normalized().toRotationMatrix();
    const Vec3 middle = 0.5 * (motion.rest[kLeftHip] + motion.rest[kRightHip]);
    return forward_kinematics(
        motion.rest,
        {to_local(global), motion.hips[f].cast<double>() + global[0] * (motion.rest[0] - middle)});
  }
  /// The largest distance of a joint from the truth, but for a lift of all, metres.
  static double farthest(const Motion& motion, const std::vector<PosedSkeleton>& truth) {
    double out = 0;
    const double lift = truth[0].joints[0].y() - posed(motion, 0).joints[0].y();
    for (size_t f = 0; f < truth.size(); ++f)
      for (size_t j = 0; j < kJoints; ++j)
        out = std::max(out,
                       (posed(motion, f).joints[j] + Vec3(0, lift, 0) - truth[f].joints[j]).norm());
    return out;
  }
  /// Mean angle between the turns of joint j and the truth, degrees; j < 0: of all.
  static double angle(const Motion& motion, const std::vector<PosedSkeleton>& truth,
                      int joint = -1) {
    double sum = 0, count = 0;
    for (size_t f = 0; f < truth.size(); ++f)
      for (int j = 0; j < kJoints; ++j)
        if (joint < 0 || j == joint) {
          const auto at = static_cast<size_t>(j);
          sum += motion.global[f][at].cast<double>().angularDistance(Quat(truth[f].global[at]));
          count += 1;
        }
    return sum / count * (180 / M_PI);
  }
};

TEST_F(ImportersJointsTest, EveryOrderKnowsItsPlacesAndATrunk) {
  for (const JointLayout& layout : joint_layouts()) {
    EXPECT_LE(layout.joints.size(), layout.count) << layout.name;
    for (const char* word : {"left_hip", "right_hip", "left_shoulder", "right_shoulder",
                             "left_wrist", "right_wrist", "left_ankle", "right_ankle"})
      EXPECT_EQ(std::count(layout.joints.begin(), layout.joints.end(), word), 1)
          << layout.name << " " << word;
  }
  EXPECT_HAS(refusal_of([] { joint_layout("h37m"); }), "h36m17");
}

TEST_F(ImportersJointsTest, AllJointsComeBackWhereTheyWere) {
  const auto truth = walk();
  const Motion motion = solved(npy_file("smpl22", truth));
  ASSERT_EQ(motion.frames(), truth.size());
  EXPECT_LT(farthest(motion, truth), 1e-3);
  // Of built-in motions, which the network has never seen.
  EXPECT_LT(angle(motion, truth), 12);
}

TEST_F(ImportersJointsTest, TheOrderIsFoundByTheBones) {
  const auto truth = walk();
  for (const std::string name :
       {"h36m17", "coco17", "openpose25", "kinect25", "smpl24", "mediapipe33"})
    EXPECT_EQ(found(npy_file(name, truth)).layout.name, name);
  // Two orders of 17 that nothing tells from each other: only one trunk and no limbs.
  EXPECT_HAS(refusal_of([&] {
               find_joint_recording(
                   dir.write("n.npy", npy<double>({2, 17, 3}, std::vector<double>(102, 1))), {});
             }),
             "layout h36m17 or coco17");
}

TEST_F(ImportersJointsTest, FewerJointsMakeAWholeMotion) {
  const auto truth = walk();
  for (const std::string name : {"h36m17", "coco17"}) {
    const Motion motion = solved(npy_file(name, truth));
    // Limbs point where they were seen to.
    for (const auto& [from, to] : {std::pair(kLeftKnee, kLeftAnkle), {kRightElbow, kRightWrist}}) {
      const auto a = static_cast<size_t>(from), b = static_cast<size_t>(to);
      const PosedSkeleton got = posed(motion, 20);
      const Vec3 wanted = (truth[20].joints[b] - truth[20].joints[a]).normalized(),
                 is = (got.joints[b] - got.joints[a]).normalized();
      EXPECT_GT(wanted.dot(is), 0.9999) << name;
    }
    EXPECT_LT(farthest(motion, truth), 0.15) << name;
  }
}

TEST_F(ImportersJointsTest, ShapesOfArrays) {
  const auto truth = walk(12);
  const std::vector<double> flat = numbers("smpl22", truth);
  std::vector<double> last(flat.size()), sure;
  for (size_t f = 0; f < 12; ++f)
    for (size_t k = 0; k < 66; ++k) last[k * 12 + f] = flat[f * 66 + k];
  for (size_t i = 0; i < flat.size(); ++i) {
    sure.push_back(flat[i]);
    if (i % 3 == 2) sure.push_back(0.9);
  }
  const std::vector<std::pair<std::vector<int64_t>, std::vector<double>>> shapes = {
      {{12, 22, 3}, flat}, {{1, 12, 22, 3}, flat}, {{22, 3, 12}, last},
      {{12, 66}, flat},    {{12, 22, 4}, sure},    {{1, 22, 3, 12}, last}};
  for (const auto& [shape, values] : shapes)
    EXPECT_LT(farthest(solved(dir.write("a.npy", npy<double>(shape, values))), truth), 1e-3)
        << shape_text(shape);
  for (const char* name : {"joints", "keypoints3d", "motion", "pred_joints"})
    EXPECT_LT(farthest(solved(dir.write("a.npz", npz({{name, npy<double>({12, 22, 3}, flat)},
                                                      {"fps", npy<double>({}, {30})}}))),
                       truth),
              1e-3)
        << name;
}

TEST_F(ImportersJointsTest, CloudsAreNoJoints) {
  Rng rng(RngKey{1, 0});
  for (const int64_t count : {127, 133, 144}) {
    std::vector<double> cloud(static_cast<size_t>(6 * count * 3));
    for (double& x : cloud) x = rng.normal();
    EXPECT_FALSE(find_joint_recording(dir.write("c.npy", npy<double>({6, count, 3}, cloud)), {})
                     .has_value());
    cloud.resize(static_cast<size_t>(count * 3));
    EXPECT_FALSE(
        find_joint_recording(dir.write("c.npy", npy<double>({count, 3}, cloud)), {}).has_value());
  }
}

TEST_F(ImportersJointsTest, AxesUnitsAndRatesAreFound) {
  const auto truth = walk();
  // z up, millimetres: (x, y, z) is (x, -z, y) there.
  const auto z_up = [](const Vec3& x) { return Vec3(1e3 * Vec3(x.x(), -x.z(), x.y())); };
  const std::string path =
      dir.write("z.npy", npy<double>({std::ssize(truth), 22, 3}, numbers("smpl22", truth, z_up)));
  ImportReport report;
  EXPECT_LT(farthest(solved(path, {}, &report), truth), 1e-3);
  EXPECT_HAS(fact(report, "up"), "z");
  EXPECT_HAS(fact(report, "units"), "millimetres");
  EXPECT_HAS(remarks(report), "taken for 30 fps");
  MotionOptions slow;
  slow.fps = 15;
  EXPECT_EQ(solved(path, slow).frames(), 2 * truth.size() - 1);
  MotionOptions wrong;
  wrong.scale = -1;
  const auto far = [](const Vec3& x) { return Vec3(2.2 * x); };
  const std::string odd =
      dir.write("o.npy", npy<double>({std::ssize(truth), 22, 3}, numbers("smpl22", truth, far)));
  EXPECT_HAS(refusal_of([&] { solved(odd); }), "no person's in any known unit");
}

TEST_F(ImportersJointsTest, ExchangedSidesAreRefused) {
  const auto truth = walk();
  const auto mirrored = [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); };
  const std::string path = dir.write(
      "m.npy", npy<double>({std::ssize(truth), 22, 3}, numbers("smpl22", truth, mirrored)));
  EXPECT_HAS(refusal_of([&] { solved(path); }), "left and right are exchanged");
  MotionOptions forced;
  forced.force = true;
  EXPECT_EQ(solved(path, forced).frames(), truth.size());
}

TEST_F(ImportersJointsTest, NoiseIsCalmedAndGapsAreBridged) {
  const auto truth = walk();
  Rng rng(RngKey{5, 0});
  const auto shaken = [&](const Vec3& x) {
    return Vec3(x + 0.015 * Vec3(rng.normal(), rng.normal(), rng.normal()));
  };
  std::vector<double> values = numbers("smpl22", truth, shaken);
  double raw = 0;
  for (size_t f = 0; f < truth.size(); ++f)
    for (size_t k = 0; k < 66; ++k)
      raw += std::abs(values[f * 66 + k] - truth[f].joints[k / 3][static_cast<int>(k % 3)]);
  for (size_t f = 10; f < 16; ++f)  // a wrist that nobody sees for a while
    for (size_t k = 60; k < 63; ++k) values[f * 66 + k] = std::nan("");
  ImportReport report;
  const Motion motion =
      solved(dir.write("s.npy", npy<double>({std::ssize(truth), 22, 3}, values)), {}, &report);
  EXPECT_HAS(fact(report, "noise"), "lengths are held");
  EXPECT_HAS(fact(report, "gaps"), "bridged");
  double off = 0, lift = 0;  // the motion stands on a floor of its own
  for (size_t f = 0; f < truth.size(); ++f)
    lift += (truth[f].joints[0].y() - posed(motion, f).joints[0].y()) / std::ssize(truth);
  for (size_t f = 0; f < truth.size(); ++f)
    for (size_t j = 0; j < kJoints; ++j)
      off += (posed(motion, f).joints[j] + Vec3(0, lift, 0) - truth[f].joints[j]).cwiseAbs().sum();
  EXPECT_LT(off, raw);
}

std::string table_of(const std::vector<double>& values, size_t joints, bool named) {
  std::string out = named ? "frame,landmark,x,y,z,visibility\n" : "time_s,id,x,y,z,visibility\n";
  for (size_t i = 0; 3 * i < values.size(); ++i)
    out += (named ? std::to_string(i / joints)
                  : format("%.4f", static_cast<double>(i / joints) / 25)) +
           format(",%d,%.6f,%.6f,%.6f,%s\n", static_cast<int>(i % joints), values[3 * i],
                  values[3 * i + 1], values[3 * i + 2], std::isnan(values[3 * i]) ? "0" : "0.9");
  return out;
}

TEST_F(ImportersJointsTest, Tables) {
  const auto truth = walk(12);
  const std::vector<double> values = numbers("mediapipe33", truth);
  for (const bool named : {true, false}) {
    const JointRecording read = found(dir.write("t.csv", table_of(values, 33, named)));
    EXPECT_EQ(read.layout.name, "mediapipe33");
    EXPECT_EQ(read.frames.size(), 12u);
    EXPECT_EQ(read.fps, named ? 0 : 25);
    EXPECT_NEAR((*read.frames[3][13] - truth[3].joints[kLeftElbow]).norm(), 0, 1e-5);
  }
  // Three columns a joint, by names.
  std::string wide = "frame", rows;
  for (const std::string_view name : kJointNames)
    for (const char* axis : {"_x", "_y", "_z"}) wide += "," + std::string(name) + axis;
  for (size_t f = 0; f < truth.size(); ++f) {
    rows += "\n" + std::to_string(f);
    for (const Vec3& x : truth[f].joints) rows += format(",%.6f,%.6f,%.6f", x.x(), x.y(), x.z());
  }
  EXPECT_LT(farthest(solved(dir.write("w.csv", wide + rows + "\n")), truth), 1e-3);
  EXPECT_FALSE(find_joint_recording(dir.write("p.csv", "x,y,z\n1,2,3\n2,3,4\n"), {}).has_value());
}

TEST_F(ImportersJointsTest, JsonOfTrackers) {
  const auto truth = walk(6);
  std::string azure = R"({"joint_names": [)", frames;
  for (const std::string_view name : kJointNames) azure += "\"" + std::string(name) + "\",";
  azure.back() = ']';
  for (size_t f = 0; f < truth.size(); ++f) {
    frames += format(R"(%s{"timestamp_usec": %d, "bodies": [{"body_id": 7, "joint_positions": [)",
                     f ? "," : "", static_cast<int>(f * 50000));
    for (const Vec3& x : truth[f].joints)
      frames += format("[%.5f, %.5f, %.5f],", 1e3 * x.x(), -1e3 * x.y(), -1e3 * x.z());
    frames.back() = ']';
    frames += "}]}";
  }
  const std::string path = dir.write("k.json", azure + ", \"frames\": [" + frames + "]}");
  const JointRecording read = found(path);
  EXPECT_NEAR(read.fps, 20, 1e-9);
  ImportReport report;
  const Motion motion = solved(path, {}, &report);
  EXPECT_HAS(fact(report, "up"), "-y");
  EXPECT_EQ(motion.frames(), 8u);
  // OpenPose: four numbers a joint, a file a frame.
  const std::vector<double> fours = numbers("openpose25", truth);
  std::filesystem::create_directory(dir / "people");
  for (size_t f = 0; f < truth.size(); ++f) {
    std::string text = R"({"people": [{"pose_keypoints_3d": [)";
    for (size_t j = 0; j < 25; ++j) {
      const double* x = fours.data() + 3 * (25 * f + j);
      text += std::isnan(x[0]) ? "0, 0, 0, 0," : format("%.6f, %.6f, %.6f, 0.8,", x[0], x[1], x[2]);
    }
    text.back() = ']';
    dir.write(format("people/take_%03d_keypoints.json", static_cast<int>(f)), text + "}]}");
  }
  const JointRecording folder = found(dir / "people");
  EXPECT_EQ(folder.layout.name, "openpose25");
  EXPECT_EQ(folder.frames.size(), truth.size());
  EXPECT_HAS(refusal_of([&] {
               find_joint_recording(
                   dir.write("2.json", R"({"people": [{"pose_keypoints_2d": [1, 2, 0.5]}]})"), {});
             }),
             "places in pictures");
  EXPECT_HAS(refusal_of([&] { find_joint_recording(dir.write("b.json", "{\"frames\": [1"), {}); }),
             "no valid JSON");
}

TEST_F(ImportersJointsTest, RowsSayWhoseTheyAreAndWhen) {
  const auto truth = walk(12);
  // Two people, rows of a frame apart from each other, numbers of frames and times.
  std::string rows = "person_id,frame,timestamp,joint,x,y,z\n";
  for (size_t j = 0; j < kJoints; ++j)
    for (size_t f = 0; f < truth.size(); ++f)
      for (const int who : {1, 0}) {
        const Vec3 x = truth[f].joints[j] + Vec3(2.0 * who, 0, 0);
        rows += format("%d,%d,%.4f,%d,%.6f,%.6f,%.6f\n", who, static_cast<int>(f),
                       static_cast<double>(f) / 60, static_cast<int>(j), x.x(), x.y(), x.z());
      }
  const std::string path = dir.write("p.csv", rows);
  EXPECT_HAS(refusal_of([&] { find_joint_recording(path, {}); }), "holds 2 people");
  for (const int who : {0, 1}) {
    const JointRecording read = found(path, {.person = std::to_string(who)});
    EXPECT_EQ(read.frames.size(), truth.size());
    EXPECT_EQ(read.fps, 60);
    EXPECT_NEAR(read.frames[5][kHead]->x(), truth[5].joints[kHead].x() + 2.0 * who, 1e-5);
  }
}

TEST_F(ImportersJointsTest, PeopleOfJsonAreFollowedByTheirIds) {
  const auto truth = walk(6);
  std::string frames;
  for (size_t f = 0; f < truth.size(); ++f) {
    std::string bodies;
    for (const int k : {0, 1}) {
      const int who = f % 2 == 0 ? k : 1 - k;  // the list changes its order
      bodies += format("%s{\"body_id\": %d, \"joint_positions\": [", k ? ", " : "", 40 + who);
      for (size_t j = 0; j < kJoints; ++j) {
        const Vec3 x = truth[f].joints[j] + Vec3(3.0 * who, 0, 0);
        bodies += format("%s[%.6f, %.6f, %s]", j ? ", " : "", x.x(), x.y(),
                         j == 15 && f == 2 ? "NaN" : format("%.6f", x.z()).c_str());
      }
      bodies += "]}";
    }
    frames += (f ? ", " : "") + ("{\"bodies\": [" + bodies + "]}");
  }
  const std::string path = dir.write("two.json", "{\"frames\": [" + frames + "]}");
  const JointRecording second = found(path, {.person = "1"});
  for (size_t f = 0; f < truth.size(); ++f)
    EXPECT_NEAR(second.frames[f][0]->x(), truth[f].joints[0].x() + 3, 1e-5) << f;
  EXPECT_FALSE(second.frames[2][15].has_value()) << "NaN is not known";
}

TEST_F(ImportersJointsTest, PixelsStraysAndRatesOfNobody) {
  const auto truth = walk();
  const auto flat = [](const Vec3& x) { return Vec3(300 * x.x(), -300 * x.y(), 0.9); };
  const auto file = [&](const char* name, const std::vector<double>& values) {
    return dir.write(name, npy<double>({std::ssize(truth), 22, 3}, values));
  };
  EXPECT_HAS(refusal_of([&] { found(file("2d.npy", numbers("smpl22", truth, flat))); }),
             "places in pictures");
  std::vector<double> stray = numbers("smpl22", truth);
  stray[66 * 20 + 60] += 50;  // a wrist, in one frame
  ImportReport report;
  EXPECT_LT(farthest(solved(file("s.npy", stray), {}, &report), truth), 0.08);
  EXPECT_HAS(remarks(report), "1 place of joints further away");
  const std::string path = npy_file("smpl22", truth);
  for (const double fps : {-1.0, 1e9, std::numeric_limits<double>::infinity()}) {
    MotionOptions wrong;
    wrong.fps = fps;
    EXPECT_HAS(refusal_of([&] { solved(path, wrong); }), "fps is out of range") << fps;
  }
  MotionOptions huge;
  huge.scale = 1e5;
  EXPECT_HAS(refusal_of([&] { solved(path, huge); }), "makes a leg of");
  MotionOptions other;
  other.layout = "smpl22";
  std::vector<double> noise = numbers("smpl22", truth);
  Rng rng(RngKey{2, 0});
  for (double& x : noise) x += 0.3 * rng.normal();
  other.force = true;
  other.scale = 1;
  solved(file("n.npy", noise), other, &report);
  EXPECT_HAS(remarks(report), "is that the order?");
}

TEST_F(ImportersJointsTest, WhatIsNoJointsOfAnybodySaysSo) {
  const std::vector<double> some(12 * 67 * 3, 0.5);
  EXPECT_HAS(refusal_of([&] {
               find_joint_recording(
                   dir.write("m.npz", npz({{"markers", npy<double>({12, 67, 3}, some)}})), {});
             }),
             "holds markers");
  EXPECT_HAS(refusal_of([&] {
               find_joint_recording(
                   dir.write("p.npy", npy<double>({12, 72}, std::vector<double>(864, 0.1))), {});
             }),
             "angles of a body model");
  EXPECT_HAS(refusal_of([&] {
               find_joint_recording(
                   dir.write("u.npy", npy<double>({12, 20, 3}, std::vector<double>(720, 1))), {});
             }),
             "an order that is not known");
  std::vector<double> features(20 * 263, 0.9);
  EXPECT_HAS(refusal_of([&] {
               features[262] = 0.5;
               find_joint_recording(dir.write("h.npy", npy<double>({20, 263}, features)), {});
             }),
             "divided by their deviations");
}

}  // namespace
}  // namespace restage
