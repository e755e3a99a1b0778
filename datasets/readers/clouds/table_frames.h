// Tables of points that hold a whole recording: a column numbers the frames, or says the times.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

struct TableFrames {
  Points points;
  std::vector<int64_t> offset;  ///< frame f has the points [offset[f], offset[f + 1])
  double fps = 0;               ///< 0: nothing says it
  std::string remark;           ///< how the table was parted
};

/// Gathers the column, row by row.
class TableSplitter {
 public:
  void add(std::string_view cell);
  /// Frames of 64 points or more on average, by equal numbers of the column `name`; of times
  /// (`counts` is false) that change faster, as those of a sensor's packets, all within a tenth of
  /// a second. Nothing where the numbers do not rise, or there is one frame alone. The unit of
  /// times is that for which their steps are those of frames or of packets.
  std::optional<TableFrames> frames(const std::string& name, bool counts) const;
  /// Whether they are times of packets of a sensor within one such frame, by a `name` with a unit.
  bool is_one_turn(const std::string& name) const;

 private:
  /// Seconds a unit, if runs of equal numbers are packets; else 0.
  double packet_unit(const std::vector<int64_t>& runs, const std::string& name) const;
  size_t units() const;  ///< how many may be that of the times, the longest first

  std::vector<double> values_;
  bool numbers_ = true;
};

/// Whether the first lines name such a column. False for what is no table.
bool names_frames(std::string_view content);

/// The frames of a table whose first line names a column of frames or times; nothing if it is one
/// cloud. Points that are NaN or infinite stay, as NaN. InputError as parse_table().
std::optional<TableFrames> parse_table_frames(std::string_view content, const std::string& path,
                                              const Vec3& origin = Vec3::Zero());

}  // namespace restage
