// A cloud, or a line of joints, that has just been captured, and where it waits for the system.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>

#include "nn/geometry/body.h"

namespace restage::live {

using Clock = std::chrono::steady_clock;

struct LiveCloud {
  Points points;              ///< in the sender's units and axes, all finite
  double seconds = 0;         ///< when the cloud was captured, by the sender's own clock; finite
  Clock::time_point arrived;  ///< when its last byte arrived here
  int64_t sender = 0;         ///< which connection it came by; another number is another sender
  size_t left_out = 0;        ///< points that were NaN or infinite
  std::string name;           ///< for messages, such as a file
  /// A line of text in place of points: JSON, joints of a moment. Its time has not been read.
  std::string line = {};
  int64_t number = 0;  ///< of the line, from 1
};

/// What it is for people: "cloud" or "line".
inline const char* what_of(const LiveCloud& cloud) { return cloud.line.empty() ? "cloud" : "line"; }

/// Holds the newest cloud only: a cloud that arrives before the one before it was taken takes its
/// place. One thread puts, another takes. Memory is that of the clouds that are held.
class Mailbox {
 public:
  /// Exchanges `cloud` for an old one, whose memory can be used again.
  void put(LiveCloud& cloud);
  /// Counts clouds that arrived but were left out in favour of a newer one, unread.
  void pass(int64_t clouds);
  /// Counts a cloud that arrived but is none.
  void refuse();
  /// Counts a cloud of a sender that is not heard, because another one is sending.
  void leave_out();
  /// No more clouds will be put.
  void close();

  /// Waits for a cloud for at most so long; false: there is none.
  bool take(LiveCloud& out, std::chrono::milliseconds wait);
  /// Closed, and the last cloud was taken.
  bool ended() const;

  struct Counts {
    int64_t arrived = 0;       ///< all clouds
    int64_t overtaken = 0;     ///< of them those that a newer one took the place of
    int64_t refused = 0;       ///< of them those that were none
    int64_t other_sender = 0;  ///< of them those of senders that were not heard
  };
  Counts counts() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  LiveCloud held_;
  bool full_ = false, closed_ = false;
  Counts counts_;
};

}  // namespace restage::live
