// Recordings whose root is the head or the chest, and skeletons that lack a head or half a body.
#include <gtest/gtest.h>

#include "autograd/base/words.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/motions/reroot.h"
#include "datasets/readers/skeletons/bvh.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

int bone_of(const SourceSkeleton& skeleton, const std::string& name) {
  for (size_t b = 0; b < skeleton.size(); ++b)
    if (skeleton.names[b] == name) return static_cast<int>(b);
  throw std::runtime_error("no bone " + name);
}

/// The file's joints and channels as text.
std::string text_of(const BvhFile& file) {
  std::string out = "HIERARCHY\n";
  const std::function<void(size_t)> add = [&](size_t j) {
    out +=
        cat(j == 0 ? "ROOT " : "JOINT ", file.skeleton.names[j], "\n{\nOFFSET ",
            bvh_test::vector_text(file.skeleton.offsets[j]), "\nCHANNELS ", file.channels[j].size(),
            j == 0 ? " Xposition Yposition Zposition" : "", " Zrotation Xrotation Yrotation\n");
    bool any = false;
    for (size_t k = j + 1; k < file.skeleton.size(); ++k)
      if (file.skeleton.parents[k] == static_cast<int>(j)) {
        add(k);
        any = true;
      }
    if (!any)
      out += cat("End Site\n{\nOFFSET ", bvh_test::vector_text(file.skeleton.ends[j]), "\n}\n");
    out += "}\n";
  };
  add(0);
  out += cat("MOTION\nFrames: ", file.frames.size(),
             "\nFrame Time: ", bvh_test::number(file.frame_time), "\n");
  for (const std::vector<double>& frame : file.frames) {
    for (const double value : frame) out += bvh_test::number(value) + " ";
    out += "\n";
  }
  return out;
}

BvhFile walking() {
  bvh_test::Style style;
  style.frames = 41;
  return parse_bvh(bvh_test::text(style), "test.bvh");
}

TEST(ImportersReroot, HipsThatHangOnTheSpineAreTheRoot) {
  const BvhFile usual = walking();
  EXPECT_EQ(hanging_pelvis(usual.skeleton, nullptr), -1);
  for (const char* root : {"mixamorig:Head", "mixamorig:Spine2", "mixamorig:Neck"}) {
    const BvhFile hung = rerooted(usual, bone_of(usual.skeleton, root));
    ASSERT_EQ(hung.skeleton.names[0], root);
    const int pelvis = hanging_pelvis(hung.skeleton, nullptr);
    ASSERT_EQ(pelvis, bone_of(hung.skeleton, "mixamorig:Hips")) << root;
    ASSERT_TRUE(has_root_positions_alone(hung));
    MotionOptions options;
    options.drop_leading = 0;
    const MotionClip clip = convert_bvh(text_of(hung), "test.bvh", options);
    ASSERT_EQ(clip.motion.frames(), 11u);
    EXPECT_HAS(clip.report.remarks.at(0), cat("its root is '", root, "'"));
    for (size_t f = 0; f < clip.joints.size(); ++f) {
      const PosedSkeleton truth = bvh_test::truth(static_cast<double>(f) / 30);
      for (int j = 0; j < kJoints; ++j)
        ASSERT_LT(
            ((clip.joints[f][j] - clip.joints[f][0]) - (truth.joints[j] - truth.joints[0])).norm(),
            2e-5)
            << root << f << " " << j;
    }
  }
}

TEST(ImportersReroot, NamesOfAProfileTellItToo) {
  BvhFile hung = rerooted(walking(), bone_of(walking().skeleton, "mixamorig:Head"));
  Profile profile = find_profile("mixamo");
  for (size_t b = 0; b < hung.skeleton.size(); ++b) {
    for (auto& names : profile.bones)
      for (std::string& name : names)
        if ("mixamorig:" + name == hung.skeleton.names[b]) name = cat("b", b);
    hung.skeleton.names[b] = cat("b", b);
  }
  EXPECT_EQ(hanging_pelvis(hung.skeleton, nullptr), -1);
  EXPECT_GT(hanging_pelvis(hung.skeleton, &profile), 0);
}

TEST(ImportersReroot, TheEndOfTheNeckIsTheHead) {
  bvh_test::Style style;
  style.without = {kHead};
  const MotionClip clip = convert_bvh(bvh_test::text(style), "test.bvh", {});
  const Vec3 found = clip.motion.rest[kHead] - clip.motion.rest[kNeck];
  EXPECT_LT((found - Vec3(0, 0.05, 0)).norm(), 1e-5);
}

TEST(ImportersReroot, HalfABodyIsNamed) {
  const auto refusal = [](const std::vector<int>& without) {
    bvh_test::Style style;
    style.without = without;
    return test::error_of([&] { convert_bvh(bvh_test::text(style), "test.bvh", {}); });
  };
  EXPECT_HAS(refusal({1, 2, 4, 5, 7, 8, 10, 11}),
             "is half a body: none of its 14 bones is of a leg");
}

/// Legs of 0.48 m, that would be 1.2 m in inches.
TEST(ImportersReroot, AToddlerInCentimetresIsNoGiantInInches) {
  bvh_test::Style style;
  style.unit = 0.0177;
  const MotionClip clip = convert_bvh(bvh_test::text(style), "test.bvh", {});
  EXPECT_EQ(clip.scale, 0.01);
}

}  // namespace
}  // namespace restage
