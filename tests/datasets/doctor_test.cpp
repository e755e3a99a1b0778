// The doctor on single scans and surfaces: what it finds, how sure it is, and what it mends; which
// way people are up and face, and in which unit.
#include <gtest/gtest.h>

#include "autograd/base/error.h"
#include "datasets/doctor/orientation_model.h"
#include "datasets/doctor/planes.h"
#include "nn/geometry/box.h"
#include "tests/support/doctor_people.h"

namespace restage {
namespace {

TEST(Doctor, AHealthyBodyHasNothing) {
  for (const Mesh& mesh : {somebody().rest, cloud(scan(somebody()))}) {
    const Diagnosis d = examine_target(mesh);
    for (const Finding& f : d.findings)
      EXPECT_EQ(f.weight, Weight::fact) << f.topic << ": " << f.what;
    EXPECT_TRUE(d.transform && d.transform->is_identity());
    float low = 1e9f, high = -1e9f;
    for (const Point& p : mesh.vertices) low = std::min(low, p.y()), high = std::max(high, p.y());
    EXPECT_NEAR(d.height, high - low, 0.03);
    EXPECT_EQ(d.find("pose")->what, "T-pose");
  }
}

TEST(Doctor, FloorIsFoundAndMoved) {
  const Diagnosis d =
      examine_surface(cloud(moved(scan(somebody()), Mat3::Identity(), 1, {0, 0.8f, 0})));
  ASSERT_TRUE(notes(d, "floor", "at 0.")) << d.find("floor")->what;
  EXPECT_NEAR(std::stod(d.find("floor")->what.substr(3)), 0.8, 0.02);  // soles are noisy too
  EXPECT_TRUE(d.usable());
  EXPECT_NEAR((*d.transform)(Point(0, 0.8f, 0)).y(), 0, 0.02);
}

/// Vertices of a mesh taken as a cloud: hundreds in the head, few elsewhere. What is usual in one
/// place makes nothing stray in another.
TEST(Doctor, ADenseHeadMakesNothingElseStray) {
  Points points = scan(somebody());
  const size_t even = points.size();
  Rng rng(RngKey{3, 0});
  for (size_t i = 0; i < even; ++i)
    for (int k = 0; k < 40 && points[i].y() > somebody().joints[15].y(); ++k)
      points.push_back(points[i] +
                       0.01f * Point(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)));
  ASSERT_GT(points.size(), 2 * even);
  const Parts parts = find_parts(points);
  EXPECT_EQ(parts.other, 0u);
  EXPECT_LT(parts.stray, even / 100);
  const Diagnosis d = examine_surface(cloud(points));
  EXPECT_EQ(d.orientation.up, 2);
  EXPECT_EQ(d.unit.unit.metres, 1);
  ASSERT_NE(d.find("pose"), nullptr);
  EXPECT_EQ(d.find("pose")->what, "T-pose");
}

/// Pixels without depth, all at one place: judged as if they were not there, and in no time.
TEST(Doctor, RepeatsOfAPointAreToldAndOtherwiseIgnored) {
  Points points = scan(somebody());
  points.push_back(Point(0, 0, 1));
  const Diagnosis clean = examine_surface(cloud(points));
  const size_t distinct_points = points.size();
  points.insert(points.begin(), 3 * distinct_points, Point(0, 0, 1));
  const Diagnosis d = examine_surface(cloud(points));
  EXPECT_TRUE(notes(d, "duplicates", std::to_string(3 * distinct_points) + " points equal"));
  EXPECT_EQ(d.size, clean.size);
  EXPECT_EQ(d.height, clean.height);
  EXPECT_EQ(d.orientation.up_sure, clean.orientation.up_sure);
  ASSERT_NE(d.find("outliers"), nullptr);
  EXPECT_EQ(d.find("outliers")->what, clean.find("outliers")->what);
  EXPECT_EQ(mended(cloud(points), d).vertices.size(),
            mended(cloud(without_repeats(points)), clean).vertices.size());

  points.assign(200000, Point(0, 0, 0));  // nothing but such pixels
  EXPECT_TRUE(examine_surface(cloud(points)).find("points"));
}

TEST(Doctor, StrayPointsAreCountedAndRemoved) {
  Points points = scan(somebody());
  const size_t clean = points.size();
  Rng rng(RngKey{7, 0});
  for (int i = 0; i < 20; ++i) {
    const double a = rng.uniform(0, 6.28);
    points.push_back(Point(static_cast<float>(1.6 * std::cos(a)),
                           static_cast<float>(rng.uniform(0, 2)),
                           static_cast<float>(1.6 * std::sin(a))));
  }
  const Diagnosis d = examine_surface(cloud(points));
  EXPECT_TRUE(notes(d, "outliers", "20 stray points"));
  EXPECT_EQ(d.orientation.up, 2);
  EXPECT_EQ(mended(cloud(points), d).vertices.size(), clean);
}

TEST(Doctor, SomebodyElseIsToldFromThePerson) {
  const Points person = scan(somebody());
  Points limb = person, crowd = person;
  for (const Point& p : scan(builtin_body(0, "test", 1), nullptr, 0, 2)) {
    if (p.x() > 0.35f) limb.push_back(p + Point(0.9f, 0, 0.2f));  // an arm reaches into the view
    crowd.push_back(p + Point(0.3f, 0, 1.5f));
  }
  const Diagnosis with_limb = examine_surface(cloud(limb));
  EXPECT_TRUE(notes(with_limb, "others", "part of somebody"));
  EXPECT_TRUE(with_limb.usable());
  EXPECT_EQ(mended(cloud(limb), with_limb).vertices.size(), person.size());
  const Diagnosis with_crowd = examine_surface(cloud(crowd));
  EXPECT_TRUE(notes(with_crowd, "others", "second person"));
  EXPECT_FALSE(with_crowd.usable());
  EXPECT_TRUE(examine_surface(mended(cloud(crowd), with_crowd)).usable());
}

TEST(Doctor, OfTwoPeopleTheOneOfTheFrameBeforeIsKept) {
  const Points first = scan(somebody());
  Points second;
  for (const Point& p : scan(builtin_body(0, "test", 1), nullptr, 0, 2))
    second.push_back(p + Point(0.3f, 0, 1.5f));
  const auto together = [&](double of_first, double of_second) {
    Points out;
    Rng rng(RngKey{8, 0});
    for (const Point& p : first)
      if (rng.uniform() < of_first) out.push_back(p);
    for (const Point& p : second)
      if (rng.uniform() < of_second) out.push_back(p);
    return out;
  };
  const auto kept = [&](const Points& points, std::optional<Point>* person) {
    const Mesh mesh = mended(cloud(points), examine_surface(cloud(points)), person);
    return box_of(mesh.vertices).center().z() < 0.75f ? 1 : 2;
  };
  std::optional<Point> person;
  EXPECT_EQ(kept(together(1, 0.7), &person), 1);
  EXPECT_EQ(kept(together(0.7, 1), nullptr), 2) << "the larger one, where nobody was before";
  EXPECT_EQ(kept(together(0.7, 1), &person), 1);
  EXPECT_EQ(kept(together(0.3, 1), &person), 2) << "not somebody of whom little is left";
}

TEST(Doctor, HolesAreFound) {
  Mesh mesh = somebody().rest;
  EXPECT_EQ(borders(mesh).edges, 0u);
  std::erase_if(mesh.faces, [&](const Triangle& f) {
    const Point& p = mesh.vertices[static_cast<size_t>(f[0])];
    return p.z() > 0 && std::abs(p.x()) < 0.05f && std::abs(p.y() - 1.2f) < 0.05f;
  });
  EXPECT_EQ(borders(mesh).loops, 1u);
  EXPECT_TRUE(notes(examine_surface(mesh), "holes", "open border"));
  Points front = scan(somebody());
  EXPECT_FALSE(notes(examine_surface(cloud(front)), "holes", "one side"));
  // A hole through the trunk of a cloud is no separate person.
  std::erase_if(front, [](const Point& p) { return std::abs(p.y() - 1.0f) < 0.06f; });
  EXPECT_EQ(examine_surface(cloud(front)).find("others"), nullptr);
}

TEST(Doctor, OneSidedScansAreFound) {
  const Body& body = somebody();
  const Points points = SurfaceSampler(body).draw(RngKey{3, 0}, 4000).on_rest(body);
  std::map<std::pair<long, long>, float> front;
  const auto ray = [](const Point& p) {
    return std::pair(std::lround(p.x() / 0.04), std::lround(p.y() / 0.04));
  };
  for (const Point& p : points) {
    const auto at = front.try_emplace(ray(p), p.z()).first;
    at->second = std::max(at->second, p.z());
  }
  Points seen;
  for (const Point& p : points)
    if (p.z() > front[ray(p)] - 0.05f) seen.push_back(p);
  EXPECT_TRUE(notes(examine_surface(cloud(seen)), "holes", "one side"));
}

TEST(Doctor, DuplicatesAndFewPoints) {
  Points points = scan(somebody());
  const size_t clean = points.size();
  points.insert(points.end(), points.begin(), points.begin() + 30);
  const Diagnosis d = examine_surface(cloud(points));
  EXPECT_TRUE(notes(d, "duplicates", "30 points"));
  EXPECT_EQ(mended(cloud(points), d).vertices.size(), clean);
  const Diagnosis few = examine_surface(cloud(Points(200, Point(1, 2, 3))));
  EXPECT_TRUE(notes(few, "points", "only 1 distinct"));
  EXPECT_FALSE(few.usable());
  EXPECT_FALSE(few.transform);
}

/// Two by two metres of floor, or of a wall behind the person.
Points with_plane(Points points, bool wall) {
  Rng rng(RngKey{11, 0});
  for (int i = 0; i < 1500; ++i) {
    const auto u = static_cast<float>(rng.uniform(-1, 1)),
               v = static_cast<float>(rng.uniform(-1, 1)),
               noise = static_cast<float>(0.004 * rng.normal());
    points.push_back(wall ? Point(u, 1 + v, -0.5f + noise) : Point(u, noise, v));
  }
  return points;
}

TEST(Doctor, FloorsAndWallsAreNamedAndRemoved) {
  const Points person = scan(somebody());
  for (const bool wall : {false, true})
    for (const double units : {1.0, 100.0}) {
      const Mesh mesh = cloud(moved(with_plane(person, wall), into_foreign(4, 1), units));
      const Diagnosis d = examine_surface(mesh);
      EXPECT_TRUE(notes(d, "plane", wall ? "a wall" : "a floor"));
      EXPECT_FALSE(d.usable());
      EXPECT_EQ(d.orientation.up, 4);
      EXPECT_EQ(d.unit.unit.metres, 1 / units);
      const size_t left = mended(mesh, d).vertices.size();
      EXPECT_LE(left, person.size() + 15);
      EXPECT_GE(left, person.size() * 96 / 100) << "soles lie on the floor";
    }
  EXPECT_THROW(check_target(cloud(with_plane(person, false)), "hero"), InputError);
}

TEST(Doctor, AFloorInViewIsLevelled) {
  for (const double degrees : {-25.0, 0.0, 12.0, 25.0}) {
    const Mat3 tilt =
        Eigen::AngleAxisd(degrees * 3.14159265358979 / 180, Vec3::UnitX()).toRotationMatrix();
    const Mesh mesh = cloud(moved(with_plane(scan(somebody()), false), tilt, 1));
    const Diagnosis d = examine_surface(mesh);
    ASSERT_TRUE(d.transform) << degrees;
    EXPECT_EQ(notes(d, "tilt", "is tilted by"), degrees != 0);
    EXPECT_GT((d.transform->rotation * tilt).col(1).y(), 0.9995) << degrees;
    double lowest = 1;
    for (const Point& p : mended(mesh, d).vertices) lowest = std::min(lowest, double{p.y()});
    EXPECT_NEAR(lowest, 0, 0.04) << degrees;
  }
}

TEST(Doctor, NobodyIsTakenForAFloor) {
  for (int k = 0; k < 22; ++k) {
    const Motion motion = builtin_motion(0, "test", k);
    EXPECT_FALSE(find_planes(scan(somebody(), &motion, motion.frames() / 2)).any()) << k;
  }
  Points flat;
  Rng rng(RngKey{12, 0});
  for (int i = 0; i < 1000; ++i)
    flat.push_back({static_cast<float>(rng.uniform()), 0, static_cast<float>(rng.uniform())});
  EXPECT_FALSE(find_planes(flat).any()) << "with nobody beside it, it is no floor";
}

/// Bent so little that the plane fitted to it has all of its points: nobody was left to judge.
TEST(Doctor, ABentSheetIsNobody) {
  const Mesh sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.02f}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const Diagnosis d = examine_surface(sheet);
  EXPECT_FALSE(d.usable());
  EXPECT_EQ(d.find("plane"), nullptr);
  EXPECT_EQ(mended(sheet, d).vertices.size(), 4u);
}

