// Rigged characters as GLB files for tests: a body of boxes that performs a known motion, in the
// styles of the programs that users export from.
#pragma once

#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/datasets/importers_bvh_text.h"
#include "tests/support/tiny_body.h"

namespace restage::testing {

using GltfJson = nlohmann::json;

/// Structure and binary chunk; every block of numbers becomes a view and an accessor.
struct GlbParts {
  GltfJson root = {{"asset", {{"version", "2.0"}}}};
  std::string binary;

  template <class T>
  int add(const std::vector<T>& values, int component, const char* type, size_t width) {
    while (binary.size() % 4 != 0) binary += '\0';
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", values.size() * sizeof(T)}});
    binary.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    root["accessors"].push_back({{"bufferView", root["bufferViews"].size() - 1},
                                 {"componentType", component},
                                 {"count", values.size() / width},
                                 {"type", type}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }
  int floats(const std::vector<float>& values, const char* type, size_t width) {
    return add(values, 5126, type, width);
  }
  std::string glb() const {
    GltfJson with_buffer = root;
    with_buffer["buffers"] = {{{"byteLength", binary.size()}}};
    std::string text = with_buffer.dump(), chunk = binary;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    chunk.resize((chunk.size() + 3) / 4 * 4, '\0');
    std::string out = "glTF";
    const auto word = [&](uint32_t value) { out.append(reinterpret_cast<char*>(&value), 4); };
    word(2);
    word(static_cast<uint32_t>(28 + text.size() + chunk.size()));
    word(static_cast<uint32_t>(text.size()));
    out += "JSON" + text;
    word(static_cast<uint32_t>(chunk.size()));
    return out + std::string("BIN\0", 4) + chunk;
  }
};

/// One exporter's habits.
struct RigStyle {
  std::array<std::string, kJoints> names;
  /// From our world to the file's: turned, or in other units.
  Eigen::Affine3d world = Eigen::Affine3d::Identity();
  /// The node above all bones; it also is the space in which vertices are stored.
  Eigen::Affine3d armature = Eigen::Affine3d::Identity();
  bool bone_axes = false;    ///< bones have axes of their own
  double arms_down = 0;      ///< degrees below the T-pose, in which the skin is made
  bool twist_bones = false;  ///< upper arms and forearms have twist bones that carry weights
  double fps = 60;
  size_t keys = 61;
  bool nodes_rest_posed = false;  ///< nodes rest in the first frame of the motion
  /// Bones that hang on another bone than the body's; -1: on the armature.
  std::map<int, int> hung = {};
  bool rigid = false;  ///< every box is a mesh of its own on its bone, without a skin

  int parent_of(int j) const { return hung.count(j) != 0 ? hung.at(j) : kParents[j]; }
};

inline RigStyle plain_style() {
  RigStyle out;
  for (int j = 0; j < kJoints; ++j) out.names[j] = kJointNames[j];
  return out;
}

/// The file that says which bone is which joint.
inline std::string bones_yaml(const RigStyle& style) {
  std::string out = "title: Mine\njoints:\n";
  for (int j = 0; j < kJoints; ++j)
    out += "  " + std::string(kJointNames[j]) + ": \"" + style.names[j] + "\"\n";
  return out;
}

/// What was put into the file, in our terms.
struct KnownCharacter {
  Body body;  ///< T-pose; arms exactly along x, each box on one bone
  std::function<Pose(double seconds)> pose;
};

inline KnownCharacter known_character() {
  KnownCharacter out;
  out.body = tiny_body("hero", "train");
  const Joints tiny = out.body.joints;
  for (const int j : {16, 17, 18, 19, 20, 21}) out.body.joints[j].z() = -0.01;
  for (size_t v = 0; v < out.body.rest.vertices.size(); ++v) {
    const int bone = static_cast<int>(v / 8) + 1;  // tiny_body(): a box for each of 1 to 21
    const Vec3 shift = out.body.joints[kParents[bone]] - tiny[kParents[bone]];
    out.body.rest.vertices[v] += shift.cast<float>();
    out.body.weights.row(static_cast<Eigen::Index>(v)).setZero();
    out.body.weights(static_cast<Eigen::Index>(v), kParents[bone]) = 1;
  }
  const Vec3 root = out.body.joints[0];
  out.pose = [root](double t) {
    Pose pose;
    for (int j = 0; j < kJoints; ++j) {
      const Vec3 axis(std::sin(1.0 + j), std::cos(2.0 * j), 0.5 * std::sin(3.0 * j + 1.0));
      const double angle = (j == 0 ? 0.4 : 0.5) * std::sin(2.0 * t + 0.7 * j);
      pose.local[j] = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    }
    pose.root = root + Vec3(0.2 * std::sin(t), 0.02 * std::sin(5 * t), 0.8 * t);
    return pose;
  };
  return out;
}

/// A bone's own axes in the T-pose.
inline Mat3 bone_axes(const RigStyle& style, int j) {
  if (!style.bone_axes) return Mat3::Identity();
  return Eigen::AngleAxisd(0.9 + 0.3 * j, Vec3(std::cos(j), 1, std::sin(2.0 * j)).normalized())
      .toRotationMatrix();
}

inline Rotations arms_down(const RigStyle& style) {
  Rotations out;
  out.fill(Mat3::Identity());
  for (const int j : {16, 18, 20, 17, 19, 21})
    out[j] = Eigen::AngleAxisd((j % 2 == 0 ? -1 : 1) * style.arms_down * M_PI / 180, Vec3::UnitZ())
                 .toRotationMatrix();
  return out;
}

inline std::vector<float> as_floats(const Eigen::MatrixXd& m) {
  std::vector<float> out;
  for (Eigen::Index i = 0; i < m.size(); ++i) out.push_back(static_cast<float>(m.data()[i]));
  return out;
}

/// Nodes 0..21 are the joints, 22 the armature, 23 the mesh, then twist bones.
class CharacterMaker {
 public:
  CharacterMaker(const KnownCharacter& known, const RigStyle& style)
      : known_(known), style_(style) {
    bind_ = place(forward_kinematics(known.body.joints, rest_pose()));
    add_nodes();
    style.rigid ? add_parts() : add_mesh();
    add_motion("walk");
  }
  GlbParts parts;

  void add_motion(const std::string& name) {
    std::vector<float> times, roots;
    std::array<std::vector<float>, kJoints> turns;
    std::map<int, std::vector<float>> places;  // of bones that hang elsewhere
    for (size_t k = 0; k < style_.keys; ++k) {
      const double t = static_cast<double>(k) / style_.fps;
      times.push_back(static_cast<float>(t));
      const auto world = place(forward_kinematics(known_.body.joints, known_.pose(t)));
      for (int j = 0; j < kJoints; ++j) {
        const Eigen::Affine3d local = local_of(world, j);
        const Quat q(local.rotation());
        for (const double x : {q.x(), q.y(), q.z(), q.w()})
          turns[j].push_back(static_cast<float>(x));
        if (style_.hung.count(j) != 0)
          for (int c = 0; c < 3; ++c)
            places[j].push_back(static_cast<float>(local.translation()[c]));
        if (j > 0) continue;
        for (int c = 0; c < 3; ++c) roots.push_back(static_cast<float>(local.translation()[c]));
      }
    }
    GltfJson animation = {{"name", name}};
    const int input = parts.floats(times, "SCALAR", 1);
    const auto channel = [&](int node, const char* path, int output) {
      animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                       {"target", {{"node", node}, {"path", path}}}});
      animation["samplers"].push_back({{"input", input}, {"output", output}});
    };
    channel(0, "translation", parts.floats(roots, "VEC3", 3));
    for (const auto& [j, moved] : places) channel(j, "translation", parts.floats(moved, "VEC3", 3));
    for (int j = 0; j < kJoints; ++j) channel(j, "rotation", parts.floats(turns[j], "VEC4", 4));
    parts.root["animations"].push_back(animation);
  }

