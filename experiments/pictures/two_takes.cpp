#include "experiments/pictures/two_takes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/format.h"

namespace restage {
namespace {

/// "a.glb: Walk"; two files of one name also say their folders.
std::string label_of(const ShowRequest& request, const ShowRequest& other, const Showing& shown) {
  const auto name = [](const ShowRequest& r) {
    return std::filesystem::path(r.path).filename().string();
  };
  const std::string file = name(request) == name(other) ? request.path : name(request);
  return shown.animation.empty() ? file : file + ": " + shown.animation;
}

void hold_last(Clip& clip, size_t frames) {
  if (clip.frames.size() >= frames) return;
  const Points last = std::as_const(clip.frames).back();
  while (clip.frames.size() < frames) clip.frames.push_back(last);
  if (!clip.focus.empty()) clip.focus.resize(frames, clip.focus.back());
}

/// The one frame that is asked for, which the longer one has.
int64_t chosen_frame(const ShowRequest& asked, int64_t frames, double fps) {
  const int64_t last = frames - 1;
  if (asked.frame && !(*asked.frame >= 0 && *asked.frame <= last))
    throw InputError(
        asked.path,
        format("has no frame %lld, nor has the other", static_cast<long long>(*asked.frame)),
        format("give --frame 0 to %lld", static_cast<long long>(last)));
  if (asked.frame) return *asked.frame;
  if (!asked.seconds) return frames / 2;
  const double end = static_cast<double>(last) / fps;
  if (!(*asked.seconds >= 0 && *asked.seconds * fps <= static_cast<double>(last) + 0.5))
    throw InputError(asked.path,
                     format("has nothing at %g seconds, nor has the other", *asked.seconds),
                     format("give --time 0 to %.3g", end));
  return std::min<int64_t>(std::llround(*asked.seconds * fps), last);
}

}  // namespace

TwoTakes read_two_takes(ShowRequest first, ShowRequest second) {
  const ShowRequest asked = first;
  std::array<ShowRequest, 2> requests = {std::move(first), std::move(second)};
  for (ShowRequest& request : requests) {
    request.fps = asked.fps.value_or(kFps);
    request.every = asked.every;
    request.single = false;
    request.frame.reset();
    request.seconds.reset();
  }
  TwoTakes out;
  std::array<size_t, 2> length;
  for (size_t k = 0; k < 2; ++k) {
    out.shown[k] = read_showing(requests[k]);
    length[k] = out.shown[k].clip.frames.size();
  }
  const size_t longer = length[0] < length[1] ? 1 : 0, frames = length[longer];
  const double fps = out.shown[0].clip.fps;
  if (asked.single) {
    const int64_t frame = chosen_frame(asked, static_cast<int64_t>(frames), fps);
    for (size_t k = 0; k < 2; ++k) {
      requests[k].single = true;
      requests[k].frame = std::min(frame, static_cast<int64_t>(length[k]) - 1);
      out.shown[k] = read_showing(requests[k]);
    }
  }
  for (size_t k = 0; k < 2; ++k) {
    Showing& shown = out.shown[k];
    shown.clip.label = label_of(requests[k], requests[1 - k], shown);
    if (!asked.single) hold_last(shown.clip, frames);
    out.close_up = std::max(out.close_up, shown.close_up);
    for (const std::string& remark : shown.remarks)
      out.remarks.push_back(shown.clip.label + ": " + remark);
  }
  const size_t shorter = 1 - longer;
  if (length[0] != length[1])
    out.remarks.push_back(
        out.shown[shorter].clip.label +
        format(" ends after %.2f s, ", static_cast<double>(length[shorter]) / fps) +
        out.shown[longer].clip.label +
        format(" after %.2f s: the shorter one holds its last frame",
               static_cast<double>(frames) / fps));
  return out;
}

}  // namespace restage
