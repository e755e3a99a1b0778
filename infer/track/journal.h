// The frames of a take that have been tracked, on disk: so memory does not grow with their number,
// and a run that was stopped goes on where it was.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "infer/track/tracker.h"

namespace restage {

/// What is kept of a frame. `points`: the vertices or the offsets of all, as the owner likes.
struct JournalFrame {
  Pose pose;
  std::optional<double> confidence;
  bool filled = false;
  std::optional<MiddleAndMost> distance;
  Points points;
};

class TrackJournal {
 public:
  /// In `folder`, which must exist. Goes on with what is there; frames behind the last keep() are
  /// dropped. WorkError: the disk is full or fails.
  TrackJournal(const std::string& folder, size_t points);
  ~TrackJournal();
  TrackJournal(const TrackJournal&) = delete;
  TrackJournal& operator=(const TrackJournal&) = delete;

  const std::string& folder() const { return folder_; }
  int64_t frames() const { return frames_; }
  /// What keep() was given last; empty: nothing was kept.
  const std::string& state() const { return state_; }
  void append(const JournalFrame& frame);
  /// From now on all frames so far outlive the process, with what those after them depend on.
  void keep(const std::string& state);
  JournalFrame read(int64_t frame) const;

 private:
  std::string folder_, path_, state_path_, state_, record_;
  size_t points_;
  int64_t frames_ = 0;
  int file_ = -1;
};

}  // namespace restage
