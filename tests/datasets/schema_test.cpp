// Bodies, motions, scans and predictions: round trips, foreign files, and every refusal.
#include "datasets/schema.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

using test::error_of;
using test::TempDir;

const FileInfo kInfo{"CC0 1.0", "made by a test"};
const double kNaN = std::numeric_limits<double>::quiet_NaN();

Joints some_joints(double shift) {
  Joints joints;
  for (int j = 0; j < kJoints; ++j)
    joints[static_cast<size_t>(j)] = Vec3(0.1 * j + shift, 1.0 / (j + 3), -shift);
  return joints;
}

Body some_body(const std::string& id, int vertices) {
  Body body;
  body.id = id;
  body.split = "train";
  body.joints = some_joints(vertices);
  body.weights.resize(vertices, kJoints);
  body.weights.setZero();
  for (int v = 0; v < vertices; ++v) {
    body.rest.vertices.emplace_back(0.25f * static_cast<float>(v), 1.f, -2.f);
    body.weights(v, v % kJoints) = 0.75f;
    body.weights(v, (v + 1) % kJoints) = 0.25f;
    if (v >= 2) body.rest.faces.push_back({v - 2, v - 1, v});
  }
  return body;
}

Motion some_motion(const std::string& id, size_t frames) {
  Motion motion;
  motion.id = id;
  motion.subject = "07";
  motion.split = "test";
  motion.action = "walk";
  motion.rest = some_joints(0);
  motion.global.resize(frames);
  for (size_t f = 0; f < frames; ++f) {
    motion.hips.emplace_back(0.1f * static_cast<float>(f), 0.9f, 0.f);
    for (size_t j = 0; j < kJoints; ++j) {
      const float angle = 0.1f * static_cast<float>(f + j);
      motion.global[f][j] = Eigen::Quaternionf(Eigen::AngleAxisf(angle, Point::UnitY()));
    }
  }
  return motion;
}

void expect_equal(const Body& a, const Body& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.split, b.split);
  EXPECT_EQ(a.rest.vertices, b.rest.vertices);
  EXPECT_EQ(a.rest.faces, b.rest.faces);
  EXPECT_EQ(a.joints, b.joints);
  EXPECT_EQ(a.weights, b.weights);
}

TEST(Schema, BodiesAndMotionsKeepEveryBitAndTheirOrder) {
  const TempDir dir;
  const std::string path = dir / "set.h5";
  Body cloud = some_body("a cloud", 5);
  cloud.rest.faces.clear();
  cloud.split = "test";
  const std::vector<Body> bodies = {some_body("z", 30), some_body("b", 30), cloud,
                                    some_body("a", 7)};
  const std::vector<Motion> motions = {some_motion("07_02", 12), some_motion("07_01", 3)};
  write_dataset(path, bodies, motions, kInfo);

  const std::vector<Body> read = read_bodies(path);
  ASSERT_EQ(read.size(), bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) expect_equal(read[i], bodies[i]);
  ASSERT_EQ(read_bodies(path, "test").size(), 1u);
  const std::vector<Motion> moved = read_motions(path);
  ASSERT_EQ(moved.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(moved[i].id, motions[i].id);
    EXPECT_EQ(moved[i].subject + moved[i].split + moved[i].action, "07testwalk");
    EXPECT_EQ(moved[i].rest, motions[i].rest);
    EXPECT_EQ(moved[i].hips, motions[i].hips);
    ASSERT_EQ(moved[i].frames(), motions[i].frames());
    for (size_t f = 0; f < motions[i].frames(); ++f)
      for (size_t j = 0; j < kJoints; ++j)
        EXPECT_EQ(moved[i].global[f][j].coeffs(), motions[i].global[f][j].coeffs());
  }
  const h5::File file = h5::File::open(path);
  EXPECT_EQ(file.children("/topologies").size(), 2u) << "equal face lists are stored once";
  EXPECT_EQ(file.integer("/", "restage_schema"), 1);
  EXPECT_EQ(file.text("/", "up"), "y");
  EXPECT_EQ(file.number("/", "fps"), 30.0);

  const Inspection seen = inspect(path);
  EXPECT_EQ(seen.kind, "dataset");
  EXPECT_EQ(seen.units, "metres");
  EXPECT_EQ(seen.license, "CC0 1.0");
  EXPECT_EQ(seen.provenance, "made by a test");
  EXPECT_EQ(seen.counts, (std::map<std::string, int64_t>{
                             {"bodies", 4}, {"vertices", 72}, {"motions", 2}, {"frames", 15}}));
  EXPECT_TRUE(verify(path).empty());
}

