// What a run of `restage track` has done so far, in a folder beside its result: a run that was
// stopped, in whatever way, goes on from there.
#pragma once

#include <string>

#include "experiments/cli/output.h"

namespace restage::cli {

class TrackWork {
 public:
  /// The folder OUT.track. `command`: all on which the work depends. Work of another command is
  /// thrown away. InputError: there is a folder of that name which is not ours.
  TrackWork(const std::string& out, const Json& command);
  const std::string& folder() const { return folder_; }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }
  bool resumed() const { return resumed_; }
  void remove() const;

 private:
  std::string folder_;
  bool resumed_ = false;
};

/// Names, sizes and times of change of the files at `path`, as a short text.
std::string stamp_of(const std::string& path);

}  // namespace restage::cli
