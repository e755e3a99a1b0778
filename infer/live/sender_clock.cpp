#include "infer/live/sender_clock.h"

#include <cmath>

#include "autograd/base/format.h"
#include "infer/live/timeline.h"
#include "nn/geometry/skeleton.h"

namespace restage::live {
namespace {

constexpr double kFar = static_cast<double>(kMostMissed) / kFps;  // seconds
constexpr int kFewest = 3;          // clouds far apart that tell the unit
constexpr int kHopeless = 5;        // clouds far apart after which something is said
constexpr double kLeastTime = 0.1;  // seconds that tell the unit

struct Unit {
  const char* name;
  double in_a_second;
};
constexpr Unit kUnits[] = {{"milliseconds", 1e3}, {"microseconds", 1e6}, {"nanoseconds", 1e9}};

}  // namespace

double SenderClock::seconds(const LiveCloud& cloud, Words& words) {
  const bool begins = cloud.sender != sender_;
  if (begins) unit_ = 1;
  if (begins || std::abs(cloud.seconds - last_) * unit_ <= kFar) {
    sender_ = cloud.sender;
    far_ = 0;
    first_ = cloud.seconds;
    first_arrived_ = cloud.arrived;
  } else {
    ++far_;
    judge(cloud, words);
  }
  last_ = cloud.seconds;
  return cloud.seconds * unit_;
}

void SenderClock::judge(const LiveCloud& cloud, Words& words) {
  const double passed = std::chrono::duration<double>(cloud.arrived - first_arrived_).count();
  const double counted = cloud.seconds - first_;
  if (far_ < kFewest || passed < kLeastTime) return;
  for (const Unit& unit : kUnits) {
    const double times = counted / passed / unit.in_a_second;
    if (unit_ != 1 || times < 0.5 || times > 2) continue;
    unit_ = 1 / unit.in_a_second;
    far_ = 0;
    words.warn("clock", format("the sender's clock counts %s, which are converted; send seconds",
                               unit.name));
    return;
  }
  if (far_ == kHopeless)
    words.warn("clock",
               format("the motion begins anew with every %s: they lie %.3g s apart by their "
                      "sender's clock, and %.3g s by ours; send 15 to 90 %ss a second, and their "
                      "times in seconds",
                      what_of(cloud), counted / far_, passed / far_, what_of(cloud)));
}

}  // namespace restage::live
