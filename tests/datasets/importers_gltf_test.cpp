// Rigged characters as bodies, motions and targets: styles of exporters with known poses, compared
// in degrees and millimetres; our own output comes back in.
#include <gtest/gtest.h>

#include "datasets/importers/import.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/schema.h"
#include "infer/writers/glb.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/datasets/importers_support.h"

namespace restage {
namespace {

using namespace test;
using testing::CharacterMaker;
using testing::GltfJson;
using testing::kTurnedRound;
using testing::mixamo_style;
using testing::plain_style;
using testing::RigStyle;
using testing::scaled;
using testing::unreal_style;
using testing::vrm_parts;
using testing::vrm_style;

class ImportersGltf : public FileTest {
 protected:
  std::string write(const std::string& name, const testing::GlbParts& parts) const {
    return dir.write(name, parts.glb());
  }
  std::string write(const std::string& name, const RigStyle& style) const {
    return write(name, CharacterMaker(known_, style).parts);
  }
  /// What is read of hero.glb.
  Character hero(const RigStyle& style, const MotionOptions& options = {}) const {
    return read_character(write("hero.glb", style), options);
  }

  /// Largest distance to the known T-pose, metres; the file's character is put over the origin.
  double largest_distance(const Points& found) const {
    const Body& body = known_.body;
    float floor = 1e9f;
    for (const Point& p : body.rest.vertices) floor = std::min(floor, p.y());
    double out = found.size() == body.rest.vertices.size() ? 0 : 1e9;
    for (size_t v = 0; v < found.size() && out < 1e9; ++v) {
      const Point shift(static_cast<float>(body.joints[0].x()), floor,
                        static_cast<float>(body.joints[0].z()));
      out = std::max(out, double{(found[v] - (body.rest.vertices[v] - shift)).norm()});
    }
    return out;
  }

  /// Body, joints and every frame of the motion are what was put in.
  void expect_known(const Character& found, double degrees, double metres) const {
    ASSERT_TRUE(found.body);
    EXPECT_LT(largest_distance(found.body->rest.vertices), metres);
    EXPECT_EQ(found.body->rest.faces, known_.body.rest.faces);
    EXPECT_TRUE(found.body->weights.isApprox(known_.body.weights));
    ASSERT_EQ(found.motions.size(), 1u);
    const Motion& motion = found.motions[0];
    ASSERT_EQ(motion.frames(), 31u);
    double worst = 0, worst_joint = 0, floor = 0;
    for (size_t f = 0; f < motion.frames(); ++f) {
      const PosedSkeleton truth =
          forward_kinematics(known_.body.joints, known_.pose(static_cast<double>(f) / kFps));
      for (int j = 0; j < kJoints; ++j) {
        const Quat q(truth.global[j]);
        worst = std::max(worst, q.angularDistance(motion.global[f][j].cast<double>()));
      }
      const Vec3 hips = 0.5 * (truth.joints[1] + truth.joints[2]);
      if (f == 0) floor = hips.y() - double{motion.hips[0].y()};
      worst_joint =
          std::max(worst_joint, (motion.hips[f].cast<double>() + Vec3(0, floor, 0) - hips).norm());
    }
    EXPECT_LT(worst * 180 / M_PI, degrees);
    EXPECT_LT(worst_joint, metres);
    for (int j = 0; j < kJoints; ++j) {
      const Vec3 place = known_.body.joints[j] - known_.body.joints[0];
      EXPECT_LT((motion.rest[j] - place).norm(), metres);
      EXPECT_LT((found.body->joints[j] - found.body->joints[0] - place).norm(), metres);
    }
  }

