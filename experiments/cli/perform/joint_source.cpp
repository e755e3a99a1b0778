#include "experiments/cli/perform/joint_source.h"

#include "autograd/base/words.h"
#include "datasets/importers/joints/joint_file.h"
#include "datasets/readers/errors.h"

namespace restage::cli {

void refuse_joints(const std::string& path) {
  std::optional<JointRecording> found;
  try {
    JointFileOptions any;
    any.person = "0";
    found = find_joint_recording(path, any);
  } catch (const InputError&) {
    return;  // what reads clouds says what is wrong
  }
  if (!found) return;
  throw InputError(path,
                   cat("holds ", counted(found->frames.size(), "frame"),
                       " of joints without rotations (", found->layout.title, "), no clouds"),
                   "restage retarget " + path +
                       " hero.glb --out moves.glb moves a character by them, restage data import " +
                       path + " --out M.h5 makes a motion of them");
}

}  // namespace restage::cli
