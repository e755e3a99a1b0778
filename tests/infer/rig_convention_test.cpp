// Skeletons as other programs expect them: read again by our reader, and kept for Blender
// (tests/infer/blender_open.py).
#include "infer/writers/rig_convention.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/importers/rigs/gltf_rig.h"
#include "infer/writers/glb.h"
#include "infer/writers/vrma.h"
#include "tests/infer/toy_body.h"
#include "tests/support/files.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::toy_body;
using testing::toy_pose;

constexpr int kFilmed = 20;

class RigConventions : public FileTest {
 protected:
  /// RESTAGE_KEEP=FOLDER keeps the files, and what must be seen in them.
  void keep(const std::string& name, const std::vector<std::string>& bones) {
    const char* folder = std::getenv("RESTAGE_KEEP");
    if (folder == nullptr) return;
    fs::copy_file(dir / name, fs::path(folder) / name, fs::copy_options::overwrite_existing);
    nlohmann::json seen = {{"seconds", 0.5}, {"bones", nlohmann::json::object()}};
    const PosedSkeleton posed = forward_kinematics(body_.joints, pose(15));
    for (size_t j = 0; j < kJoints; ++j)
      seen["bones"][bones[j]] = {posed.joints[j].x(), posed.joints[j].y(), posed.joints[j].z()};
    std::ofstream(fs::path(folder) / (name + ".json")) << seen;
  }
  Pose pose(int frame) const { return toy_pose(body_, frame / double{kFilmed}); }
  /// The file's motion is the one that was written, whoever names and turns the bones.
  void check(const std::string& name) {
    const SkeletonTake take = read_take(dir / name, {});
    ASSERT_EQ(take.frames.size(), size_t{kFilmed}) << name;
    for (size_t f = 0; f < take.frames.size(); ++f) {
      const PosedSkeleton wanted = forward_kinematics(body_.joints, pose(static_cast<int>(f)));
      for (size_t j = 0; j < kJoints; ++j) {
        EXPECT_LT((take.frames[f].joints[j] - wanted.joints[j]).norm(), 1e-5) << name << f;
        EXPECT_LT((take.frames[f].global[j] - wanted.global[j]).norm(), 1e-4) << name << j;
      }
    }
  }
  const Body body_ = toy_body();
};

TEST_F(RigConventions, AllSayTheSameMotion) {
  for (const std::string& name : rig_conventions()) {
    GlbOptions options;
    options.skeleton = name;
    GlbWriter writer(dir / (name + ".glb"), body_.rest, body_.joints, body_.weights, options);
    for (int f = 0; f < kFilmed; ++f) {
      const Points surface = linear_blend_skinning(body_, pose(f));
      writer.push(pose(f), std::nullopt, &surface);
    }
    const InfluenceError cut = writer.commit();
    // Against plain skinning by all weights, the surface lacks what the weights lack.
    EXPECT_NEAR(writer.surface_error().mean, cut.mean, 1e-6);
    EXPECT_NEAR(writer.surface_error().max, cut.max, 1e-5);
    check(name + ".glb");
    const RigConvention rig = rig_convention(name, body_.joints, 1.8);
    EXPECT_EQ(std::ssize(read_gltf(dir / (name + ".glb")).bones),
              std::ssize(rig.names) + std::ssize(rig.extra) + (rig.root.empty() ? 0 : 1));
    keep(name + ".glb", {rig.names.begin(), rig.names.end()});
  }
}

TEST_F(RigConventions, AxesAreTurnsAndPointAlongBones) {
  const Joints& rest = body_.joints;
  for (const std::string& name : rig_conventions())
    for (const Mat3& axes : rig_convention(name, rest, 1.8).axes) {
      EXPECT_LT((axes * axes.transpose() - Mat3::Identity()).norm(), 1e-12) << name;
      EXPECT_NEAR(axes.determinant(), 1, 1e-12) << name;
    }
  const auto along = [&](size_t a, size_t b) { return Vec3((rest[b] - rest[a]).normalized()); };
  const RigConvention mixamo = rig_convention("mixamo", rest, 1.8);
  EXPECT_LT((mixamo.axes[kLeftElbow].col(1) - along(kLeftElbow, kLeftWrist)).norm(), 1e-9);
  EXPECT_LT((mixamo.axes[kRightKnee].col(1) - along(kRightKnee, kRightAnkle)).norm(), 1e-9);
  EXPECT_GT(mixamo.axes[kRightKnee].col(2).z(), 0.9);
  EXPECT_EQ(mixamo.extra.size(), 3u);  // 25 bones
  const RigConvention unreal = rig_convention("unreal", rest, 1.8);
  EXPECT_EQ(unreal.root, "root");
  EXPECT_LT((unreal.axes[kSpine1].col(0) - along(kSpine1, kSpine2)).norm(), 1e-9);
  EXPECT_LT((unreal.axes[kLeftElbow].col(0) - along(kLeftElbow, kLeftWrist)).norm(), 1e-9);
  EXPECT_LT((unreal.axes[kRightElbow].col(0) + along(kRightElbow, kRightWrist)).norm(), 1e-6);
  EXPECT_LT((unreal.axes[kLeftHip].col(0) + along(kLeftHip, kLeftKnee)).norm(), 1e-9);
  EXPECT_LT((unreal.axes[kRightHip].col(0) - along(kRightHip, kRightKnee)).norm(), 1e-6);
  EXPECT_NEAR(unreal.axes[kLeftAnkle](1, 0), 1, 1e-12);
  EXPECT_EQ(rig_convention("smpl", rest, 1.8).extra.size(), 2u);  // 24 joints
  EXPECT_THROW(rig_convention("biped", rest, 1.8), InputError);
}

TEST_F(RigConventions, VrmAnimation) {
  VrmaWriter writer(dir / "walk.vrma", body_.joints, "walk");
  EXPECT_THROW(writer.commit(), InputError);
  for (int f = 0; f < kFilmed; ++f) writer.push(pose(f));
  writer.commit();
  const Gltf file = read_gltf(dir / "walk.vrma");
  EXPECT_EQ(file.standard, "VRM animation");
  EXPECT_EQ(file.humanoid.size(), size_t{kJoints});
  EXPECT_EQ(file.clips.at(0).name, "walk");
  check("walk.vrma");
  if (const char* folder = std::getenv("RESTAGE_KEEP"))  // for the validator, which knows .glb
    fs::copy_file(dir / "walk.vrma", fs::path(folder) / "vrma.glb",
                  fs::copy_options::overwrite_existing);
}

}  // namespace
}  // namespace restage
