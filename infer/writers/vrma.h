// VRM animation (.vrma): the motion alone, for every VRM character
// (vrm-c/vrm-specification, VRMC_vrm_animation-1.0).
#pragma once

#include <string>

#include "infer/writers/tracks.h"

namespace restage {

/// A GLB of 22 nodes in T-pose, which VRM's list of bones names, and one animation: their turns,
/// and the place of the hips. No mesh. Players scale the path by the height of the hips.
class VrmaWriter {
 public:
  VrmaWriter(std::string path, const Joints& rest, std::string clip, double fps = kFps);
  /// WorkError if the pose is not finite.
  void push(const Pose& pose);
  /// InputError without frames: the format wants an animation.
  void commit();

 private:
  std::string path_, clip_;
  Joints rest_;
  double fps_;
  RigConvention rig_;
  glb::Tracks tracks_;
};

}  // namespace restage
