// restage stream --out: what a stream shows, kept as a file that `restage retarget` could have
// written.
#pragma once

#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "experiments/cli/perform/retarget.h"

namespace restage::cli {

/// Nothing for a command without `c.to.out`. InputError: it names no animation, may not be written,
/// or lies in `folder` (empty: none), from which clouds are read; an option does not go with it.
void check_take(const RetargetCommand& c, const std::string& folder);

/// Moments of a thirtieth of a second, one frame each. Only poses are kept: of a target in a .bvh
/// file nothing in memory, else some 350 bytes a frame.
class StreamTake {
 public:
  /// InputError where the target lacks what the file needs, before anything is shown. `clip`: what
  /// the motion is called.
  StreamTake(const SinkOptions& options, const Shown& shown, const std::string& clip,
             const std::string& target, const std::shared_ptr<const GltfOwnRig>& own);

  /// A new pose, `after` moments (1 or more) after the pose before. Of the moments between them
  /// those that were not held() are held now.
  void show(const RetargetedFrame& frame, int64_t after);
  /// The last pose is still shown, so many moments after it was new.
  void hold(int64_t moments);
  /// Writes the file. Without a pose none is written. What went wrong on the way (a full disk) is
  /// thrown now: the stream was not to end for it.
  void finish();

  int64_t frames() const { return frames_; }
  const std::string& out() const { return out_; }

 private:
  void push(const RetargetedFrame& frame);

  std::string out_;
  Sink sink_;
  RetargetedFrame held_;  ///< the last pose, without vertices
  std::vector<int64_t> filled_;
  int64_t frames_ = 0;  ///< of the file
  int64_t holds_ = 0;   ///< of the last pose, beyond the first
  std::exception_ptr fault_;
};

}  // namespace restage::cli
