// Joints in tables: CSV of landmarks, TRC of markers that are called as joints are.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>

#include "autograd/base/atomic_file.h"
#include "datasets/importers/joints/joint_file.h"
#include "datasets/importers/joints/times.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::joints_detail {
namespace {

constexpr size_t kMostColumns = 4096;

/// The cells of a line, parted by commas, semicolons or tabs, without quotes and blanks around.
std::vector<std::string> cells_of(std::string_view line, char by) {
  std::vector<std::string> out;
  while (out.size() < kMostColumns) {
    const size_t end = std::min(line.find(by), line.size());
    std::string_view cell = line.substr(0, end);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '"')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '"' || cell.back() == '\r'))
      cell.remove_suffix(1);
    out.emplace_back(cell);
    if (end == line.size()) break;
    line.remove_prefix(end + 1);
  }
  return out;
}

char parted_by(std::string_view line) {
  for (const char by : {',', ';', '\t'})
    if (line.find(by) != line.npos) return by;
  return ',';
}

double number_of(const std::string& cell) {
  double out = 0;
  return text::parse(cell, out) ? out : std::numeric_limits<double>::quiet_NaN();
}

// ---- a row for each joint ----------------------------------------------------------------------

struct LongColumns {
  int frame = -1, time = -1, person = -1, joint = -1, x = -1, y = -1, z = -1, confidence = -1;
  /// Where there are no numbers of frames, times tell them apart.
  int parting() const { return frame >= 0 ? frame : time; }
  bool complete() const { return parting() >= 0 && joint >= 0 && x >= 0 && y >= 0 && z >= 0; }
};

bool is_one_of(const std::string& word, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), word) != names.end();
}

LongColumns long_columns(const std::vector<std::string>& head) {
  LongColumns out;
  for (int i = 0; i < static_cast<int>(head.size()); ++i) {
    const std::string name = lower_case(head[static_cast<size_t>(i)]);
    if (is_one_of(name,
                  {"frame", "frame_id", "frame_idx", "frame_index", "frame_number", "image_id"}))
      out.frame = i;
    else if (is_one_of(name, {"time", "time_s", "timestamp", "time_ms", "t"}))
      out.time = i;
    else if (is_one_of(name, {"person", "person_id", "person_index", "track_id", "track", "body_id",
                              "subject"}))
      out.person = i;
    else if (is_one_of(name,
                       {"landmark", "joint", "joint_id", "landmark_id", "keypoint", "id", "name",
                        "joint_name", "landmark_name", "landmark_index", "keypoint_id"}))
      out.joint = i;
    else if (is_one_of(name, {"x", "world_x", "x_m", "x_mm"}))
      out.x = i;
    else if (is_one_of(name, {"y", "world_y", "y_m", "y_mm"}))
      out.y = i;
    else if (is_one_of(name, {"z", "world_z", "z_m", "z_mm"}))
      out.z = i;
    else if (is_one_of(name, {"visibility", "confidence", "score", "conf"}))
      out.confidence = i;
  }
  return out;
}

struct Table {
  uint64_t bytes = 0;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};

Table read_table(const std::string& content) {
  Table out;
  out.bytes = content.size();
  text::Lines lines(content);
  std::string_view line;
  char by = 0;
  while (lines.next(line)) {
    if (line.empty() || line.starts_with("#")) continue;
    if (by == 0) by = parted_by(line);
    auto cells = cells_of(line, by);
    if (out.head.empty())
      out.head = std::move(cells);
    else
      out.rows.push_back(std::move(cells));
  }
  return out;
}

/// InputError for decimals with commas, be the columns parted by commas or not.
void check_decimals(const Table& table, const std::string& path) {
  const std::vector<std::string>& row = table.rows[0];
  for (const std::string& cell : row)
    if (text::has_decimal_comma(cell)) text::throw_no_number(cell, path);
  if (row.size() > table.head.size() + table.head.size() / 2)
    throw InputError(path,
                     cat("has rows of ", row.size(), " cells below a head of ", table.head.size(),
                         ": its decimals have commas"),
                     "write decimals with points, not with commas");
}

/// The rows of the person who is asked for, where a column says whose a row is.
void choose_person(Table& table, int column, const std::string& path,
                   const JointFileOptions& options) {
  if (column < 0) return;
  const auto whose = [&](const std::vector<std::string>& row) {
    return static_cast<size_t>(column) < row.size() ? row[static_cast<size_t>(column)]
                                                    : std::string();
  };
  std::vector<std::string> people;
  for (const auto& row : table.rows)
    if (std::find(people.begin(), people.end(), whose(row)) == people.end() && people.size() < 1000)
      people.push_back(whose(row));
  std::sort(people.begin(), people.end());
  const std::string chosen = people[person_of(options.person, people.size(), path)];
  std::erase_if(table.rows, [&](const auto& row) { return whose(row) != chosen; });
}

