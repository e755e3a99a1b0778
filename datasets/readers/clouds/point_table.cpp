// Tables of points as text: .xyz, .pts, .csv and their like.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "autograd/base/format.h"
#include "datasets/readers/clouds/frame_columns.h"
#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/table_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

const char* const kSaveAgain = "save the points again, x y z in each line";
const char* const kPartOtherwise =
    "save the points again, x y z in each line (where a comma begins the decimals, part the "
    "columns "
    "by semicolons)";
const char* const kFileEach = "write each frame into a file of its own";
constexpr size_t kMaxColumns = 4096;
constexpr size_t kHead = 4096;  // bytes that tell what a table is

using Cells = std::vector<std::string_view>;

/// Without blanks and quotation marks around it.
std::string_view bare(std::string_view cell) {
  constexpr const char* kAround = " \t\r\"'";
  const size_t begin = cell.find_first_not_of(kAround);
  if (begin == std::string_view::npos) return {};
  return cell.substr(begin, cell.find_last_not_of(kAround) - begin + 1);
}

/// Cells between separators; but for blanks a cell may be empty.
void split(std::string_view line, char separator, Cells& cells) {
  cells.clear();
  if (separator == ' ') {
    for (auto word = text::take_word(line); !word.empty() && cells.size() < kMaxColumns;
         word = text::take_word(line))
      cells.push_back(bare(word));
    return;
  }
  for (size_t end = 0; end != std::string_view::npos && cells.size() < kMaxColumns;) {
    end = line.find(separator);
    cells.push_back(bare(line.substr(0, end)));
    if (end != std::string_view::npos) line.remove_prefix(end + 1);
  }
}

/// Commas in numbers ("0,5 1,5 2,5") are no separators. Tabs are separators like semicolons (a cell
/// may be empty) if there is one for each column.
char separator_of(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return ';';
  if (line.find('\t') != std::string_view::npos && line.find(',') == std::string_view::npos) {
    Cells cells, words;
    split(line, '\t', cells);
    split(line, ' ', words);
    const bool empty = std::any_of(cells.begin(), cells.end(), [](auto c) { return c.empty(); });
    if (cells.size() >= 3 && (empty ? words.size() < 3 : cells.size() == words.size())) return '\t';
  }
  Cells words;
  split(line, ' ', words);
  const bool decimals = words.size() >= 3 && std::all_of(words.begin(), words.end(), [](auto word) {
                          double value = 0;
                          return text::has_decimal_comma(word) || text::parse(word, value);
                        });
  return line.find(',') != std::string_view::npos && !decimals ? ',' : ' ';
}

/// "X", "x [m]", "pos_y", "//Z" and their like: 0 to 2; "Points:0" and its like: 3 to 5; -1:
/// another column.
int axis_of(std::string_view cell) {
  std::string name = lower_case(cell);
  name = name.substr(0, name.find_first_of("[("));
  while (!name.empty() && (name.back() == ' ' || name.back() == '_')) name.pop_back();
  name.erase(0, name.find_first_not_of("/# "));
  constexpr std::array<std::string_view, 7> kBefore = {"",    "p",      "pos_",  "position_",
                                                       "pos", "coord_", "point_"};
  for (int axis = 0; axis < 3; ++axis) {
    for (const std::string_view before : kBefore)
      if (name == std::string(before) + "xyz"[axis]) return axis;
    for (const std::string_view before : {"points:", "points_", "points_m_xyz:"})
      if (name == std::string(before) + "012"[axis]) return 3 + axis;
  }
  return -1;
}

/// The columns of x, y and z; of both ways to call them (VeloView's have both) x, y and z. {-1, -1,
/// -1}: each does not stand there once.
std::array<int, 3> axis_columns(const Cells& names) {
  std::array<int, 6> columns{-1, -1, -1, -1, -1, -1}, seen{};
  for (size_t i = 0; i < names.size(); ++i)
    if (const int axis = axis_of(names[i]); axis >= 0) {
      columns[static_cast<size_t>(axis)] = static_cast<int>(i);
      ++seen[static_cast<size_t>(axis)];
    }
  for (const size_t from : {0, 3})
    if (seen[from] == 1 && seen[from + 1] == 1 && seen[from + 2] == 1)
      return {columns[from], columns[from + 1], columns[from + 2]};
  return {-1, -1, -1};
}

