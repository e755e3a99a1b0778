// A character's own document with one animation more: what is in it is what was asked for, and all
// else is what it was.
#include <gtest/gtest.h>

#include "datasets/characters/gltf_clip.h"
#include "datasets/characters/gltf_document.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "infer/writers/glb.h"
#include "nn/geometry/skinning.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/datasets/importers_support.h"

namespace restage {
namespace {

using namespace test;
using testing::CharacterMaker;
using testing::GlbParts;
using testing::GltfJson;
using testing::RigStyle;

constexpr size_t kFrames = 20;

/// The two chunks of a GLB.
std::pair<GltfJson, std::string> parts_of(const std::string& glb) {
  const auto word = [&](size_t at) {
    uint32_t value;
    std::memcpy(&value, glb.data() + at, 4);
    return size_t{value};
  };
  EXPECT_EQ(word(8), glb.size());
  const size_t json = word(12);
  const std::string binary = 20 + json < glb.size() ? glb.substr(28 + json) : "";
  return {GltfJson::parse(glb.substr(20, json)), binary};
}

class Characters : public FileTest {
 protected:
  std::string write(const std::string& name, const GlbParts& parts) const {
    return dir.write(name, parts.glb());
  }
  Pose pose(size_t f) const { return known_.pose(static_cast<double>(f) / kFps); }

  /// The motion of known_ in the file of a character.
  std::string performed(const std::string& in, const std::string& out,
                        GltfClipWriter::Options options = {}, const std::string& bones = "") const {
    const TargetMesh target = read_target(in, bones);
    EXPECT_TRUE(target.own) << target.unknown_rig;
    GltfClipWriter writer(out, in, target.own, std::move(options));
    for (size_t f = 0; f < kFrames; ++f) writer.push(pose(f), 0.5);
    writer.set_filled({3});
    writer.commit();
    return out;
  }

  /// What a program that plays the new animation shows is what place() says, and its joints turn as
  /// the poses do.
  void expect_played(const std::string& in, const std::string& out,
                     const std::string& bones = "") const {
    const TargetMesh target = read_target(in, bones);
    const Gltf file = read_gltf(out);
    const GltfClip& clip = find_clip(file, "retargeted");
    ASSERT_EQ(clip_frames(file, clip), int64_t{kFrames});
    double surface = 0, turn = 0, joint = 0;
    for (size_t f = 0; f < kFrames; ++f) {
      const auto nodes = gltf_pose(file, clip, clip.begin + static_cast<double>(f) / kFps);
      const Mesh shown = gltf_mesh(file, nodes);
      Joints joints;
      Points vertices;
      target.own->place(pose(f), nullptr, &joints, &vertices);
      ASSERT_EQ(shown.vertices.size(), vertices.size());
      const GltfRig& rig = target.own->rig();
      for (size_t v = 0; v < vertices.size(); ++v)
        surface = std::max(
            surface,
            double{(rig.to_ours(shown.vertices[v].cast<double>()).cast<float>() - vertices[v])
                       .norm()});
      const PosedSkeleton got = rig_pose(rig, nodes);
      const PosedSkeleton wanted = forward_kinematics(target.own->rest(), pose(f));
      for (int j = 0; j < kJoints; ++j) {
        turn = std::max(turn, Quat(got.global[j]).angularDistance(Quat(wanted.global[j])));
        joint = std::max(joint, (got.joints[j] - wanted.joints[j]).norm());
        EXPECT_LT((joints[j] - got.joints[j]).norm(), 1e-5);
      }
    }
    EXPECT_LT(surface, 1e-4);
    EXPECT_LT(joint, 1e-4);
    EXPECT_LT(turn * 180 / M_PI, 0.05);
  }

