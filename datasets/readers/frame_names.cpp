#include "datasets/readers/frame_names.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/npz.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

using Value = long double;  // of times in nanoseconds, exactly

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; }

/// A part of a name: text, or a number.
struct Piece {
  std::string text;  ///< as it stands in the name
  bool number = false, negative = false;
  std::string whole, fraction;  ///< digits before the point (without leading zeros) and behind it
  Value value() const {
    const Value out = std::stold(cat(whole.substr(0, 4000), ".", fraction.substr(0, 4000), "0"));
    return negative ? -out : out;
  }
};
using Pieces = std::vector<Piece>;

/// How marks in names are meant.
struct Meaning {
  bool decimals = false;      ///< a point between two runs of digits is a decimal point
  bool letter_signs = false;  ///< so is a minus between a letter and a digit: a sign
};

std::string digits_at(const std::string& name, size_t at) {
  size_t end = at;
  while (end < name.size() && is_digit(name[end])) ++end;
  return name.substr(at, end - at);
}

/// Whether the point at `at` has digits on both sides and no further point and digits beyond them
/// (as versions and dates have).
bool is_lone_point(const std::string& name, size_t at) {
  const auto digit = [&](size_t i) { return i < name.size() && is_digit(name[i]); };
  if (at == 0 || name[at] != '.' || !digit(at - 1) || !digit(at + 1)) return false;
  size_t before = at, after = at + 1;
  while (before > 0 && digit(before - 1)) --before;
  while (digit(after)) ++after;
  const bool chain_before = before >= 2 && name[before - 1] == '.' && digit(before - 2);
  return !chain_before && !(after < name.size() && name[after] == '.' && digit(after + 1));
}

/// Whether the minus that ends `text` is the sign of a number that follows.
bool ends_in_sign(const std::string& text, bool after_number, const Meaning& meaning) {
  if (!text.ends_with('-')) return false;
  if (text.size() == 1) return !after_number;
  const char before = text[text.size() - 2];
  return is_letter(before) ? meaning.letter_signs : before != ')';
}

Pieces pieces_of(const std::string& name, const Meaning& meaning) {
  Pieces out;
  for (size_t at = 0; at < name.size();) {
    if (!is_digit(name[at])) {
      size_t end = at;
      while (end < name.size() && !is_digit(name[end])) ++end;
      out.push_back({name.substr(at, end - at), false, false, "", ""});
      at = end;
      continue;
    }
    Piece piece{digits_at(name, at), true, false, "", ""};
    at += piece.text.size();
    piece.whole =
        piece.text.substr(std::min(piece.text.find_first_not_of('0'), piece.text.size() - 1));
    if (meaning.decimals && at < name.size() && is_lone_point(name, at)) {
      piece.fraction = digits_at(name, at + 1);
      at += 1 + piece.fraction.size();
    }
    if (!out.empty() && ends_in_sign(out.back().text, out.size() > 1, meaning)) {
      piece.negative = true;
      out.back().text.pop_back();
      if (out.back().text.empty()) out.pop_back();
    }
    out.push_back(std::move(piece));
  }
  return out;
}

/// The name with # for each number.
std::string pattern_of(const Pieces& pieces) {
  std::string out;
  for (const Piece& piece : pieces) out += piece.number ? "#" : piece.text;
  return out;
}

int compare_numbers(const Piece& a, const Piece& b) {
  const auto order = [](const std::string& x, const std::string& y) { return x.compare(y); };
  if (a.negative != b.negative) return a.negative ? -1 : 1;
  int out = a.whole.size() != b.whole.size() ? (a.whole.size() < b.whole.size() ? -1 : 1)
                                             : order(a.whole, b.whole);
  if (out == 0) {  // "5" is "50" and more than "05"
    const size_t length = std::max(a.fraction.size(), b.fraction.size());
    std::string x = a.fraction, y = b.fraction;
    x.resize(length, '0');
    y.resize(length, '0');
    out = order(x, y);
  }
  return a.negative ? -out : out;
}

int compare(const Pieces& a, const Pieces& b) {
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    const int order =
        a[i].number && b[i].number ? compare_numbers(a[i], b[i]) : a[i].text.compare(b[i].text);
    if (order != 0) return order;
  }
  return a.size() == b.size() ? 0 : a.size() < b.size() ? -1 : 1;
}

// ---- what marks mean ---------------------------------------------------------------------------

/// How much longer the longest step between sorted values is than the usual one.
Value unevenness(const std::vector<std::vector<Value>>& runs) {
  std::vector<Value> steps;
  for (std::vector<Value> run : runs) {
    std::sort(run.begin(), run.end());
    for (size_t i = 1; i < run.size(); ++i) steps.push_back(run[i] - run[i - 1]);
  }
  if (steps.empty()) return 1;
  std::sort(steps.begin(), steps.end());
  return steps.back() / std::max<Value>(steps[steps.size() / 2], 1e-30L);
}

/// The names that have a decimal point, if points are such.
struct Decimals {
  std::vector<std::vector<Value>> as_decimals{{}}, as_counters;
  bool unequal = false, leading_zero = false, trailing_zero = false, twice = false, several = false;
  bool negative = false;
};