/// What programs write for a number that is missing. "Na" is sodium.
bool is_missing(std::string_view cell) {
  constexpr std::array<std::string_view, 20> kMissing = {
      "",     "-",    "--",   "---",  "?",   "NA",   "na",   "N/A",  "n/a",     "#N/A",
      "<NA>", "NULL", "Null", "null", "nil", "None", "none", "NONE", "missing", "."};
  return std::find(kMissing.begin(), kMissing.end(), cell) != kMissing.end();
}

/// A number, or a word for a missing one.
bool is_value(std::string_view cell) {
  double value = 0;
  return is_missing(cell) || text::parse(cell, value) || text::has_decimal_comma(cell);
}

bool is_frame_name(std::string_view cell) {
  const std::string name = lower_case(cell);
  return name.starts_with("frame") || name.ends_with("frame") || name == "f";
}

/// "frame", "Frame #", "frame_id"; or a time, which frames share, too.
bool counts_frames(std::string_view cell) {
  const std::string name = lower_case(cell);
  return is_frame_name(cell) || (name.starts_with("time") && !name.ends_with("type")) ||
         name == "t" || name == "t [s]";
}

/// Whether each number stands in two cells, as "0,512,1,204,0,031" does where commas both part the
/// columns and begin the decimals: nobody writes whole numbers as "031" or "-0".
bool are_halves(const Cells& cells) {
  if (cells.size() < 6 || cells.size() % 2 != 0) return false;
  bool certain = false;
  for (size_t i = 0; i < cells.size(); ++i) {
    std::string_view digits = cells[i];
    if (i % 2 == 0 && digits.starts_with('-')) digits.remove_prefix(1);
    const bool whole = !digits.empty() && std::all_of(digits.begin(), digits.end(),
                                                      [](char c) { return c >= '0' && c <= '9'; });
    if (!whole) return false;
    certain = certain || (i % 2 == 1 && digits.size() > 1 && digits[0] == '0') ||
              (i % 2 == 0 && cells[i] == "-0");
  }
  return certain;
}

class TableParser {
 public:
  TableParser(std::string_view content, const std::string& path, const Vec3& origin, NonFinite how)
      : lines_(text::without_mark(content, path)), path_(path), origin_(origin), how_(how) {}

  /// From now on the column that numbers frames goes there, and several are no error.
  void split_by(TableSplitter& splitter) { split_ = &splitter; }
  /// Of the column that numbers frames; empty: there is none.
  const std::string& frame_name() const { return frame_name_; }

  /// `whole`: not only the first lines of a file.
  Mesh parse(bool whole) {
    std::string_view line;
    while (lines_.next(line)) {
      if (is_remark(line)) continue;
      const size_t begin = line.find_first_not_of(separator_ == '\t' ? " \r" : " \t\r");
      if (begin == std::string_view::npos) continue;
      line.remove_prefix(begin);
      const bool comment = (line[0] == '#' && !line.starts_with("#N/A")) || line.starts_with("//");
      if (comment && (columns_ > 0 || !names_axes(line))) continue;
      if (columns_ == 0)
        first_line(line);
      else
        point(line);
    }
    if (whole) check_end();
    return std::move(out_);
  }

 private:
  std::string where() const { return cat(path_, ":", lines_.number()); }

  /// The second line of an .xyz file of chemists, behind the count of points: any words, or none.
  /// The heading of a .pts file: "version: 1", "n_points: 68", braces.
  bool is_remark(std::string_view line) {
    Cells words;
    split(line, ' ', words);
    if (columns_ == 0 && is_behind_count(lines_.number())) {
      has_remark_ = !is_row(words);
      return has_remark_ && !names_axes(line);
    }
    if (words.empty()) return false;
    if (words[0] == "{" || words[0] == "}") return words.size() == 1;
    const size_t colon = line.find(':');
    if (columns_ > 0 || colon == std::string_view::npos) return false;
    const std::string name = lower_case(bare(line.substr(0, colon)));
    if (name == "n_points") announce(bare(line.substr(colon + 1)));
    return name == "version" || name == "n_points";
  }

