// What a skeleton does in its file, to be done by another skeleton exactly: no network, no surface.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/motions/motion_clip.h"
#include "datasets/readers/gltf/gltf.h"
#include "nn/geometry/own_rig.h"

namespace restage {

struct SkeletonTake {
  std::string name;  ///< of the clip, else of the file
  Joints rest;       ///< the T-pose that turns are counted from, metres, y up, facing +z
  /// At 30 fps: world turns from the T-pose, and joints, in the world in which `rest` stands.
  std::vector<PosedSkeleton> frames;
  bool own_floor = false;                ///< the source says where its floor is
  std::vector<FingerTurns> fingers;      ///< the same of fingers; empty: the source has none
  std::shared_ptr<const OwnRig> figure;  ///< whose skeleton it is; null: bare bones
  ImportReport report;
};

/// Whether the file holds a skeleton that moves: BVH and AMC recordings by their names; a glTF file
/// by what is in it: an animation, and a rig that find_rig() accepts; a file with a body model's
/// parameters (AMASS and its kin, estimated.h); an HDF5 file of motions; positions of joints
/// without rotations (joints/joint_file.h), in the order `layout` if that is not empty. `why`: of
/// an animated surface whose rig is not accepted, the reason. InputError where there is no surface
/// either. `bones`: as MotionOptions::profile; a rig that is named by the user is taken or refused.
bool holds_take(const std::string& path, const std::string& bones = "", std::string* why = nullptr,
                const std::string& layout = "");

struct TakeOptions {
  MotionOptions motion =
      {};  ///< count as in read_bvh(), read_amc(), read_character(), import_amass()
  /// Of a glTF file its animation, empty: the first that moves the 22 joints. Of a file of motions
  /// the motion's id.
  std::string clip = {};
  std::optional<int64_t> sequence = std::nullopt;  ///< of a file of motions, from 0
  /// Of a body model's parameters: the model or a folder of models (BodyModels). Empty: `like`.
  std::string asf = {};  ///< of an AMC file; empty: the one beside it
  std::string body_model = {};
  std::string person = {};  ///< whose, where a file has several people's motions
  /// Rest joints of who performs; nothing: an average built-in body. Where parameters come without
  /// a body model, a skeleton of this shape with an adult's legs stands in: turns go over as they
  /// are.
  std::optional<Joints> like = std::nullopt;
};

SkeletonTake read_take(const std::string& path, const TakeOptions& options);

/// Puts the rest pose upright over the place where frames have their floor: its feet stand on it.
/// A rest pose that stands within 5 cm of it is believed.
void stand_on_floor(SkeletonTake& take);

/// Lifts or lowers a recording as a whole where whoever performs it would float or sink: a
/// recording does not say where its floor is, and rest poses have their feet in many ways. Within 3
/// cm, and of a source that says it, the floor stays.
void put_on_floor(SkeletonTake& take, const Joints& rest);

/// One frame of it by a skeleton of these rest joints, which stands in T-pose on y = 0: the same
/// world turns; thighs, shins, upper arms and forearms point where the source's do (whose rest
/// directions may be others); the middle of the hips goes its way, scaled by the length of the legs
/// about the origin of the floor. For the same skeleton all of it is exact.
Pose perform_take(const SkeletonTake& take, size_t frame, const Joints& rest);

}  // namespace restage