TEST(Schema, RefusesBadIdsAndMissingGroups) {
  const TempDir dir;
  const auto write = [&](const std::string& a, const std::string& b) {
    write_bodies(dir / "x.h5", {some_body(a, 4), some_body(b, 4)}, kInfo);
  };
  EXPECT_NE(error_of([&] { write("a", "a"); }).find("two entries are called 'a'"),
            std::string::npos);
  EXPECT_NE(error_of([&] { write("a", "b/c"); }).find("cannot be an id"), std::string::npos);
  EXPECT_NE(error_of([&] { write("a", ""); }).find("cannot be an id"), std::string::npos);
  EXPECT_TRUE(test::names_in(dir.path()).empty());
  write("a", "b");
  EXPECT_EQ(inspect(dir / "x.h5").kind, "bodies");
  EXPECT_NE(error_of([&] { read_motions(dir / "x.h5"); }).find("x.h5:/motions: is missing"),
            std::string::npos);
}

TEST(Schema, VerifyNamesEveryBrokenBodyAndMotion) {
  const TempDir dir;
  const std::string path = dir / "bad.h5";
  std::vector<Body> bodies(5, some_body("", 6));
  const char* ids[5] = {"good", "weights", "nan", "face", "split"};
  for (size_t i = 0; i < 5; ++i) bodies[i].id = ids[i];
  bodies[1].weights(3, 0) += 0.5f;
  bodies[2].rest.vertices[4][1] = std::numeric_limits<float>::infinity();
  bodies[3].rest.faces[1][2] = 6;
  bodies[4].split = "training";
  std::vector<Motion> motions = {some_motion("good", 4), some_motion("long", 4)};
  motions[1].global[2][5].coeffs() *= 1.5f;
  write_dataset(path, bodies, motions, kInfo);
  const std::vector<std::string> problems = verify(path);
  ASSERT_EQ(problems.size(), 5u);
  EXPECT_NE(problems[0].find("/bodies/weights/weights: the weights of vertex 3"), std::string::npos)
      << problems[0];
  EXPECT_NE(problems[1].find("/bodies/nan/vertices: row 4 holds infinity"), std::string::npos)
      << problems[1];
  EXPECT_NE(problems[2].find("face 1 has vertex 6 of 6"), std::string::npos) << problems[2];
  EXPECT_NE(problems[3].find("has the split 'training'"), std::string::npos) << problems[3];
  EXPECT_NE(problems[4].find("/motions/long/rotations: frame 2 joint 5 is no unit"),
            std::string::npos)
      << problems[4];
  EXPECT_THROW(read_bodies(path), InputError);
}

TEST(Schema, ScansKeepChangingCountsAndSequences) {
  const TempDir dir;
  const Points points = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {9, 1, 1}, {2, 2, 2}};
  {
    ScanWriter writer(dir / "a.h5", kInfo, 25);
    writer.append({points[0], points[1]});
    writer.append({points[2]});
    writer.end_sequence();
    writer.end_sequence();  // nothing new: no empty sequence
    writer.append({points[3], points[4]});
    writer.commit();
  }
  const Scans scans = read_scans(dir / "a.h5");
  EXPECT_EQ(scans.points, points);
  EXPECT_EQ(scans.frame_offset, (std::vector<int64_t>{0, 2, 3, 5}));
  EXPECT_EQ(scans.sequence_offset, (std::vector<int64_t>{0, 2, 3}));
  EXPECT_EQ(scans.fps, 25);
  write_scans(dir / "b.h5", scans, kInfo);
  EXPECT_EQ(read_scans(dir / "b.h5").points, points);
  EXPECT_TRUE(verify(dir / "a.h5").empty());
  EXPECT_EQ(inspect(dir / "a.h5").counts,
            (std::map<std::string, int64_t>{{"points", 5}, {"frames", 3}, {"sequences", 2}}));
}

/// Writes a file of bare data sets without attributes, as any program may.
struct Bare {
  h5::File file;
  explicit Bare(const std::string& path) : file(h5::File::create(path)) {}
  void joints(int64_t frames, double first = 0) {
    std::vector<double> values(static_cast<size_t>(frames) * 66, 0.5);
    if (!values.empty()) values[0] = first;
    file.write<double>("/joints", {frames, 22, 3}, values);
  }
  void vertices(int64_t frames, int64_t n) {
    file.write<float>("/vertices", {frames, n, 3},
                      std::vector<float>(static_cast<size_t>(frames * n * 3), 1.5f));
  }
};

