// The doctor on sequences, and what retargeting asks of it.
#include <gtest/gtest.h>

#include "autograd/base/error.h"
#include "tests/support/doctor_people.h"

namespace restage {
namespace {

TEST(DoctorSequence, HealthyFramesHaveNothing) {
  Frames frames(performance(60));
  const Diagnosis d = examine_frames(frames);
  EXPECT_EQ(d.frames, 60);
  EXPECT_TRUE(d.usable());
  EXPECT_TRUE(d.repeated.empty());
  EXPECT_TRUE(d.gap.empty());
  EXPECT_EQ(d.find("missing frames"), nullptr);
  EXPECT_EQ(d.orientation.up, 2);
}

TEST(DoctorSequence, AxesAndUnitsOfASequence) {
  std::vector<Points> frames = performance(24);
  for (Points& points : frames) points = moved(points, into_foreign(4, 1), 100);
  Frames source(frames);
  const Diagnosis d = examine_frames(source);
  EXPECT_FALSE(d.usable());
  EXPECT_TRUE(notes(d, "up", "+z is up"));
  EXPECT_TRUE(notes(d, "units", "1 cm"));
  EXPECT_NE(d.find("units")->fix.find("--scale 0.01"), std::string::npos);
}

TEST(DoctorSequence, RepeatedFramesInAnyOrderOfPoints) {
  std::vector<Points> frames = performance(30);
  std::reverse_copy(frames[9].begin(), frames[9].end(), frames[10].begin());
  Frames source(frames);
  const Diagnosis d = examine_frames(source);
  EXPECT_EQ(d.repeated, std::set<int64_t>{10});
  EXPECT_TRUE(notes(d, "repeated frames", "1 frame equal"));
  EXPECT_EQ(d.keep_every, 1);

  std::vector<Points> twice;
  for (const Points& p : performance(20)) twice.insert(twice.end(), 2, p);
  Frames doubled(twice);
  const Diagnosis slow = examine_frames(doubled);
  EXPECT_EQ(slow.keep_every, 2);
  EXPECT_TRUE(notes(slow, "repeated frames", "15 frames a second"));
}

TEST(DoctorSequence, MissingFramesByNumberAndByMotion) {
  std::vector<Points> frames = performance(30);
  std::vector<std::string> names;
  for (int i = 0; i < 30; ++i) names.push_back("f" + std::to_string(i < 12 ? i : i + 3) + ".ply");
  Frames numbered(frames, names);
  const Diagnosis d = examine_frames(numbered);
  EXPECT_EQ(d.gap, (std::map<int64_t, int64_t>{{12, 3}}));
  EXPECT_TRUE(notes(d, "missing frames", "3 numbers missing"));

  std::vector<Points> jump = frames;
  for (size_t f = 15; f < jump.size(); ++f)
    for (Point& p : jump[f]) p += Point(0.6f, 0, 0);
  Frames jumping(jump);
  EXPECT_TRUE(notes(examine_frames(jumping), "missing frames", "jumps before frame 15"));
}

TEST(DoctorSequence, OneUnitThroughout) {
  std::vector<Points> frames = performance(40);
  for (size_t f = 20; f < frames.size(); ++f)
    for (Point& p : frames[f]) p *= 100;
  Frames changing(frames);
  const Diagnosis d = examine_frames(changing);
  EXPECT_TRUE(notes(d, "sizes", "before frame 20"));
  EXPECT_FALSE(d.usable());
  EXPECT_FALSE(d.transform);
  EXPECT_NO_THROW(check_frame(frames[19], "f19"));
  EXPECT_THROW(check_frame(frames[20], "f20"), InputError);
  // Somebody who comes into view is no other unit.
  std::vector<Points> joined = performance(40);
  for (size_t f = 20; f < joined.size(); ++f)
    for (const Point& p : Points(joined[f])) joined[f].push_back(p + Point(1.2f, 0, 0));
  Frames company(joined);
  EXPECT_EQ(examine_frames(company).find("sizes"), nullptr);
}

TEST(DoctorSequence, EveryFrameNeedsPoints) {
  std::vector<Points> frames = performance(60);
  frames[51].resize(50);
  Frames source(frames);
  EXPECT_TRUE(notes(examine_frames(source), "points", "only 50"));
}

TEST(DoctorSequence, SkeletonsAreOfAPersonsSize) {
  Joints joints = somebody().joints;
  EXPECT_EQ(examine_skeletons({joints}).what, "metres");
  for (Vec3& x : joints) x *= 100;
  EXPECT_EQ(examine_skeletons({joints}).weight, Weight::wrong);
  joints.fill(Vec3::Zero());
  EXPECT_EQ(examine_skeletons({joints}).weight, Weight::wrong);
}

TEST(DoctorSequence, NobodyRunsThatFast) {
  std::vector<Points> frames = performance(20);
  for (size_t f = 0; f < frames.size(); ++f)
    for (Point& p : frames[f]) p += static_cast<float>(f) * Point(0, 0, 0.3f);
  Frames fast(frames, {}, 120);
  EXPECT_TRUE(notes(examine_frames(fast), "frame rate", "cannot be"));
}

TEST(DoctorChecks, RefuseNonsenseWithTheOptionThatMendsIt) {
  const auto words = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const auto source = [&](const Mat3& turn, double scale, const SourceFrame& given = {}) {
    std::vector<Mesh> frames;
    for (const Points& p : performance(kSourceFrames))
      frames.push_back(cloud(moved(p, turn, scale)));
    return words([&] { check_source(frames, "scans", given); });
  };
  // What was given already counts: metres read as centimetres, y up read as z up.
  EXPECT_NE(source(Mat3::Identity(), 0.01, {0.01, false}).find("leave --scale out"),
            std::string::npos);
  EXPECT_NE(source(Mat3::Identity(), 10, {0.1, false}).find("--scale 0.01"), std::string::npos);
  EXPECT_NE(source(into_foreign(5, 2), 1, {1, true}).find("leave --source-up out"),
            std::string::npos);
  EXPECT_NE(source(Mat3::Identity(), 3e4).find("--scale"), std::string::npos);
  EXPECT_EQ(source(Mat3::Identity(), 1), "");
  EXPECT_NE(source(into_foreign(4, 1), 1).find("--source-up z"), std::string::npos);
  EXPECT_NE(source(into_foreign(0, 4), 1).find("--fix"), std::string::npos);
  EXPECT_NE(source(Mat3::Identity(), 100).find("--scale 0.01"), std::string::npos);
  const auto target = [&](const Mat3& turn, double scale) {
    return words([&] { check_target(cloud(moved(scan(somebody()), turn, scale)), "hero"); });
  };
  EXPECT_EQ(target(Mat3::Identity(), 1), "");
  EXPECT_NE(target(into_foreign(4, 1), 1).find("+z"), std::string::npos);
  EXPECT_NE(target(into_foreign(2, 5), 1).find("faces -z"), std::string::npos);
  EXPECT_NE(target(Mat3::Identity(), 1000).find("1 mm"), std::string::npos);
}

TEST(DoctorChecks, GoodInputIsNeverRefused) {
  const std::vector<Body> bodies = builtin_bodies(0, 0, 0, 4);
  for (const Body& body : bodies) {
    EXPECT_NO_THROW(check_target(body.rest, body.id));
    EXPECT_NO_THROW(check_target(cloud(scan(body)), body.id));
  }
  for (int k = 0; k < 44; ++k) {
    const Motion motion = builtin_motion(0, "test", k);
    const Body& body = bodies[static_cast<size_t>(k) % bodies.size()];
    std::vector<Mesh> frames;
    for (size_t f = 0; f < kSourceFrames; ++f) {
      const Pose pose = pose_on(motion, body, f);
      frames.push_back(cloud(SurfaceSampler(body).draw(RngKey{f, 1}, 1000).on_pose(body, pose)));
    }
    EXPECT_NO_THROW(check_source(frames, motion.id)) << motion.action;
  }
}

}  // namespace
}  // namespace restage
