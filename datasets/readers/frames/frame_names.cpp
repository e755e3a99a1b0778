#include "datasets/readers/frames/frame_names.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "autograd/base/format.h"
#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/camera_names.h"
#include "datasets/readers/frames/name_copies.h"
#include "datasets/readers/frames/name_digits.h"
#include "datasets/readers/frames/name_numbers.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using numbered::is_digit;
using numbered::Meaning;
using numbered::Pieces;
using numbered::Value;

struct Name {
  std::string path, shown, stem;
  Pieces pieces;
};
using Names = std::vector<Name>;

/// What is in order: files of a folder, its folders, or arrays and groups in a file.
enum class Kind { files, folders, members };

const char* own_place(Kind kind) {
  return kind == Kind::members ? "a file of its own" : "a folder of its own";
}

/// The numbers of each name, in columns: those that change.
std::vector<std::vector<Value>> changing_numbers(const Names& series) {
  std::vector<std::vector<Value>> out;
  for (size_t k = 0; k < series[0].pieces.size(); ++k) {
    if (!series[0].pieces[k].number) continue;
    std::vector<Value> column;
    for (const Name& name : series) column.push_back(name.pieces[k].value());
    if (std::set<Value>(column.begin(), column.end()).size() > 1) out.push_back(std::move(column));
  }
  return out;
}

/// Names such as cam0_0001 and cam1_0001 are frames of several recordings at once: each value of
/// the first number comes with about the same values of the second. (Minutes and seconds do so
/// too.)
void refuse_parallel_series(const Names& series, const std::string& folder, Kind kind) {
  const auto columns = changing_numbers(series);
  if (columns.size() != 2) return;
  std::map<Value, std::set<Value>> second;
  for (size_t i = 0; i < series.size(); ++i) second[columns[0][i]].insert(columns[1][i]);
  size_t fewest = SIZE_MAX, most = 0;
  for (const auto& [value, with] : second) {
    if (*with.begin() != *second.begin()->second.begin()) return;
    if (*with.begin() == 0 && *with.rbegin() == 59) return;
    fewest = std::min(fewest, with.size());
    most = std::max(most, with.size());
  }
  if (fewest < 2 || 10 * fewest < 8 * most) return;
  throw InputError(folder,
                   cat("holds several series of frames, such as ", text::quote(series[0].shown),
                       " and ", text::quote(series.back().shown)),
                   cat("put each series into ", own_place(kind)));
}

/// cam0 to cam3 show one moment.
void refuse_cameras(const Names& series, const std::string& folder) {
  constexpr size_t kMostCameras = 16, kMostDigits = 2;
  if (series.size() > kMostCameras || changing_numbers(series).size() != 1) return;
  const Pieces &first = series[0].pieces, &last = series.back().pieces;
  for (size_t k = 1; k < first.size(); ++k) {
    if (!first[k].number || first[k].value() == last[k].value()) continue;
    if (first[k].text.size() > kMostDigits || !ends_in_camera(first[k - 1].text)) return;
    throw InputError(
        folder,
        cat("holds clouds of several cameras, by the names ", text::quote(series[0].shown), " to ",
            text::quote(series.back().shown), ", and not frames"),
        cat(kFuseCameras, " (if they are frames, name them frame_0, frame_1 ...)"));
  }
}

/// Numbers in even steps from the column that changes; empty where there are none.
std::vector<int64_t> even_numbers(const std::vector<Value>& column, bool decimals) {
  std::vector<Value> steps;
  for (size_t i = 1; i < column.size(); ++i) steps.push_back(column[i] - column[i - 1]);
  if (steps.empty()) return {};
  std::vector<Value> sorted = steps;
  std::sort(sorted.begin(), sorted.end());
  const Value least = sorted[0], usual = sorted[sorted.size() / 2];
  if (!(least > 0)) return {};
  const bool whole = !decimals && std::abs(column[0]) < 1e15L && std::abs(column.back()) < 1e15L &&
                     std::all_of(steps.begin(), steps.end(),
                                 [&](Value step) { return std::fmod(step, least) == 0; });
  std::vector<int64_t> out = {whole ? static_cast<int64_t>(column[0]) : 0};
  for (const Value step : steps) {
    const Value count = std::round(step / usual);
    if (!whole && !(count >= 1 && std::abs(step - count * usual) < 0.25L * usual && count < 1e9L))
      return {};
    out.push_back(out.back() + static_cast<int64_t>(whole ? step : count));
  }
  return out;
}

