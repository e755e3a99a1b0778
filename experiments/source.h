// The source of a motion, as `retarget` and `render` read it: every frame in metres, y up.
#pragma once

#include <memory>
#include <optional>

#include "autograd/base/error.h"
#include "datasets/doctor/cloud_door.h"
#include "datasets/doctor/people.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/schema.h"

namespace restage {

/// A frame that could be read, or why it could not.
struct SourceCloud {
  Frame frame;                      ///< without points if it has a fault
  std::optional<InputError> fault;  ///< names the frame's file
};

class Source {
 public:
  /// InputError: there is nothing to read; check_one_sequence(); a setting that is out of range, by
  /// the name of its option (--scale, --source-up, --fps).
  explicit Source(const SourceRecord& how, uint64_t max_memory = kMaxMemory);
  /// Of frames that somebody has at hand; `how.path` is what they are called.
  Source(const SourceRecord& how, std::unique_ptr<FrameSource> frames);

  /// The next frame; nothing at the end. Of several people the one that `how.person` names, from
  /// the first frame that shows the person to the last; frames between them without the person have
  /// a fault. A frame that is damaged, or empty, does not end the sequence: it comes with its
  /// fault. Points that are not finite, or far from all others (nn/geometry/strays.h), are left out
  /// (Frame::left_out).
  std::optional<SourceCloud> next();
  void skip(int64_t frames);
  void rewind();

  int64_t frames() const { return end_ - begin_; }
  double fps() const { return *how_.fps; }
  /// What the user should know of the whole, such as files that were left out.
  std::vector<std::string> remarks() const;
  /// How it is read; the rate is there, also where it is the file's.
  const SourceRecord& record() const { return how_; }

 private:
  void return_to_place();
  /// Which frames show the person who is asked for. InputError: none does.
  void find_person();
  std::optional<SourceCloud> read();
  /// Leaves the points of the person who is asked for, and whole clouds without.
  void choose_person(SourceCloud& cloud);

  SourceRecord how_;
  ToOurs to_ours_;
  std::unique_ptr<FrameSource> frames_;
  PeopleTracker people_;              // where one of several is asked for
  int64_t at_ = 0;                    // frames given or skipped, of the whole file
  int64_t begin_ = 0, end_ = 0;       // frames that are given
  std::optional<InputError> broken_;  // nothing behind this place can be read
};

/// InputError where a file holds several sequences and none was chosen (--sequence): nothing is
/// done with all of them as if they were one, and the first is not taken silently.
void check_one_sequence(const std::string& path, int64_t sequences,
                        const std::optional<int64_t>& chosen);

/// How the source is read, for the doctor.
SourceFrame frame_of(const SourceRecord& how);

/// The doctor's words on what would make nonsense of all that is done with the source: looks at
/// its first frames, and rewinds. InputError, as check_source() says.
void check_first_frames(Source& source);

}  // namespace restage