 private:
  Pose rest_pose() const { return {to_local(arms_down(style_)), known_.body.joints[0]}; }

  using World = std::array<Eigen::Affine3d, kJoints>;

  /// Bones in the file's world.
  World place(const PosedSkeleton& pose) const {
    World out;
    for (int j = 0; j < kJoints; ++j) {
      out[j] = Eigen::Affine3d::Identity();
      out[j].linear() = pose.global[j] * bone_axes(style_, j);
      out[j].translation() = pose.joints[j];
      out[j] = style_.world * out[j] * Eigen::Scaling(1 / unit());
    }
    return out;
  }
  /// Lengths in the armature's space are this many times ours; bones have no scale of their own.
  double unit() const {
    return std::cbrt(style_.world.linear().determinant() / style_.armature.linear().determinant());
  }
  Eigen::Affine3d local_of(const World& world, int j) const {
    const int parent = style_.parent_of(j);
    return (parent < 0 ? style_.armature : world[parent]).inverse() * world[j];
  }
  static GltfJson trs(const std::string& name, const Eigen::Affine3d& local) {
    const double scale = std::cbrt(local.linear().determinant());
    const Quat q(Mat3(local.linear() / scale));
    const Vec3 t = local.translation();
    return {{"name", name},
            {"translation", {t.x(), t.y(), t.z()}},
            {"rotation", {q.x(), q.y(), q.z(), q.w()}},
            {"scale", {scale, scale, scale}}};
  }