void add_numbers(const Names& series, bool decimals, FrameList& out) {
  const auto columns = changing_numbers(series);
  if (columns.size() != 1) return;
  out.numbers = even_numbers(columns[0], decimals);
  if (!decimals || out.numbers.empty() || out.numbers.back() == 0) return;
  const auto step = static_cast<double>((columns[0].back() - columns[0][0]) / out.numbers.back());
  if (step > 0.001 && step < 1)
    out.remarks.push_back(
        spelled(format("the names of the frames count in steps of %.4g: if these are "
                       "seconds, the rate is %.4g frames a second ({fps})",
                       step, 1 / step)));
}

std::string shown_of(const std::string& path) {
  const std::filesystem::path name(path);
  return (name.has_filename() ? name : name.parent_path()).filename().string();
}

/// The files that are no part of the series.
void tell_others(const std::map<std::string, Names>& groups, const Names* series, FrameList& out) {
  std::vector<std::string> others;
  for (const auto& [pattern, names] : groups)
    if (&names != series)
      for (const Name& name : names) others.push_back(name.shown);
  if (others.empty()) return;
  std::sort(others.begin(), others.end(), natural_less);
  out.remarks.push_back(cat("left out ", list_of(others), ": not named like the ", series->size(),
                            " frames such as ", text::quote((*series)[0].shown)));
}

/// How the names of a folder are read.
struct NameReading {
  Meaning meaning;
  std::optional<numbered::Hexadecimal> hexadecimal;
  std::optional<numbered::Unnumbered> unnumbered;
  Pieces operator()(const std::string& stem) const {
    if (hexadecimal)
      if (auto out = hexadecimal->pieces_of(stem)) return *out;
    return pieces_of(unnumbered && stem == unnumbered->first ? unnumbered->as_number : stem,
                     meaning);
  }
};

NameReading reading_of(const std::vector<std::string>& stems, const std::string& folder) {
  NameReading out;
  out.hexadecimal = numbered::hexadecimal_names(stems);
  std::vector<std::string> others;
  for (const std::string& stem : stems)
    if (!out.hexadecimal || !out.hexadecimal->pieces_of(stem)) others.push_back(stem);
  out.meaning = numbered::meaning_of(others, folder);
  out.unnumbered = numbered::unnumbered_first(others);
  return out;
}

/// What is not plain in the order of the series.
void tell_reading(const NameReading& reading, const Names& series, FrameList& out) {
  if (!reading.meaning.remark.empty()) out.remarks.push_back(reading.meaning.remark);
  if (reading.hexadecimal && reading.hexadecimal->pieces_of(series[0].stem))
    out.remarks.push_back(cat("the names of the frames count in hexadecimal, from ",
                              text::quote(series[0].shown), " to ",
                              text::quote(series.back().shown)));
  if (reading.unnumbered && series[0].stem == reading.unnumbered->first)
    out.remarks.push_back(cat(text::quote(series[0].shown), " is taken for the frame before ",
                              text::quote(series[1].shown)));
}

/// f0 and f00, or 0000.ply and 0.obj: nobody can tell which is the frame.
void refuse_twice(const Names& series, const std::string& folder, Kind kind) {
  for (size_t i = 1; i < series.size(); ++i)
    if (compare(series[i - 1].pieces, series[i].pieces) == 0)
      throw InputError(folder,
                       cat("holds one frame twice: ", text::quote(series[i - 1].shown), " and ",
                           text::quote(series[i].shown), " have the same number"),
                       cat("keep one of the two, or put each set of files into ", own_place(kind)));
}

FrameList in_order_of_names(const std::vector<std::string>& files, const std::string& folder) {
  if (files.size() > 1 && std::all_of(files.begin(), files.end(), [](const std::string& file) {
        return is_camera_name(std::filesystem::path(file).stem().string());
      }))
    throw InputError(
        folder,
        cat("holds clouds of several cameras, by the names ", text::quote(shown_of(files[0])),
            " and ", text::quote(shown_of(files[1])), ", and not frames"),
        kFuseCameras);
  FrameList out;
  out.files = files;
  std::sort(out.files.begin(), out.files.end(), natural_less);
  if (files.size() > 1)
    out.remarks.push_back(
        cat("the names of the ", files.size(),
            " files are no series of numbers: all are frames, in the order of their names"));
  return out;
}

std::string stem_of(const std::string& file, Kind kind) {
  return numbered::plain_numbers(kind == Kind::files ? std::filesystem::path(file).stem().string()
                                                     : shown_of(file));
}

