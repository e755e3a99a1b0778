#include "datasets/importers/joints/times.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/doctor/shape.h"
#include "datasets/readers/errors.h"

namespace restage::joints_detail {
namespace {

constexpr double kBridged = 1.0 / 3;  // seconds without a frame
constexpr double kFarApart = 10;      // seconds: these are two recordings
constexpr int kGoesBack = 10;         // frames in a row whose clock began anew

/// A frame that counts, and when it was: seconds, by the clock of the file.
struct Timed {
  size_t frame = 0;
  double at = 0;
};

/// The usual step between finite times that rise; 0: none does.
double usual_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i)
    if (const double step = times[i] - times[i - 1]; std::isfinite(step) && step > 0)
      steps.push_back(step);
  return steps.empty() ? 0 : median(std::move(steps));
}

struct TimeUnit {
  double seconds;
  const char* name;
};

/// What times with such a step count; 0 seconds: no rate of anybody's.
TimeUnit unit_of_step(double step) {
  constexpr TimeUnit kTimeUnits[] = {
      {1, "seconds"}, {1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}};
  constexpr double kLeastStep = 5e-4, kMostStep = 1, kNoSeconds = 5;
  if (step < kLeastStep || (step > kMostStep && step < kNoSeconds)) return {0, ""};
  for (const TimeUnit& unit : kTimeUnits)
    if (step * unit.seconds <= kMostStep) return unit;
  return {0, ""};
}

/// Says once how many frames are left out, and why.
void say_left_out(JointRecording& recording, size_t count, const std::string& noun,
                  const std::string& why) {
  if (count > 0)
    recording.remarks.push_back(cat(
        counted(count, noun), count == 1 ? " is left out: its " : " are left out: their ", why));
}

/// Those whose time goes on.
std::vector<Timed> going_on(JointRecording& recording, const std::vector<double>& times,
                            double unit, const std::string& noun, const std::string& where) {
  std::vector<Timed> out;
  size_t untimed = 0, stale = 0;
  int back = 0;
  double before = 0;  // of the frame that was left out last
  for (size_t i = 0; i < times.size(); ++i) {
    const double at = times[i] * unit;
    if (!std::isfinite(at)) {
      ++untimed;
      continue;
    }
    // One time that leaps ahead, of a frame between two that go on.
    const bool leaps = !out.empty() && i + 1 < times.size() && at - out.back().at > kBridged &&
                       times[i + 1] * unit < at && times[i + 1] * unit > out.back().at;
    if (out.empty() || (at > out.back().at && !leaps)) {
      out.push_back({i, at});
      back = 0;
      continue;
    }
    back = !leaps && back > 0 && at > before ? back + 1 : 1;
    before = at;
    ++stale;
    if (back == kGoesBack)
      throw InputError(where,
                       format("has times that go back by %.4g s after %s %zu and go on from there",
                              out.back().at - times[out.back().frame + 1] * unit, noun.c_str(),
                              out.back().frame + 1),
                       "cut it into a file for each recording");
  }
  say_left_out(recording, untimed, noun, "time is not known, and others have one");
  say_left_out(recording, stale, noun, "time does not go on");
  return out;
}

/// Steps of a recording: their mean, gaps left out, and longer ones counted as several.
double mean_step(const std::vector<Timed>& frames) {
  std::vector<double> steps;
  for (size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].at - frames[i - 1].at);
  const double usual = median(steps);
  double seconds = 0, count = 0;
  for (const double step : steps)
    if (step < kBridged + 1.5 * usual) {
      seconds += step;
      count += std::max(1.0, std::round(step / usual));
    }
  return count > 0 ? seconds / count : usual;
}

/// Times are rounded: near a whole number of frames a second it is that.
double whole_rate(double fps, double seconds) {
  const double rounding = std::min(0.005, 1e-4 + 1e-3 / seconds);
  return std::abs(fps - std::round(fps)) < rounding * fps ? std::round(fps) : fps;
}

bool is_gap(double seconds, double step) { return seconds - step > kBridged + 0.5 * step; }

/// Refuses what is no one recording, and notes the longest gap.
void look_for_gaps(JointRecording& recording, const std::vector<Timed>& frames, double step,
                   const std::string& noun, const std::string& where) {
  double longest = 0;
  for (size_t i = 1; i < frames.size(); ++i) {
    const double seconds = frames[i].at - frames[i - 1].at;
    if (!is_gap(seconds, step) || seconds <= longest) continue;
    longest = seconds;
    recording.gap = format(
        "has nothing for %.4g s after %s %zu (%.2f s after its start), a gap of over a "
        "third of a second",
        seconds, noun.c_str(), frames[i - 1].frame + 1, frames[i - 1].at - frames[0].at);
  }
  if (longest > kFarApart)
    throw InputError(where, recording.gap, "cut it there into a file for each recording");
}

