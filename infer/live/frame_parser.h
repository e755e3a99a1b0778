// Clouds in a stream of bytes. A frame is, little-endian and without padding:
//   uint32   number of points
//   float64  seconds, by the sender's clock
//   float32  x, y, z of each point
// Or lines of JSON, which tell themselves: they begin with { or [ or other printed letters (what a
// logger says first), and no number of points that is allowed has the bytes of four of them.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>

#include "infer/live/cloud.h"

namespace restage::live {

inline constexpr uint32_t kMostLivePoints = 1u << 22;  ///< in a frame, 50 MB; more is garbage
inline constexpr size_t kFrameHead = 12;               ///< bytes before the points
inline constexpr size_t kLongestLine = 1u << 20;       ///< bytes; a longer one is left out

class FrameParser {
 public:
  /// Takes the next bytes, however they were cut, and hands every frame to `deliver` when its last
  /// byte is there; `deliver` may exchange the cloud for another whose memory is used again. Points
  /// that are not finite are left out. A frame whose time is not finite, or a line that is too
  /// long, is handed to `refuse`, with a reason. Returns why the bytes cannot be frames at all, and
  /// then nothing behind them can be found; empty: they are frames.
  std::string take(std::span<const unsigned char> bytes, Clock::time_point arrived,
                   const std::function<void(LiveCloud&)>& deliver,
                   const std::function<void(const std::string&)>& refuse);
  /// No more bytes come: hands over a last line that has no end.
  void end(Clock::time_point arrived, const std::function<void(LiveCloud&)>& deliver);
  /// Whether the last byte taken was in the middle of a frame.
  bool in_frame() const { return got_ > 0 || !line_.empty() || too_long_; }

 private:
  void take_lines(std::span<const unsigned char> bytes, Clock::time_point arrived,
                  const std::function<void(LiveCloud&)>& deliver,
                  const std::function<void(const std::string&)>& refuse);
  void finish_line(Clock::time_point arrived, const std::function<void(LiveCloud&)>& deliver);
  void finish(Clock::time_point arrived, const std::function<void(LiveCloud&)>& deliver,
              const std::function<void(const std::string&)>& refuse);

  std::array<unsigned char, kFrameHead> head_;
  size_t got_ = 0;   ///< bytes of this frame that are there
  size_t size_ = 0;  ///< bytes of this frame, once its head is there
  LiveCloud cloud_;
  bool known_ = false;  ///< whether the bytes are lines
  bool lines_ = false;
  std::string line_;       ///< what is there of one
  int64_t number_ = 0;     ///< of lines that are over
  bool too_long_ = false;  ///< the rest of a line is passed over
};

}  // namespace restage::live
