// Bodies, motions, scans and predictions: round trips, foreign files, every refusal, and several
// files as one.
#include "datasets/schema.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "datasets/corpus.h"
#include "datasets/merge.h"
#include "tests/support/files.h"
#include "tests/support/tiny_body.h"

namespace restage {
namespace {

using namespace test;
using testing::tiny_body;
using testing::tiny_joints;
using testing::tiny_motion;
using Schema = FileTest;
using Merge = FileTest;

const FileInfo kInfo{"CC0 1.0", "made by a test"};
const double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST_F(Schema, BodiesAndMotionsKeepEveryBitAndTheirOrder) {
  const std::string path = dir / "set.h5";
  Body cloud = tiny_body("a cloud", "test"), other = tiny_body("a", "train", 0.9);
  cloud.rest.faces.clear();
  other.rest.faces.pop_back();
  const std::vector<Body> bodies = {tiny_body("z", "train"), tiny_body("b", "train", 1.1), cloud,
                                    other};
  const std::vector<Motion> motions = {tiny_motion("07_02", "07", "test", 12),
                                       tiny_motion("07_01", "07", "test", 3)};
  write_dataset(path, bodies, motions, kInfo);

  const std::vector<Body> read = read_bodies(path);
  ASSERT_EQ(read.size(), bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) {
    EXPECT_EQ(read[i].id, bodies[i].id);
    EXPECT_EQ(read[i].split, bodies[i].split);
    EXPECT_EQ(read[i].rest.vertices, bodies[i].rest.vertices);
    EXPECT_EQ(read[i].rest.faces, bodies[i].rest.faces);
    EXPECT_EQ(read[i].joints, bodies[i].joints);
    EXPECT_EQ(read[i].weights, bodies[i].weights);
  }
  ASSERT_EQ(read_bodies(path, "test").size(), 1u);
  const std::vector<Motion> moved = read_motions(path);
  ASSERT_EQ(moved.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(moved[i].id, motions[i].id);
    EXPECT_EQ(moved[i].subject + moved[i].split + moved[i].action, "07testswing");
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
  EXPECT_EQ(seen.counts,
            (std::map<std::string, int64_t>{
                {"bodies", 4}, {"vertices", 4 * 168}, {"motions", 2}, {"frames", 15}}));
  EXPECT_TRUE(verify(path).empty());
}

TEST_F(Schema, BodiesSayWhichJointsTheyHave) {
  Body ours = tiny_body("a", "train"), theirs = tiny_body("b", "train");
  ours.definition = "makehuman";
  theirs.definition = "smpl";
  const Motion motion = tiny_motion("m", "s", "train", 3);
  write_dataset(dir / "ours.h5", {ours, tiny_body("silent", "train")}, {motion}, kInfo);
  write_bodies(dir / "theirs.h5", {theirs}, kInfo);
  EXPECT_THROW(write_dataset(dir / "both.h5", {ours, theirs}, {motion}, kInfo), InputError);
  EXPECT_EQ(read_bodies(dir / "theirs.h5")[0].definition, "smpl");
  EXPECT_EQ(inspect(dir / "ours.h5").definitions,
            (std::map<std::string, int64_t>{{"makehuman", 1}}));
  EXPECT_EQ(load_corpus({.source = dir / "ours.h5"}).joints, "makehuman");
  EXPECT_THROW(merge_data({dir / "ours.h5", dir / "theirs.h5"}, dir / "all.h5", {}), InputError);
}

TEST_F(Schema, RefusesBadIdsAndMissingGroups) {
  const auto write = [&](const std::string& a, const std::string& b) {
    write_bodies(dir / "x.h5", {tiny_body(a, "train"), tiny_body(b, "train")}, kInfo);
  };
  EXPECT_HAS(error_of([&] { write("a", "a"); }), "two entries are called 'a'");
  EXPECT_HAS(error_of([&] { write("a", "b/c"); }), "cannot be an id");
  EXPECT_HAS(error_of([&] { write("a", ""); }), "cannot be an id");
  EXPECT_TRUE(names_in(dir.path()).empty());
  write("a", "b");
  EXPECT_EQ(inspect(dir / "x.h5").kind, "bodies");
  EXPECT_HAS(error_of([&] { read_motions(dir / "x.h5"); }), "x.h5:/motions: is missing");
}

TEST_F(Schema, VerifyNamesEveryBrokenBodyAndMotion) {
  const std::string path = dir / "bad.h5";
  std::vector<Body> bodies;
  for (const char* id : {"good", "weights", "nan", "face", "split"})
    bodies.push_back(tiny_body(id, "train"));
  bodies[1].weights(3, 0) += 0.5f;
  bodies[2].rest.vertices[4][1] = std::numeric_limits<float>::infinity();
  bodies[3].rest.faces[1][2] = 168;
  bodies[4].split = "training";
  std::vector<Motion> motions = {tiny_motion("good", "07", "test", 4),
                                 tiny_motion("long", "07", "test", 4)};
  motions[1].global[2][5].coeffs() *= 1.5f;
  write_dataset(path, bodies, motions, kInfo);
  const std::vector<std::string> problems = verify(path);
  const char* expected[] = {"/bodies/weights/weights: the weights of vertex 3",
                            "/bodies/nan/vertices: row 4 holds infinity",
                            "face 1 has vertex 168 of 168", "has the split 'training'",
                            "/motions/long/rotations: frame 2 joint 5 is no unit"};
  ASSERT_EQ(problems.size(), std::size(expected));
  for (size_t i = 0; i < problems.size(); ++i) EXPECT_HAS(problems[i], expected[i]);
  EXPECT_THROW(read_bodies(path), InputError);
}

TEST_F(Schema, ScansKeepChangingCountsAndSequences) {
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
  /// A size of -1 is what the values make it.
  void integers(const char* name, h5::Shape shape, const std::vector<int64_t>& values) {
    if (shape[0] < 0) shape[0] = static_cast<int64_t>(values.size());
    file.write<int64_t>(name, shape, values);
  }
};

TEST_F(Schema, PredictionsNeedNoAttributes) {
  const std::string path = dir / "p.h5";
  {
    Bare bare(path);
    bare.joints(4, 0.1);
    bare.vertices(4, 5);
    bare.integers("/sequence_offset", {3}, {0, 3, 4});
    bare.integers("/faces", {1, 3}, {0, 1, 4});
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

TEST_F(Schema, PredictionWriterStreamsAndIsAtomic) {
  const std::string path = dir / "p.h5";
  {
    PredictionWriter writer(path, 3, {{0, 1, 2}}, kInfo);
    for (int f = 0; f < 5; ++f)
      writer.append(tiny_joints(1 + f),
                    {Point(static_cast<float>(f), 0, 0), Point(1, 1, 1), Point(2, 2, 2)});
    EXPECT_THROW(writer.append(tiny_joints(), {}), ShapeError);
    EXPECT_FALSE(std::filesystem::exists(path));
    writer.commit();
  }
  const Prediction p = read_prediction(path);
  EXPECT_EQ(p.frames, 5);
  EXPECT_EQ(p.sequence_offset, (std::vector<int64_t>{0, 5}));
  EXPECT_EQ(p.vertices[4 * 9], 4.0);
  EXPECT_NEAR(p.joints[4 * 66 + 3], 5 * 0.09, 1e-6);
  { PredictionWriter abandoned(dir / "q.h5", 0, {}, kInfo); }
  EXPECT_EQ(names_in(dir.path()), Names{"p.h5"});
}

TEST_F(Schema, RotationsAreUnitQuaternionsOfAllFramesOrOfNone) {
  const std::string path = dir / "p.h5";
  Rotations turned;
  turned.fill(Eigen::AngleAxisd(2.0, Vec3::UnitY()).toRotationMatrix());
  {
    PredictionWriter writer(path, 0, {}, kInfo);
    for (int f = 0; f < 2; ++f) {
      writer.append(tiny_joints(), {});
      writer.append_rotations(turned);
    }
    writer.commit();
  }
  const h5::File file = h5::File::open(path);
  const std::vector<float> all = file.read<float>("/rotations", {2, kJoints, 4});
  EXPECT_NEAR(all[0], std::cos(1.0), 1e-6);
  EXPECT_NEAR(all[2], std::sin(1.0), 1e-6);
  EXPECT_TRUE(verify(path).empty());
  PredictionWriter some(dir / "q.h5", 0, {}, kInfo);
  some.append(tiny_joints(), {});
  some.append_rotations(turned);
  some.append(tiny_joints(), {});
  EXPECT_THROW(some.commit(), ShapeError);
}

TEST_F(Schema, ConfidenceIsOfAllFramesOrOfNone) {
  const std::string path = dir / "p.h5";
  {
    PredictionWriter writer(path, 0, {}, kInfo);
    for (const double sure : {0.25, 1.0}) writer.append(tiny_joints(), {}, sure);
    writer.end_sequence();
    writer.append(tiny_joints(), {}, 0.5);
    writer.commit();
  }
  EXPECT_EQ(read_prediction(path).confidence, (std::vector<double>{0.25, 1.0, 0.5}));
  EXPECT_EQ(read_confidence(path, 0), (std::vector<double>{0.25, 1.0}));
  EXPECT_EQ(read_confidence(path, 1), (std::vector<double>{0.5}));
  EXPECT_TRUE(verify(path).empty());
  PredictionWriter writer(path, 0, {}, kInfo);
  writer.append(tiny_joints(), {}, 0.5);
  writer.append(tiny_joints(), {});
  EXPECT_THROW(writer.commit(), ShapeError);
}

TEST_F(Schema, AResultRemembersItsSourceAndWhatWasFilled) {
  namespace fs = std::filesystem;
  const auto write = [](const std::string& path, const SourceRecord& source) {
    PredictionWriter writer(path, 0, {}, kInfo, 10);
    for (int f = 0; f < 3; ++f) writer.append(tiny_joints(), {});
    writer.set_source(source);
    writer.set_filled({1, 2});
    writer.commit();
  };
  fs::create_directories(dir / "here/results");
  fs::create_directories(dir / "here/scans");
  const fs::path before = fs::current_path();
  fs::current_path(dir / "here");
  write("results/r.h5", {.path = "scans", .fps = 60, .scale = 0.001, .up = "-z"});
  const SourceRecord read = read_source_record("results/r.h5").value();
  EXPECT_EQ(read.path, "scans");
  EXPECT_EQ(read.fps, 60);
  EXPECT_EQ(read.scale, 0.001);
  EXPECT_EQ(read.up, "-z");
  EXPECT_EQ(read.clip, "");
  EXPECT_FALSE(read.sequence);
  // Both moved together, and seen from elsewhere.
  fs::current_path(before);
  fs::rename(dir / "here", dir / "there");
  const SourceRecord moved = read_source_record(dir / "there/results/r.h5").value();
  EXPECT_TRUE(fs::equivalent(moved.path, dir / "there/scans")) << moved.path;
  write(dir / "a.h5", {.path = dir / "there/scans", .clip = "Walk", .sequence = 2});
  const SourceRecord absolute = read_source_record(dir / "a.h5").value();
  EXPECT_EQ(absolute.path, dir / "there/scans");
  EXPECT_EQ(absolute.clip, "Walk");
  EXPECT_EQ(absolute.sequence, 2);
  EXPECT_FALSE(absolute.fps);
  EXPECT_EQ(absolute.up, "y");

  EXPECT_EQ(read_filled(dir / "a.h5"), (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(inspect(dir / "a.h5").counts.at("filled"), 2);
  EXPECT_EQ(inspect(dir / "a.h5").fps, 10);
  EXPECT_TRUE(verify(dir / "a.h5").empty());
  {
    PredictionWriter writer(dir / "b.h5", 0, {}, kInfo);
    writer.append(tiny_joints(), {});
    writer.set_filled({1});
    writer.commit();
  }
  EXPECT_FALSE(read_source_record(dir / "b.h5"));
  ASSERT_EQ(verify(dir / "b.h5").size(), 1u);
  EXPECT_HAS(verify(dir / "b.h5")[0], "/filled");
}

TEST_F(Schema, RadiusIsOfAllFramesOrOfNone) {
  const std::string path = dir / "p.h5";
  std::array<double, kJoints> radius;
  for (size_t j = 0; j < kJoints; ++j) radius[j] = 0.25 * static_cast<double>(j + 1);
  {
    PredictionWriter writer(path, 0, {}, kInfo);
    for (int f = 0; f < 2; ++f) writer.append_joints(tiny_joints(), radius);
    writer.commit();
  }
  const Prediction read = read_prediction(path);
  ASSERT_EQ(read.radius.size(), 2 * kJoints);
  EXPECT_EQ(read.radius[kJoints + 3], 1.0);
  EXPECT_TRUE(verify(path).empty());
  PredictionWriter writer(path, 0, {}, kInfo);
  writer.append_joints(tiny_joints(), radius);
  writer.append(tiny_joints(), {});
  EXPECT_THROW(writer.commit(), ShapeError);
}

TEST_F(Schema, RefusesEveryBadPrediction) {
  const std::string path = dir / "p.h5";
  const auto refuse = [&](const std::function<void(Bare&)>& fill, const std::string& says) {
    {
      Bare bare(path);
      fill(bare);
      bare.file.commit();
    }
    const std::string said = error_of([&] { read_prediction(path); });
    EXPECT_EQ(said.rfind(path + says, 0), 0u) << said;
  };
  const std::pair<std::function<void(Bare&)>, const char*> cases[] = {
      {[](Bare&) {}, ":/joints: is missing"},
      {[](Bare& b) { b.joints(0); }, ":/joints: holds no frames"},
      {[](Bare& b) { b.joints(2, kNaN); }, ":/joints: row 0 holds NaN"},
      {[](Bare& b) { b.vertices(3, 0); }, ":/vertices: holds no vertices"},
      {[](Bare& b) { b.joints(2), b.vertices(3, 4); }, ":/vertices: has 3 frames but"},
      {[](Bare& b) {
         b.file.write<double>("/joints", {2, 21, 3}, std::vector<double>(126));
       },
       ":/joints: is shaped [2, 21, 3] instead of [*, 22, 3]"},
      {[](Bare& b) { b.file.create_group("/joints"); }, ":/joints: is no data set"},
      {[](Bare& b) {
         b.vertices(1, 4), b.integers("/faces", {1, 3}, {0, 1, 4});
       },
       ":/faces: face 0 has vertex 4 of 4"},
      {[](Bare& b) { b.joints(1), b.file.set_integer("/", "restage_schema", 2); },
       ": has schema version 2, which is unknown"},
      {[](Bare& b) { b.joints(1), b.file.set_text("/", "restage_schema", "one"); },
       ":/ attribute restage_schema: is not an integer"}};
  for (const auto& [fill, says] : cases) refuse(fill, says);
  for (const std::vector<int64_t>& bad :
       {std::vector<int64_t>{0, 2, 1, 3}, {1, 3}, {0, 2}, {0, 4}, {0}, {0, 1, 1, 3}, {0, -1, 3}})
    refuse([&](Bare& b) { b.joints(3), b.integers("/sequence_offset", {-1}, bad); },
           ":/sequence_offset: does not rise from 0 to 3");
}

TEST_F(Schema, BlendShapesMustBeThereAndFit) {
  const Body body = tiny_body("a", "train");
  const auto flat = [](const auto& points) {
    std::vector<double> out;
    for (const auto& p : points) out.insert(out.end(), {p[0], p[1], p[2]});
    return out;
  };
  const auto refusal = [&](const h5::Shape& shape, float value) {
    h5::File file = h5::File::create(dir / "a.h5");
    const std::vector<float> weights(body.weights.data(),
                                     body.weights.data() + body.weights.size());
    file.write<double>("/bodies/a/vertices", {168, 3}, flat(body.rest.vertices));
    file.write<double>("/bodies/a/joints", {kJoints, 3}, flat(body.joints));
    file.write<float>("/bodies/a/weights", {168, kJoints}, weights);
    file.set_text("/bodies/a", "split", "train");
    file.set_text("/bodies/a", "blend_shapes", "0");
    if (!shape.empty())
      file.write<float>(
          "/blend_shapes/0", shape,
          std::vector<float>(static_cast<size_t>(shape[0] * shape[1] * shape[2]), value));
    file.commit();
    return error_of([&] { read_bodies(dir / "a.h5"); });
  };
  EXPECT_HAS(refusal({}, 0), "/blend_shapes/0: is missing");
  EXPECT_HAS(refusal({169, 3, 189}, 0), "[169, 3, 189] instead of [168, 3, 189]");
  EXPECT_HAS(refusal({168, 3, 207}, 0), "[168, 3, 207] instead of [168, 3, 189]");
  EXPECT_HAS(refusal({168, 3, 189}, NAN), "/blend_shapes/0");
}

TEST_F(Schema, ASequenceOfScansCanBeTakenBack) {
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

TEST_F(Schema, ScanOffsetsMustFitThePoints) {
  Scans scans;
  scans.points = {{0, 0, 0}, {1, 1, 1}};
  scans.frame_offset = {0, 2, 1, 2};
  write_scans(dir / "a.h5", scans, kInfo);
  EXPECT_HAS(error_of([&] { read_scans(dir / "a.h5"); }), "/frame_offset: does not rise");
  EXPECT_EQ(verify(dir / "a.h5").size(), 1u);
  Bare empty(dir / "b.h5");
  empty.file.commit();
  EXPECT_HAS(error_of([&] { verify(dir / "b.h5"); }), "holds no bodies, motions, scans");
}

// ---- several files as one ----------------------------------------------------------------------

/// What merging says against it, if anything; no result is left then.
std::string complaint(const std::vector<std::string>& files, const std::string& out) {
  const std::string said = refusal_of([&] { merge_data(files, out); });
  EXPECT_TRUE(said.empty() || !out.ends_with("out.h5") || !std::filesystem::exists(out));
  return said;
}

Motion clip(const char* id, const char* subject, const char* split) {
  return tiny_motion(id, subject, split, 3);
}

TEST_F(Merge, SplitsMustBeKnown) {
  const std::string a = dir / "a.h5", out = dir / "out.h5";
  write_bodies(a, {tiny_body("b1", "train")}, {});
  write_bodies(dir / "b.h5", {tiny_body("odd", "nope")}, {});
  write_motions(dir / "c.h5", {clip("m", "", "nope")}, {});
  EXPECT_HAS(complaint({a, dir / "b.h5"}, out), "b.h5:/bodies/odd: has the split 'nope'");
  EXPECT_HAS(complaint({a, dir / "c.h5"}, out), "c.h5:/motions/m: has the split 'nope'");
}

TEST_F(Merge, BodiesMotionsLicencesAndAcknowledgementsAreJoined) {
  const std::string a = dir / "a.h5", b = dir / "b.h5", c = dir / "c.h5", out = dir / "out.h5";
  write_dataset(a, {tiny_body("b1", "train"), tiny_body("b2", "train")},
                {clip("m1", "ann", "train")},
                {"bodies: CC0 1.0; motions: with acknowledgement", "made at A"});
  write_motions(b, {clip("m2", "bob", "test")}, {"motions: with acknowledgement", "made at B"});
  write_bodies(c, {tiny_body("b3", "train")}, {"CC0-1.0", "made at A"});
  const MergeSummary done = merge_data({a, b, c}, out);
  EXPECT_EQ(done.bodies, 3u);
  EXPECT_EQ(done.motions, 2u);
  EXPECT_TRUE(verify(out).empty());
  const Inspection found = inspect(out);
  EXPECT_EQ(found.license, "bodies: CC0 1.0; motions: with acknowledgement; CC0-1.0");
  EXPECT_EQ(found.provenance, "made at A; made at B");
  EXPECT_EQ(read_bodies(out)[2].id, "b3");
  EXPECT_EQ(read_motions(out)[1].subject, "bob");
  EXPECT_EQ(read_motions(out)[1].split, "test");
}

TEST_F(Merge, ClashesAreNamedAndAPrefixSolvesThem) {
  const std::string a = dir / "a.h5", b = dir / "b.h5", out = dir / "out.h5";
  write_motions(a, {clip("walk", "ann", "train"), clip("run", "ann", "train")}, {});
  write_motions(b, {clip("walk", "bob", "train"), clip("run", "bob", "train")}, {});
  const std::string said = complaint({a, b}, out);
  EXPECT_HAS(said, "'walk' of " + a + " and " + b + " (and 1 more)");
  EXPECT_HAS(said, "prefix");
  merge_data({a, b}, out, {true});
  const std::vector<Motion> motions = read_motions(out);
  ASSERT_EQ(motions.size(), 4u);
  EXPECT_EQ(motions[0].id, "a_walk");
  EXPECT_EQ(motions[3].id, "b_run");
}

TEST_F(Merge, RefusesWhatWouldLeakOrIsNoData) {
  const std::string a = dir / "a.h5", b = dir / "b.h5", out = dir / "out.h5";
  write_motions(a, {clip("walk", "ann", "train")}, {});
  write_motions(b, {clip("run", "ann", "test")}, {});
  EXPECT_HAS(complaint({a, b}, out), "subject 'ann' is in the split 'test'");
  EXPECT_HAS(complaint({a}, out), "nothing to merge");
  EXPECT_HAS(complaint({a, a}, out), "same id");
  EXPECT_HAS(complaint({a, b}, a), "is one of the inputs");
  Scans scans;
  scans.points = {Point(0, 0, 0)};
  scans.frame_offset = {0, 1};
  scans.sequence_offset = {0, 1};
  write_scans(dir / "s.h5", scans, {});
  EXPECT_HAS(complaint({a, dir / "s.h5"}, out), "neither bodies nor motions");
  EXPECT_NE(complaint({a, dir / "none.h5"}, out), "");
}

}  // namespace
}  // namespace restage