  /// Whether that line may be the second one of chemists' files.
  bool is_behind_count(int64_t line) const {
    return announced_ && line == count_line_ + 1 && text::ends_in(path_, {".xyz"});
  }

  /// Three numbers or more, with or without an element in front.
  static bool is_row(const Cells& words) {
    const bool element = !words.empty() && words[0].size() <= 3 && !is_value(words[0]);
    return words.size() >= (element ? 4 : 3) &&
           std::all_of(words.begin() + element, words.end(), is_value);
  }

  /// Whether it is the number of points, which is kept.
  bool announce(std::string_view cell) {
    int64_t count = 0;
    if (announced_ || !text::parse(cell, count) || count < 0) return false;
    announced_ = count;
    count_line_ = lines_.number();
    return true;
  }

  bool names_axes(std::string_view line) const {
    while (!line.empty() && (line[0] == '#' || line[0] == '/')) line.remove_prefix(1);
    Cells cells;
    split(line, separator_of(line), cells);
    return axis_columns(cells)[0] >= 0;
  }

  void first_line(std::string_view line) {
    if (names_axes(line)) return header(line);
    separator_ = separator_of(line);
    split(line, separator_, cells_);
    if (cells_.size() == 1 && announce(cells_[0])) return;
    drop_empty_end();
    if (axis_column_[0] < 0) axis_column_ = first_axes();
    columns_ = std::max(cells_.size(), named_columns_);
    counts_ = IdColumn(named_columns_ == 0 && columns_ > 3 && axis_column_[0] == 0);
    point(line);
  }

  /// x, y and z come first, or behind a column of labels: words, or the elements of chemists'
  /// files.
  std::array<int, 3> first_axes() const {
    constexpr int64_t kElements = 118;
    int64_t number = 0;
    const bool element = has_remark_ && !cells_.empty() && text::parse(cells_[0], number) &&
                         number >= 1 && number <= kElements;
    const bool labels = cells_.size() > 3 && (element || !is_value(cells_[0])) &&
                        std::all_of(cells_.begin() + 1, cells_.begin() + 4, is_value);
    return labels ? std::array<int, 3>{1, 2, 3} : std::array<int, 3>{0, 1, 2};
  }

  /// Of a line that ends with a separator: "1,2,3,".
  void drop_empty_end() {
    if (cells_.size() > std::max<size_t>(columns_, 3) && cells_.back().empty()) cells_.pop_back();
  }

  void header(std::string_view line) {
    while (!line.empty() && (line[0] == '#' || line[0] == '/')) line.remove_prefix(1);
    split(line, separator_of(line), cells_);
    drop_empty_end();
    axis_column_ = axis_columns(cells_);
    for (size_t i = 0; i < cells_.size(); ++i) {
      if (counts_frames(cells_[i]) && tells_better(cells_[i])) {
        frame_column_ = static_cast<int>(i);
        frame_name_ = cells_[i];
      }
      // COLMAP's tracks: "TRACK[] as (IMAGE_ID, POINT2D_IDX)" stands for any number of columns.
      any_length_ = any_length_ || cells_[i].find("[]") != std::string_view::npos;
    }
    named_columns_ = any_length_ ? 0 : cells_.size();
  }

  /// Of several columns that may number frames the last that is called so, else the last time.
  bool tells_better(std::string_view name) const {
    return frame_column_ < 0 || is_frame_name(name) || !is_frame_name(frame_name_);
  }