Decimals decimals_in(const std::vector<std::string>& names) {
  Decimals out;
  std::map<std::string, std::vector<Value>> counters;  // by all that is before the fraction
  std::set<Value> seen;
  std::set<std::string> wholes;
  size_t length = 0;
  for (const std::string& name : names)
    for (const Piece& piece : pieces_of(name, {.decimals = true})) {
      if (piece.fraction.empty()) continue;
      out.twice = out.twice || !seen.insert(piece.value()).second;
      out.as_decimals[0].push_back(piece.value());
      out.negative = out.negative || piece.negative;
      counters[piece.whole].push_back(std::stold(piece.fraction.substr(0, 4000)));
      wholes.insert(piece.whole);
      out.unequal = out.unequal || (length != 0 && length != piece.fraction.size());
      length = piece.fraction.size();
      out.leading_zero = out.leading_zero || (length > 1 && piece.fraction[0] == '0');
      out.trailing_zero = out.trailing_zero || (length > 1 && piece.fraction.back() == '0');
    }
  for (auto& [whole, values] : counters) out.as_counters.push_back(std::move(values));
  out.several = wholes.size() > 1;
  return out;
}

/// Whether points between digits are decimal points. Programs write 0.05, 0.1, 0.15 for times, and
/// take1.9, take1.10 for counters.
bool means_decimals(const std::vector<std::string>& names) {
  const Decimals found = decimals_in(names);
  if (found.as_decimals[0].empty() || found.twice) return false;
  // The same names without a fraction: 100, 100.05.
  std::set<std::string> plain, pointed;
  for (const std::string& name : names) {
    const Pieces pieces = pieces_of(name, {.decimals = true});
    const bool has = std::any_of(pieces.begin(), pieces.end(),
                                 [](const Piece& p) { return !p.fraction.empty(); });
    (has ? pointed : plain).insert(pattern_of(pieces));
  }
  for (const std::string& pattern : plain)
    if (pointed.count(pattern) > 0) return true;
  if (found.negative) return true;  // nobody counts so
  if (found.unequal && found.leading_zero != found.trailing_zero) return found.leading_zero;
  const Value decimals = unevenness(found.as_decimals), counters = unevenness(found.as_counters);
  if (found.unequal) return decimals <= counters;
  return found.several && decimals <= 2 * counters;  // of one length, both give one order
}

Meaning meaning_of(const std::vector<std::string>& names) {
  Meaning out;
  out.decimals = means_decimals(names);
  std::set<std::string> patterns;
  for (const std::string& name : names) patterns.insert(pattern_of(pieces_of(name, out)));
  for (const std::string& pattern : patterns)
    for (size_t at = pattern.find("-#"); at != std::string::npos; at = pattern.find("-#", at + 1)) {
      std::string without = pattern;
      without.erase(at, 1);
      out.letter_signs = out.letter_signs || (at > 0 && patterns.count(without) > 0);
    }
  return out;
}

// ---- series ------------------------------------------------------------------------------------

struct Name {
  std::string path, shown;
  Pieces pieces;
};
using Names = std::vector<Name>;

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
void refuse_parallel_series(const Names& series, const std::string& folder) {
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
                   "put each series into a folder of its own");
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
        format("the names of the frames count in steps of %.4g: if these are "
               "seconds, the rate is %.4g frames a second (--fps)",
               step, 1 / step));
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

FrameList order(const std::vector<std::string>& files, const std::string& folder, bool folders) {
  std::vector<std::string> stems;
  for (const std::string& file : files)
    stems.push_back(folders ? shown_of(file) : std::filesystem::path(file).stem().string());
  const Meaning meaning = meaning_of(stems);
  std::map<std::string, Names> groups;
  for (size_t i = 0; i < files.size(); ++i) {
    Name name{files[i], shown_of(files[i]), pieces_of(stems[i], meaning)};
    groups[pattern_of(name.pieces)].push_back(std::move(name));
  }
  Names* series = nullptr;
  for (auto& [pattern, names] : groups)
    if (names.size() > 1 && (series == nullptr || names.size() > series->size())) series = &names;
  FrameList out;
  if (series == nullptr) {
    if (folders) return out;
    out.files = files;
    std::sort(out.files.begin(), out.files.end(), natural_less);
    if (files.size() > 1)
      out.remarks.push_back(
          cat("the names of the ", files.size(),
              " files are no series of numbers: all are frames, in the order of their names"));
    return out;
  }
  for (const auto& [pattern, names] : groups)
    if (&names != series && names.size() > 1 && 2 * names.size() > series->size())
      throw InputError(folder,
                       cat("holds several series of frames, such as ",
                           text::quote((*series)[0].shown), " and ", text::quote(names[0].shown)),
                       "put each series into a folder of its own");
  std::sort(series->begin(), series->end(), [](const Name& a, const Name& b) {
    const int order = compare(a.pieces, b.pieces);
    return order != 0 ? order < 0 : a.path < b.path;
  });
  refuse_parallel_series(*series, folder);
  for (const Name& name : *series) out.files.push_back(name.path);
  tell_others(groups, series, out);
  add_numbers(*series, meaning.decimals, out);
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
  return order(files, folder, false);
}

FrameList order_folders(const std::vector<std::string>& folders, const std::string& folder) {
  return order(folders, folder, true);
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
