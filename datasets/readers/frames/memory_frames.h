// Frames that somebody has at hand.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>

#include "datasets/readers/frames/frame_folder.h"

namespace restage {

/// So many frames, as one sequence at kFps; `frame` gives each by its number, from 0.
class MemoryFrames final : public FrameSource {
 public:
  MemoryFrames(size_t count, std::function<Frame(size_t)> frame)
      : count_(count), frame_(std::move(frame)) {}
  std::optional<Frame> next() override {
    if (at_ == count_) return std::nullopt;
    return frame_(at_++);
  }
  void skip() override { at_ = std::min(at_ + 1, count_); }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return static_cast<int64_t>(count_); }
  double fps() const override { return kFps; }

 private:
  size_t count_, at_ = 0;
  std::function<Frame(size_t)> frame_;
};

}  // namespace restage