/// Triangles that share a corner and nothing else: all their edges are borders, of one line.
TEST(Doctor, AFanOfTrianglesIsOneBorder) {
  Mesh fan{{Point::Zero()}, {}};
  for (int32_t i = 1; i < 200000; i += 2) {
    fan.vertices.insert(fan.vertices.end(), 2, Point(static_cast<float>(i), 1, 0));
    fan.faces.push_back({0, i, i + 1});
  }
  EXPECT_EQ(borders(fan).edges, 300000u);
  EXPECT_EQ(borders(fan).loops, 1u);
}

TEST(Doctor, NobodyIsOfThatSize) {
  const auto judged = [](double scale, std::optional<double> given = std::nullopt) {
    ExamineOptions options;
    options.scale = given;
    return examine_surface(cloud(moved(scan(somebody()), Mat3::Identity(), scale)), options);
  };
  for (const double scale : {1e-30, 1e-3, 1e-2, 1 / 0.3048, 20.0, 1e9, 1e30})
    EXPECT_FALSE(judged(scale).usable()) << scale;
  for (const double scale : {0.31, 0.55, 1.0, 1.7}) EXPECT_TRUE(judged(scale).usable()) << scale;
  EXPECT_TRUE(judged(100, 0.01).usable());
  EXPECT_FALSE(judged(100, 1).usable());
  EXPECT_NE(judged(100, 1).find("units")->fix.find("scale 0.01"), std::string::npos);
}

