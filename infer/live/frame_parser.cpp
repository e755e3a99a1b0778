#include "infer/live/frame_parser.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace restage::live {

static_assert(std::endian::native == std::endian::little, "frames are copied as they lie");
static_assert(sizeof(Point) == 12);

std::string FrameParser::take(std::span<const unsigned char> bytes, Clock::time_point arrived,
                              const std::function<void(LiveCloud&)>& deliver,
                              const std::function<void(const std::string&)>& refuse) {
  while (!bytes.empty()) {
    const bool head = got_ < kFrameHead;
    const size_t count = std::min(bytes.size(), (head ? kFrameHead : size_) - got_);
    unsigned char* const to =
        head ? head_.data() + got_
             : reinterpret_cast<unsigned char*>(cloud_.points.data()) + (got_ - kFrameHead);
    std::memcpy(to, bytes.data(), count);
    got_ += count;
    bytes = bytes.subspan(count);
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

void FrameParser::finish(Clock::time_point arrived, const std::function<void(LiveCloud&)>& deliver,
                         const std::function<void(const std::string&)>& refuse) {
  got_ = 0;
  std::memcpy(&cloud_.seconds, head_.data() + 4, sizeof cloud_.seconds);
  if (!std::isfinite(cloud_.seconds)) return refuse("its time is not a finite number");
  cloud_.left_out = std::erase_if(cloud_.points, [](const Point& p) { return !p.allFinite(); });
  cloud_.arrived = arrived;
  cloud_.name.clear();
  deliver(cloud_);
}

}  // namespace restage::live
