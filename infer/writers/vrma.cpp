#include "infer/writers/vrma.h"

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "infer/writers/glb_detail.h"
#include "nn/geometry/glb_file.h"

namespace restage {

VrmaWriter::VrmaWriter(std::string path, const Joints& rest, std::string clip, double fps)
    : path_(std::move(path)),
      clip_(std::move(clip)),
      rest_(rest),
      fps_(fps),
      rig_(rig_convention("vrm", rest, 0)),
      tracks_(rig_) {}

void VrmaWriter::push(const Pose& pose) {
  if (!tracks_.push(pose))
    throw WorkError(path_ + ": the pose of frame " + std::to_string(tracks_.frames()) +
                    " is not finite; check the source and the weights");
}

void VrmaWriter::commit() {
  if (tracks_.frames() == 0)
    throw InputError(path_, "would hold no animation", "give a source with frames");
  glb::Json root;
  glb::Buffer buffer;
  root["asset"] = {{"version", "2.0"}, {"generator", "restage"}};
  root["extensionsUsed"] = {"VRMC_vrm_animation"};
  root["scene"] = 0;
  root["scenes"] = glb::Json::array({{{"nodes", {0}}}});
  root["nodes"] = glb::nodes(rest_, rig_);
  root["animations"] = glb::Json::array({glb::animation(buffer, tracks_, clip_, fps_)});
  glb::Json bones;
  for (size_t j = 0; j < kJoints; ++j) bones[rig_.names[j]] = {{"node", j}};
  root["extensions"]["VRMC_vrm_animation"] = {{"specVersion", "1.0"},
                                              {"humanoid", {{"humanBones", bones}}}};
  buffer.describe(root);
  write_file_atomically(path_, glb_bytes(root.dump(), buffer.bytes(), path_));
}

}  // namespace restage