/// The same target, the same answer: what the doctor calls wrong is refused, nothing else.
TEST(Doctor, TargetsAreJudgedAsRetargetingDoes) {
  const Body& body = somebody();
  const auto posed = [&](int joint, const Vec3& axis, double angle, int child, double back) {
    Pose pose;
    pose.root = body.joints[0];
    pose.local.fill(Mat3::Identity());
    for (const int side : {0, 1}) {
      const double sign = axis.z() != 0 && side == 1 ? -1 : 1;
      pose.local[static_cast<size_t>(joint + side)] =
          Eigen::AngleAxisd(sign * angle, axis).toRotationMatrix();
      if (child > 0)
        pose.local[static_cast<size_t>(child + side)] =
            Eigen::AngleAxisd(back, axis).toRotationMatrix();
    }
    return cloud(SurfaceSampler(body).draw(RngKey{4, 0}, 1500).on_pose(body, pose));
  };
  const Mesh turned = cloud(moved(scan(body), turn_about_y(0.75)));
  const Mesh seated = posed(1, Vec3::UnitX(), -1.5, 4, 1.5),
             hanging = posed(16, Vec3::UnitZ(), -1, 0, 0);
  for (const auto& [mesh, good] :
       {std::pair(body.rest, true), {turned, false}, {seated, false}, {hanging, false}}) {
    const Diagnosis d = examine_target(mesh);
    EXPECT_EQ(d.usable(), good) << d.find("pose")->evidence << ", up " << d.orientation.up_sure;
    EXPECT_EQ(notes(d, "pose", "not a T-pose"), !good);
    if (good)
      EXPECT_NO_THROW(check_target(mesh, "hero"));
    else
      EXPECT_THROW(check_target(mesh, "hero"), InputError);
  }
}

