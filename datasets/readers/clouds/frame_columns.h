// Columns of tables of points that tell which frame a point is of, or only number the points.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace restage {

/// Looks for a column that numbers frames, row by row: several clouds stand in one table then, and
/// the column is no coordinate. Times and names with a number at their end (frame_7) count, too.
class FrameColumns {
 public:
  struct Found {
    size_t column = 0;
    double first = 0, last = 0;  ///< its least and its largest number
  };

  void add(const std::vector<std::string_view>& cells);
  /// The first column that rises slowly (if `slow`), with two rows or more for a number, or counts
  /// up and begins anew, as rows in the order of points do. The second and third column, which may
  /// be coordinates of a grid, count only where they hold whole numbers.
  std::optional<Found> find(bool slow) const;
  /// Whether the first of the columns holds the same number in all of eight rows or more.
  bool first_is_constant() const;

 private:
  struct Column {
    bool whole = true, rises = true, cycles = true;
    double first = 0, last = 0, most = 0;
    int64_t values = 1, restarts = 0;  ///< changes upwards and one; returns to the first number
    bool may_count() const { return rises || cycles; }
  };
  static void extend(Column& column, double value, bool is_first);

  std::vector<Column> columns_;
  int64_t rows_ = 0;
};

/// Whether the first of nameless columns numbers the points, as COLMAP's and others' tables do.
class IdColumn {
 public:
  explicit IdColumn(bool may_be = false) : by_one_(may_be), rises_(may_be) {}
  bool may_be() const { return rises_; }
  /// Each is one more than the one before.
  bool by_one() const { return by_one_; }
  /// Whole numbers that rise from row to row, while the three behind them have decimals.
  bool are_ids() const { return rises_ && rows_ > 3 && 2 * decimals_ > rows_; }
  void refuse() { by_one_ = rises_ = false; }
  /// The first four numbers of a row.
  void add(const std::array<double, 4>& row) {
    const auto whole = [](double value) { return value == std::floor(value); };
    const bool first = rows_ == 0;
    rises_ = rises_ && whole(row[0]) && (first || row[0] > last_);
    by_one_ = by_one_ && whole(row[0]) && (first || row[0] == last_ + 1);
    decimals_ += !whole(row[1]) && !whole(row[2]) && !whole(row[3]);
    last_ = row[0];
    ++rows_;
  }

 private:
  bool by_one_, rises_;
  int64_t rows_ = 0, decimals_ = 0;
  double last_ = 0;
};

}  // namespace restage
