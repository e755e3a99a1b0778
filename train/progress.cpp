#include "train/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "autograd/base/format.h"

namespace restage {
namespace {

constexpr double kRedraw = 0.1, kLineEvery = 10.0, kRateWindow = 30.0;  // seconds
constexpr int kWidestBar = 30, kNarrowestBar = 8;
constexpr const char* kClearLine = "\r\x1b[K";

}  // namespace

ProgressOutput standard_progress(bool quiet) {
  const char* term = std::getenv("TERM");
  const char* no_colour = std::getenv("NO_COLOR");
  ProgressOutput out;
  out.write = [](std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fflush(stderr);
  };
  out.clock = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  out.width = [] {
    winsize size{};
    const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? static_cast<int>(size.ws_col) : 80;
  };
  out.terminal =
      ::isatty(STDERR_FILENO) == 1 && !(term != nullptr && std::string_view(term) == "dumb");
  out.colour = out.terminal && (no_colour == nullptr || *no_colour == '\0');
  out.quiet = quiet;
  return out;
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long long>(std::clamp(seconds, 0.0, 1e9) + 0.5);
  if (whole < 3600) return format("%lld:%02lld", whole / 60, whole % 60);
  return format("%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
}

Progress::Progress(std::string title, int64_t total, ProgressOutput output, int64_t done)
    : title_(std::move(title)),
      total_(std::max<int64_t>(total, 0)),
      done_(done),
      out_(std::move(output)) {
  start_ = out_.clock();
  drawn_ = start_ - kLineEvery;  // the first update is shown at once
  history_.emplace_back(start_, done_);
}

Progress::~Progress() {
  if (bar_shown_) out_.write("\n");
}

void Progress::update(int64_t done, const Values& values) {
  if (out_.quiet || finished_) return;
  done_ = done;
  values_ = values;
  const double now = out_.clock();
  if (now - drawn_ < (out_.terminal ? kRedraw : kLineEvery)) return;
  drawn_ = now;
  history_.emplace_back(now, done_);
  while (history_.size() > 2 && now - history_.front().first > kRateWindow) history_.pop_front();
  if (out_.terminal)
    draw_bar();
  else
    write_line(false);
}

double Progress::rate() const {
  const double time = history_.back().first - history_.front().first;
  const auto steps = static_cast<double>(history_.back().second - history_.front().second);
  return time > 0 && steps > 0 ? steps / time : 0;
}

/// "42% 1234/3000", rate and time left.
std::string Progress::numbers(bool last) const {
  const int percent =
      total_ > 0
          ? static_cast<int>(100.0 * static_cast<double>(done_) / static_cast<double>(total_))
          : 100;
  std::string out = format("%3d%% %lld/%lld", percent, static_cast<long long>(done_),
                           static_cast<long long>(total_));
  if (last) return out + "  took " + duration_text(history_.back().first - start_);
  const double speed = rate();
  if (speed <= 0) return out;
  out += speed >= 1 ? format("  %.1f/s", speed) : format("  %.1f s/step", 1 / speed);
  return out + "  ETA " +
         duration_text(static_cast<double>(std::max<int64_t>(total_ - done_, 0)) / speed);
}

void Progress::draw_bar() {
  const auto width =
      static_cast<size_t>(std::max(out_.width() - 1, 1));  // the last column would wrap
  std::string tail = " " + numbers(finished_);
  for (const auto& entry : values_) {  // as many values as fit into the line
    const std::string item = "  " + entry.first + " " + format("%.4g", entry.second);
    if (title_.size() + 2 + kNarrowestBar + 2 + tail.size() + item.size() > width) break;
    tail += item;
  }
  std::string line = title_;
  size_t bar_start = 0, filled = 0;
  // While the terminal keeps its width the bar may shrink and never grows.
  if (width != bar_width_) bar_cells_ = kWidestBar;
  bar_width_ = width;
  const auto room =
      static_cast<int64_t>(width) - static_cast<int64_t>(title_.size() + tail.size() + 3);
  if (room >= kNarrowestBar) {
    const auto cells = static_cast<size_t>(bar_cells_ = std::min(room, bar_cells_));
    const double share =
        total_ > 0 ? static_cast<double>(done_) / static_cast<double>(total_) : 1.0;
    filled = static_cast<size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(cells));
    bar_start = line.size() + 2;
    line += " [" + std::string(filled, '#') + std::string(cells - filled, '-') + "]";
  }
  line = (line + tail).substr(0, width);
  if (out_.colour && filled > 0) {
    line.insert(bar_start + filled, "\x1b[0m");
    line.insert(bar_start, "\x1b[32m");
  }
  // one write, new text first and then the rest of the line cleared: nothing flickers
  out_.write("\r" + line + "\x1b[K");
  bar_shown_ = true;
}

void Progress::write_line(bool last) {
  std::string line = title_ + " " + numbers(last);
  for (const auto& entry : values_) line += "  " + entry.first + " " + format("%.4g", entry.second);
  out_.write(line + "\n");
}

void Progress::note(const std::string& text) {
  if (out_.quiet) return;
  out_.write((bar_shown_ ? kClearLine : "") + text + "\n");
  if (bar_shown_) draw_bar();
}

void Progress::clear() {
  if (bar_shown_) out_.write(kClearLine);
  bar_shown_ = false;
}

void Progress::finish() {
  if (out_.quiet || finished_) return;
  finished_ = true;
  history_.emplace_back(out_.clock(), done_);
  if (!out_.terminal) return write_line(true);
  draw_bar();
  out_.write("\n");
  bar_shown_ = false;
}

}  // namespace restage