  const testing::KnownCharacter known_ = testing::known_character();
};

/// Every rig as users export it.
TEST_F(Characters, PlayTheMotionOnTheirOwnBones) {
  RigStyle posed = testing::mixamo_style();
  posed.nodes_rest_posed = true;  // the nodes rest in the first frame of another motion
  const std::pair<const char*, RigStyle> styles[] = {{"plain", testing::plain_style()},
                                                     {"mixamo", testing::mixamo_style()},
                                                     {"unreal", testing::unreal_style()},
                                                     {"posed", posed}};
  for (const auto& [name, style] : styles) {
    SCOPED_TRACE(name);
    const std::string in = write("in.glb", CharacterMaker(known_, style).parts);
    expect_played(in, performed(in, dir / "out.glb"));
  }
  for (const bool list : {true, false}) {  // VRM 0 faces -z
    const std::string in = write("in.vrm", testing::vrm_parts(known_, list));
    expect_played(in, performed(in, dir / "out.vrm"));
  }
}

/// As exports with IK have them: goals on the armature. No bone is left behind.
TEST_F(Characters, BonesThatHangElsewhereGoWithTheBody) {
  RigStyle goals = testing::mixamo_style();
  goals.arms_down = 40;
  goals.hung = {{7, -1}, {8, -1}, {20, -1}, {21, -1}};
  RigStyle beside = testing::plain_style();
  beside.hung = {{4, 0}, {5, 0}};  // shins on the pelvis
  for (const RigStyle& style : {goals, beside}) {
    const std::string in = write("in.glb", CharacterMaker(known_, style).parts);
    const std::string bones = dir.write("names.yaml", testing::bones_yaml(style));
    EXPECT_TRUE(read_target(in, bones).own);
    if (style.hung.count(4) == 0) {
      EXPECT_TRUE(read_target(in).own) << read_target(in).unknown_rig;
    }
    expect_played(in, performed(in, dir / "out.glb", {}, bones), bones);
  }
}

TEST_F(Characters, ATrunkBesideItsLegsIsMovedByWhatCarriesBoth) {
  // Root carries the thighs and Hips, Hips the spine alone.
  RigStyle style = testing::plain_style();
  style.names[0] = "Root";
  style.names[3] = "Hips";
  style.names[6] = "Abdomen";
  style.names[9] = "Chest";
  const std::string in = write("in.glb", CharacterMaker(known_, style).parts);
  expect_played(in, performed(in, dir / "out.glb"));
}

/// A bone file may name the root on the ground: it carries legs and spine.
TEST_F(Characters, APelvisOnTheGroundTurnsTheBodyAboutTheHips) {
  testing::KnownCharacter known = known_;
  known.body.joints[0] = Vec3(0, 0, 0);
  const RigStyle style = testing::plain_style();
  const std::string in = write("in.glb", CharacterMaker(known, style).parts);
  const std::string bones = dir.write("names.yaml", testing::bones_yaml(style));
  const TargetMesh target = read_target(in, bones);
  ASSERT_TRUE(target.own);
  const Joints& rest = target.own->rest();
  const Vec3 hips = 0.5 * (rest[kLeftHip] + rest[kRightHip]);
  EXPECT_GT(rest[kPelvis].y(), hips.y());
  EXPECT_LT((rest[kPelvis] - hips).norm(), 0.2 * leg_length(rest));
  expect_played(in, performed(in, dir / "out.glb", {}, bones), bones);
}

TEST_F(Characters, APelvisThatIsNamedBesideTheLegsIsMovedByWhatCarriesBoth) {
  // Body carries the thighs and Hips, and is named for nothing.
  RigStyle style = testing::plain_style();
  style.names[0] = "Body";
  style.names[3] = "Hips";
  const std::string in = write("in.glb", CharacterMaker(known_, style).parts);
  std::string bones = testing::bones_yaml(style);
  const auto change = [&](const std::string& from, const std::string& to) {
    bones.replace(bones.find(from), from.size(), to);
  };
  change("pelvis: \"Body\"", "pelvis: \"Hips\"");
  change("  spine1: \"Hips\"\n", "");
  const TargetMesh target = read_target(in, dir.write("names.yaml", bones));
  ASSERT_TRUE(target.own);
  Joints joints;
  Points vertices;
  Pose stands;
  stands.local.fill(Mat3::Identity());
  stands.root = target.own->rest()[kPelvis];
  target.own->place(stands, nullptr, &joints, &vertices);
  for (size_t v = 0; v < vertices.size(); ++v)
    ASSERT_LT((vertices[v] - target.own->mesh().vertices[v]).norm(), 1e-5) << v;
  for (size_t f = 0; f < kFrames; ++f) {
    const Pose now = pose(f);
    target.own->place(now, nullptr, &joints, &vertices);
    EXPECT_LT((joints[kPelvis] - now.root).norm(), 1e-6) << f;
  }
}

/// Bones that carry weights, are none of the joints, and hang on the armature.
TEST_F(Characters, WhatMovesVerticesIsNeverLeftBehind) {
  RigStyle style = testing::plain_style();
  style.twist_bones = true;
  GlbParts parts = CharacterMaker(known_, style).parts;
  const std::string whole = write("whole.glb", parts);
  GltfJson& nodes = parts.root["nodes"];
  for (const auto& [twist, bone] : {std::pair<size_t, size_t>{24, 16}, {25, 17}}) {
    GltfJson kept = GltfJson::array();
    for (const GltfJson& child : nodes[bone]["children"])
      if (child.get<size_t>() != twist) kept.push_back(child);
    ASSERT_EQ(kept.size() + 1, nodes[bone]["children"].size());
    nodes[bone]["children"] = kept;
    nodes[22]["children"].push_back(twist);
    const Vec3& place = known_.body.joints[bone];
    nodes[twist]["translation"] = {place.x(), place.y(), place.z()};
  }
  const std::string in = write("in.glb", parts);
  const TargetMesh target = read_target(in), other = read_target(whole);
  ASSERT_TRUE(target.own && other.own);
  for (size_t f = 0; f < kFrames; ++f) {
    Joints joints;
    Points got, wanted;
    target.own->place(pose(f), nullptr, &joints, &got);
    other.own->place(pose(f), nullptr, &joints, &wanted);
    for (size_t v = 0; v < got.size(); ++v) ASSERT_LT((got[v] - wanted[v]).norm(), 1e-4) << f;
  }
}

/// A character of whose left forearm a bone of its own carries the second half.
GlbParts with_forearm_bone(const testing::KnownCharacter& known, const char* name, double along) {
  GlbParts parts = CharacterMaker(known, testing::plain_style()).parts;
  GltfJson& nodes = parts.root["nodes"];
  const Vec3 place = along * (known.body.joints[kLeftWrist] - known.body.joints[kLeftElbow]);
  const size_t added = nodes.size();
  nodes.push_back({{"name", name}, {"translation", {place.x(), place.y(), place.z()}}});
  nodes[kLeftElbow]["children"].push_back(added);
  return parts;
}

/// The hand turned about the forearm's line, everything else at rest.
Pose wrung(const Joints& rest, double degrees) {
  Pose out;
  out.local.fill(Mat3::Identity());
  out.root = rest[kPelvis];
  const Vec3 line = (rest[kLeftWrist] - rest[kLeftElbow]).normalized();
  out.local[kLeftWrist] = Eigen::AngleAxisd(degrees * M_PI / 180, line).toRotationMatrix();
  return out;
}

/// The angle of a node's rotation in a pose from the one at rest, degrees.
double turned(const GltfOwnRig& own, int number, const Pose& pose) {
  const auto rotation = [&](const Pose& p) {
    for (const auto& [node, turn] : own.turns(p, nullptr).local)
      if (node == number) return turn;
    ADD_FAILURE() << "node " << number << " is not turned";
    return Quat::Identity();
  };
  return rotation(pose).angularDistance(rotation(wrung(own.rest(), 0))) * 180 / M_PI;
}

TEST_F(Characters, TwistBonesTakeTheirShare) {
  const Joints& rest = known_.body.joints;
  const int added = 22 + 2;  // after the joints, the armature and the mesh
  for (const auto& [name, along, share] :
       {std::tuple{"lowerarm_twist_01_l", 0.6, 0.6}, {"Forearm Roll L", 0.0, 0.5}}) {
    const TargetMesh target = read_target(write("in.glb", with_forearm_bone(known_, name, along)));
    ASSERT_TRUE(target.own);
    EXPECT_NEAR(turned(*target.own, added, wrung(rest, 100)), share * 100, 0.5) << name;
    EXPECT_NEAR(turned(*target.own, kLeftElbow, wrung(rest, 100)), 0, 1e-3) << name;
  }
}

TEST_F(Characters, AWrungWristIsEasedByTheForearm) {
  for (const char* name : {"Sleeve", "Shield_controller", "ForeArmRoll_end", ""}) {  // others stay
    GlbParts parts = *name ? with_forearm_bone(known_, name, 0.5)
                           : CharacterMaker(known_, testing::plain_style()).parts;
    const TargetMesh target = read_target(write("in.glb", parts));
    ASSERT_TRUE(target.own);
    const Joints& rest = target.own->rest();
    EXPECT_NEAR(turned(*target.own, kLeftElbow, wrung(rest, 70)), 0, 1e-3);
    EXPECT_NEAR(turned(*target.own, kLeftElbow, wrung(rest, 135)), 40, 0.5);
    EXPECT_NEAR(turned(*target.own, kLeftElbow, wrung(rest, 180)), 0, 0.5) << "no sign";
    Joints joints;
    target.own->place(wrung(rest, 135), nullptr, &joints, nullptr);
    EXPECT_LT((joints[kLeftWrist] - rest[kLeftWrist]).norm(), 1e-4);
  }
}

TEST_F(Characters, RigidPartsAreDrivenByTheirNodes) {
  RigStyle style = testing::mixamo_style();
  style.rigid = true;
  const std::string in = write("in.glb", CharacterMaker(known_, style).parts);
  expect_played(in, performed(in, dir / "out.glb"));
}

/// A mesh without bones, shown by two nodes, one of which is moved.
GlbParts bare(const testing::KnownCharacter& known) {
  GlbParts parts = CharacterMaker(known, testing::plain_style()).parts;
  parts.root.erase("skins");
  parts.root.erase("animations");
  GltfJson& attributes = parts.root["meshes"][0]["primitives"][0]["attributes"];
  attributes.erase("JOINTS_0");
  attributes.erase("WEIGHTS_0");
  std::vector<float> uvs(2 * known.body.rest.vertices.size(), 0.25f);
  attributes["TEXCOORD_0"] = parts.floats(uvs, "VEC2", 2);
  parts.root["materials"] = {{{"name", "Cloth"}}};
  parts.root["meshes"][0]["primitives"][0]["material"] = 0;
  parts.root["nodes"] = {{{"name", "Body"}, {"mesh", 0}},
                         {{"name", "Holder"}, {"translation", {0.1, 0, 0}}, {"children", {2}}},
                         {{"name", "Twin"}, {"mesh", 0}, {"scale", {1.1, 1.1, 1.1}}}};
  parts.root["scenes"] = {{{"nodes", {0, 1}}}};
  return parts;
}

TEST_F(Characters, BareMeshesKeepWhatTheyHaveAndGetBones) {
  const GlbParts parts = bare(known_);
  const std::string in = write("in.glb", parts), content = parts.glb();
  const Gltf file = parse_gltf(content, in);
  const Mesh mesh = gltf_mesh(file, gltf_rest(file));
  const size_t half = known_.body.rest.vertices.size();
  ASSERT_EQ(mesh.vertices.size(), 2 * half);
  SkinWeights weights(2 * half, kJoints);
  SkinWeights twins = SkinWeights::Zero(static_cast<Eigen::Index>(half), kJoints);
  twins.col(kHead).setOnes();
  weights << known_.body.weights, twins;
  GlbWriter ours("ours.glb", mesh, known_.body.joints, weights);
  for (size_t f = 0; f < kFrames; ++f) ours.push(pose(f), 0.5);
  for (const char* name : {"out.glb", "out.gltf"}) {
    GltfDocument document(content, in);
    document.wear(ours.bytes(), file);
    document.write(dir / name);
    const Gltf out = read_gltf(dir / name);
    const GltfClip& clip = find_clip(out, "motion");
    for (size_t f = 0; f < kFrames; ++f) {
      const Mesh shown = gltf_mesh(out, gltf_pose(out, clip, static_cast<double>(f) / kFps));
      ASSERT_EQ(shown.vertices.size(), mesh.vertices.size());
      const PosedSkeleton posed = forward_kinematics(known_.body.joints, pose(f));
      double off = 0;
      for (size_t v = 0; v < mesh.vertices.size(); ++v)
        off = std::max(off, (shown.vertices[v].cast<double>() -
                             blend(mesh.vertices[v].cast<double>(),
                                   weights.row(static_cast<Eigen::Index>(v)).data(),
                                   known_.body.joints, posed))
                                .norm());
      EXPECT_LT(off, 1e-4) << name << ", frame " << f;
    }
  }
  const auto [before, binary] = parts_of(content);
  const auto [after, longer] = parts_of(bytes_of(dir / "out.glb"));
  EXPECT_EQ(longer.substr(0, parts.binary.size()), parts.binary);
  EXPECT_EQ(after["materials"], before["materials"]);
  for (const size_t mesh_number : {size_t{0}, size_t{1}}) {
    const GltfJson& part = after["meshes"][mesh_number]["primitives"][0];
    for (const char* name : {"POSITION", "TEXCOORD_0"})
      EXPECT_EQ(part["attributes"][name], before["meshes"][0]["primitives"][0]["attributes"][name]);
    EXPECT_TRUE(part["attributes"].contains("JOINTS_0"));
    EXPECT_EQ(part["indices"], before["meshes"][0]["primitives"][0]["indices"]);
  }
  EXPECT_NE(after["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"],
            after["meshes"][1]["primitives"][0]["attributes"]["JOINTS_0"]);
  EXPECT_FALSE(after["nodes"][2].contains("mesh")) << "a skin ignores where its node is";
}

/// The mesh stands in another pose than the bones rest in; its vertices stay where they are.
TEST_F(Characters, ABareMeshMayStandInAnyPose) {
  const GlbParts parts = bare(known_);
  const std::string in = write("in.glb", parts), content = parts.glb();
  const Gltf file = parse_gltf(content, in);
  const Mesh mesh = gltf_mesh(file, gltf_rest(file));
  SkinWeights weights(2 * known_.body.weights.rows(), kJoints);
  weights << known_.body.weights, known_.body.weights;
  JointMoves unposed;
  for (size_t j = 0; j < kJoints; ++j)
    unposed[j] = Eigen::Translation3d(0.01 * static_cast<double>(j), 0.02, -0.03) *
                 Eigen::AngleAxisd(0.05 * static_cast<double>(j), Vec3::UnitZ());
  GlbWriter ours("ours.glb", mesh, known_.body.joints, weights);
  for (size_t f = 0; f < kFrames; ++f) ours.push(pose(f));
  GltfDocument document(content, in);
  document.wear(ours.bytes(), file, &unposed);
  document.write(dir / "out.glb");
  const Gltf out = read_gltf(dir / "out.glb");
  const GltfClip& clip = find_clip(out, "motion");
  for (size_t f = 0; f < kFrames; ++f) {
    const Mesh shown = gltf_mesh(out, gltf_pose(out, clip, static_cast<double>(f) / kFps));
    const PosedSkeleton posed = forward_kinematics(known_.body.joints, pose(f));
    for (size_t v = 0; v < mesh.vertices.size(); ++v) {
      Vec3 wanted = Vec3::Zero();
      for (size_t j = 0; j < kJoints; ++j)
        wanted += double{weights(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(j))} *
                  (posed.global[j] *
                       (unposed[j] * mesh.vertices[v].cast<double>() - known_.body.joints[j]) +
                   posed.joints[j]);
      ASSERT_LT((shown.vertices[v].cast<double>() - wanted).norm(), 1e-4) << f << " " << v;
    }
  }
  EXPECT_EQ(parts_of(bytes_of(dir / "out.glb")).second.substr(0, parts.binary.size()),
            parts.binary);
}

TEST_F(Characters, WhatWouldBeTornIsRefused) {
  RigStyle style = testing::mixamo_style();
  style.hung = {
      {12, 3}};  // trunks are built in many ways: the neck goes with the first of the spine
  const std::string in = write("in.glb", CharacterMaker(known_, style).parts);
  const TargetMesh target = read_target(in, dir.write("names.yaml", testing::bones_yaml(style)));
  ASSERT_TRUE(target.own);
  Joints joints;
  Pose bent = pose(0);
  for (const int j : {6, 9})
    bent.local[j] = Eigen::AngleAxisd(0.1, Vec3::UnitX()).toRotationMatrix();
  target.own->place(bent, nullptr, &joints, nullptr);
  for (const int j : {6, 9})
    bent.local[j] = Eigen::AngleAxisd(1.5, Vec3::UnitX()).toRotationMatrix();
  EXPECT_THROW(target.own->place(bent, nullptr, &joints, nullptr), InputError);
}

TEST_F(Characters, AllElseIsWhatItWas) {
  GlbParts parts = CharacterMaker(known_, testing::mixamo_style()).parts;
  parts.root["materials"] = {
      {{"name", "Skin"}, {"pbrMetallicRoughness", {{"baseColorFactor", {0.1, 0.2, 0.3, 1}}}}}};
  parts.root["images"] = {
      {{"mimeType", "image/png"}, {"bufferView", parts.root["bufferViews"].size()}}};
  parts.root["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", parts.binary.size()}, {"byteLength", 5}});
  parts.binary += "pixel";  // not a whole number of words
  parts.root["extensionsUsed"] = {"MAKER_odd"};
  parts.root["extensions"]["MAKER_odd"] = {{"tailored", {1, 2.5, "x"}}};
  parts.root["nodes"][3]["extras"] = {{"note", "ä"}};
  const std::string in = write("in.glb", parts), before = bytes_of(in);
  const std::string out = performed(in, dir / "out.glb");
  const auto [was, was_binary] = parts_of(before);
  auto [is, is_binary] = parts_of(bytes_of(out));
  EXPECT_EQ(is_binary.substr(0, was["buffers"][0]["byteLength"]),
            was_binary.substr(0, was["buffers"][0]["byteLength"]));
  EXPECT_EQ(is["buffers"][0]["byteLength"], is_binary.size());
  ASSERT_EQ(is["animations"].size(), 2u);
  const GltfJson added = is["animations"][1];
  EXPECT_EQ(added["name"], "retargeted");
  EXPECT_EQ(added["extras"]["confidence"].size(), kFrames);
  EXPECT_EQ(added["extras"]["filled"], (std::vector<int>{3}));
  size_t moved = 0;
  for (const auto& channel : added["channels"]) {
    if (channel["target"]["path"] != "translation") continue;
    ++moved;
    EXPECT_EQ(channel["target"]["node"], 0);
  }
  EXPECT_EQ(moved, 1u);
  EXPECT_EQ(added["channels"].size(), 23u);
  is["animations"].erase(1);
  for (const char* list : {"bufferViews", "accessors"}) {
    ASSERT_GT(is[list].size(), was[list].size());
    while (is[list].size() > was[list].size()) is[list].erase(is[list].size() - 1);
  }
  is["buffers"] = was["buffers"];
  EXPECT_EQ(is, was);
  EXPECT_EQ(bytes_of(in), before) << "the input was written to";
  EXPECT_EQ(bytes_of(performed(in, dir / "again.glb")), bytes_of(out));
}

