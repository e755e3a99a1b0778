#include "infer/live/timeline.h"

#include <cmath>

#include "nn/geometry/skeleton.h"

namespace restage::live {

Step Timeline::place(double seconds, int64_t sender) {
  constexpr double kFollow = 0.1;
  const double at = (seconds - zero_) * kFps, ahead = at - static_cast<double>(last_);
  constexpr double kReach = kMostMissed + 1.5;
  if (!began_ || sender != sender_ || !(std::abs(ahead) < kReach)) {
    began_ = true;
    sender_ = sender;
    last_ = 0;
    newest_ = seconds;
    zero_ = seconds;
    crowded_ = false;
    return {Step::Kind::anew};
  }
  const auto moments = static_cast<int64_t>(std::lround(ahead));
  if (moments < 1) {
    crowded_ = true;
    if (!(seconds > newest_)) return {Step::Kind::late};
    newest_ = seconds;
    return {Step::Kind::early, 0, (1 - ahead) / kFps};
  }
  newest_ = seconds;
  last_ += moments;
  if (!crowded_) zero_ += kFollow * (at - static_cast<double>(last_)) / kFps;
  crowded_ = false;
  return {Step::Kind::next, moments - 1};
}

void Timeline::take_early() { ++last_; }

}  // namespace restage::live