  void add_nodes() {
    const World rest = style_.nodes_rest_posed
                           ? place(forward_kinematics(known_.body.joints, known_.pose(0)))
                           : bind_;
    for (int j = 0; j < kJoints; ++j)
      parts.root["nodes"].push_back(trs(style_.names[j], local_of(rest, j)));
    parts.root["nodes"].push_back(trs("Armature", style_.armature));
    parts.root["nodes"].push_back({{"name", "Body"}, {"mesh", 0}, {"skin", 0}});
    parts.root["nodes"][22]["children"] = {0, 23};
    for (int j = 0; j < kJoints; ++j) joints_.push_back(j);
    if (style_.twist_bones)
      for (const int j : {16, 17, 18, 19}) {
        const int node = static_cast<int>(parts.root["nodes"].size());
        parts.root["nodes"].push_back({{"name", style_.names[j] + "_twist_01"}});
        parts.root["nodes"][j]["children"].push_back(node);
        twist_[j] = static_cast<int>(joints_.size());
        joints_.push_back(node);
      }
    for (int j = 1; j < kJoints; ++j) {
      const int parent = style_.parent_of(j);
      parts.root["nodes"][parent < 0 ? 22 : parent]["children"].push_back(j);
    }
    parts.root["scene"] = 0;
    parts.root["scenes"] = {{{"nodes", {22}}}};
  }

  void add_mesh() {
    const Body& body = known_.body;
    const Points posed = linear_blend_skinning(body, rest_pose());
    std::vector<float> positions, weights;
    std::vector<uint8_t> joints;
    for (size_t v = 0; v < body.rest.vertices.size(); ++v) {
      int bone = 0;
      body.weights.row(static_cast<Eigen::Index>(v)).maxCoeff(&bone);
      const Vec3 stored = style_.armature.inverse() * (style_.world * posed[v].cast<double>());
      for (int c = 0; c < 3; ++c) positions.push_back(static_cast<float>(stored[c]));
      const bool twist = twist_.count(bone) != 0;
      for (const int joint : {bone, twist ? twist_.at(bone) : 0, 0, 0})
        joints.push_back(static_cast<uint8_t>(joint));
      for (const float w : {twist ? 0.25f : 1.0f, twist ? 0.75f : 0.0f, 0.0f, 0.0f})
        weights.push_back(w);
    }
    std::vector<uint32_t> index;
    for (const Triangle& f : body.rest.faces)
      for (const int32_t i : f) index.push_back(static_cast<uint32_t>(i));
    GltfJson primitive;
    primitive["attributes"]["POSITION"] = parts.floats(positions, "VEC3", 3);
    primitive["attributes"]["JOINTS_0"] = parts.add(joints, 5121, "VEC4", 4);
    primitive["attributes"]["WEIGHTS_0"] = parts.floats(weights, "VEC4", 4);
    primitive["indices"] = parts.add(index, 5125, "SCALAR", 1);
    parts.root["meshes"] = {{{"primitives", {primitive}}}};
    std::vector<float> inverse;
    for (const int node : joints_) {
      int bone = node;
      for (const auto& [of, joint] : twist_)
        if (joints_[static_cast<size_t>(joint)] == node) bone = of;
      const auto m = as_floats((bind_[bone].inverse() * style_.armature).matrix());
      inverse.insert(inverse.end(), m.begin(), m.end());
    }
    parts.root["skins"] = {
        {{"joints", joints_}, {"inverseBindMatrices", parts.floats(inverse, "MAT4", 16)}}};
  }