/// Without files that are copies of others by their names, with a remark. InputError if hardly
/// anything else is there: then they may be meant as frames.
std::vector<std::string> without_copies(const std::vector<std::string>& files,
                                        const std::string& folder, Kind kind,
                                        std::vector<std::string>& remarks) {
  std::map<std::string, std::string> by_stem;
  for (const std::string& file : files) by_stem[stem_of(file, kind)] = file;
  std::vector<std::string> out, copies;
  std::string original;
  for (const std::string& file : files) {
    const std::optional<std::string> copied = numbered::copied_name(stem_of(file, kind));
    const auto at = copied ? by_stem.find(*copied) : by_stem.end();
    (at == by_stem.end() ? out : copies).push_back(file);
    if (at != by_stem.end()) original = shown_of(at->second);
  }
  if (copies.empty()) return out;
  for (std::string& copy : copies) copy = shown_of(copy);
  std::sort(copies.begin(), copies.end(), natural_less);
  if (out.size() < 2)
    throw InputError(
        folder,
        cat("holds ", text::quote(copies[0]), ", by its name a copy of ", text::quote(original)),
        "remove the copies, or number the files that are frames (0001, 0002 ...)");
  remarks.push_back(cat("left out ", list_of(copies), ": by their names copies of other frames"));
  return out;
}

/// InputError if the names are those of two series.
void refuse_second_series(const std::map<std::string, Names>& groups, const Names& series,
                          const std::string& folder, Kind kind) {
  for (const auto& [pattern, names] : groups)
    if (&names != &series && names.size() > 1 && 2 * names.size() > series.size())
      throw InputError(folder,
                       cat("holds several series of frames, such as ", text::quote(series[0].shown),
                           " and ", text::quote(names[0].shown)),
                       cat("put each series into ", own_place(kind)));
}

FrameList order(const std::vector<std::string>& all, const std::string& folder, Kind kind) {
  FrameList out;
  const std::vector<std::string> files = without_copies(all, folder, kind, out.remarks);
  std::vector<std::string> stems;
  stems.reserve(files.size());
  for (const std::string& file : files) stems.push_back(stem_of(file, kind));
  const NameReading reading = reading_of(stems, folder);
  std::map<std::string, Names> groups;
  for (size_t i = 0; i < files.size(); ++i) {
    Name name{files[i], shown_of(files[i]), stems[i], reading(stems[i])};
    groups[pattern_of(name.pieces)].push_back(std::move(name));
  }
  Names* series = nullptr;
  for (auto& [pattern, names] : groups)
    if (names.size() > 1 && (series == nullptr || names.size() > series->size())) series = &names;
  if (series == nullptr)
    return kind == Kind::files ? in_order_of_names(files, folder) : FrameList{};
  refuse_second_series(groups, *series, folder, kind);
  std::sort(series->begin(), series->end(), [](const Name& a, const Name& b) {
    const int order = compare(a.pieces, b.pieces);
    return order != 0 ? order < 0 : a.path < b.path;
  });
  refuse_twice(*series, folder, kind);
  refuse_parallel_series(*series, folder, kind);
  refuse_cameras(*series, folder);
  out.is_series = true;
  for (const Name& name : *series) out.files.push_back(name.path);
  tell_others(groups, series, out);
  tell_reading(reading, *series, out);
  add_numbers(*series, reading.meaning.mark != numbered::Mark::parts, out);
  return out;
}

/// The run of digits at `at`, without leading zeros; moves `at` behind it.
std::string take_digits(const std::string& text, size_t& at) {
  size_t begin = at;
  while (at < text.size() && is_digit(text[at])) ++at;
  while (begin + 1 < at && text[begin] == '0') ++begin;
  return text.substr(begin, at - begin);
}

}  // namespace

FrameList order_frames(const std::vector<std::string>& files, const std::string& folder) {
  return order(files, folder, Kind::files);
}

FrameList order_folders(const std::vector<std::string>& folders, const std::string& folder) {
  return order(folders, folder, Kind::folders);
}

FrameList order_members(const std::vector<std::string>& names, const std::string& file) {
  return order(names, file, Kind::members);
}

bool natural_less(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string x = take_digits(a, i), y = take_digits(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
    }
  }
  if ((i == a.size()) != (j == b.size())) return i == a.size();
  return a < b;  // equal but for leading zeros: any fixed order
}

}  // namespace restage
