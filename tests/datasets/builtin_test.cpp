// What is built in: closed human surfaces with smooth weights; motions that are plausible, smooth,
// on the floor, varied, and split by subject. All of it functions of a seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "datasets/benchmark/realism.h"
#include "datasets/builtin/bodies.h"
#include "datasets/builtin/motions.h"
#include "datasets/builtin/pose_channels.h"
#include "tests/support/tiny_body.h"
#include "tests/support/use_set.h"

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

double winding(const Body& body, const Vec3& at) {
  return winding_number(body.rest.vertices, body.rest.faces, at);
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

/// The same people with one mesh: faces and order are the same, and each surface is still the own
/// one.
TEST(BuiltinBodies, OneMeshForAll) {
  const std::vector<Body> bodies = builtin_bodies(11, 8, 2, 2, true);
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Body &body = bodies[i], &own = some_bodies()[i];
    EXPECT_EQ(body.rest.faces, bodies[0].rest.faces);
    EXPECT_EQ(body.rest.vertices.size(), bodies[0].rest.vertices.size());
    EXPECT_NEAR(volume(body.rest) / volume(own.rest), 1, 0.01) << body.id;
    for (size_t j = 0; j < kJoints; ++j)
      EXPECT_LT((body.joints[j] - own.joints[j]).norm(), 0.01) << body.id;
    const auto off = [](const Points& points, const Points& from) {
      double sum = 0;
      for (size_t k = 0; k < points.size(); k += 40) {
        float least = 1e9f;
        for (const Point& p : from) least = std::min(least, (p - points[k]).norm());
        sum += least;
      }
      return sum / static_cast<double>((points.size() + 39) / 40);
    };
    EXPECT_LT(off(body.rest.vertices, own.rest.vertices), 0.012) << body.id;
    EXPECT_LT(off(own.rest.vertices, body.rest.vertices), 0.012) << body.id;
  }
  EXPECT_FALSE(bodies[0].rest.vertices == bodies[1].rest.vertices);
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
      EXPECT_NEAR(winding(body, body.joints[j]), 1, 1e-3) << body.id << " joint " << j;
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
    EXPECT_NEAR(winding(body, {0, knee, 0}), 0, 1e-3);
    EXPECT_NEAR(winding(body, {body.joints[18].x(), body.joints[9].y(), 0}), 0, 1e-3);
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
  const auto made = [](int n) {
    const testing::UseThreads use(n);
    return builtin_bodies(5, 2, 0, 1);
  };
  const std::vector<Body> one = made(1), three = made(3);
  for (size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(same(one[i], three[i]));
}

TEST(BuiltinBodies, RefuseBadRequests) {
  EXPECT_THROW(builtin_body(1, "exam", 0), InputError);
  EXPECT_THROW(builtin_body(1, "train", -1), InputError);
  EXPECT_THROW(builtin_bodies(1, -1, 0, 0), InputError);
  EXPECT_TRUE(builtin_bodies(1, 0, 0, 0).empty());
}

// ---- motions
// -------------------------------------------------------------------------------------

const std::vector<Motion>& some_motions() {
  static const std::vector<Motion> motions = builtin_motions(21, 66, 22, 22);
  return motions;
}

TEST(BuiltinMotions, AreFiniteUnitAndOfTheRightLength) {
  for (const Motion& m : some_motions()) {
    EXPECT_GE(m.frames(), 60u) << m.id;
    EXPECT_LE(m.frames(), 180u) << m.id;
    ASSERT_EQ(m.hips.size(), m.frames());
    for (size_t f = 0; f < m.frames(); ++f) {
      ASSERT_TRUE(m.hips[f].allFinite());
      for (const auto& q : m.global[f]) ASSERT_NEAR(q.norm(), 1, 1e-5);
    }
  }
}

TEST(BuiltinMotions, MoveAtHumanSpeed) {
  for (const Motion& m : some_motions()) {
    Joints before = testing::motion_joints(m, 0);
    for (size_t f = 1; f < m.frames(); ++f) {
      EXPECT_LT((m.hips[f] - m.hips[f - 1]).norm() * kFps, 6.5) << m.id << " frame " << f;
      const Joints now = testing::motion_joints(m, f);
      for (int j = 0; j < kJoints; ++j) {
        EXPECT_LT((now[j] - before[j]).norm() * kFps, 14)
            << m.id << " frame " << f << " joint " << j;
        const double turn = m.global[f][j].angularDistance(m.global[f - 1][j]);
        EXPECT_LT(turn, 0.9) << m.id << " frame " << f << " joint " << j;
      }
      before = now;
    }
  }
}

TEST(BuiltinMotions, StandOnTheFloor) {
  for (const Motion& m : some_motions()) {
    double worst = 0, highest = 0;
    for (size_t f = 0; f < m.frames(); ++f) {
      const Joints x = testing::motion_joints(m, f);
      double lowest = 1e9;
      for (const int j : {7, 8, 10, 11}) lowest = std::min(lowest, x[j].y() - m.rest[j].y());
      worst = std::min(worst, lowest);
      highest = std::max(highest, lowest);
    }
    EXPECT_GT(worst, -0.05) << m.id;
    const bool flies = m.action == "jog" || m.action == "jump" || m.action == "dance";
    EXPECT_LT(highest, flies ? 0.6 : 0.12) << m.id;
    if (m.action == "jump") {
      EXPECT_GT(highest, 0.08) << m.id;
    }
  }
}

TEST(BuiltinMotions, StandingFeetHardlySlide) {
  for (const Motion& m : some_motions()) {
    if (m.action == "jump" || m.action == "jog" || m.action == "dance") continue;
    std::vector<double> speed;
    Joints before = testing::motion_joints(m, 0);
    for (size_t f = 1; f < m.frames(); ++f) {
      const Joints now = testing::motion_joints(m, f);
      double slowest = 1e9;
      for (const int j : {7, 8, 10, 11})
        slowest = std::min(slowest, (now[j] - before[j]).cwiseProduct(Vec3(1, 0, 1)).norm() * kFps);
      speed.push_back(slowest);
      before = now;
    }
    std::sort(speed.begin(), speed.end());
    EXPECT_LT(speed[speed.size() / 2], 0.3) << m.id;
  }
}

TEST(BuiltinMotions, SplitsShareNoSubjectAndHaveEveryAction) {
  std::map<std::string, std::string> split_of;
  std::map<std::string, std::set<std::string>> actions;
  std::set<std::string> ids;
  for (const Motion& m : some_motions()) {
    const auto [it, fresh] = split_of.emplace(m.subject, m.split);
    EXPECT_EQ(it->second, m.split) << m.subject;
    actions[m.split].insert(m.action);
    ids.insert(m.id);
  }
  EXPECT_EQ(ids.size(), some_motions().size());
  for (const char* split : {"train", "validation", "test"})
    EXPECT_EQ(actions[split].size(), builtin_actions().size()) << split;
}

TEST(BuiltinMotions, AreFunctionsOfSeedSplitAndNumber) {
  const Motion again = builtin_motion(21, "validation", 4);
  const Motion& first = some_motions()[66 + 4];
  ASSERT_EQ(first.id, again.id);
  ASSERT_EQ(first.frames(), again.frames());
  EXPECT_EQ(first.hips, again.hips);
  for (size_t f = 0; f < first.frames(); ++f)
    for (int j = 0; j < kJoints; ++j)
      ASSERT_EQ(first.global[f][j].coeffs(), again.global[f][j].coeffs());
  EXPECT_NE(builtin_motion(22, "validation", 4).hips, first.hips);
  EXPECT_NE(builtin_motion(21, "test", 4).hips, first.hips);
  // The same action by the same maker is never the same performance.
  EXPECT_EQ(some_motions()[0].action, some_motions()[22].action);
  EXPECT_NE(some_motions()[0].hips, some_motions()[22].hips);
}

// A network must see raised, crossed and bent arms, deep knees, twisted trunks and all headings.
TEST(BuiltinMotions, CoverThePoseSpace) {
  int raised = 0, crossed = 0, elbow = 0, knee = 0, bent = 0, twisted = 0;
  std::array<int, 8> heading{};
  for (const Motion& m : some_motions())
    for (size_t f = 0; f < m.frames(); f += 3) {
      const Joints x = testing::motion_joints(m, f);
      const auto axis = [&](int j, const Vec3& v) {
        return Vec3(m.global[f][j].cast<double>() * v);
      };
      const Vec3 left = axis(9, Vec3::UnitX());
      raised += x[20].y() > x[15].y() || x[21].y() > x[15].y();
      crossed += (x[20] - x[9]).dot(left) < -0.05 || (x[21] - x[9]).dot(left) > 0.05;
      elbow += (x[18] - x[16]).normalized().dot((x[20] - x[18]).normalized()) < 0.2;
      knee += (x[4] - x[1]).normalized().dot((x[7] - x[4]).normalized()) < 0.2;
      bent += (x[12] - x[0]).normalized().y() < 0.75;
      twisted += axis(9, Vec3::UnitZ()).dot(axis(0, Vec3::UnitZ())) < 0.85;
      const Vec3 front = axis(0, Vec3::UnitZ());
      const double turn = std::atan2(front.x(), front.z()) / (2 * M_PI) + 0.5;
      ++heading[static_cast<size_t>(turn * 8) % 8];
    }
  for (const int count : {raised, crossed, elbow, knee, bent, twisted}) EXPECT_GT(count, 60);
  for (const int count : heading) EXPECT_GT(count, 100);
}

TEST(BuiltinMotions, RestIsATPoseOfTheAverageBody) {
  const Joints rest = builtin_rest_joints();
  EXPECT_EQ(some_motions()[0].rest, rest);
  EXPECT_NEAR(leg_length(rest), 0.8, 0.08);
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT((rest[kMirror[j]].cwiseProduct(Vec3(-1, 1, 1)) - rest[j]).norm(), 1e-12);
}

TEST(BuiltinMotions, RefuseBadRequests) {
  EXPECT_THROW(builtin_motion(1, "", 0), InputError);
  EXPECT_THROW(builtin_motion(1, "test", -2), InputError);
  EXPECT_THROW(builtin_motions(1, 0, -1, 0), InputError);
}

TEST(BuiltinPoseChannels, ZeroIsTheTPoseAndMirrorsAgree) {
  for (const Mat3& r : channel_rotations(Angles{})) EXPECT_LT((r - Mat3::Identity()).norm(), 1e-12);
  Angles a = neutral_angles();
  for (int c = 0; c < kChannels; ++c) a[c] += 7 * std::sin(1.3 * c);
  const Rotations r = channel_rotations(a), m = channel_rotations(mirrored(a));
  const Mat3 flip = Vec3(-1, 1, 1).asDiagonal();
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT((m[kMirror[j]] - flip * r[j] * flip).norm(), 1e-9) << j;
}

TEST(BuiltinPoseChannels, SignsMeanWhatTheHeaderSays) {
  const Joints rest = builtin_rest_joints();
  const auto pose = [&](int which, double degrees) {
    Angles a{};
    a[which] = degrees;
    return forward_kinematics(rest, {channel_rotations(a), rest[0]}).joints;
  };
  EXPECT_GT(pose(channel(0, kElbow), 90)[20].z(), rest[20].z() + 0.2);     // forearm forward
  EXPECT_LT(pose(channel(1, kArmSide), -80)[21].y(), rest[21].y() - 0.4);  // arm down
  EXPECT_GT(pose(channel(1, kHipFlex), 60)[5].z(), rest[5].z() + 0.2);     // thigh forward
  EXPECT_LT(pose(channel(0, kKnee), 60)[7].z(), rest[7].z() - 0.2);        // shank back
  EXPECT_GT(pose(channel(0, kHipSide), 30)[7].x(), rest[7].x() + 0.2);
  EXPECT_LT(pose(channel(1, kHipSide), 30)[8].x(), rest[8].x() - 0.2);
  EXPECT_GT(pose(channel(0, kAnkle), 20)[10].y(), rest[10].y());
  EXPECT_GT(pose(kSpineBend, 40)[15].z(), rest[15].z() + 0.1);
}

TEST(BuiltinPoseChannels, LimitsKeepAnglesInRangeAndLeaveOrdinaryOnes) {
  Angles wild = neutral_angles();
  for (double& x : wild) x += 500;
  const Angles high = limit(wild);
  EXPECT_LE(high[channel(0, kElbow)], 145);
  EXPECT_LE(high[channel(1, kKnee)], 145);
  EXPECT_LE(high[kNeckTurn], 80);
  Angles mild{};
  mild[kSpineBend] = 30;
  mild[channel(0, kKnee)] = 60;
  EXPECT_EQ(limit(mild)[kSpineBend], 30);
  EXPECT_EQ(limit(mild)[channel(0, kKnee)], 60);
}

}  // namespace
}  // namespace restage
