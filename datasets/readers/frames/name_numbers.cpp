#include "datasets/readers/frames/name_numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage::numbered {
namespace {

bool is_letter(char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; }
bool is_mark(char c) { return c == '.' || c == ','; }

std::string digits_at(const std::string& name, size_t at) {
  size_t end = at;
  while (end < name.size() && is_digit(name[end])) ++end;
  return name.substr(at, end - at);
}

/// Whether the point or comma at `at` has digits on both sides and no further mark and digits
/// beyond them (as versions and dates have).
bool is_lone_mark(const std::string& name, size_t at) {
  const auto digit = [&](size_t i) { return i < name.size() && is_digit(name[i]); };
  if (at == 0 || !is_mark(name[at]) || !digit(at - 1) || !digit(at + 1)) return false;
  size_t before = at, after = at + 1;
  while (before > 0 && digit(before - 1)) --before;
  while (digit(after)) ++after;
  const bool chain_before = before >= 2 && is_mark(name[before - 1]) && digit(before - 2);
  return !chain_before && !(after < name.size() && is_mark(name[after]) && digit(after + 1));
}

/// Whether the minus that ends `text` is the sign of a number that follows.
bool ends_in_sign(const std::string& text, bool after_number, const Meaning& meaning) {
  if (!text.ends_with('-')) return false;
  if (text.size() == 1) return !after_number;
  const char before = text[text.size() - 2];
  return is_letter(before) ? meaning.letter_signs : before != ')';
}

std::string without_zeros(const std::string& digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size() - 1));
}

constexpr size_t kNanoseconds = 9;  // digits

// ---- what a point means ------------------------------------------------------------------------

const Meaning kAsDecimals{Mark::decimal, false, ""}, kAsParts{Mark::parts, false, ""};

