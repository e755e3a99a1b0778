#include "datasets/readers/clouds/frame_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr int64_t kFewestRows = 4, kFewestConstant = 8;

/// The number of a cell, or the digits that end a word; NaN where there are none.
double count_in(std::string_view cell) {
  double value = std::numeric_limits<double>::quiet_NaN();
  if (text::parse(cell, value)) return value;
  size_t at = cell.size();
  while (at > 0 && cell[at - 1] >= '0' && cell[at - 1] <= '9') --at;
  const bool decimal_comma = text::has_decimal_comma(cell);
  if (decimal_comma || at == cell.size() || !text::parse(cell.substr(at), value))
    return std::numeric_limits<double>::quiet_NaN();
  return value;
}

}  // namespace

void FrameColumns::extend(Column& column, double value, bool is_first) {
  if (std::isnan(value)) {
    column.whole = column.rises = column.cycles = false;
    return;
  }
  column.whole = column.whole && value == std::floor(value);
  if (is_first) {
    column.first = column.last = column.most = value;
    return;
  }
  const bool on = value == column.last + 1;
  const bool anew = value == column.first && column.last > column.first;
  column.cycles = column.cycles && column.whole && (on || anew);
  column.rises = column.rises && value >= column.last;
  column.restarts += anew;
  column.values += value > column.last;
  column.most = std::max(column.most, value);
  column.last = value;
}

void FrameColumns::add(const std::vector<std::string_view>& cells) {
  if (rows_ == 0) columns_.resize(cells.size());
  for (size_t i = 0; i < std::min(cells.size(), columns_.size()); ++i)
    if (columns_[i].may_count()) extend(columns_[i], count_in(cells[i]), rows_ == 0);
  ++rows_;
}

std::optional<FrameColumns::Found> FrameColumns::find(bool slow) const {
  if (rows_ < kFewestRows) return std::nullopt;
  for (size_t i = 0; i < columns_.size(); ++i) {
    const Column& column = columns_[i];
    const bool slowly = slow && column.rises && column.values > 1 && 2 * column.values <= rows_;
    const bool again = column.cycles && column.restarts > 0;
    const bool may_be_axis = i == 1 || i == 2;
    if ((slowly || again) && (column.whole || !may_be_axis))
      return Found{i, column.first, column.most};
  }
  return std::nullopt;
}

bool FrameColumns::first_is_constant() const {
  return rows_ >= kFewestConstant && !columns_.empty() && columns_[0].rises &&
         columns_[0].values == 1;
}

}  // namespace restage