  void point(std::string_view line) {
    split(line, separator_, cells_);
    drop_empty_end();
    check_count_of_cells();
    if (out_.vertices.empty()) first_row_ = lines_.number();
    if (cells_.size() != columns_ && out_.vertices.size() == 1 && is_behind_count(first_row_)) {
      out_.vertices.clear();  // three numbers, and yet the remark
      behind_.clear();
      has_remark_ = true;
      axis_column_[0] = -1;
      columns_ = 0;
      return first_line(line);
    }
    const bool long_enough =
        any_length_ && std::all_of(axis_column_.begin(), axis_column_.end(),
                                   [&](int column) { return column < std::ssize(cells_); });
    if (cells_.size() != columns_ && !long_enough)
      throw InputError(where(), cat("has ", cells_.size(), " columns, the lines before ", columns_),
                       separator_ == ',' ? kPartOtherwise : kSaveAgain);
    const bool twice = named_columns_ > 0 && cells_.size() == 2 * named_columns_;
    if (separator_ == ',' && (twice || are_halves(cells_)))
      throw InputError(where(), "has commas both between its columns and before decimals",
                       "part the columns by semicolons or tabs, or write decimals with a point");
    Point point;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double value = number(cells_[static_cast<size_t>(axis_column_[axis])]);
      point[static_cast<int>(axis)] = text::coordinate(
          value - origin_[static_cast<int>(axis)], [&] { return where(); }, how_);
    }
    if (counts_.may_be()) count(cells_);
    if (frame_column_ >= 0) check_frame(cells_[static_cast<size_t>(frame_column_)]);
    if (named_columns_ == 0 && !any_length_ && columns_ > 3) frames_.add(cells_);
    if (repeats_frames_) frames_.add({cells_[*repeats_frames_]});
    out_.vertices.push_back(point);
  }

  void check_count_of_cells() const {
    if (cells_.size() >= 3) return;
    int64_t count = 0;
    if (cells_.size() == 1 && announced_ && std::ssize(out_.vertices) >= *announced_ &&
        text::parse(cells_[0], count))
      throw InputError(where(), "another frame begins here, and a table is one frame", kFileEach);
    if (cells_.size() == 2 && out_.vertices.empty() && is_value(cells_[0]) && is_value(cells_[1]))
      throw InputError(where(), "holds points of a picture: two numbers each",
                       "give points of space, x y z in each line");
    throw InputError(where(), "has fewer than 3 numbers", kSaveAgain);
  }

  /// A word for a missing number is NaN.
  double number(std::string_view cell) const {
    double value = std::numeric_limits<double>::quiet_NaN();
    if (is_missing(cell) || text::parse(cell, value)) return value;
    if (separator_ != ';' || !text::has_decimal_comma(cell)) text::throw_no_number(cell, where());
    std::string with_point(cell);
    with_point[with_point.find(',')] = '.';
    text::parse(with_point, value);
    return value;
  }

  /// Looks whether the first column holds numbers of points.
  void count(const Cells& cells) {
    if (!std::all_of(cells.begin(), cells.begin() + 4, is_value)) return counts_.refuse();
    std::array<double, 4> values{};
    for (size_t i = 0; i < 4; ++i) values[i] = number(cells[i]);
    counts_.add(values);
    Point point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = text::coordinate(
          values[static_cast<size_t>(axis) + 1] - origin_[axis], [&] { return where(); }, how_);
    behind_.push_back(point);
  }

  void check_frame(std::string_view cell) {
    if (split_ != nullptr) return split_->add(cell);
    times_.add(cell);
    if (out_.vertices.empty()) frame_ = cell;
    if (cell == frame_ || changed_at_ > 0) return;
    if (out_.vertices.size() > 1) {
      changed_at_ = lines_.number();
      if (is_frame_name(frame_name_)) refuse_another_frame();
      return;  // a sensor may have turned once in these times
    }
    // It counts points, is a scanner's time of each, or goes through all frames of a point.
    repeats_frames_ = static_cast<size_t>(frame_column_);
    frame_column_ = -1;
    frames_.add({frame_});
  }

  [[noreturn]] void refuse_another_frame() const {
    throw InputError(cat(path_, ":", changed_at_),
                     "another frame begins here, and a table is one frame", kFileEach);
  }

  /// InputError if a column tells the frames of the points, where no first line says what it is.
  void check_no_frames() const {
    constexpr const char* kOrName =
        "; if the column is something else, name the columns in a first line (x y z label)";
    if (const auto found = frames_.find(named_columns_ == 0))
      throw InputError(path_,
                       cat("its column ", repeats_frames_.value_or(found->column) + 1, " (",
                           format("%.10g to %.10g", found->first, found->last),
                           ") numbers frames, and a table is one frame"),
                       named_columns_ > 0 ? kFileEach : cat(kFileEach, kOrName));
    if (named_columns_ == 0 && axis_column_[0] == 0 && frames_.first_is_constant())
      throw InputError(path_,
                       "its first column is the same in all rows, as the number of a frame is, and "
                       "x is not",
                       "leave that column out, or name the columns in a first line (frame x y z)");
  }

  void check_end() {
    // One more than announced: the first was the remark of an .xyz file.
    if (is_behind_count(first_row_) && std::ssize(out_.vertices) == *announced_ + 1)
      out_.vertices.erase(out_.vertices.begin());
    if (announced_ && *announced_ != std::ssize(out_.vertices))
      throw InputError(
          path_, cat("holds ", out_.vertices.size(), " points, its first line says ", *announced_),
          "give the whole file");
    const bool ids = counts_.are_ids() && behind_.size() == out_.vertices.size();
    if (counts_.by_one() && !ids && out_.vertices.size() > 3)
      throw InputError(path_, "its first column only counts the points",
                       "leave that column out, or name the columns in a first line (n x y z)");
    if (changed_at_ > 0 && !times_.is_one_turn(frame_name_)) refuse_another_frame();
    check_no_frames();
    if (ids) out_.vertices = std::move(behind_);
  }

  text::Lines lines_;
  const std::string& path_;
  Vec3 origin_;
  NonFinite how_;
  Mesh out_;
  Cells cells_;
  char separator_ = ' ';
  size_t columns_ = 0, named_columns_ = 0;
  std::array<int, 3> axis_column_ = {-1, -1, -1};
  int frame_column_ = -1;
  std::string frame_, frame_name_;
  TableSplitter* split_ = nullptr;
  TableSplitter times_;     // of the column that may number frames
  int64_t changed_at_ = 0;  // the line where that first changed
  FrameColumns frames_;
  std::optional<size_t> repeats_frames_;    // a column named so whose value changes at once
  std::optional<int64_t> announced_;        // points
  int64_t count_line_ = 0, first_row_ = 0;  // lines: where that stands, and the first point
  bool has_remark_ = false;                 // is_remark()
  bool any_length_ = false;                 // of the rows, by the first line
  IdColumn counts_;                         // the first of nameless columns
  Points behind_;                           // by the three columns behind it
};