/// The names that differ in their numbers alone, of which there are most.
std::vector<std::string> main_series(const std::vector<std::string>& names) {
  std::map<std::string, std::vector<std::string>> groups;
  for (const std::string& name : names)
    groups[pattern_of(pieces_of(name, kAsDecimals))].push_back(name);
  const auto most = std::max_element(
      groups.begin(), groups.end(),
      [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  return most == groups.end() ? std::vector<std::string>() : most->second;
}

/// The number of each name that has a fraction in some of them, and changes; none if there is none.
std::vector<Piece> changing_fractions(const std::vector<std::string>& series) {
  std::vector<Pieces> names;
  names.reserve(series.size());
  for (const std::string& name : series) names.push_back(pieces_of(name, kAsDecimals));
  for (size_t k = 0; !names.empty() && k < names[0].size(); ++k) {
    std::vector<Piece> column;
    bool fraction = false, changes = false;
    for (const Pieces& pieces : names) {
      column.push_back(pieces[k]);
      fraction = fraction || !pieces[k].fraction.empty();
      changes =
          changes || pieces[k].whole != column[0].whole || pieces[k].fraction != column[0].fraction;
    }
    if (fraction && changes) return column;
  }
  return {};
}

/// How many even steps lie between the least and the largest value, for each that is there: 1 for
/// values in even steps without a gap.
Value unevenness(std::vector<Value> values) {
  std::sort(values.begin(), values.end());
  Value least = std::numeric_limits<Value>::infinity();
  for (size_t i = 1; i < values.size(); ++i) least = std::min(least, values[i] - values[i - 1]);
  if (values.size() < 2) return 1;
  if (!(least > 0)) return std::numeric_limits<Value>::infinity();
  return ((values.back() - values[0]) / least + 1) / static_cast<Value>(values.size());
}

/// What the fractions of a series look like, and how even the names are in each reading.
struct Fractions {
  bool unequal = false, plain = false, negative = false;
  bool leading_zero = false;   ///< 05: no number that is written without leading zeros
  bool trailing_zero = false;  ///< 50: no decimal that is written without trailing zeros
  bool longer_zero = false;    ///< a leading zero in a fraction that is not one of the shortest
  bool twice = false;          ///< 0.5 and 0.50
  bool epoch = true;           ///< seconds since 1970, by their number of digits
  bool several = false;        ///< numbers before the point
  size_t longest = 0;
  Value decimals = 1, parts = 1, nanoseconds = 1;  ///< unevenness
  Value least_part_step = std::numeric_limits<Value>::infinity();

  bool may_be_nanoseconds() const {
    return !leading_zero && longest + 2 >= kNanoseconds && longest <= kNanoseconds;
  }
};

/// Unevenness of numbers behind a point, which begin anew behind each number before it.
void look_at_parts(const std::vector<Piece>& column, Fractions& out) {
  std::map<Value, std::vector<Value>> parts;
  for (const Piece& piece : column)
    if (!piece.fraction.empty())
      parts[std::stold(piece.whole.substr(0, 4000))].push_back(
          std::stold(piece.fraction.substr(0, 4000)));
  out.several = parts.size() > 1;
  for (auto& [whole, values] : parts) {
    std::sort(values.begin(), values.end());
    for (size_t i = 1; i < values.size(); ++i)
      out.least_part_step = std::min(out.least_part_step, values[i] - values[i - 1]);
    const bool begins_late = whole != parts.begin()->first && values[0] > 1;
    out.parts = std::max(out.parts, unevenness(values) * (begins_late ? 4 : 1));
  }
}

Fractions look_at(const std::vector<Piece>& column) {
  Fractions out;
  size_t shortest = SIZE_MAX;
  for (const Piece& piece : column) {
    out.plain = out.plain || piece.fraction.empty();
    if (!piece.fraction.empty()) shortest = std::min(shortest, piece.fraction.size());
    out.longest = std::max(out.longest, piece.fraction.size());
  }
  std::vector<Value> decimals, nanoseconds;
  for (const Piece& piece : column) {
    const std::string& f = piece.fraction;
    out.negative = out.negative || piece.negative;
    out.epoch = out.epoch && (piece.whole.size() == 9 || piece.whole.size() == 10);
    out.unequal = out.unequal || (!f.empty() && f.size() != shortest);
    const bool zero = f.size() > 1 && f[0] == '0';
    out.leading_zero = out.leading_zero || zero;
    out.longer_zero = out.longer_zero || (zero && f.size() > shortest);
    out.trailing_zero = out.trailing_zero || (f.size() > 1 && f.back() == '0');
    decimals.push_back(piece.value());
    nanoseconds.push_back(std::stold(piece.whole.substr(0, 4000)) +
                          (f.empty() ? 0 : std::stold(f.substr(0, 4000)) / 1e9L));
  }
  out.twice = std::set<Value>(decimals.begin(), decimals.end()).size() < decimals.size();
  out.decimals = unevenness(decimals);
  out.nanoseconds = unevenness(nanoseconds);
  look_at_parts(column, out);
  return out;
}

/// Two names whose order depends on the reading: `first` comes first where digits behind a mark are
/// a number of their own, and not first where they are decimals.
struct Dispute {
  std::string first, second;
};

std::optional<Dispute> dispute(const std::vector<std::string>& series) {
  struct Readings {
    std::string name;
    Pieces parts, decimals;
  };
  std::vector<Readings> names;
  names.reserve(series.size());
  for (const std::string& name : series)
    names.push_back({name, pieces_of(name, kAsParts), pieces_of(name, kAsDecimals)});
  std::sort(names.begin(), names.end(), [](const Readings& a, const Readings& b) {
    const int order = compare(a.parts, b.parts);
    return order != 0 ? order < 0 : a.name < b.name;
  });
  for (size_t i = 1; i < names.size(); ++i) {
    const int order = compare(names[i - 1].decimals, names[i].decimals);
    const bool same = order == 0 && compare(names[i - 1].parts, names[i].parts) == 0;
    if (order >= 0 && !same) return Dispute{names[i - 1].name, names[i].name};
  }
  return std::nullopt;
}

[[noreturn]] void throw_undecided(const std::string& folder, const std::string& a,
                                  const std::string& b, const std::string& otherwise) {
  throw InputError(folder,
                   cat("the order of its frames cannot be told: ", text::quote(a), " and ",
                       text::quote(b), " may count in decimals or in ", otherwise),
                   "rename the frames, with as many digits behind the point in each");
}

/// The reading of which nothing else gives another order.
Mark plain_reading(const Fractions& f) {
  if (f.plain || f.negative) return Mark::decimal;
  if (f.unequal && f.may_be_nanoseconds() && (f.trailing_zero || f.epoch)) return Mark::nanoseconds;
  if (f.unequal) return f.trailing_zero ? Mark::parts : Mark::decimal;
  return f.several && f.decimals <= 2 * f.parts ? Mark::decimal : Mark::parts;
}

/// The reading that the form of the numbers and even steps speak for; nothing if they do not.
/// Programs write 0.05, 0.1, 0.15 for times (no zero at the end), take1.9, take1.10 for numbers (no
/// zero in front); ROS writes nanoseconds without zeros in front, too.
std::optional<Mark> likely_reading(const Fractions& f) {
  constexpr Value kClearly = 1.5L;
  if (f.negative || f.longer_zero) return Mark::decimal;  // nobody counts so
  const bool stamps = f.may_be_nanoseconds();
  const Mark other = stamps ? Mark::nanoseconds : Mark::parts;
  if (stamps && f.longest == kNanoseconds && f.epoch) return other;
  const Value uneven = stamps ? f.nanoseconds : f.parts;
  if (f.twice)  // 1.5 and 1.50 are there: a run of numbers, or the same moment twice
    return uneven < kClearly && f.least_part_step == 1 ? std::optional(other) : std::nullopt;
  const bool for_decimals = kClearly * f.decimals <= uneven;
  const bool for_other = kClearly * uneven <= f.decimals;
  if (f.trailing_zero) return for_decimals ? std::nullopt : std::optional(other);
  if (f.plain) return for_other ? std::nullopt : std::optional(Mark::decimal);
  if (for_decimals == for_other) return std::nullopt;
  return for_decimals ? Mark::decimal : other;
}

std::string remark_on(Mark mark, const Dispute& names) {
  const bool kept = mark != Mark::decimal;
  const char* how =
      mark == Mark::decimal ? "the names are read as decimals: "
      : mark == Mark::parts
          ? "the digits behind the points of the names are read as numbers of their own: "
          : "the names are read as seconds and nanoseconds: ";
  return cat(how, text::quote(kept ? names.first : names.second), " comes before ",
             text::quote(kept ? names.second : names.first));
}

/// 999, 1,000: a mark that may part thousands.
void refuse_thousands(const std::vector<Piece>& column, const std::string& folder,
                      const std::vector<std::string>& series) {
  Value largest_plain = 0, least_marked = std::numeric_limits<Value>::infinity();
  for (const Piece& piece : column) {
    if (piece.fraction.empty())
      largest_plain = std::max(largest_plain, piece.value());
    else if (piece.fraction.size() != 3 || piece.whole == "0")
      return;
    else
      least_marked = std::min(least_marked, 1000 * piece.value());
  }
  if (largest_plain < 1000 && least_marked <= 2 * largest_plain)
    throw_undecided(folder, series.front(), series.back(), "thousands");
}

Meaning meaning_of_marks(const std::vector<std::string>& names, const std::string& folder) {
  const std::vector<std::string> series = main_series(names);
  const std::vector<Piece> column = changing_fractions(series);
  if (column.empty()) return {};
  refuse_thousands(column, folder, series);
  const Fractions fractions = look_at(column);
  Meaning out;
  const std::optional<Dispute> names_in_dispute = dispute(series);
  if (!names_in_dispute) {
    out.mark = plain_reading(fractions);
    return out;
  }
  const std::optional<Mark> mark = likely_reading(fractions);
  if (!mark)
    throw_undecided(folder, names_in_dispute->first, names_in_dispute->second, "two numbers");
  out.mark = *mark;
  out.remark = remark_on(*mark, *names_in_dispute);
  return out;
}

int compare_numbers(const Piece& a, const Piece& b) {
  if (a.negative != b.negative) return a.negative ? -1 : 1;
  int out = a.whole.size() != b.whole.size() ? (a.whole.size() < b.whole.size() ? -1 : 1)
                                             : a.whole.compare(b.whole);
  if (out == 0) {  // "5" is "50" and more than "05"
    const size_t length = std::max(a.fraction.size(), b.fraction.size());
    std::string x = a.fraction, y = b.fraction;
    x.resize(length, '0');
    y.resize(length, '0');
    out = x.compare(y);
  }
  return a.negative ? -out : out;
}

}  // namespace

Value Piece::value() const {
  const Value out = std::stold(cat(whole.substr(0, 4000), ".", fraction.substr(0, 4000), "0"));
  return negative ? -out : out;
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
    piece.whole = without_zeros(piece.text);
    if (meaning.mark != Mark::parts && at < name.size() && is_lone_mark(name, at)) {
      piece.fraction = digits_at(name, at + 1);
      at += 1 + piece.fraction.size();
      if (meaning.mark == Mark::nanoseconds && piece.fraction.size() < kNanoseconds)
        piece.fraction.insert(0, kNanoseconds - piece.fraction.size(), '0');
    }
    if (!out.empty() && ends_in_sign(out.back().text, out.size() > 1, meaning)) {
      piece.negative = (piece.whole + piece.fraction).find_first_not_of('0') != std::string::npos;
      out.back().text.pop_back();
      if (out.back().text.empty()) out.pop_back();
    }
    out.push_back(std::move(piece));
  }
  return out;
}

std::string pattern_of(const Pieces& pieces) {
  std::string out;
  for (const Piece& piece : pieces) out += piece.number ? "#" : piece.text;
  return out;
}

int compare(const Pieces& a, const Pieces& b) {
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    const int order =
        a[i].number && b[i].number ? compare_numbers(a[i], b[i]) : a[i].text.compare(b[i].text);
    if (order != 0) return order;
  }
  return a.size() == b.size() ? 0 : a.size() < b.size() ? -1 : 1;
}

Meaning meaning_of(const std::vector<std::string>& names, const std::string& folder) {
  Meaning out = meaning_of_marks(names, folder);
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

}  // namespace restage::numbered