FileFrame frame_between(const FileFrame& a, const FileFrame& b, double share) {
  FileFrame out(std::max(a.size(), b.size()));
  for (size_t j = 0; j < std::min(a.size(), b.size()); ++j)
    if (a[j] && b[j]) out[j] = Vec3(*a[j] + share * (*b[j] - *a[j]));
  return out;
}

/// The places of the frames on the grid; none where times are off by more than three quarters of a
/// step.
std::vector<size_t> even_places(const std::vector<Timed>& frames, double step) {
  std::vector<size_t> out = {0};
  for (size_t i = 1; i < frames.size(); ++i) {
    const double at = (frames[i].at - frames[0].at) / step;
    const auto place = std::max(out.back() + 1, static_cast<size_t>(std::lround(at)));
    if (std::abs(at - static_cast<double>(place)) > 0.75) return {};
    out.push_back(place);
  }
  return out;
}

/// The step of times that tremble about an even row, by the straight line through them; 0: they lie
/// further from it than three quarters of a step.
double trembling_step(const std::vector<Timed>& frames) {
  const auto n = static_cast<double>(frames.size());
  double middle = 0, slope = 0, squares = 0;
  for (const Timed& one : frames) middle += (one.at - frames[0].at) / n;
  for (size_t i = 0; i < frames.size(); ++i) {
    const double k = static_cast<double>(i) - 0.5 * (n - 1);
    slope += k * (frames[i].at - frames[0].at - middle);
    squares += k * k;
  }
  slope /= squares;
  for (size_t i = 0; i < frames.size(); ++i) {
    const double k = static_cast<double>(i) - 0.5 * (n - 1);
    if (std::abs(frames[i].at - frames[0].at - middle - k * slope) > 0.75 * slope) return 0;
  }
  return slope;
}

/// The frames of the grid between those of the file; empty ones in gaps.
std::vector<FileFrame> between_uneven(const std::vector<FileFrame>& all,
                                      const std::vector<Timed>& frames, double step, size_t count) {
  std::vector<FileFrame> out(count, FileFrame(all[0].size()));
  size_t a = 0;
  for (size_t f = 0; f < count; ++f) {
    const double at = frames[0].at + static_cast<double>(f) * step;
    while (a + 2 < frames.size() && frames[a + 1].at <= at) ++a;
    const Timed &from = frames[a], &to = frames[a + 1];
    if (is_gap(to.at - from.at, step) && at > from.at && at < to.at) continue;
    out[f] = frame_between(all[from.frame], all[to.frame],
                           std::clamp((at - from.at) / (to.at - from.at), 0.0, 1.0));
  }
  return out;
}

}  // namespace

void place_by_times(JointRecording& recording, const std::vector<double>& times,
                    const std::string& noun, const std::string& where) {
  constexpr double kMostFrames = 1 << 20;
  const double usual = usual_step(times);
  if (!(usual > 0)) {
    if (std::count_if(times.begin(), times.end(), [](double t) { return std::isfinite(t); }) > 1)
      recording.remarks.push_back("its times never go on, and are passed over");
    return;
  }
  const TimeUnit unit = unit_of_step(usual);
  if (unit.seconds == 0) return;
  const std::vector<Timed> frames = going_on(recording, times, unit.seconds, noun, where);
  if (frames.size() < 2) return;
  const double length = frames.back().at - frames[0].at;
  double fps = whole_rate(1 / mean_step(frames), length);
  look_for_gaps(recording, frames, 1 / fps, noun, where);
  if (!(length * fps < kMostFrames))
    throw InputError(where, format("would make %.0f frames by its times", length * fps),
                     "check its times, or cut it");
  std::vector<size_t> places = even_places(frames, 1 / fps);
  if (const double even = places.empty() ? trembling_step(frames) : 0; even > 0) {
    fps = whole_rate(1 / even, length);
    for (size_t i = 0; i < frames.size(); ++i) places.push_back(i);
  }
  const double step = 1 / fps;
  if (unit.seconds != 1) recording.remarks.push_back(cat("its times count ", unit.name));
  recording.fps = fps;
  if (places.empty()) {
    const auto count = static_cast<size_t>(std::floor(length / step + 1e-6)) + 1;
    recording.remarks.push_back(
        format("its times are not even: frames are placed between its own, %g a second", fps));
    recording.frames = between_uneven(recording.frames, frames, step, count);
    return;
  }
  std::vector<FileFrame> out(places.back() + 1, FileFrame(recording.frames[0].size()));
  for (size_t i = 0; i < places.size(); ++i)
    out[places[i]] = std::move(recording.frames[frames[i].frame]);
  if (const size_t missing = out.size() - places.size(); missing > 0 && recording.gap.empty())
    recording.remarks.push_back(
        cat(counted(missing, noun), missing == 1 ? " is" : " are",
            " missing, as the times tell, and found between those around them"));
  recording.frames = std::move(out);
}

}  // namespace restage::joints_detail
