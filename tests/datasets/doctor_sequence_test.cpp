// The doctor on sequences, and what retargeting asks of it; what it mends, and points that are too
// far away to be read.
#include <gtest/gtest.h>

#include <fstream>

#include "autograd/base/error.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/clouds/precision.h"
#include "tests/support/doctor_people.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"

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
  EXPECT_NE(d.find("units")->fix.find("scale 0.01"), std::string::npos);
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

/// A frame without a point is a missing frame, whether or not names count.
TEST(DoctorSequence, EmptyFramesAreMissingFrames) {
  for (const bool named : {false, true}) {
    std::vector<Points> frames = performance(30);
    std::vector<std::string> names;
    for (int i = 0; i < 30; ++i) names.push_back("f" + std::to_string(i) + ".ply");
    frames[12].clear();
    frames[13].clear();
    const auto source = without_empty_frames(
        std::make_unique<Frames>(frames, named ? names : std::vector<std::string>{}));
    const Diagnosis d = examine_frames(*source);
    EXPECT_EQ(d.frames, 28);
    EXPECT_EQ(d.gap, (std::map<int64_t, int64_t>{{12, 2}})) << named;
    EXPECT_TRUE(notes(d, "missing frames", "2 frames without any point"));
    EXPECT_FALSE(notes(d, "missing frames", "numbers missing"));
  }
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

TEST(DoctorSequence, TheRateIsTheUsersOrTheFiles) {
  Frames said(performance(12), {}, 60);
  EXPECT_EQ(examine_frames(said).fps, 60);
  said.rewind();
  ExamineOptions known;
  known.fps = 120;
  const Diagnosis d = examine_frames(said, known);
  EXPECT_EQ(d.fps, 120);
  ASSERT_NE(d.find("frame rate"), nullptr);
  EXPECT_EQ(d.find("frame rate")->what, "120 frames a second");
}

/// From wherever they are seen, people are turned by the angle that they are turned by, where it is
/// sure and large enough.
TEST(DoctorSequence, IsTurnedByTheAngleFound) {
  Frames straight(performance(4));
  const Mat3 forwards = examine_frames(straight).orientation.exact_turn();
  int exactly = 0;
  for (int k = 0; k < 12; ++k) {
    const Mat3 turn = turn_about_y((15 + 30 * k) * 3.14159265358979 / 180);
    std::vector<Points> frames;
    for (const Points& frame : performance(4)) frames.push_back(moved(frame, turn));
    Frames turned(frames);
    const Diagnosis d = examine_frames(turned);
    ASSERT_TRUE(d.transform);
    // The performer stands as if the sequence had not been turned at all; by quarters alone that
    // would be up to 45 degrees off.
    const Mat3 left = d.transform->rotation * turn * forwards.transpose();
    const double off = std::abs(std::atan2(left(0, 2), left(2, 2))) * 180 / 3.14159265358979;
    EXPECT_LT(off, d.turned != 0 ? 15 : 50) << k;
    exactly += d.turned != 0;
  }
  EXPECT_GE(exactly, 4);
}

TEST(DoctorSequence, NobodyIsTurnedOnAGuess) {
  int unsure = 0;
  for (double degrees = 20; degrees < 75; degrees += 5) {
    std::vector<Points> frames = performance(12);
    const Mat3 tilt =
        Eigen::AngleAxisd(degrees * 3.14159265358979 / 180, Vec3::UnitX()).toRotationMatrix();
    for (Points& points : frames) points = moved(points, tilt, 1);
    Frames source(frames);
    const Diagnosis d = examine_frames(source);
    const Finding* up = d.find("up");
    if (up == nullptr || up->weight != Weight::note || !d.transform) continue;
    ++unsure;
    EXPECT_GT(d.transform->rotation(1, 1), 0.99) << degrees;
    EXPECT_HAS(up->what, "may be up, not +y");
    EXPECT_HAS(up->fix, "up=");
  }
  EXPECT_GT(unsure, 0);
}

TEST(DoctorSequence, FirstFramesOfSomethingElseAreNoOtherUnit) {
  std::vector<Points> frames = performance(24);
  for (size_t f = 0; f < 3; ++f) frames[f] = moved(frames[f], Mat3::Identity(), 3);
  Frames source(frames);
  const Diagnosis d = examine_frames(source);
  EXPECT_TRUE(d.usable());
  EXPECT_EQ(d.odd_front, 3);
  EXPECT_TRUE(d.transform);
  std::vector<Points> cm = performance(24);
  for (size_t f = 0; f < 12; ++f) cm[f] = moved(cm[f], Mat3::Identity(), 100);
  Frames mixed(cm);
  EXPECT_FALSE(examine_frames(mixed).usable());
}

TEST(DoctorSequence, NobodyRunsThatFast) {
  std::vector<Points> frames = performance(20);
  for (size_t f = 0; f < frames.size(); ++f)
    for (Point& p : frames[f]) p += static_cast<float>(f) * Point(0, 0, 0.3f);
  Frames fast(frames, {}, 120);
  EXPECT_TRUE(notes(examine_frames(fast), "frame rate", "cannot be"));
}

TEST(DoctorChecks, RefuseNonsenseWithTheOptionThatMendsIt) {
  const auto source = [&](const Mat3& turn, double scale, const SourceFrame& given = {}) {
    std::vector<Mesh> frames;
    for (const Points& p : performance(kSourceFrames))
      frames.push_back(cloud(moved(p, turn, scale)));
    return test::refusal_of([&] { check_source(frames, "scans", given); });
  };
  // What was given already counts: metres read as centimetres, y up read as z up.
  EXPECT_HAS(source(Mat3::Identity(), 0.01, {0.01, "y"}), "leave scale out");
  EXPECT_HAS(source(Mat3::Identity(), 10, {0.1, "y"}), "scale 0.01");
  EXPECT_EQ(source(into_foreign(5, 2), 1, {1, "z", true}), "") << "who says so is believed";
  EXPECT_EQ(source(into_foreign(4, 1), 1, {1, "y", true}), "");
  EXPECT_HAS(source(Mat3::Identity(), 3e4), "scale");
  EXPECT_EQ(source(Mat3::Identity(), 1), "");
  EXPECT_HAS(source(into_foreign(4, 1), 1), "source_up z");
  EXPECT_HAS(source(into_foreign(0, 4), 1), "source_up x");
  EXPECT_HAS(source(into_foreign(3, 4), 1), "source_up -y");
  EXPECT_HAS(source(Mat3::Identity(), 100), "scale 0.01");
  const auto target = [&](const Mat3& turn, double scale) {
    return test::refusal_of(
        [&] { check_target(cloud(moved(scan(somebody()), turn, scale)), "hero"); });
  };
  EXPECT_EQ(target(Mat3::Identity(), 1), "");
  EXPECT_HAS(target(into_foreign(4, 1), 1), "+z");
  EXPECT_HAS(target(into_foreign(2, 5), 1), "faces -z");
  EXPECT_HAS(target(Mat3::Identity(), 1000), "1 mm");
}

/// On the floor, the head along z.
Points lying(const Points& standing) {
  Points out = moved(standing, into_foreign(4, 1), 1);
  float lowest = out[0].y();
  for (const Point& p : out) lowest = std::min(lowest, p.y());
  for (Point& p : out) p.y() -= lowest;
  return out;
}

TEST(DoctorChecks, WhoLiesFirstAndStandsUpLaterIsTakenAsGiven) {
  std::vector<Points> take = performance(40);
  for (size_t f = 0; f < 28; ++f) take[f] = lying(take[f]);
  const auto refusal = [](const std::vector<Points>& clouds, bool all) {
    std::vector<Mesh> first;
    for (size_t f = 0; f < kSourceFrames; ++f) first.push_back(cloud(clouds[f]));
    const TakeClouds whole = [&] { return clouds; };
    return test::refusal_of([&] { check_source(first, "scans", {}, all ? whole : TakeClouds()); });
  };
  EXPECT_HAS(refusal(take, false), "up");
  EXPECT_EQ(refusal(take, true), "");
  EXPECT_EQ(up_of_take(take, 2), 2);
  // In a file whose z is up the same person does not stand along y, though they lie along it.
  std::vector<Points> foreign;
  for (const Points& p : take) foreign.push_back(moved(p, into_foreign(4, 1), 1));
  EXPECT_EQ(up_of_take(foreign, 2), 4);
  EXPECT_HAS(refusal(foreign, true), "source_up z");
  // On the hands all the time: nothing tells it from somebody upright in another frame.
  std::vector<Points> hands;
  for (const Points& p : performance(40))
    hands.push_back(moved(p, Eigen::AngleAxisd(M_PI, Vec3::UnitX()).matrix(), 1));
  EXPECT_HAS(refusal(hands, true), "-y");
  // Who stands along y now and then, but over no floor: swinging from a bar, in a file with z up.
  std::vector<Points> swinging = performance(40);
  for (size_t f = 0; f < 40; ++f) {
    if (f < 24) swinging[f] = moved(swinging[f], into_foreign(4, 1), 1);
    for (Point& p : swinging[f]) p += 0.1f * static_cast<float>(f % 8) * Point(0, 1, 0);
  }
  EXPECT_HAS(refusal(swinging, true), "source_up z");
  // Nobody stands: both readings are told, and nothing is taken.
  for (Points& p : take) p = lying(performance(1)[0]);
  EXPECT_HAS(refusal(take, true), "where people lie");
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
  const Mesh out = mended_here(somebody().rest);
  EXPECT_EQ(out.vertices, somebody().rest.vertices);
  EXPECT_EQ(out.faces, somebody().rest.faces);
}

TEST(DoctorRepair, WholePiecesThatAreNotThePersonAreLeftOut) {
  const Mesh both = together(plate(0.7f), somebody().rest, Point(3, 0, 0));
  const Mesh out = mended_here(both);
  EXPECT_EQ(out.faces, somebody().rest.faces) << "in their order, with new numbers";
  ASSERT_EQ(out.vertices.size(), somebody().rest.vertices.size());
  EXPECT_EQ(out.vertices[0], both.vertices[4]);
}

TEST(DoctorRepair, SeamsHoldASurfaceTogetherAndTinyPiecesGoWithTheirPlace) {
  // As exporters write it: every triangle with vertices of its own.
  Mesh soup;
  for (const Triangle& f : somebody().rest.faces)
    for (const int32_t v : f)
      soup.vertices.push_back(somebody().rest.vertices[static_cast<size_t>(v)]);
  for (int32_t i = 0; i < static_cast<int32_t>(soup.vertices.size()); i += 3)
    soup.faces.push_back({i, i + 1, i + 2});
  EXPECT_EQ(mended_here(soup).faces.size(), soup.faces.size());
  // Too small for a sample of the surface: on the skin it stays, far from it it goes.
  const Point skin = somebody().rest.vertices[10];
  EXPECT_EQ(mended_here(together(somebody().rest, plate(1e-4f), skin)).faces.size(),
            somebody().rest.faces.size() + 2);
  EXPECT_EQ(mended_here(together(somebody().rest, plate(1e-4f), Point(2, 1, 2))).faces.size(),
            somebody().rest.faces.size());
}

TEST(DoctorRepair, OfEqualPointsTheFirstStays) {
  Mesh cloud{somebody().rest.vertices, {}};
  cloud.vertices.push_back(cloud.vertices[3]);
  cloud.vertices.insert(cloud.vertices.begin(), cloud.vertices[5]);
  const Mesh out = mended_here(cloud);
  ASSERT_EQ(out.vertices.size(), somebody().rest.vertices.size());
  EXPECT_EQ(out.vertices[0], somebody().rest.vertices[5]);
}

TEST(DoctorRepair, TransformsFollowEachOther) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Similarity first{0.01, turn, Vec3(3, -4, 5)}, then{2, turn.transpose(), Vec3(1, 2, -3)};
  const Vec3 p(7, 8, 9);
  EXPECT_TRUE(then.after(first)(p).isApprox(then(first(p)), 1e-12));
}

TEST(Precision, FarPointsAreRefusedOrReadRelativeToThem) {
  EXPECT_FALSE(is_blurred(somebody().rest.vertices));
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
  LeftOut left_out;
  const Mesh mesh = read_mesh(path, left_out, origin);
  EXPECT_EQ(mesh.vertices[1].x() + origin.x(), 5000000.25);
  EXPECT_EQ(mesh.vertices[1].y() + origin.y(), 1.5);
  write_obj(dir / "near.obj", somebody().rest);
  read_mesh(dir / "near.obj", left_out, origin);
  EXPECT_TRUE(origin.isZero(0));
}

}  // namespace
}  // namespace restage