/// A figure whose flesh looks upside down: what its rig says holds, for the doctor and retargeting.
TEST(Doctor, ARigKnowsBetterThanTheShapeOfItsFlesh) {
  const Body& body = somebody();
  Mesh figure = body.rest;  // turned over, which keeps left and right
  for (Point& p : figure.vertices) p = Point(p.x(), 1.7f - p.y(), -p.z());
  EXPECT_TRUE(notes(examine_target(figure), "up", "-y is up"));
  EXPECT_THROW(check_target(figure, "hero"), InputError);

  ExamineOptions known;
  known.target = true;
  known.joints = body.joints;
  const Diagnosis d = examine_surface(figure, known);
  EXPECT_TRUE(d.usable());
  EXPECT_EQ(d.find("up")->evidence, "the rig's joints");
  EXPECT_EQ(d.find("pose")->what, "T-pose");
  ASSERT_TRUE(d.transform);
  EXPECT_TRUE(d.transform->rotation.isIdentity(0));
  EXPECT_EQ(d.transform->scale, 1);
  EXPECT_NO_THROW(check_target(figure, "hero", known));
  // Whoever knows better still may say so.
  known.up = 3;
  EXPECT_FALSE(examine_surface(figure, known).transform->rotation.isIdentity(0.1));
  known.up.reset();

  // The rig's own pose is judged by the same rule.
  for (const int side : {0, 1})
    for (const int j : {18, 20}) {
      Vec3& p = (*known.joints)[static_cast<size_t>(j + side)];
      const Vec3 shoulder = body.joints[static_cast<size_t>(16 + side)];
      p = shoulder + Eigen::AngleAxisd((side == 0 ? -1 : 1) * 0.9, Vec3::UnitZ()) * (p - shoulder);
    }
  EXPECT_TRUE(notes(examine_surface(figure, known), "pose", "not a T-pose"));
  EXPECT_THROW(check_target(figure, "hero", known), InputError);

  // Of a rig that is not known the format's axis stays up.
  ExamineOptions format;
  format.target = format.y_up = true;
  const Diagnosis unknown = examine_surface(figure, format);
  EXPECT_TRUE(notes(unknown, "up", "though its shape looks as if -y were"));
  EXPECT_EQ(unknown.orientation.up, 2);
  ASSERT_TRUE(unknown.transform);
  EXPECT_EQ((unknown.transform->rotation * Vec3::UnitY()).y(), 1);
}