/// Its first lines, each of them whole.
std::string head_of(std::string_view content) {
  std::string out(content.substr(0, kHead));
  if (content.size() > out.size()) out.resize(out.rfind('\n') + 1);  // npos + 1 is 0
  return out;
}

}  // namespace

bool starts_as_table(std::string_view content) {
  const std::string head = head_of(content);
  try {
    const std::string nowhere;
    return !TableParser(head, nowhere, Vec3::Zero(), NonFinite::mark).parse(false).vertices.empty();
  } catch (const InputError&) {
    return false;
  }
}

bool names_frames(std::string_view content) {
  try {
    TableSplitter any;
    const std::string head = head_of(content), nowhere;
    TableParser parser(head, nowhere, Vec3::Zero(), NonFinite::mark);
    parser.split_by(any);
    parser.parse(false);
    return !parser.frame_name().empty();
  } catch (const InputError&) {
    return false;
  }
}

std::optional<TableFrames> parse_table_frames(std::string_view content, const std::string& path,
                                              const Vec3& origin) {
  TableSplitter splitter;
  TableParser parser(content, path, origin, NonFinite::mark);
  parser.split_by(splitter);
  Mesh mesh = parser.parse(true);
  std::optional<TableFrames> out =
      splitter.frames(parser.frame_name(), is_frame_name(parser.frame_name()));
  if (out) out->points = std::move(mesh.vertices);
  return out;
}

Mesh parse_table(std::string_view content, const std::string& path, const Vec3& origin,
                 NonFinite how) {
  std::string with_ends;  // lines of old Macintosh programs end with CR alone
  if (content.find('\n') == std::string_view::npos &&
      content.find('\r') != std::string_view::npos) {
    with_ends = content;
    std::replace(with_ends.begin(), with_ends.end(), '\r', '\n');
    content = with_ends;
  }
  return TableParser(content, path, origin, how).parse(true);
}

}  // namespace restage