TEST_F(Characters, TextsAndTheFilesThatTheyName) {
  GlbParts parts = CharacterMaker(known_, testing::plain_style()).parts;
  GltfJson root = parts.root;
  root["buffers"] = {{{"byteLength", parts.binary.size()}, {"uri", "its%20data.bin"}}};
  root["images"] = {{{"uri", "tex/skin.jpg"}}};
  dir.write("a/its data.bin", parts.binary);
  dir.write("a/tex/skin.jpg", "JPEG");
  const std::string in = dir.write("a/in.gltf", root.dump());
  // Beside them; elsewhere, where they are copied; all in one file.
  expect_played(in, performed(in, dir / "a/out.gltf"));
  std::filesystem::create_directories(dir / "b");
  const std::string there = performed(in, dir / "b/out.gltf");
  expect_played(in, there);
  EXPECT_EQ(bytes_of(dir / "b/tex/skin.jpg"), "JPEG");
  const GltfJson text = GltfJson::parse(bytes_of(there));
  EXPECT_EQ(text["images"], root["images"]);
  EXPECT_EQ(text["buffers"][0], root["buffers"][0]);
  std::filesystem::create_directories(dir / "c");
  const std::string whole = performed(in, dir / "c/out.glb");
  expect_played(in, whole);
  const auto [json, binary] = parts_of(bytes_of(whole));
  EXPECT_EQ(json["buffers"].size(), 1u);
  const GltfJson view = json["bufferViews"][json["images"][0]["bufferView"].get<size_t>()];
  EXPECT_EQ(binary.substr(view["byteOffset"], view["byteLength"]), "JPEG");
  EXPECT_EQ(json["images"][0]["mimeType"], "image/jpeg");
  // A GLB as a text.
  const std::string glb = write("in.glb", parts);
  expect_played(glb, performed(glb, dir / "b/from_glb.gltf"));
  // What others put there stays.
  dir.write("d/tex/skin.jpg", "somebody's");
  EXPECT_HAS(refusal_of([&] { performed(in, dir / "d/out.gltf"); }), "is another file");
  EXPECT_EQ(bytes_of(dir / "d/tex/skin.jpg"), "somebody's");
  EXPECT_FALSE(std::filesystem::exists(dir / "d/out.gltf"));
}

