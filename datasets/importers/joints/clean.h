// Positions of joints as a person's: upright, in metres, without gaps in the trunk, as calm as
// bones of constant length allow. Internal to this folder.
#pragma once

#include <vector>

#include "datasets/importers/joints/joint_file.h"
#include "datasets/importers/motions/skeleton_take.h"

namespace restage::joints_detail {

/// From a source's axes and units to ours, as it was found or given.
struct JointFrame {
  Mat3 turn = Mat3::Identity();
  double scale = 1;  ///< metres per unit, after the turn
  double reach = 0;  ///< in the source's units: nobody's joint is further from a shoulder; 0: any
};

struct CleanJoints {
  std::vector<MappedFrame> frames;  ///< metres, y up; in every frame the trunk is known
  double fps = kFps;
  bool in_place = false;  ///< the file does not say where the root is
  JointFrame from;
  double sigma = 0;  ///< frames over which places were averaged (Gaussian); 0: they were not
};

/// Axes, unit and rate as found or as `options` say (up, scale, fps); gaps of up to half a second
/// are bridged, those of the trunk all. Facts and remarks go into the report. InputError: units of
/// nobody, left and right exchanged (unless forced).
CleanJoints clean_joints(const JointRecording& recording, const MotionOptions& options,
                         ImportReport& report);

/// Calls `f` with every place of a frame.
template <class Frame, class F>
void each_place(Frame& frame, F&& f) {
  for (auto& x : frame.joints) f(x);
  for (auto* x : {&frame.nose, &frame.left_ear, &frame.right_ear}) f(*x);
  for (auto* sides : {&frame.hand, &frame.index, &frame.pinky})
    for (auto& x : *sides) f(x);
}
/// Whether the place that each_place() comes to as number `track` is a hip or a shoulder.
bool is_of_trunk(size_t track);

/// Takes joints that are further away than anybody reaches for not known; returns how many.
/// `reach`: as in JointFrame.
size_t drop_strays(MappedFrame& frame, double reach);
/// Into metres, y up.
void to_ours(MappedFrame& frame, const JointFrame& from);

/// How much a bone's length changes from frame to frame, metres: the median over bones of the
/// deviations of their lengths.
double unsteadiness(const std::vector<MappedFrame>& frames);

}  // namespace restage::joints_detail