TEST(Schema, PredictionsNeedNoAttributes) {
  const TempDir dir;
  const std::string path = dir / "p.h5";
  {
    Bare bare(path);
    bare.joints(4, 0.1);
    bare.vertices(4, 5);
    bare.file.write<int64_t>("/sequence_offset", {3}, std::vector<int64_t>{0, 3, 4});
    bare.file.write<int64_t>("/faces", {1, 3}, std::vector<int64_t>{0, 1, 4});
    bare.file.commit();
  }
  const Prediction p = read_prediction(path);
  EXPECT_EQ(p.frames, 4);
  EXPECT_EQ(p.vertex_count, 5);
  EXPECT_EQ(p.joints.size(), 4u * 66);
  EXPECT_EQ(p.joints[0], 0.1);
  EXPECT_EQ(p.vertices, std::vector<double>(60, 1.5));
  EXPECT_EQ(p.sequence_offset, (std::vector<int64_t>{0, 3, 4}));
  EXPECT_EQ(p.faces, (std::vector<Triangle>{{0, 1, 4}}));
  EXPECT_EQ(inspect(path).kind, "prediction");
  EXPECT_EQ(inspect(path).license, "unknown");

  write_prediction(dir / "q.h5", p, kInfo);
  const Prediction q = read_prediction(dir / "q.h5");
  EXPECT_EQ(q.joints, p.joints);
  EXPECT_EQ(q.sequence_offset, p.sequence_offset);
  EXPECT_TRUE(verify(dir / "q.h5").empty());
}

TEST(Schema, PredictionWriterStreamsAndIsAtomic) {
  const TempDir dir;
  const std::string path = dir / "p.h5";
  {
    PredictionWriter writer(path, 3, {{0, 1, 2}}, kInfo);
    for (int f = 0; f < 5; ++f)
      writer.append(some_joints(f),
                    {Point(static_cast<float>(f), 0, 0), Point(1, 1, 1), Point(2, 2, 2)});
    EXPECT_THROW(writer.append(some_joints(0), {}), ShapeError);
    EXPECT_FALSE(std::filesystem::exists(path));
    writer.commit();
  }
  const Prediction p = read_prediction(path);
  EXPECT_EQ(p.frames, 5);
  EXPECT_EQ(p.sequence_offset, (std::vector<int64_t>{0, 5}));
  EXPECT_EQ(p.vertices[4 * 9], 4.0);
  EXPECT_NEAR(p.joints[4 * 66 + 3], 4.1, 1e-6);
  { PredictionWriter abandoned(dir / "q.h5", 0, {}, kInfo); }
  EXPECT_EQ(test::names_in(dir.path()), std::vector<std::string>{"p.h5"});
}

TEST(Schema, RefusesEveryBadPrediction) {
  const TempDir dir;
  const std::string path = dir / "p.h5";
  const auto refusal = [&](const std::function<void(Bare&)>& fill) {
    {
      Bare bare(path);
      fill(bare);
      bare.file.commit();
    }
    return error_of([&] { read_prediction(path); }).substr(path.size());
  };
  const auto starts = [](const std::string& text, const std::string& with) {
    return text.rfind(with, 0) == 0 ? testing::AssertionSuccess()
                                    : testing::AssertionFailure() << text;
  };
  EXPECT_TRUE(starts(refusal([](Bare&) {}), ":/joints: is missing"));
  EXPECT_TRUE(starts(refusal([](Bare& b) { b.joints(0); }), ":/joints: holds no frames"));
  EXPECT_TRUE(starts(refusal([](Bare& b) { b.joints(2, kNaN); }), ":/joints: row 0 holds NaN"));
  EXPECT_TRUE(starts(refusal([](Bare& b) { b.vertices(3, 0); }), ":/vertices: holds no vertices"));
  EXPECT_TRUE(starts(refusal([](Bare& b) { b.joints(2), b.vertices(3, 4); }),
                     ":/vertices: has 3 frames but"));
  EXPECT_TRUE(starts(refusal([](Bare& b) {
                       b.file.write<double>("/joints", {2, 21, 3}, std::vector<double>(126));
                     }),
                     ":/joints: is shaped [2, 21, 3] instead of [*, 22, 3]"));
  EXPECT_TRUE(
      starts(refusal([](Bare& b) { b.file.create_group("/joints"); }), ":/joints: is no data set"));
  for (const std::vector<int64_t>& bad :
       {std::vector<int64_t>{0, 2, 1, 3}, {1, 3}, {0, 2}, {0, 4}, {0}, {0, 1, 1, 3}, {0, -1, 3}})
    EXPECT_TRUE(starts(refusal([&](Bare& b) {
                         b.joints(3);
                         b.file.write<int64_t>("/sequence_offset",
                                               {static_cast<int64_t>(bad.size())}, bad);
                       }),
                       ":/sequence_offset: does not rise from 0 to 3"));
  EXPECT_TRUE(starts(refusal([](Bare& b) {
                       b.vertices(1, 4);
                       b.file.write<int32_t>("/faces", {1, 3}, std::vector<int32_t>{0, 1, 4});
                     }),
                     ":/faces: face 0 has vertex 4 of 4"));
  EXPECT_TRUE(starts(refusal([](Bare& b) {
                       b.joints(1);
                       b.file.set_integer("/", "restage_schema", 2);
                     }),
                     ": has schema version 2, which is unknown"));
  EXPECT_TRUE(starts(refusal([](Bare& b) {
                       b.joints(1);
                       b.file.set_text("/", "restage_schema", "one");
                     }),
                     ":/ attribute restage_schema: is not an integer"));
}

