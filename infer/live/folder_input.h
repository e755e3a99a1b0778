// A folder into which a capturing program writes one file a cloud.
#pragma once

#include "infer/live/input.h"

namespace restage::live {

/// What the folder's reader must know of files.
struct FolderFiles {
  std::function<bool(const std::string& name)> is_cloud;                   ///< by its name
  std::function<bool(const std::string& a, const std::string& b)> before;  ///< natural order
  /// Reads the last cloud of a file into `points` and `left_out`, and returns how many clouds the
  /// file holds before it. InputError: damaged.
  std::function<int64_t(const std::string& path, LiveCloud& into)> read;
};

/// A file is taken when it is renamed into the folder, or when whoever wrote it closes it; the ones
/// that are there when run() begins have just come. Of files that come together the last in natural
/// order is read, the others count as overtaken. Of a file with several clouds the last is taken,
/// the others count as overtaken, and a warning says so. A cloud's time is when its file came. A
/// file that cannot be read may have been closed half written: it is tried again when it is closed
/// again, and given up after half a second or when another file comes. If the folder goes away, it
/// is waited for.
class FolderInput final : public CloudInput {
 public:
  FolderInput(std::string folder, FolderFiles files)
      : folder_(std::move(folder)), files_(std::move(files)) {}
  void run(int stop, Mailbox& to, Words& words) override;

 private:
  std::string folder_;
  FolderFiles files_;
};

}  // namespace restage::live
