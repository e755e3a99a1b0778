// Where clouds lie on the grid of 30 moments a second that a system works on
// (docs/decisions.md, "Live and pictures").
#pragma once

#include <cstdint>

namespace restage::live {

/// Moments of the grid that a system may be told it has missed, a third of a second; after a longer
/// gap it begins anew.
inline constexpr int64_t kMostMissed = 10;

/// What a cloud is to the sequence so far.
struct Step {
  enum class Kind {
    /// The cloud goes on with the sequence. `missed` moments lie between it and the cloud before.
    next,
    /// The cloud is newer than the last cloud, and belongs to the same moment.
    /// The cloud waits for `wait` seconds.
    /// If another cloud comes in that time, the other cloud is placed instead.
    /// If none comes, the cloud takes the next moment (take_early()).
    early,
    /// The cloud is not newer than the last cloud.
    late,
    /// A sequence begins with the cloud.
    anew
  } kind;
  int64_t missed = 0;
  double wait = 0;
};

class Timeline {
 public:
  /// The next cloud, captured at `seconds` (finite) of the clock of `sender`. Each cloud belongs to
  /// the nearest moment of the grid, and the grid follows the sender slowly: by a tenth of what the
  /// cloud is off, unless clouds are more than the grid has moments. So neither trembling times
  /// nor a rate that is not quite 30 cost clouds.
  Step place(double seconds, int64_t sender);

  /// The cloud that was early stands for the next moment.
  void take_early();

 private:
  bool began_ = false;
  int64_t sender_ = 0;
  int64_t last_ = 0;      ///< the moment of the last cloud, from 0
  double newest_ = 0;     ///< the sender's time of the last cloud that was placed
  double zero_ = 0;       ///< the sender's time of moment 0
  bool crowded_ = false;  ///< a cloud has come since that belongs to no later moment
};

}  // namespace restage::live