/// What the doctor calls unusable is refused as a target, also with few points.
TEST(Doctor, FlatSquaresAreNoTarget) {
  Mesh squares;  // twelve of them, with corners of their own: 48 vertices
  for (int32_t i = 0; i < 12; ++i) {
    const Point at(0.06f * static_cast<float>(i % 4), 0.06f * static_cast<float>(i / 4), 0);
    for (const Point& corner :
         {Point(0, 0, 0), Point(0.05f, 0, 0), Point(0.05f, 0.05f, 0), Point(0, 0.05f, 0)})
      squares.vertices.push_back(at + corner);
    squares.faces.push_back({4 * i, 4 * i + 1, 4 * i + 2});
    squares.faces.push_back({4 * i, 4 * i + 2, 4 * i + 3});
  }
  EXPECT_FALSE(examine_target(squares).usable());
  EXPECT_THROW(check_target(squares, "squares"), InputError);
}

TEST(Doctor, TargetsMustStandInTPoseAndFaceForwards) {
  const Motion motion = builtin_motion(0, "test", 0);
  const Mesh walking = cloud(scan(somebody(), &motion, 10));
  EXPECT_TRUE(notes(examine_target(walking), "pose", "not a T-pose"));
  EXPECT_TRUE(examine_surface(walking).usable()) << "fine as a source";
  const Mesh backwards = cloud(moved(scan(somebody()), turn_about_y(3.14159265358979)));
  EXPECT_TRUE(notes(examine_target(backwards), "facing", "-z"));
  EXPECT_TRUE(examine_surface(backwards).usable());
}