JointRecording long_table(const Table& table, const LongColumns& at, const std::string& path,
                          const JointFileOptions& options) {
  const auto cell = [](const std::vector<std::string>& row, int i) {
    return i >= 0 && static_cast<size_t>(i) < row.size() ? row[static_cast<size_t>(i)] : "";
  };
  std::vector<std::string> names;
  std::map<std::string, size_t> number;
  bool numbered = true;
  for (const auto& row : table.rows)
    if (const std::string name = cell(row, at.joint); number.emplace(name, names.size()).second) {
      names.push_back(name);
      numbered = numbered && std::isfinite(number_of(name));
      if (names.size() > 600)
        throw InputError(path, "has more than 600 joints in its column of them",
                         "give one row for each joint of each frame");
    }
  if (numbered) {
    std::sort(names.begin(), names.end(),
              [](const auto& a, const auto& b) { return number_of(a) < number_of(b); });
    for (size_t i = 0; i < names.size(); ++i) number[names[i]] = i;
  }
  // Rows of a frame need not follow each other.
  std::map<std::string, size_t> frames;
  for (const auto& row : table.rows) frames.emplace(cell(row, at.parting()), frames.size());
  check_dense(frames.size(), names.size(), table.bytes, path);
  JointRecording out;
  out.frames.assign(frames.size(), FileFrame(names.size()));
  std::vector<double> times(frames.size());
  for (const auto& row : table.rows) {
    const size_t f = frames[cell(row, at.parting())], j = number[cell(row, at.joint)];
    if (at.time >= 0) times[f] = number_of(cell(row, at.time));
    const double sure = at.confidence >= 0 ? number_of(cell(row, at.confidence)) : 1;
    out.frames[f][j] = joint_at(number_of(cell(row, at.x)), number_of(cell(row, at.y)),
                                number_of(cell(row, at.z)), sure, j == 0);
  }
  if (at.time >= 0) place_by_times(out, times, "frame", path);
  out.layout = !options.layout.empty() || numbered
                   ? *choose_layout(out.frames, options.layout, path, true)
                   : named_layout(names);
  out.form = cat("a table of ", table.rows.size(), " rows, one for each of ", names.size(),
                 " joints of a frame");
  return out;
}

// ---- three columns for each joint --------------------------------------------------------------

/// "left_knee_x", "x_12", "LKnee:Z", "nose.y", "pos_x_3" as the joint's name and its axis.
std::optional<std::pair<std::string, int>> axis_of(const std::string& head) {
  const std::string low = lower_case(head);
  const auto parting = [](char c) {
    return c == '_' || c == '.' || c == ':' || c == ' ' || c == '-';
  };
  const size_t n = low.size();
  if (n >= 3 && low[n - 1] >= 'x' && low[n - 1] <= 'z' && parting(low[n - 2]))
    return std::pair(head.substr(0, n - 2), low[n - 1] - 'x');
  if (n >= 3 && low[0] >= 'x' && low[0] <= 'z' && parting(low[1]))
    return std::pair(head.substr(2), low[0] - 'x');
  if (n >= 2 && low[0] >= 'x' && low[0] <= 'z' && std::isdigit(static_cast<unsigned char>(low[1])))
    return std::pair(head.substr(1), low[0] - 'x');
  return {};
}

struct WideColumns {
  std::vector<std::string> names;
  std::vector<std::array<int, 3>> columns;
  int time = -1;
};

WideColumns wide_columns(const std::vector<std::string>& head) {
  WideColumns out;
  std::map<std::string, size_t> number;
  for (size_t i = 0; i < head.size(); ++i) {
    const std::string low = lower_case(head[i]);
    if (low.starts_with("time") || low == "t") out.time = static_cast<int>(i);
    const auto axis = axis_of(head[i]);
    if (!axis) continue;
    const auto [at, fresh] = number.emplace(axis->first, out.names.size());
    if (fresh) {
      out.names.push_back(axis->first);
      out.columns.push_back({-1, -1, -1});
    }
    out.columns[at->second][static_cast<size_t>(axis->second)] = static_cast<int>(i);
  }
  for (size_t j = out.names.size(); j-- > 0;)
    if (std::find(out.columns[j].begin(), out.columns[j].end(), -1) != out.columns[j].end()) {
      out.names.erase(out.names.begin() + static_cast<std::ptrdiff_t>(j));
      out.columns.erase(out.columns.begin() + static_cast<std::ptrdiff_t>(j));
    }
  return out;
}

