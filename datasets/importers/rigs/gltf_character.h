// Rigged glTF characters (Mixamo, VRM, Unreal, MakeHuman and Anny, SMPL, our own output) as bodies,
// motions and targets of retargeting.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/doctor/examine.h"
#include "datasets/importers/rigs/gltf_own_rig.h"

namespace restage {

struct Character {
  std::optional<Body> body;     ///< none, if the file holds no mesh or none with a skin
  std::vector<Motion> motions;  ///< one per animation that moves the 22 joints
  ImportReport report;
};

/// The body stands in T-pose on y = 0 with its pelvis over the origin; weights are those of the
/// file's bones, each counted for the nearest of the 22 joints at it or above it. The motions are
/// relative to the same T-pose, sampled at 30 fps by the file's own interpolation (slerp for
/// LINEAR), over the floor. `clip`: this animation only; empty: all. Of the options, beside what
/// find_rig() takes, `force` and the names count; empty id: the file's name, subject: the id,
/// action: the clip's name. InputError: see read_gltf() and find_rig(); neither a mesh with a skin
/// nor motion; left and right exchanged; no such clip; more frames than a file of this size can
/// mean.
Character read_character(const std::string& path, const MotionOptions& options = {},
                         const std::string& clip = "");

/// Whether a track moves one of the 22 joints or what it hangs on.
bool moves_joints(const Gltf& file, const GltfRig& rig, const GltfClip& clip);
/// The first animation that moves one of the 22 joints or what it hangs on. InputError: there is
/// none.
const GltfClip& first_clip(const Gltf& file, const GltfRig& rig);
/// Frames of an animation at 30 fps, our axes and metres: turns from the T-pose, and joints.
/// InputError for a joint that lies nowhere.
std::vector<PosedSkeleton> clip_poses(const Gltf& file, const GltfRig& rig, const GltfClip& clip,
                                      int64_t frames, ImportReport& report);

struct TargetMesh {
  Mesh mesh;
  ImportReport report;                    ///< empty for PLY and OBJ
  std::optional<Joints> joints;           ///< of a known rig, by their names, beside the surface
  std::shared_ptr<const GltfOwnRig> own;  ///< of a known rig: it poses the mesh itself
  bool rigged = false;                    ///< it has a rig, known or not
  std::string unknown_rig;  ///< why the joints of a rig were not found; empty: they were
  /// Of a file without a skin which meshes it is made of, and why its nodes are no body's; else
  /// empty.
  std::string parts, unknown_parts;
  /// What took a mesh without a rig from the pose in which it stands to the T-pose
  /// (infer/unpose.h); nothing: it stands in T-pose.
  std::optional<JointMoves> unposed;
  /// What the doctor need not guess of it.
  ExamineOptions known() const;
};

/// How many nodes are joints of skins; one of several skins counts once.
size_t skin_joints(const Gltf& file);

/// What `restage retarget --target` takes: of a glTF character the surface in T-pose, in metres, y
/// up, facing +z, with all vertices and faces in the file's order; a glTF file without a known rig
/// as it stands, with a remark; any other mesh as read_mesh() gives it. `bones`: of the rig, as
/// MotionOptions::profile. InputError also for two characters, and for `bones` where there is no
/// rig.
TargetMesh read_target(const std::string& path, const std::string& bones = "");

}  // namespace restage
