#include "datasets/readers/clouds/table_frames.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr int64_t kFewestOfFrame = 64;  // points, on average
constexpr double kTurn = 0.1;           // seconds: a frame of a sensor that does not stop

/// Seconds, milliseconds, microseconds, nanoseconds.
constexpr std::array<double, 4> kSeconds = {1, 1e-3, 1e-6, 1e-9};

/// Where each run of equal numbers begins, and the end.
std::vector<int64_t> runs_of(const std::vector<double>& values) {
  std::vector<int64_t> out{0};
  for (size_t i = 1; i < values.size(); ++i)
    if (values[i] != values[i - 1]) out.push_back(static_cast<int64_t>(i));
  out.push_back(std::ssize(values));
  return out;
}

double median_step(const std::vector<double>& values, const std::vector<int64_t>& runs) {
  std::vector<double> steps;
  for (size_t r = 1; r + 1 < runs.size(); ++r)
    steps.push_back(values[static_cast<size_t>(runs[r])] -
                    values[static_cast<size_t>(runs[r - 1])]);
  std::nth_element(steps.begin(), steps.begin() + std::ssize(steps) / 2, steps.end());
  return steps[steps.size() / 2];
}

/// The unit for which a step is from `least` seconds to 500 times as long; 0: none. `units`: the
/// first so many of kSeconds may be.
double unit_of(double step, double least, size_t units) {
  for (size_t i = 0; i < units; ++i)
    if (step * kSeconds[i] >= least && step * kSeconds[i] < 500 * least) return kSeconds[i];
  return 0;
}

/// By a name such as "TIMESTAMP (ns)" or "time_us"; 0: it says none.
double unit_in(const std::string& name) {
  constexpr std::array<std::string_view, 4> kNames = {"s", "ms", "us", "ns"};
  std::string word;
  for (const char c : lower_case(name))
    if (std::isalpha(static_cast<unsigned char>(c)) != 0)
      word += c;
    else if (c != ')' && c != ']' && c != ' ')
      word.clear();
  for (size_t i = 0; i < kNames.size(); ++i)
    if (word == kNames[i]) return kSeconds[i];
  return 0;
}

}  // namespace

void TableSplitter::add(std::string_view cell) {
  double value = 0;
  numbers_ = numbers_ && text::parse(cell, value) && std::isfinite(value) &&
             (values_.empty() || value >= values_.back());
  if (numbers_) values_.push_back(value);
}

size_t TableSplitter::units() const {
  const bool whole = std::all_of(values_.begin(), values_.end(),
                                 [](double value) { return value == std::floor(value); });
  return whole ? kSeconds.size() : 1;  // nobody writes parts of milliseconds
}

double TableSplitter::packet_unit(const std::vector<int64_t>& runs, const std::string& name) const {
  constexpr double kLeastPacket = 4e-5, kLeastNamed = 1e-5;  // seconds
  if (runs.size() < 3 || std::ssize(values_) < 2 * (std::ssize(runs) - 1)) return 0;
  const double step = median_step(values_, runs), unit = unit_in(name);
  if (unit == 0) return unit_of(step, kLeastPacket, units());
  return step * unit >= kLeastNamed && step * unit < 500 * kLeastNamed ? unit : 0;
}

bool TableSplitter::is_one_turn(const std::string& name) const {
  if (!numbers_ || values_.empty() || unit_in(name) == 0) return false;
  const double unit = packet_unit(runs_of(values_), name);
  return unit > 0 && (values_.back() - values_[0]) * unit < 1.5 * kTurn;
}

std::optional<TableFrames> TableSplitter::frames(const std::string& name, bool counts) const {
  constexpr double kLeastFrame = 0.004;  // seconds
  if (!numbers_ || values_.empty()) return std::nullopt;
  TableFrames out;
  out.offset = runs_of(values_);
  const auto many = [&] {
    const int64_t frames = std::ssize(out.offset) - 1;
    return frames > 1 && std::ssize(values_) >= kFewestOfFrame * frames;
  };
  if (out.offset.size() < 3) return std::nullopt;
  const double step = median_step(values_, out.offset);
  if (many()) {
    const double named = unit_in(name);
    const double unit = counts || (named == 0 && step == 1) ? 0
                        : named > 0                         ? named
                                                            : unit_of(step, kLeastFrame, units());
    const double seconds = step * unit;
    if (seconds > 0) out.fps = std::clamp(1 / seconds, 1.0, 1000.0);
    out.remark =
        cat("its column ", text::quote(name), " parts it into ", out.offset.size() - 1, " frames");
    return out;
  }
  const double unit = counts || is_one_turn(name) ? 0 : packet_unit(out.offset, name);
  if (unit == 0) return std::nullopt;
  out.offset = {0};
  for (size_t i = 1; i < values_.size(); ++i) {
    const auto turn = [&](double at) {
      return std::floor((at - values_[0]) * unit / kTurn + 1e-6);
    };
    for (double k = turn(values_[i - 1]); k < turn(values_[i]); ++k) {
      if (out.offset.size() > values_.size()) return std::nullopt;  // mostly gaps
      out.offset.push_back(static_cast<int64_t>(i));
    }
  }
  out.offset.push_back(std::ssize(values_));
  if (!many()) return std::nullopt;
  out.fps = 1 / kTurn;
  out.remark = cat("its column ", text::quote(name), " holds times, by which it is parted into ",
                   out.offset.size() - 1, " frames of a tenth of a second");
  return out;
}

}  // namespace restage
