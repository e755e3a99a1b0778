// Which files of a folder are the frames of a sequence, and in which order: by the numbers in their
// names.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace restage {

/// Files that are frames, in order, and what the user should know of the folder.
struct FrameList {
  std::vector<std::string> files;
  /// The number of each frame by its name, in even steps (decimals: counted in steps from the first
  /// name); empty if the names do not count so.
  std::vector<int64_t> numbers;
  std::vector<std::string> remarks;  ///< such as files that were left out
  bool is_series = false;            ///< their names differ in numbers alone, but for one
};

/// Orders frames by the numbers in their names: f2 before f10, 100.05 before 100.1, -2 before -1,
/// 0f before 10, 0x9 before 0xa, 9e-05 before 0.0001, scan before scan (1) and before scan_1;
/// digits of other scripts count as digits. A point or comma between digits is a decimal mark,
/// parts two numbers (take1.9, take1.10), or seconds and nanoseconds (of up to nine digits without
/// zeros in front, as ROS writes them), as it makes sense for all names together; where the order
/// depends on it, a remark says how it was read. A minus is a sign or a mark in the same way. The
/// largest series of names that differ only in numbers is the sequence; other files are left out,
/// with a remark. If nothing is a series, all files are frames, in the order of their names.
/// InputError naming `folder` if it holds two series (cam0_1, cam1_1), which are two sequences; two
/// files of one number (f0, f00, -0 and 0); names whose order cannot be told (1.9, 1.11); names of
/// cameras (cam0, cam1; left, right), whose clouds show one moment; hardly anything but a file and
/// copies of it (scan - Copy). Among frames copies are left out, with a remark.
FrameList order_frames(const std::vector<std::string>& files, const std::string& folder);
/// The same of folders, each of which holds a frame. No files if their names are no series.
FrameList order_folders(const std::vector<std::string>& folders, const std::string& folder);

/// The same of arrays or groups in a file.
FrameList order_members(const std::vector<std::string>& names, const std::string& file);

/// f2 < f10: runs of digits compare as numbers, everything else by character.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace restage
