// When the moments of a recording were captured, by its own clock. Internal to this folder.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/joints/joint_file.h"

namespace restage::joints_detail {

/// Lays the frames of a recording on an even grid by the times of their own clock, and sets its
/// rate: that of the usual step. NaN: the frame says no time. Without two times nothing is changed.
/// - Steps that tremble by less than three quarters of one stay as they are; where they vary more,
/// the frames
///   of the grid lie between those of the file.
/// - A frame that is missing is empty (no joint is known); over more than a third of a second
///   JointRecording::gap says so.
/// - Frames whose time does not go on, or that say none while others do, are left out, and a remark
///   counts them.
/// - Times that count milli-, micro- or nanoseconds are told by their size.
/// InputError naming `where`: nothing for ten seconds, or a clock that goes back and on from there.
/// `noun`: what a frame is called in messages, such as "line".
void place_by_times(JointRecording& recording, const std::vector<double>& times,
                    const std::string& noun, const std::string& where);

}  // namespace restage::joints_detail