  /// A mesh for each bone that has vertices, in the bone's space.
  void add_parts() {
    const Body& body = known_.body;
    const Points posed = linear_blend_skinning(body, rest_pose());
    for (int j = 0; j < kJoints; ++j) {
      std::vector<float> positions;
      std::vector<uint32_t> index;
      std::map<int32_t, uint32_t> place;
      for (const Triangle& f : body.rest.faces) {
        if (body.weights(f[0], j) == 0) continue;
        for (const int32_t v : f) {
          if (place.emplace(v, place.size()).second)
            for (const double x :
                 Vec3(bind_[j].inverse() *
                      (style_.world * posed[static_cast<size_t>(v)].cast<double>())))
              positions.push_back(static_cast<float>(x));
          index.push_back(place.at(v));
        }
      }
      if (index.empty()) continue;
      GltfJson primitive;
      primitive["attributes"]["POSITION"] = parts.floats(positions, "VEC3", 3);
      primitive["indices"] = parts.add(index, 5125, "SCALAR", 1);
      parts.root["nodes"][j]["mesh"] = parts.root["meshes"].size();
      parts.root["meshes"].push_back({{"primitives", {primitive}}});
    }
    parts.root["nodes"][23].erase("mesh");
    parts.root["nodes"][23].erase("skin");
  }

  const KnownCharacter& known_;
  RigStyle style_;
  World bind_;
  std::vector<int> joints_;   // node of each joint of the skin
  std::map<int, int> twist_;  // bone: its twist bone, as joint of the skin
};

// ---- rigs as users export them
// -------------------------------------------------------------------

inline const Mat3 kLyingDown = Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitX()).toRotationMatrix();
inline const Mat3 kTurnedRound = Eigen::AngleAxisd(M_PI, Vec3::UnitY()).toRotationMatrix();

inline Eigen::Affine3d scaled(double scale, const Mat3& turn = Mat3::Identity()) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  out.linear() = scale * turn;
  return out;
}

/// Mixamo through Blender: centimetres and z up below an armature of scale 0.01, bones with axes.
inline RigStyle mixamo_style(const std::string& prefix = "mixamorig:") {
  RigStyle out;
  for (int j = 0; j < kJoints; ++j)
    out.names[j] = prefix + (bvh_test::kMixamo[j] + std::strlen("mixamorig:"));
  out.armature = scaled(0.01, kLyingDown);
  out.bone_axes = true;
  return out;
}

/// Unreal: an A-pose, twist bones, centimetres that nothing scales.
inline RigStyle unreal_style() {
  RigStyle out;
  out.names = {"pelvis",     "thigh_l",    "thigh_r",    "spine_01", "calf_l",     "calf_r",
               "spine_02",   "foot_l",     "foot_r",     "spine_03", "ball_l",     "ball_r",
               "neck_01",    "clavicle_l", "clavicle_r", "head",     "upperarm_l", "upperarm_r",
               "lowerarm_l", "lowerarm_r", "hand_l",     "hand_r"};
  out.world = scaled(100);
  out.armature = scaled(1, kLyingDown);
  out.bone_axes = true;
  out.arms_down = 45;
  out.twist_bones = true;
  out.fps = 24;
  out.keys = 25;
  return out;
}

/// VRM 0: faces -z; nodes have names of their own, the extension says which bone is which.
inline RigStyle vrm_style() {
  RigStyle out;
  for (int j = 0; j < kJoints; ++j) out.names[j] = "J_" + std::to_string(100 + j);
  out.world = scaled(1, kTurnedRound);
  return out;
}

inline const char* const kVrmNames[kJoints] = {
    "hips",         "leftUpperLeg",  "rightUpperLeg", "spine",      "leftLowerLeg", "rightLowerLeg",
    "chest",        "leftFoot",      "rightFoot",     "upperChest", "leftToes",     "rightToes",
    "neck",         "leftShoulder",  "rightShoulder", "head",       "leftUpperArm", "rightUpperArm",
    "leftLowerArm", "rightLowerArm", "leftHand",      "rightHand"};

/// The same with that list, as VRM 0 has it or, without `list`, VRM 1.
inline GlbParts vrm_parts(const KnownCharacter& known, bool list) {
  GlbParts parts = CharacterMaker(known, vrm_style()).parts;
  GltfJson bones;
  for (int j = 0; j < kJoints; ++j) {
    if (list)
      bones.push_back({{"bone", kVrmNames[j]}, {"node", j}});
    else
      bones[kVrmNames[j]] = {{"node", j}};
  }
  parts.root["extensions"][list ? "VRM" : "VRMC_vrm"]["humanoid"]["humanBones"] = bones;
  return parts;
}

}  // namespace restage::testing
