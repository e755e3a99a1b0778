// What the clock of a sender counts.
#pragma once

#include "infer/live/words.h"

namespace restage::live {

/// Turns the times of a sender into seconds. Our own clock tells when clouds arrive. A sender's
/// clock that counts milli-, micro- or nanoseconds runs so many times as fast, and is recognised by
/// that within a few clouds. Its sender is to send seconds (docs/stream.md), so a warning says what
/// was recognised.
class SenderClock {
 public:
  /// The time of the next cloud, seconds. Warns where the clouds of a sender lie so far apart, by
  /// its clock, that the motion begins anew with each of them.
  double seconds(const LiveCloud& cloud, Words& words);

 private:
  void judge(const LiveCloud& cloud, Words& words);

  int64_t sender_ = -1;  ///< of the last cloud; -1: none has come
  double unit_ = 1;      ///< seconds
  double last_ = 0;      ///< time of the last cloud, as sent
  // The last clouds that lie far apart, each from the one before it:
  int far_ = 0;                      ///< so many
  double first_ = 0;                 ///< time of the cloud before them, as sent
  Clock::time_point first_arrived_;  ///< when that cloud arrived
};

}  // namespace restage::live