  const testing::KnownCharacter known_ = testing::known_character();
};

/// Places of two skeletons from their own pelvis.
void expect_same_places(const Joints& a, const Joints& b, double metres) {
  for (int j = 0; j < kJoints; ++j) EXPECT_LT((a[j] - a[0] - (b[j] - b[0])).norm(), metres) << j;
}

TEST_F(ImportersGltf, MixamoInCentimetresBelowAScaledNode) {
  const Character found = hero(mixamo_style());
  expect_known(found, 0.05, 1e-4);
  EXPECT_EQ(found.body->id, "hero");
  EXPECT_EQ(found.motions[0].action, "walk");
  EXPECT_EQ(fact(found.report, "rest pose"), "T-pose");
  EXPECT_HAS(fact(found.report, "joints"), "left_elbow = 'mixamorig:LeftForeArm'");
  EXPECT_HAS(fact(found.report, "clip 'walk'"), "60 a second");
}

TEST_F(ImportersGltf, PrefixesAndNumbersOfNamesAreLeftOut) {
  RigStyle style = mixamo_style("mixamorig");  // as three.js writes it
  expect_known(hero(style), 0.05, 1e-4);
  for (int j = 0; j < kJoints; ++j)
    style.names[j] += "_0" + std::to_string(j);  // as Sketchfab does
  expect_known(hero(style), 0.05, 1e-4);
}

TEST_F(ImportersGltf, UnrealInAnAPoseWithTwistBones) {
  const Character found = hero(unreal_style());
  expect_known(found, 0.4, 1e-3);  // 24 keys a second of a smooth motion, between them by slerp
  EXPECT_HAS(fact(found.report, "units"), "0.01 m");
  EXPECT_HAS(fact(found.report, "rest pose"), "left upper arm 45.0 degrees");
}

TEST_F(ImportersGltf, VrmByItsListOfBonesTurnedToTheFront) {
  for (const bool list : {true, false}) {
    const Character found = read_character(write("hero.vrm", vrm_parts(known_, list)));
    expect_known(found, 0.05, 1e-4);
    EXPECT_HAS(fact(found.report, "facing"), "180");
  }
  // Without the list the names say nothing.
  EXPECT_THROW(hero(vrm_style()), InputError);
}

/// Nodes and animation only, as VRM animations (.vrma) and exports without a mesh are.
void leave_out_skin(testing::GlbParts& parts) {
  parts.root.erase("skins");
  parts.root.erase("meshes");
  for (auto& node : parts.root["nodes"]) {
    node.erase("skin");
    node.erase("mesh");
  }
}

TEST_F(ImportersGltf, MotionWithoutASkinIsRead) {
  const Motion truth = hero(mixamo_style()).motions[0];
  const auto expect_truth = [&](const testing::GlbParts& parts, const std::string& name) {
    const Character found = read_character(write(name, parts));
    EXPECT_FALSE(found.body) << name;
    ASSERT_EQ(found.motions.size(), 1u) << name;
    ASSERT_EQ(found.motions[0].frames(), truth.frames()) << name;
    for (size_t f = 0; f < truth.frames(); ++f)
      for (int j = 0; j < kJoints; ++j)
        EXPECT_LT(found.motions[0].global[f][j].angularDistance(truth.global[f][j]), 1e-3)
            << name << " " << f << " " << j;
    EXPECT_LT((found.motions[0].hips[10] - truth.hips[10]).norm(), 1e-3) << name;
  };
  testing::GlbParts mixamo = CharacterMaker(known_, mixamo_style()).parts;
  leave_out_skin(mixamo);
  expect_truth(mixamo, "walk.glb");
  testing::GlbParts vrm = vrm_parts(known_, false);
  leave_out_skin(vrm);
  vrm.root["extensions"]["VRMC_vrm_animation"] = vrm.root["extensions"]["VRMC_vrm"];
  vrm.root["extensions"].erase("VRMC_vrm");
  expect_truth(vrm, "walk.vrma");
  expect_truth(vrm, "renamed.glb");
  EXPECT_HAS(error_of([&] { open_frames(dir / "walk.vrma"); }), "restage data perform");
}

/// A VRM's list may lack what is optional there. Where the file has a bone for it all the same,
/// that is the joint: what carries the arms is spine3.
TEST_F(ImportersGltf, VrmMayLackWhatIsOptionalThere) {
  const Character whole = read_character(write("whole.vrm", vrm_parts(known_, false)));
  for (const std::vector<const char*>& lacks :
       {std::vector{"upperChest", "neck", "leftShoulder", "rightShoulder"},
        {"chest", "upperChest"},
        {"chest"},
        {"neck", "leftToes", "rightToes"}}) {
    testing::GlbParts parts = vrm_parts(known_, false);
    auto& bones = parts.root["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"];
    for (const char* name : lacks) bones.erase(name);
    const Character found = read_character(write("hero.vrm", parts));
    EXPECT_HAS(fact(found.report, "joints"), "spine3 = 'J_109'") << lacks[0];
    EXPECT_HAS(fact(found.report, "joints"), "spine2 = 'J_106'") << lacks[0];
    EXPECT_HAS(fact(found.report, "joints"), "neck = 'J_112', ") << lacks[0];
    ASSERT_TRUE(found.body);
    for (int j = 0; j < kJoints; ++j)
      EXPECT_LT((found.body->joints[j] - whole.body->joints[j]).norm(), 1e-6) << kJointNames[j];
  }
}

/// What VRM requires and its list lacks is said in VRM's words: nobody gave a profile.
TEST_F(ImportersGltf, AnIncompleteVrmListIsNamed) {
  const auto refused = [&](std::initializer_list<const char*> lacks) {
    testing::GlbParts parts = vrm_parts(known_, false);
    auto& bones = parts.root["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"];
    for (const char* name : lacks) bones.erase(name);
    const std::string file = write("hero.vrm", parts);
    return error_of([&] { read_character(file); });
  };
  const std::string one = refused({"leftHand"});
  EXPECT_HAS(one, "VRM's list of bones (humanBones) lacks leftHand (the left_wrist)");
  EXPECT_HAS(one, "in the program that exports VRM");
  EXPECT_HAS(one, "bones names.yaml");
  EXPECT_EQ(one.find("leave bones out"), std::string::npos) << one;
  EXPECT_HAS(refused({"head", "rightUpperLeg"}),
             "lacks rightUpperLeg (the right_hip), head (the head)");
}

/// A VRM list in which sides are crossed within a limb.
TEST_F(ImportersGltf, AVrmListMustHangTogether) {
  testing::GlbParts parts = vrm_parts(known_, false);
  auto& bones = parts.root["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"];
  std::swap(bones["leftLowerLeg"], bones["rightLowerLeg"]);
  const std::string file = write("hero.vrm", parts);
  const std::string says = error_of([&] { read_character(file); });
  EXPECT_HAS(says, "the bone for left_knee, 'leftLowerLeg', hangs on the bone for right_hip");
  EXPECT_HAS(says, "in the program that exports VRM");
}

TEST_F(ImportersGltf, TwoCharactersInOneFileAreRefused) {
  testing::GlbParts two = CharacterMaker(known_, mixamo_style()).parts;
  const size_t count = two.root["nodes"].size();
  GltfJson more = two.root["nodes"];
  for (auto& node : more) {
    if (node.contains("children"))
      for (auto& child : node["children"]) child = child.get<size_t>() + count;
    if (node.contains("skin")) node["skin"] = 1;
    two.root["nodes"].push_back(node);
  }
  GltfJson skin = two.root["skins"][0];
  for (auto& joint : skin["joints"]) joint = joint.get<size_t>() + count;
  two.root["skins"].push_back(skin);
  two.root["scenes"][0]["nodes"].push_back(22 + count);
  const std::string file = write("two.glb", two);
  EXPECT_HAS(error_of([&] { read_character(file); }), "holds 2 characters");
  EXPECT_HAS(error_of([&] { read_target(file); }), "holds 2 characters");
  testing::GlbParts horse = two;  // no person, but a skin all the same
  for (size_t n = count; n < 2 * count; ++n)
    horse.root["nodes"][n]["name"] = "horse " + std::to_string(n);
  const std::string rider = write("rider.glb", horse);
  EXPECT_HAS(error_of([&] { read_character(rider); }), "not the person's ('horse");
  MotionOptions named;
  named.profile = "mixamo";
  EXPECT_HAS(error_of([&] { read_character(file, named); }), "holds 2 characters");
  leave_out_skin(two);  // which of the two is meant by a name is not guessed
  EXPECT_HAS(error_of([&] { read_character(write("two.glb", two), named); }),
             "two of its bones are called");
}

TEST_F(ImportersGltf, BonesOfATargetMayBeNamed) {
  const std::string file = write("alien.glb", vrm_style());
  std::string yaml = "title: Alien\njoints:\n";
  for (int j = 0; j < kJoints; ++j)
    yaml += "  " + std::string(kJointNames[j]) + ": J_" + std::to_string(100 + j) + "\n";
  const TargetMesh found = read_target(file, dir.write("alien.YML", yaml));
  EXPECT_EQ(found.unknown_rig, "");
  ASSERT_TRUE(found.joints);
  EXPECT_HAS(read_target(file).unknown_rig, "none of its");
  write_ply(dir / "hero.ply", known_.body.rest);
  EXPECT_HAS(error_of([&] { read_target(dir / "hero.ply", "mixamo"); }), "leave bones out");
}

TEST_F(ImportersGltf, NodesThatRestInAnAnimationDoNotMatter) {
  RigStyle style = mixamo_style();
  style.nodes_rest_posed = true;
  const Character found = hero(style);
  expect_known(found, 0.05, 1e-4);
  ASSERT_EQ(found.report.remarks.size(), 1u);
  EXPECT_HAS(found.report.remarks[0], "another pose");
}

TEST_F(ImportersGltf, UnevenScalesAreToldOf) {
  testing::GlbParts parts = CharacterMaker(known_, mixamo_style()).parts;
  EXPECT_TRUE(read_character(write("even.glb", parts)).report.remarks.empty());
  parts.root["nodes"][22]["scale"][1] = 1.2 * parts.root["nodes"][22]["scale"][0].get<double>();
  const Character found = read_character(write("uneven.glb", parts));
  ASSERT_EQ(found.report.remarks.size(), 2u);
  EXPECT_HAS(found.report.remarks[0], "is scaled unevenly (20 % more along one axis)");
  EXPECT_HAS(found.report.remarks[1], "turn or stretch");
}

TEST_F(ImportersGltf, AxesAndUnitsOfEveryKindComeOutRight) {
  const Mat3 z_up = Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()).toRotationMatrix();
  const Mat3 oblique = turn_about_y(0.6);
  for (const Mat3& turn : {z_up, kTurnedRound, oblique, Mat3(z_up * kTurnedRound)})
    for (const double scale : {1.0, 100.0, 1000.0}) {
      RigStyle style = plain_style();
      style.world = scaled(scale, turn);
      style.bone_axes = true;
      expect_known(hero(style), 0.05, 1e-4);
    }
  RigStyle style = plain_style();
  style.world = scaled(1 / 0.0254);
  MotionOptions inches;
  inches.scale = 0.0254;
  expect_known(hero(style, inches), 0.05, 1e-4);
  expect_known(hero(style), 0.05, 1e-4);  // and found by the leg
  style.world = scaled(0.05);
  EXPECT_THROW(hero(style), InputError);
}

TEST_F(ImportersGltf, TargetStandsInTPoseWithItsVerticesInOrder) {
  const TargetMesh found = read_target(write("hero.glb", unreal_style()));
  EXPECT_LT(largest_distance(found.mesh.vertices), 1e-4);
  EXPECT_EQ(found.mesh.faces, known_.body.rest.faces);
  // Unknown names: as it stands, and said so.
  const TargetMesh unknown = read_target(write("alien.glb", vrm_style()));
  EXPECT_EQ(unknown.mesh.faces, known_.body.rest.faces);
  ASSERT_FALSE(unknown.report.remarks.empty());
  EXPECT_HAS(unknown.report.remarks[0], "as it stands");
  // Any other mesh is taken as before.
  write_ply(dir / "hero.ply", known_.body.rest);
  EXPECT_EQ(read_target(dir / "hero.ply").mesh.vertices, known_.body.rest.vertices);
}

TEST_F(ImportersGltf, AnimationPlaysAsASequenceOfSurfaces) {
  const std::string file = write("hero.glb", mixamo_style());
  const auto frames = open_frames(file);
  ASSERT_EQ(frames->frames(), 31);
  for (int f = 0; f < 31; ++f) {
    const auto frame = frames->next();
    ASSERT_TRUE(frame);
    const Points truth = linear_blend_skinning(known_.body, known_.pose(f / kFps));
    ASSERT_EQ(frame->points.size(), truth.size());
    for (size_t v = 0; v < truth.size(); ++v)
      ASSERT_LT((frame->points[v] - truth[v]).norm(), 1e-4f) << f;
  }
  EXPECT_FALSE(frames->next());
  frames->rewind();
  EXPECT_EQ(frames->next()->source, file + ":0");
}

TEST_F(ImportersGltf, ClipsAreChosenByName) {
  CharacterMaker maker(known_, plain_style());
  maker.add_motion("run/fast");
  maker.add_motion("walk");
  const std::string file = write("hero.glb", maker.parts);
  const Character all = read_character(file);
  ASSERT_EQ(all.motions.size(), 3u);
  EXPECT_EQ(all.motions[0].id, "hero_walk");
  EXPECT_EQ(all.motions[1].id, "hero_run_fast");
  EXPECT_EQ(all.motions[2].id, "hero_walk_2");
  EXPECT_EQ(read_character(file, {}, "run/fast").motions.size(), 1u);
  EXPECT_EQ(open_frames(file, {"run/fast"})->frames(), 31);
  EXPECT_THROW(read_character(file, {}, "jump"), InputError);
  EXPECT_THROW(open_frames(file, {"jump"}), InputError);
}

TEST_F(ImportersGltf, ImportedFileHoldsBodyAndMotions) {
  write("hero.glb", unreal_style());
  dir.write("bad.glb", "glTF");
  ImportOptions options;
  options.motion.split = "test";
  options.license = "CC0-1.0";
  const ImportSummary one = import_data(dir / "hero.glb", dir / "one.h5", options);
  EXPECT_EQ(one.bodies, 1u);
  EXPECT_EQ(one.motions, 1u);
  EXPECT_EQ(one.reports.size(), 1u);
  EXPECT_TRUE(verify(dir / "one.h5").empty());
  EXPECT_EQ(read_bodies(dir / "one.h5", "test").size(), 1u);
  EXPECT_EQ(read_motions(dir / "one.h5", "test")[0].subject, "hero");
  const ImportSummary folder = import_data(dir.path(), dir / "all.h5", options);
  EXPECT_EQ(folder.bodies, 1u);
  ASSERT_EQ(folder.skipped.size(), 1u);
  EXPECT_HAS(folder.skipped[0], "bad.glb");
  options.motion.fps = 24;
  EXPECT_THROW(import_data(dir / "hero.glb", dir / "no.h5", options), InputError);
}

/// pose_on() puts a file's own motion onto its own body as the file plays it.
TEST_F(ImportersGltf, BodyPerformsItsOwnMotion) {
  const Character found = hero(unreal_style());
  ASSERT_TRUE(found.body);
  for (const size_t f : {0u, 10u, 30u}) {
    const PosedSkeleton posed =
        forward_kinematics(found.body->joints, pose_on(found.motions[0], *found.body, f));
    const PosedSkeleton truth =
        forward_kinematics(known_.body.joints, known_.pose(static_cast<double>(f) / kFps));
    expect_same_places(posed.joints, truth.joints, 0.005);
  }
}

TEST_F(ImportersGltf, OurOwnOutputComesBackIn) {
  const Body body =
      testing::tiny_body("own", "train");  // at most two joints a vertex: nothing is cut
  const Motion motion = testing::tiny_motion("swing", "ann", "train", 10);
  std::vector<Pose> poses;
  GlbWriter writer(dir / "own.glb", body.rest, body.joints, body.weights);
  for (size_t f = 0; f < 10; ++f) {
    poses.push_back(pose_on(motion, body, f));
    writer.push(poses.back());
  }
  EXPECT_LT(writer.commit().max, 1e-6);

  const auto frames = open_frames(dir / "own.glb");
  ASSERT_EQ(frames->frames(), 10);
  for (const Pose& pose : poses) {
    const auto frame = frames->next();
    const Points truth = linear_blend_skinning(body, pose);
    ASSERT_EQ(frame->points.size(), truth.size());
    for (size_t v = 0; v < truth.size(); ++v)
      ASSERT_LT((frame->points[v] - truth[v]).norm(), 1e-4f);
    EXPECT_EQ(frame->faces, body.rest.faces);
  }

  const Character found = read_character(dir / "own.glb");
  ASSERT_TRUE(found.body);
  EXPECT_EQ(fact(found.report, "rest pose"), "T-pose");
  EXPECT_TRUE(found.body->weights.isApprox(body.weights, 1e-6f));
  ASSERT_EQ(found.motions.size(), 1u);
  ASSERT_EQ(found.motions[0].frames(), 10u);
  for (size_t f = 0; f < 10; ++f) {
    const PosedSkeleton ours = forward_kinematics(body.joints, poses[f]);
    const PosedSkeleton theirs =
        forward_kinematics(found.body->joints, pose_on(found.motions[0], *found.body, f));
    expect_same_places(ours.joints, theirs.joints, 1e-4);
    for (int j = 0; j < kJoints; ++j)
      EXPECT_LT(Quat(ours.global[j]).angularDistance(Quat(theirs.global[j])), 1e-4);
  }
}

TEST_F(ImportersGltf, RigsThatCannotBeUsedAreRefusedWithAWord) {
  const auto refused = [&](const testing::GlbParts& parts) {
    return error_of([&] { read_character(write("hero.glb", parts)); });
  };
  RigStyle up = plain_style();
  up.arms_down = -150;
  CharacterMaker arms(known_, up);
  EXPECT_HAS(refused(arms.parts),
             "left_shoulder");  // arms overhead and crossed: no shortest arc is meant
  CharacterMaker nameless(known_, plain_style());
  nameless.parts.root["nodes"][4]["name"] = "bone";
  EXPECT_HAS(refused(nameless.parts), "left_knee");
  testing::GlbParts empty;
  empty.root["nodes"] = {{{"name", "hips"}}};
  EXPECT_HAS(refused(empty), "left_hip");
}

}  // namespace
}  // namespace restage