TEST_F(Characters, PartsThatNobodyReadsMayBeWrong) {
  const GlbParts good = CharacterMaker(known_, testing::plain_style()).parts;
  std::filesystem::create_directories(dir / "b");
  const auto refused = [&](const char* name, const GltfJson& value, const std::string& out) {
    GlbParts parts = good;
    parts.root[name] = value;
    const std::string in = write("in.glb", parts);
    EXPECT_HAS(refusal_of([&] { performed(in, dir / out); }), "in.glb: ");
    EXPECT_FALSE(std::filesystem::exists(dir / out)) << value;
  };
  for (const char* out : {"out.glb", "b/out.gltf"})
    for (const GltfJson& uri : {GltfJson(5), GltfJson("no_such.png"), GltfJson("../outside.png")})
      refused("images", GltfJson::array({{{"uri", uri}}}), out);
  GltfJson views = good.root["bufferViews"];
  views.push_back({{"buffer", 9}, {"byteLength", 4}});
  refused("bufferViews", views, "out.glb");
}

/// Players interpolate the four numbers: q and -q next to each other would turn the long way round.
TEST_F(Characters, AFullTurnHasNoFlips) {
  const std::string in = write("in.glb", CharacterMaker(known_, testing::mixamo_style()).parts);
  const TargetMesh target = read_target(in);
  GltfClipWriter writer(dir / "out.glb", in, target.own, {});
  for (int f = 0; f < 30; ++f) {
    Pose spin = pose(0);
    spin.local[0] = Eigen::AngleAxisd(0.3 * f, Vec3::UnitY()).toRotationMatrix();
    writer.push(spin);
  }
  writer.commit();
  const Gltf file = read_gltf(dir / "out.glb");
  for (const GltfTrack& track : find_clip(file, "retargeted").tracks) {
    if (track.path != GltfTrack::Path::rotation) continue;
    for (size_t k = 4; k < track.values.size(); k += 4)
      EXPECT_GT(Eigen::Map<const Eigen::Vector4f>(&track.values[k])
                    .dot(Eigen::Map<const Eigen::Vector4f>(&track.values[k - 4])),
                0);
  }
}