TEST(Doctor, MirrorImagesShowInNamedJoints) {
  Joints joints = somebody().joints;
  EXPECT_EQ(is_mirrored(joints), std::optional(false));
  for (Vec3& p : joints) p.x() = -p.x();
  EXPECT_EQ(is_mirrored(joints), std::optional(true));
  for (Vec3& p : joints) p = turn_about_y(2) * p;
  EXPECT_EQ(is_mirrored(joints), std::optional(true));
  joints.fill(Vec3::Zero());
  EXPECT_FALSE(is_mirrored(joints));
}

TEST(DoctorOrientation, HypothesesAreProperTurns) {
  int permutations = 0;
  for (int up = 0; up < 6; ++up)
    for (int heading = 0; heading < 24; ++heading) {
      const Eigen::Matrix3f turn = doctor_detail::hypothesis(up, heading);
      EXPECT_NEAR(turn.determinant(), 1, 1e-5);
      EXPECT_TRUE((turn * direction(up).cast<float>()).isApprox(Point::UnitY(), 1e-5f));
      permutations += turn.isApprox(turn.array().round().matrix(), 0);
    }
  EXPECT_EQ(permutations, 24);
}

TEST(DoctorOrientation, EveryAxisAndUnitOfAScanIsFound) {
  const Points rest = scan(somebody());
  size_t unit = 0;
  for (int up = 0; up < 6; ++up)
    for (int facing = 0; facing < 6; ++facing) {
      if (facing / 2 == up / 2) continue;
      const LengthUnit length = kUnits[unit++ % kUnits.size()];
      const Points foreign = moved(rest, into_foreign(up, facing), 1 / length.metres);
      const Diagnosis d = examine_surface(cloud(foreign));
      EXPECT_EQ(d.orientation.up, up);
      EXPECT_EQ(d.orientation.facing, facing);
      EXPECT_GT(d.orientation.up_sure, 0.9);
      EXPECT_EQ(d.unit.unit.metres, length.metres);
      EXPECT_EQ(d.usable(), up == 2 && length.metres == 1);
      // The transform brings every point back to where it was, and there again.
      ASSERT_TRUE(d.transform);
      for (size_t i = 0; i < rest.size(); i += 100) {
        EXPECT_LT(((*d.transform)(foreign[i]) - rest[i]).norm(), 1e-4f);
        EXPECT_LT((d.transform->undo((*d.transform)(foreign[i])) - foreign[i]).norm(),
                  1e-4 / length.metres);
      }
    }
}

TEST(DoctorOrientation, PeopleInMotionAreSeldomTakenForOthers) {
  int up = 0, facing = 0, all = 0;
  for (int k = 0; k < 22; ++k) {
    const Motion motion = builtin_motion(0, "test", k);
    for (const size_t frame : {motion.frames() / 3, 2 * motion.frames() / 3}) {
      OrientationVote vote;
      vote.add(scan(somebody(), &motion, frame, static_cast<uint64_t>(k)));
      const Orientation o = vote.result();
      up += o.up == 2;
      facing += o.up == 2 && o.facing == 4;
      ++all;
    }
  }
  EXPECT_EQ(up, all);
  EXPECT_GE(facing, all - 1);
}

