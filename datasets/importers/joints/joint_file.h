// Files of positions of joints: what trackers, lifters and text-to-motion models write. They say
// where joints are and not how bones are turned; solve.h finds that.
//
// - NPY, NPZ: [F, J, 3], [F, J, 4] with a confidence, [1, F, J, 3], [J, 3, F], flat rows [F, 3 J],
//   HumanML3D's 263 numbers. An NPZ's array is named joints, keypoints3d, motion or the like; so is
//   a pickle's (AIST++), which is read without running it.
// - CSV: a row for each joint of each frame (frame, joint, x, y, z) or three columns for each
// joint.
// - JSON of Azure Kinect, OpenPose, EasyMocap and MMPose; a folder of those that hold one frame
//   (notes, films and the like beside them are passed over); JSON lines, a frame each
//   (joint_lines.h).
// - TRC whose markers are called as joints are.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/joints/layouts.h"
#include "datasets/readers/byte_stream.h"

namespace restage {

/// Of joints that come while they are captured, the person who is nearest to the origin then.
inline constexpr const char* kNearestPerson = "nearest";

struct JointFileOptions {
  std::string layout = {};  ///< a layout's name; empty: the one that fits
  std::string person = {};  ///< a number from 0, of a file that holds several
  uint64_t max_memory = kMaxMemory;
};

struct JointRecording {
  JointLayout layout;
  std::vector<FileFrame> frames;  ///< in the file's axes and units
  double fps = 0;                 ///< 0: the file does not say
  std::string form;               ///< for the report: "'joints' [12, 22, 3]"
  std::vector<std::string> remarks;
  /// What is missing by the times of the file, if it is more than a third of a second; else empty.
  std::string gap = {};
};

/// Nothing for a file, or folder, that holds no joints. Cheap for clouds: a look at names and
/// shapes, and at the content only where there are as few points a frame as somebody has joints.
/// InputError: joints that cannot be read, with the way to have them read: of an unknown layout,
/// pixels, without hips or shoulders, markers, a model's parameters.
std::optional<JointRecording> find_joint_recording(const std::string& path,
                                                   const JointFileOptions& options);

/// InputError where a folder holds recordings of joints, a file each, with the way to use them.
void refuse_recordings_in(const std::string& folder, const JointFileOptions& options);

/// Whether the name is that of a file whose joints are looked for: .npy, .npz, pickles, .csv, .txt,
/// .json, .jsonl, .trc.
bool may_hold_joints(const std::string& path);

namespace joints_detail {

/// Fewer joints show nobody; no tracker has more.
inline constexpr size_t kFewestJoints = 12, kMostJoints = 600;

/// The same by kind of file.
std::optional<JointRecording> joints_of_arrays(const std::string& path, const JointFileOptions&);
std::optional<JointRecording> joints_of_table(const std::string& path, const JointFileOptions&);
JointRecording joints_of_trc(const std::string& path, const JointFileOptions&);
/// Of several files, a frame each; nothing where one of them holds several frames, as recordings of
/// their own do. InputError naming the file that holds no frame.
std::optional<JointRecording> joints_of_json(const std::vector<std::string>& files,
                                             const std::string& path, const JointFileOptions&);

/// Frames in the order in which `layout` or, if that is empty, a layout of so many joints has them:
/// the one that fits a person, by bones of constant length and equal sides. InputError naming
/// {layout} where none fits or two do; nothing where no layout has so many joints and `sure` is
/// false.
std::optional<JointLayout> choose_layout(const std::vector<FileFrame>& frames,
                                         const std::string& asked, const std::string& where,
                                         bool sure);
/// A layout of joints that a file calls by names; words that are not known are passed over.
JointLayout named_layout(const std::vector<std::string>& names);
/// A joint; nothing if it is NaN, infinite, exactly 0 but for the first one, or of no confidence.
std::optional<Vec3> joint_at(double x, double y, double z, double confidence, bool first);
/// Which of `people` is asked for; of one alone the first. InputError naming {person}: there are
/// several and none is asked for, or no such number. `ids`: by which they are counted, for
/// messages.
size_t person_of(const std::string& asked, size_t people, const std::string& where,
                 const std::string& ids = "");
/// InputError where a small file would make frames of so many joints that they are nearly all
/// unknown, before memory is taken for them.
void check_dense(size_t frames, size_t joints, uint64_t bytes, const std::string& where);
/// InputError for joints that lie in a plane across z: pixels, and perhaps a score.
void require_depth(const JointRecording& recording, const std::string& where);
/// What every recording has to pass: require_trunk(), require_depth(); and a remark where a layout
/// that was asked for does not fit.
void check_recording(JointRecording& recording, const JointFileOptions& options,
                     const std::string& where);
/// InputError unless any joint is known in any frame.
void require_known(const std::vector<FileFrame>& frames, const std::string& where);
/// InputError unless somebody's hips and shoulders are known in one frame at least.
void require_trunk(const JointRecording& recording, const std::string& where);

}  // namespace joints_detail
}  // namespace restage
