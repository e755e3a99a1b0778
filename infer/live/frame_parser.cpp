#include "infer/live/frame_parser.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

namespace restage::live {

static_assert(std::endian::native == std::endian::little, "frames are copied as they lie");
static_assert(sizeof(Point) == 12);

namespace {

constexpr size_t kMark = 4;  // bytes that tell lines from frames: a frame's number of points

bool is_printed(unsigned char byte) {
  return (byte >= 0x20 && byte < 0x7F) || byte == '\t' || byte == '\r' || byte == '\n';
}

/// No frame may have so many points that the last of these bytes is not 0.
bool begin_lines(std::span<const unsigned char> mark) {
  static_assert(kMostLivePoints < 1u << 24);
  constexpr unsigned char kByteOrder = 0xEF;  // begins a byte order mark
  if (mark.front() == '{' || mark.front() == '[' || mark.front() == kByteOrder)
    return mark.back() != 0;
  return std::all_of(mark.begin(), mark.end(), is_printed);
}

}  // namespace

std::string FrameParser::take(std::span<const unsigned char> bytes, Clock::time_point arrived,
                              const std::function<void(LiveCloud&)>& deliver,
                              const std::function<void(const std::string&)>& refuse) {
  while (!bytes.empty()) {
    if (lines_) {
      take_lines(bytes, arrived, deliver, refuse);
      return "";
    }
    const bool head = got_ < kFrameHead;
    const size_t part = !known_ ? kMark : head ? kFrameHead : size_;
    const size_t count = std::min(bytes.size(), part - got_);
    unsigned char* const to =
        head ? head_.data() + got_
             : reinterpret_cast<unsigned char*>(cloud_.points.data()) + (got_ - kFrameHead);
    std::memcpy(to, bytes.data(), count);
    got_ += count;
    bytes = bytes.subspan(count);
    if (!known_ && got_ == kMark) {
      known_ = true;
      lines_ = begin_lines(std::span(head_).first(kMark));
      if (lines_) got_ = 0, take_lines(std::span(head_).first(kMark), arrived, deliver, refuse);
    }
    if (head && got_ == kFrameHead) {
      uint32_t points = 0;
      std::memcpy(&points, head_.data(), sizeof points);
      if (points > kMostLivePoints)
        return "a frame that says it has " + std::to_string(points) + " points (at most " +
               std::to_string(kMostLivePoints) + " can be)";
      size_ = kFrameHead + sizeof(Point) * points;
      cloud_.points.resize(points);
    }
    if (got_ >= kFrameHead && got_ == size_) finish(arrived, deliver, refuse);
  }
  return "";
}

void FrameParser::take_lines(std::span<const unsigned char> bytes, Clock::time_point arrived,
                             const std::function<void(LiveCloud&)>& deliver,
                             const std::function<void(const std::string&)>& refuse) {
  for (const unsigned char byte : bytes) {
    if (byte == '\n' && too_long_) {
      too_long_ = false;
      ++number_;
    } else if (byte == '\n') {
      finish_line(arrived, deliver);
    } else if (!too_long_) {
      line_ += static_cast<char>(byte);
    }
    if (line_.size() <= kLongestLine) continue;
    too_long_ = true;
    line_.clear();
    refuse("line " + std::to_string(number_ + 1) + " is longer than 1 MB");
  }
}

void FrameParser::finish_line(Clock::time_point arrived,
                              const std::function<void(LiveCloud&)>& deliver) {
  ++number_;
  const bool empty = line_.find_first_not_of(" \t\r") == line_.npos;
  if (!empty) {
    cloud_.points.clear();
    cloud_.left_out = 0;
    cloud_.arrived = arrived;
    cloud_.name.clear();
    cloud_.line = line_;
    cloud_.number = number_;
    deliver(cloud_);
  }
  line_.clear();
}

void FrameParser::end(Clock::time_point arrived, const std::function<void(LiveCloud&)>& deliver) {
  if (!known_ && got_ > 0 && begin_lines(std::span(head_).first(got_))) {  // "[]" and no more
    line_.assign(reinterpret_cast<const char*>(head_.data()), got_);
    if (line_.back() == '\n') line_.pop_back();
    got_ = 0;
  }
  if (!line_.empty()) finish_line(arrived, deliver);
}

void FrameParser::finish(Clock::time_point arrived, const std::function<void(LiveCloud&)>& deliver,
                         const std::function<void(const std::string&)>& refuse) {
  got_ = 0;
  std::memcpy(&cloud_.seconds, head_.data() + 4, sizeof cloud_.seconds);
  if (!std::isfinite(cloud_.seconds)) return refuse("its time is not a finite number");
  cloud_.left_out = std::erase_if(cloud_.points, [](const Point& p) { return !p.allFinite(); });
  cloud_.arrived = arrived;
  cloud_.name.clear();
  cloud_.line.clear();
  deliver(cloud_);
}

}  // namespace restage::live