TEST(Schema, BlendShapesMustBeThereAndFit) {
  const TempDir dir;
  const Body body = some_body("a", 4);
  const auto refusal = [&](const h5::Shape& shape, float value) {
    h5::File file = h5::File::create(dir / "a.h5");
    std::vector<float> vertices;
    for (const Point& p : body.rest.vertices) vertices.insert(vertices.end(), &p[0], &p[0] + 3);
    std::vector<double> joints;
    for (const Vec3& p : body.joints) joints.insert(joints.end(), &p[0], &p[0] + 3);
    const std::vector<float> weights(body.weights.data(),
                                     body.weights.data() + body.weights.size());
    file.write<float>("/bodies/a/vertices", {4, 3}, vertices);
    file.write<double>("/bodies/a/joints", {kJoints, 3}, joints);
    file.write<float>("/bodies/a/weights", {4, kJoints}, weights);
    file.set_text("/bodies/a", "split", "train");
    file.set_text("/bodies/a", "blend_shapes", "0");
    if (!shape.empty())
      file.write<float>(
          "/blend_shapes/0", shape,
          std::vector<float>(static_cast<size_t>(shape[0] * shape[1] * shape[2]), value));
    file.commit();
    return error_of([&] { read_bodies(dir / "a.h5"); });
  };
  EXPECT_NE(refusal({}, 0).find("/blend_shapes/0: is missing"), std::string::npos);
  EXPECT_NE(refusal({5, 3, 189}, 0).find("[5, 3, 189] instead of [4, 3, 189]"), std::string::npos);
  EXPECT_NE(refusal({4, 3, 207}, 0).find("[4, 3, 207] instead of [4, 3, 189]"), std::string::npos);
  EXPECT_NE(refusal({4, 3, 189}, NAN).find("/blend_shapes/0"), std::string::npos);
}

TEST(Schema, ASequenceOfScansCanBeTakenBack) {
  const test::TempDir dir;
  const Points cloud(700, Point(1, 2, 3)), other(1500, Point(4, 5, 6));
  Joints joints;
  joints.fill(Vec3::Zero());
  for (const bool disturbed : {false, true}) {
    ScanWriter writer(dir / (disturbed ? "b.h5" : "a.h5"), kInfo);
    if (disturbed) {
      writer.append(other, joints);
      writer.drop_sequence();
    }
    writer.append(cloud, joints);
    writer.append(other, joints);
    writer.end_sequence();
    if (disturbed) {
      writer.append(other, joints);
      writer.append(cloud, joints);
      writer.drop_sequence();
    }
    writer.append(cloud, joints);
    writer.commit();
  }
  EXPECT_TRUE(verify(dir / "b.h5").empty());
  const Scans a = read_scans(dir / "a.h5"), b = read_scans(dir / "b.h5");
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.frame_offset, b.frame_offset);
  EXPECT_EQ(a.sequence_offset, b.sequence_offset);
  EXPECT_EQ(b.sequence_offset, (std::vector<int64_t>{0, 2, 3}));
}

TEST(Schema, ScanOffsetsMustFitThePoints) {
  const TempDir dir;
  Scans scans;
  scans.points = {{0, 0, 0}, {1, 1, 1}};
  scans.frame_offset = {0, 2, 1, 2};
  write_scans(dir / "a.h5", scans, kInfo);
  EXPECT_NE(error_of([&] { read_scans(dir / "a.h5"); }).find("/frame_offset: does not rise"),
            std::string::npos);
  EXPECT_EQ(verify(dir / "a.h5").size(), 1u);
  Bare empty(dir / "b.h5");
  empty.file.commit();
  EXPECT_NE(error_of([&] { verify(dir / "b.h5"); }).find("holds no bodies, motions, scans"),
            std::string::npos);
}

}  // namespace
}  // namespace restage
