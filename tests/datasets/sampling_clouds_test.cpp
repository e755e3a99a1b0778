// Clouds for the skeleton extractor and the lists that it is judged on.
#include "datasets/sampling/clouds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "autograd/base/error.h"
#include "datasets/sampling/evaluation.h"
#include "datasets/sampling/memory.h"
#include "tests/datasets/sampling_support.h"

namespace restage {
namespace {

using namespace testing;

TEST(SamplingClouds, CentredOnThePointsWithJointsInside) {
  const CloudBatch batch = CloudSampler(training_corpus(), {.points = 512}, 1).batch(0, 20);
  EXPECT_EQ(batch.points.shape(), (Shape{20, 512, 3}));
  EXPECT_EQ(batch.joints.shape(), (Shape{20, kJoints, 3}));
  for (int64_t i = 0; i < 20; ++i) {
    Vec3 sum = Vec3::Zero();
    for (int p = 0; p < 512; ++p) sum += at(batch.points, i, p);
    EXPECT_LT((sum / 512).norm(), 1e-5);
    // Boxes run along every bone, so points are near every joint.
    for (int j = 0; j < kJoints; ++j) {
      double nearest = std::numeric_limits<double>::infinity();
      for (int p = 0; p < 512; ++p)
        nearest = std::min(nearest, (at(batch.points, i, p) - at(batch.joints, i, j)).norm());
      EXPECT_LT(nearest, 0.15) << "joint " << j;
    }
  }
}

TEST(SamplingClouds, MirroredCloudsBelongToMirroredJoints) {
  Corpus corpus = training_corpus();
  corpus.bodies.resize(1);
  const CloudSampler sampler(corpus, {.points = 256, .noise = 0}, 1);
  CloudSubject plain;
  plain.at = {0, 20};
  plain.augmentation.heading = 0.4;
  CloudSubject image = plain;
  image.augmentation.mirror = true;
  // The first sample of either list draws the same points of the surface.
  const CloudBatch a = sampler.clouds({plain}), b = sampler.clouds({image});
  const auto flipped = [](const Vec3& x) { return Vec3(-x.x(), x.y(), x.z()); };
  for (int p = 0; p < 256; ++p)
    EXPECT_LT((flipped(at(a.points, 0, p)) - at(b.points, 0, p)).norm(), 1e-5);
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT((flipped(at(a.joints, 0, kMirror[j])) - at(b.joints, 0, j)).norm(), 1e-5);
}

TEST(SamplingClouds, SkinWeightsBelongToTheirPoints) {
  CloudConfig config{.points = 128, .noise = 0, .min_fraction = 0.5};
  EXPECT_FALSE(CloudSampler(training_corpus(), config, 1).batch(0, 1).weights.defined());
  config.skin_weights = true;
  CloudSubject subject;
  subject.rest = true;
  CloudSubject image = subject;
  image.augmentation.mirror = true;
  const CloudBatch plain = CloudSampler(training_corpus(), config, 1).clouds({subject});
  const CloudBatch mirrored = CloudSampler(training_corpus(), config, 1).clouds({image});
  ASSERT_EQ(plain.weights.shape(), (Shape{1, 128, kJoints}));
  for (int i = 0; i < 128; ++i) {
    const float* w = plain.weights.data<float>() + i * kJoints;
    const float* m = mirrored.weights.data<float>() + i * kJoints;
    float sum = 0;
    int strongest = 0;
    for (int j = 0; j < kJoints; ++j) {
      sum += w[j];
      EXPECT_EQ(w[j], m[kMirror[j]]);
      if (w[j] > w[strongest]) strongest = j;
    }
    EXPECT_NEAR(sum, 1.0f, 1e-5f);
    // A box is moved most by the joint where its bone begins; bones are shorter than 0.6 m.
    EXPECT_LT((at(plain.points, 0, i) - at(plain.joints, 0, strongest)).norm(), 0.6);
    EXPECT_LT((at(mirrored.points, 0, i) - at(mirrored.joints, 0, kMirror[strongest])).norm(), 0.6);
  }
}

TEST(SamplingClouds, SharesOfTposesMirrorsAndHeadings) {
  const CloudSampler sampler(training_corpus(), {.tpose_share = 0.2}, 2);
  const int n = 4000;
  int rest = 0, mirrored = 0, away = 0;
  std::set<size_t> bodies, motions;
  for (int i = 0; i < n; ++i) {
    const CloudSubject s = sampler.subject(i);
    rest += s.rest;
    mirrored += s.augmentation.mirror;
    bodies.insert(s.body);
    motions.insert(s.at.motion);
    EXPECT_LT(s.at.frame, training_corpus().motions[s.at.motion].frames());
    if (s.rest)
      EXPECT_LE(std::abs(s.augmentation.heading), 30 * 3.14160 / 180);
    else
      away += std::abs(s.augmentation.heading) > 1.5707963;
  }
  const double sigma = std::sqrt(0.25 / n);
  EXPECT_NEAR(rest / double(n), 0.2, 5 * sigma);
  EXPECT_NEAR(mirrored / double(n), 0.5, 5 * sigma);
  EXPECT_NEAR(away / double(n - rest), 0.5, 6 * sigma);
  EXPECT_EQ(bodies.size(), training_corpus().bodies.size());
  EXPECT_EQ(motions.size(), training_corpus().motions.size());
}

TEST(SamplingClouds, TposesShowTheRestJoints) {
  const CloudSampler sampler(
      training_corpus(), {.heading = false, .mirror = false, .tpose_share = 1, .scale_jitter = 0.1},
      3);
  const CloudBatch batch = sampler.batch(0, 4);
  for (int i = 0; i < 4; ++i) {
    const CloudSubject s = sampler.subject(i);
    const Joints& rest = training_corpus().bodies[s.body].joints;
    EXPECT_LE(std::abs(s.scale - 1), 0.1);
    for (int j = 1; j < kJoints; ++j) {
      const Vec3 bone = at(batch.joints, i, j) - at(batch.joints, i, 0);
      EXPECT_LT((bone - s.scale * (rest[j] - rest[0])).norm(), 1e-5);
    }
  }
}

TEST(SamplingClouds, PoorScansRepeatPoints) {
  const CloudBatch batch =
      CloudSampler(training_corpus(), {.points = 200, .min_fraction = 0.25}, 4).batch(0, 40);
  size_t least = 200, most = 0;
  for (int64_t i = 0; i < 40; ++i) {
    std::set<std::array<double, 3>> distinct;
    for (int k = 0; k < 200; ++k) {
      const Vec3 p = at(batch.points, i, k);
      distinct.insert({p.x(), p.y(), p.z()});
    }
    least = std::min(least, distinct.size());
    most = std::max(most, distinct.size());
  }
  EXPECT_GE(least, 50u);
  EXPECT_LT(least, 100u);
  EXPECT_GT(most, 150u);
}

TEST(SamplingClouds, MemoriesAreOfTheFrameBefore) {
  CloudConfig config{.points = 64, .noise = 0};
  const CloudBatch plain = CloudSampler(training_corpus(), config, 1).batch(0, 4);
  EXPECT_FALSE(plain.past.defined());
  config.remembered = 0.8;
  const CloudSampler sampler(training_corpus(), config, 1);
  const CloudBatch batch = sampler.batch(0, 400);
  EXPECT_EQ(at(batch.points, 3, 5), at(plain.points, 3, 5));  // the same people in the same poses
  int known = 0;
  for (int64_t i = 0; i < 400; ++i) {
    const float* past = batch.past.data<float>() + i * kJoints * 4;
    EXPECT_EQ(past[3] > 0, sampler.subject(i).memory != CloudSubject::Memory::none);
    known += past[3] > 0;
  }
  EXPECT_NEAR(known, 320, 40);
}

TEST(SamplingClouds, MemoriesErrAsFarAsTheySay) {
  const Joints truth = training_corpus().bodies[0].joints;
  Joints elsewhere = truth;
  for (Vec3& joint : elsewhere) joint.z() += 5;
  Rng rng(RngKey{1, 0});
  int exchanged = 0, lost = 0;
  double ratio = 0;
  const int n = 4000;
  for (int i = 0; i < n; ++i) {
    const Memory memory = draw_memory(rng, truth, elsewhere);
    lost += memory.joints[0].z() - truth[0].z() > 2.5;
    exchanged += memory.joints[20].x() < memory.joints[21].x();
    for (int j = 0; j < kJoints && kMirror[j] == j; ++j) {  // the pelvis, which has no side
      const double s = 0.03 / memory.trust[j] - 0.03;
      ratio += std::min((memory.joints[j] - truth[j]).norm() / (3 * s), 10.0) / n;
    }
  }
  EXPECT_NEAR(exchanged, n / 16.0, 60);
  EXPECT_NEAR(lost, n / 30.0, 40);
  EXPECT_NEAR(ratio, 1.3, 0.1);  // 1, and 10 for those of elsewhere
}

TEST(SamplingClouds, FramesBeforeAreOfTheSameScene) {
  CloudConfig config{.points = 64, .noise = 0};
  config.remembered = 1;
  config.dressed = 0.5;
  const CloudSampler sampler(training_corpus(), config, 1);
  const CloudBatch batch = sampler.batch(40, 60), before = sampler.before(40, batch);
  EXPECT_NEAR(static_cast<double>(batch.asked.size()), 30, 12);
  ASSERT_EQ(before.points.size(0), std::ssize(batch.asked));
  for (size_t k = 0; k < batch.asked.size(); ++k) {
    const int64_t now = batch.asked[k], then = static_cast<int64_t>(k);
    EXPECT_EQ(sampler.subject(40 + now).memory, CloudSubject::Memory::asked);
    const auto joint = [](const CloudBatch& of, int64_t row, int j) {
      const float* c = of.centres.data<float>() + 3 * row;
      return Vec3(at(of.joints, row, j) + Vec3(c[0], c[1], c[2]));
    };
    for (int j = 0; j < kJoints; ++j)
      EXPECT_LT((joint(batch, now, j) - joint(before, then, j)).norm(), 0.3);
  }
}

TEST(SamplingClouds, BentPosesKeepTheirBonesAndTheirTpose) {
  const CloudSampler straight(training_corpus(), {.tpose_share = 0.3}, 1),
      bent(training_corpus(), {.tpose_share = 0.3, .bend = 10}, 1);
  double turned = 0;
  int joints = 0;
  for (int64_t i = 0; i < 40; ++i) {
    const CloudSubject plain = straight.subject(i), subject = bent.subject(i);
    ASSERT_EQ(plain.rest, subject.rest);
    EXPECT_EQ(plain.at.frame, subject.at.frame);
    const Pose before = straight.pose(plain), after = bent.pose(subject);
    EXPECT_EQ(before.local[0], after.local[0]);
    EXPECT_EQ(before.root, after.root);
    for (size_t j = 1; j < kJoints; ++j, ++joints)
      turned += Eigen::AngleAxisd(before.local[j].transpose() * after.local[j]).angle();
    EXPECT_EQ(bent.pose(subject).local[5], after.local[5]);
  }
  EXPECT_NEAR(turned / joints * 180 / M_PI, 10 * std::sqrt(2 / M_PI), 1);  // mean of |normal|
  const CloudBatch a = straight.batch(0, 40), b = bent.batch(0, 40);
  for (int64_t i = 0; i < 40; ++i)
    EXPECT_EQ(at(a.joints, i, 15) == at(b.joints, i, 15), straight.subject(i).rest) << i;
}

TEST(SamplingClouds, SettingsOutOfRangeAreErrors) {
  for (const CloudConfig& bad :
       {CloudConfig{.points = 0}, CloudConfig{.noise = -1}, CloudConfig{.min_fraction = 0}})
    EXPECT_THROW(CloudSampler(training_corpus(), bad, 1), InputError);
  EXPECT_THROW(CloudSampler(Corpus{}, {}, 1), InputError);
}

TEST(SamplingEvaluation, ListsCoverBodiesAndMotionsAndRepeat) {
  const Corpus corpus = subset(tiny_corpus(), "test");
  const auto clouds = evaluation_clouds(corpus, 50, 1);
  std::set<size_t> bodies, motions;
  for (const CloudSubject& s : clouds) {
    EXPECT_FALSE(s.rest);
    bodies.insert(s.body);
    motions.insert(s.at.motion);
    EXPECT_LT(s.at.frame, corpus.motions[s.at.motion].frames());
  }
  EXPECT_EQ(bodies.size(), 2u);
  EXPECT_EQ(motions.size(), 2u);
  EXPECT_EQ(evaluation_clouds(corpus, 50, 1)[7].augmentation.heading,
            clouds[7].augmentation.heading);
  const auto tposes = evaluation_tposes(corpus, 3, 30, 1);
  ASSERT_EQ(tposes.size(), 6u);
  for (const CloudSubject& s : tposes) EXPECT_TRUE(s.rest);
  const CloudBatch batch = CloudSampler(corpus, {}, 9).clouds(tposes);
  EXPECT_EQ(batch.points.size(0), 6);
}

TEST(SamplingEvaluation, SequencesUseTwoBodiesAndFitTheirMotion) {
  const Corpus corpus = subset(tiny_corpus(), "test");
  const auto list = evaluation_sequences(corpus, 12, 30, 3);
  ASSERT_EQ(list.size(), 12u);
  std::set<size_t> motions;
  for (const EvalSequence& s : list) {
    EXPECT_NE(s.body_a, s.body_b);
    EXPECT_LE(s.first + s.frames, corpus.motions[s.motion].frames());
    EXPECT_EQ(s.frames, std::min<size_t>(30, corpus.motions[s.motion].frames()));
    motions.insert(s.motion);
  }
  EXPECT_EQ(motions.size(), 2u);
  Corpus lonely = corpus;
  lonely.bodies.resize(1);
  EXPECT_THROW(evaluation_sequences(lonely, 2, 30, 3), InputError);
}

TEST(SamplingEvaluation, PerformancesAreScansOfTheTruth) {
  const Corpus corpus = subset(tiny_corpus(), "test");
  const EvalSequence sequence = evaluation_sequences(corpus, 1, 8, 3).at(0);
  const Performance show(corpus, sequence, {}, 11);
  ASSERT_EQ(show.frames(), 8u);
  std::set<size_t> counts;
  for (size_t i = 0; i < show.frames(); ++i) {
    const Points cloud = show.cloud(i);
    EXPECT_GE(cloud.size(), 900u);
    EXPECT_LE(cloud.size(), 1400u);
    counts.insert(cloud.size());
    EXPECT_LT((centroid(cloud).cast<double>() - show.joints_a(i)[0]).norm(), 0.5);
  }
  EXPECT_GT(counts.size(), 4u);
  EXPECT_EQ(show.cloud(3), Performance(corpus, sequence, {}, 11).cloud(3));
  const Points vertices = show.vertices_b(2);
  EXPECT_EQ(vertices.size(), show.target().rest.vertices.size());
  const Vec3 pelvis = show.joints_b(2)[0];
  EXPECT_LT((vertices[0].cast<double>() - pelvis).norm(), 0.3);
  const Joints posed = forward_kinematics(show.target().joints, show.pose_b(2)).joints;
  EXPECT_LT((posed[21] - show.joints_b(2)[21]).norm(), 1e-12);
  EXPECT_EQ(show.target_cloud(77).size(), 77u);
  EXPECT_THROW(show.cloud(8), ShapeError);
  EXPECT_THROW(Performance(corpus, sequence, {10, 5}, 1), InputError);
}

TEST(SamplingEvaluation, AHoleStaysWhereItIsOnTheBody) {
  const Corpus corpus = subset(tiny_corpus(), "test");
  const EvalSequence sequence = evaluation_sequences(corpus, 1, 8, 3).at(0);
  const Performance whole(corpus, sequence, {900, 1400, 0}, 11);
  const Performance holed(corpus, sequence, {900, 1400, 0, 0.15}, 11);
  for (size_t i = 0; i < whole.frames(); ++i) {
    const Points all = whole.cloud(i), seen = holed.cloud(i);
    ASSERT_LT(seen.size(), all.size()) << i;
    Points lost;
    for (const Point& p : all)
      if (std::find(seen.begin(), seen.end(), p) == seen.end()) lost.push_back(p);
    EXPECT_EQ(lost.size() + seen.size(), all.size()) << "the others are as they were";
    const Point middle = centroid(lost);
    for (const Point& p : lost) EXPECT_LT((p - middle).norm(), 0.3f) << "one place";
  }
}

}  // namespace
}  // namespace restage
