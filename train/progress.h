// Progress of a long loop: one bar that redraws itself on a terminal, a plain line every few
// seconds elsewhere, nothing when quiet. Losses, rate and time left stand beside the count.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace restage {

/// Where progress is shown and what can be done there. Tests replace its members.
struct ProgressOutput {
  std::function<void(std::string_view)> write;
  std::function<double()> clock;  ///< seconds, monotonic
  std::function<int()> width;     ///< columns of the terminal now
  bool terminal = false;          ///< the cursor can be moved
  bool colour = false;
  bool quiet = false;
};

/// Standard error: a terminal if it is one and TERM is not "dumb"; colour unless NO_COLOR is set.
ProgressOutput standard_progress(bool quiet = false);

class Progress {
 public:
  using Values = std::vector<std::pair<std::string, double>>;

  /// `total` steps of which `done` lie behind us (a resumed run).
  Progress(std::string title, int64_t total, ProgressOutput output, int64_t done = 0);
  ~Progress();  ///< leaves the cursor on a line of its own
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` steps are done. Cheap; draws at most every 0.1 s (a line every 10 s without terminal).
  void update(int64_t done, const Values& values = {});
  /// A line of text of its own (a validation result), above the bar.
  void note(const std::string& text);
  /// Takes the bar away until the next update, for a line that somebody else writes.
  void clear();
  /// The last state and the time it took; later calls do nothing.
  void finish();

 private:
  void draw_bar();
  void write_line(bool last);
  double rate() const;  ///< steps per second over the last half minute; 0 if that is not known yet
  std::string numbers(bool last) const;

  std::string title_;
  int64_t total_, done_;
  ProgressOutput out_;
  Values values_;
  std::deque<std::pair<double, int64_t>> history_;  // (time, done)
  double start_, drawn_;
  int64_t bar_cells_ = 0;
  size_t bar_width_ = 0;  // of the terminal when the bar was last measured
  bool bar_shown_ = false, finished_ = false;
};

/// "0:07", "12:30", "3:04:05".
std::string duration_text(double seconds);

}  // namespace restage