TEST_F(Characters, TheAnimationAlone) {
  const std::string in = write("in.glb", CharacterMaker(known_, testing::unreal_style()).parts);
  GltfClipWriter::Options alone;
  alone.animation_only = true;
  alone.fps = 15;
  const std::string out = performed(in, dir / "out.glb", alone);
  const auto [json, binary] = parts_of(bytes_of(out));
  for (const char* gone : {"meshes", "skins", "materials"})
    EXPECT_FALSE(json.contains(gone)) << gone;
  EXPECT_EQ(json["nodes"].size(), parts_of(bytes_of(in)).first["nodes"].size());
  EXPECT_EQ(json["animations"].size(), 1u);
  const Gltf file = read_gltf(out);
  EXPECT_TRUE(file.vertices.empty());
  EXPECT_NEAR(file.clips[0].end, (kFrames - 1) / 15.0, 1e-6);
}

/// 3ds Max hangs the legs on the first spine bone: it turns with the pelvis, and legs stay.
TEST_F(Characters, LegsOnTheSpineStayWhereTheyAre) {
  RigStyle style = testing::plain_style();
  GlbParts parts = CharacterMaker(known_, style).parts;
  auto& nodes = parts.root["nodes"];
  const Vec3 spine(nodes[3]["translation"][0], nodes[3]["translation"][1],
                   nodes[3]["translation"][2]);
  for (const int hip : {1, 2}) {  // from the pelvis to the spine, at the same place
    auto& children = nodes[0]["children"];
    children.erase(std::find(children.begin(), children.end(), GltfJson(hip)));
    nodes[3]["children"].push_back(hip);
    for (int c = 0; c < 3; ++c)
      nodes[hip]["translation"][static_cast<size_t>(c)] =
          nodes[hip]["translation"][static_cast<size_t>(c)].get<double>() - spine[c];
  }
  const TargetMesh target = read_target(write("in.glb", parts));
  ASSERT_TRUE(target.own) << target.unknown_rig;
  for (size_t f = 0; f < kFrames; ++f) {
    Joints joints;
    target.own->place(pose(f), nullptr, &joints, nullptr);
    const PosedSkeleton wanted = forward_kinematics(target.own->rest(), pose(f));
    for (const int j : {0, 1, 2, 4, 5, 7, 8, 10, 11})
      EXPECT_LT((joints[j] - wanted.joints[j]).norm(), 1e-5) << kJointNames[j];
  }
}

}  // namespace
}  // namespace restage