JointRecording wide_table(const Table& table, const WideColumns& at, const std::string& path,
                          const JointFileOptions& options) {
  check_dense(table.rows.size(), at.names.size(), table.bytes, path);
  JointRecording out;
  std::vector<double> times;
  for (const auto& row : table.rows) {
    const auto number = [&](int i) {
      return static_cast<size_t>(i) < row.size() ? number_of(row[static_cast<size_t>(i)])
                                                 : std::numeric_limits<double>::quiet_NaN();
    };
    FileFrame frame;
    for (const auto& c : at.columns)
      frame.push_back(joint_at(number(c[0]), number(c[1]), number(c[2]), 1, frame.empty()));
    out.frames.push_back(std::move(frame));
    if (at.time >= 0) times.push_back(number(at.time));
  }
  place_by_times(out, times, "row", path);
  const bool numbered = std::all_of(at.names.begin(), at.names.end(), [](const std::string& name) {
    return std::isfinite(number_of(name));
  });
  out.layout = !options.layout.empty() || numbered
                   ? *choose_layout(out.frames, options.layout, path, true)
                   : named_layout(at.names);
  out.form = cat("a table of ", at.names.size(), " joints in columns");
  return out;
}

}  // namespace

std::optional<JointRecording> joints_of_table(const std::string& path,
                                              const JointFileOptions& options) {
  constexpr uint64_t kMost = uint64_t{1} << 30;  // bytes
  FileStream file(path);
  const std::vector<char> start = file.take(std::min<uint64_t>(file.size(), 200'000));
  std::string_view begin(start.data(), start.size());
  if (begin.find('\0') != begin.npos) return {};
  text::Lines lines(begin);
  std::string_view line;
  std::vector<std::string> head;
  while (head.empty() && lines.next(line))
    if (!line.empty() && !line.starts_with("#")) head = cells_of(line, parted_by(line));
  const LongColumns rows = long_columns(head);
  const WideColumns columns = wide_columns(head);
  if (!rows.complete() && columns.names.size() < kFewestJoints) return {};
  if (file.size() > kMost)
    throw InputError(path, "is a table of more than a gigabyte", "cut it into several");
  Table table = read_table(read_file(path));
  if (table.rows.empty()) throw InputError(path, "has no row behind its head", "export it again");
  check_decimals(table, path);
  choose_person(table, rows.person, path, options);
  return rows.complete() ? long_table(table, rows, path, options)
                         : wide_table(table, columns, path, options);
}

JointRecording joints_of_trc(const std::string& path, const JointFileOptions& options) {
  const std::string content = read_file(path);
  text::Lines lines(content);
  std::string_view line;
  std::vector<std::vector<std::string>> head;
  while (head.size() < 5 && lines.next(line)) head.push_back(cells_of(line, '\t'));
  if (head.size() < 5 || head[0][0] != "PathFileType" || head[3].size() < 3)
    throw InputError(path, "is no TRC file", "export it again, or as BVH");
  JointRecording out;
  std::vector<std::string> names;
  for (size_t i = 2; i < head[3].size(); ++i)
    if (!head[3][i].empty()) names.push_back(head[3][i]);
  out.layout = named_layout(names);
  const auto has = [&](std::string_view word) {
    return std::find(out.layout.joints.begin(), out.layout.joints.end(), word) !=
           out.layout.joints.end();
  };
  if (!(has("left_hip") && has("right_hip") && has("left_shoulder") && has("right_shoulder")) &&
      options.layout.empty())
    throw InputError(path, "holds markers, not a skeleton",
                     "solve a skeleton in its own program and export BVH");
  check_dense(static_cast<size_t>(std::count(content.begin(), content.end(), '\n')), names.size(),
              content.size(), path);
  while (lines.next(line)) {
    const auto cells = cells_of(line, '\t');
    if (cells.size() < 3 || cells[0].empty()) continue;
    FileFrame frame;
    for (size_t j = 0; j < names.size(); ++j) {
      const auto number = [&](size_t axis) {
        const size_t i = 2 + 3 * j + axis;
        return i < cells.size() && !cells[i].empty() ? number_of(cells[i])
                                                     : std::numeric_limits<double>::quiet_NaN();
      };
      frame.push_back(joint_at(number(0), number(1), number(2), 1, false));
    }
    out.frames.push_back(std::move(frame));
  }
  if (out.frames.empty()) throw InputError(path, "holds no frame", "export it again");
  for (size_t i = 0; i < std::min(head[1].size(), head[2].size()); ++i)
    if (head[1][i] == "DataRate") out.fps = number_of(head[2][i]);
  if (!options.layout.empty()) out.layout = *choose_layout(out.frames, options.layout, path, true);
  out.form = cat("TRC, ", names.size(), " points called as joints are");
  return out;
}

}  // namespace restage::joints_detail