/// The angle of somebody who is turned, and the repair that takes it away.
TEST(DoctorOrientation, PeopleAreTurnedByTheAngleFound) {
  std::vector<double> off;
  for (int person = 0; person < 4; ++person) {
    const Body body = builtin_body(0, "test", static_cast<size_t>(person));
    for (const double degrees : {-150.0, -60.0, -35.0, 25.0, 35.0, 45.0, 130.0}) {
      const double turn = degrees * 3.14159265358979 / 180;
      const Diagnosis d = examine_surface(cloud(moved(scan(body), turn_about_y(turn))));
      ASSERT_TRUE(d.transform);
      EXPECT_NE(d.turned, 0) << degrees << " " << person;
      const Mat3 left = d.transform->rotation * turn_about_y(turn);
      off.push_back(std::abs(std::atan2(left(0, 2), left(2, 2))) * 180 / 3.14159265358979);
      EXPECT_LT(off.back(), 3) << degrees << " " << person;
      EXPECT_NE(d.find("facing")->fix.find("by that angle"), std::string::npos);
    }
  }
  EXPECT_LT(median(off), 1);
  // Nearly straight is left as it is, to the last bit.
  const Diagnosis d = examine_surface(cloud(moved(scan(somebody()), turn_about_y(0.1))));
  EXPECT_EQ(d.turned, 0);
  EXPECT_TRUE(d.transform->rotation.isIdentity(0));
}

TEST(DoctorOrientation, WhereUpIsInQuestionOnlyQuartersAreTurned) {
  Orientation o;
  o.facing_sure = o.turned_sure = 1;
  o.turned = 35;
  const Mat3 exact = o.exact_turn();  // +z is 35 degrees to the right of them
  EXPECT_TRUE((exact * (turn_about_y(35 * 3.14159265358979 / 180) * Vec3::UnitZ()))
                  .isApprox(Vec3::UnitZ(), 1e-9));
  EXPECT_TRUE(o.turn().isIdentity(0));
  Points points;  // nobody in particular: a bent sheet that might stand or lie
  Rng rng(RngKey{21, 0});
  for (int i = 0; i < 900; ++i) {
    const auto a = static_cast<float>(rng.uniform(-1, 1)),
               b = static_cast<float>(rng.uniform(-1, 1));
    points.push_back({0.8f * a, 0.8f * b, 0.3f * a * a});
  }
  EXPECT_EQ(examine_surface(cloud(points)).turned, 0);
}

TEST(DoctorOrientation, WhatIsNoPersonIsUnsure) {
  Rng rng(RngKey{5, 0});
  Points ball;
  for (int i = 0; i < 600; ++i)
    ball.push_back(Point(static_cast<float>(rng.normal()), static_cast<float>(rng.normal()),
                         static_cast<float>(rng.normal())) *
                   70);
  const Diagnosis d = examine_surface(cloud(ball));
  EXPECT_TRUE(notes(d, "up", "nobody"));
  EXPECT_FALSE(d.usable());
  EXPECT_THROW(check_target(cloud(ball), "ball"), InputError);
  EXPECT_LT(d.unit.sure, 0.5) << "a unit is told by a person's size";
  EXPECT_EQ(guess_unit(0).sure, 0);
  EXPECT_LT(guess_unit(1e30).sure, 1e-6);
}

TEST(DoctorOrientation, KnownBetterBeatsFound) {
  const Mesh mesh = cloud(scan(somebody()));
  ExamineOptions known;
  known.scale = 0.5;
  known.up = 4;
  known.facing = 0;
  const Diagnosis d = examine_surface(mesh, known);
  EXPECT_EQ(d.transform->scale, 0.5);
  EXPECT_TRUE((d.transform->rotation * Vec3::UnitZ()).isApprox(Vec3::UnitY()));
  EXPECT_TRUE((d.transform->rotation * Vec3::UnitX()).isApprox(Vec3::UnitZ()));
  known.facing = 5;
  EXPECT_THROW(examine_surface(mesh, known), InputError);
}

}  // namespace
}  // namespace restage
