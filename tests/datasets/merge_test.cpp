// Several data files as one.
#include "datasets/merge.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/schema.h"
#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

Motion motion(const std::string& id, const std::string& subject, const std::string& split) {
  Motion out;
  out.id = id;
  out.subject = subject;
  out.split = split;
  out.rest.fill(Vec3::Zero());
  out.global.resize(3);
  for (auto& frame : out.global) frame.fill(Eigen::Quaternionf::Identity());
  out.hips.assign(3, Point(0, 1, 0));
  return out;
}

Body body(const std::string& id) {
  Body out;
  out.id = id;
  out.split = "train";
  out.rest.vertices = {Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)};
  out.rest.faces.push_back({0, 1, 2});
  out.joints.fill(Vec3::Zero());
  out.weights.setZero(3, kJoints);
  out.weights.col(0).setOnes();
  return out;
}

std::string complaint(const std::vector<std::string>& files, const std::string& out,
                      bool prefix = false) {
  try {
    merge_data(files, out, {prefix});
  } catch (const InputError& error) {
    EXPECT_FALSE(std::filesystem::exists(out) && out.find("out") != std::string::npos);
    return error.what();
  }
  return "";
}

TEST(Merge, SplitsMustBeKnown) {
  const test::TempDir dir;
  const std::string a = dir / "a.h5", out = dir / "out.h5";
  Body odd = body("odd");
  odd.split = "nope";
  write_bodies(a, {body("b1")}, {});
  write_bodies(dir / "b.h5", {odd}, {});
  write_motions(dir / "c.h5", {motion("m", "", "nope")}, {});
  EXPECT_NE(complaint({a, dir / "b.h5"}, out).find("b.h5:/bodies/odd: has the split 'nope'"),
            std::string::npos);
  EXPECT_NE(complaint({a, dir / "c.h5"}, out).find("c.h5:/motions/m: has the split 'nope'"),
            std::string::npos);
}

TEST(Merge, BodiesMotionsLicencesAndAcknowledgementsAreJoined) {
  const test::TempDir dir;
  const std::string a = dir / "a.h5", b = dir / "b.h5", c = dir / "c.h5", out = dir / "out.h5";
  write_dataset(a, {body("b1"), body("b2")}, {motion("m1", "ann", "train")},
                {"bodies: CC0 1.0; motions: with acknowledgement", "made at A"});
  write_motions(b, {motion("m2", "bob", "test")}, {"motions: with acknowledgement", "made at B"});
  write_bodies(c, {body("b3")}, {"CC0-1.0", "made at A"});
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

TEST(Merge, ClashesAreNamedAndAPrefixSolvesThem) {
  const test::TempDir dir;
  const std::string a = dir / "a.h5", b = dir / "b.h5", out = dir / "out.h5";
  write_motions(a, {motion("walk", "ann", "train"), motion("run", "ann", "train")}, {});
  write_motions(b, {motion("walk", "bob", "train"), motion("run", "bob", "train")}, {});
  const std::string said = complaint({a, b}, out);
  EXPECT_NE(said.find("'walk' of " + a + " and " + b + " (and 1 more)"), std::string::npos) << said;
  EXPECT_NE(said.find("--prefix"), std::string::npos);
  merge_data({a, b}, out, {true});
  const std::vector<Motion> motions = read_motions(out);
  ASSERT_EQ(motions.size(), 4u);
  EXPECT_EQ(motions[0].id, "a_walk");
  EXPECT_EQ(motions[3].id, "b_run");
}

TEST(Merge, RefusesWhatWouldLeakOrIsNoData) {
  const test::TempDir dir;
  const std::string a = dir / "a.h5", b = dir / "b.h5", out = dir / "out.h5";
  write_motions(a, {motion("walk", "ann", "train")}, {});
  write_motions(b, {motion("run", "ann", "test")}, {});
  EXPECT_NE(complaint({a, b}, out).find("subject 'ann' is in the split 'test'"), std::string::npos);
  EXPECT_NE(complaint({a}, out).find("nothing to merge"), std::string::npos);
  EXPECT_NE(complaint({a, a}, out).find("same id"), std::string::npos);
  EXPECT_NE(complaint({a, b}, a).find("is one of the inputs"), std::string::npos);
  Scans scans;
  scans.points = {Point(0, 0, 0)};
  scans.frame_offset = {0, 1};
  scans.sequence_offset = {0, 1};
  write_scans(dir / "s.h5", scans, {});
  EXPECT_NE(complaint({a, dir / "s.h5"}, out).find("neither bodies nor motions"),
            std::string::npos);
  EXPECT_NE(complaint({a, dir / "none.h5"}, out), "");
}

}  // namespace
}  // namespace restage
