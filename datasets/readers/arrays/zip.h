// Zip archives, read member by member, by libzip: stored and deflate, zip64, data descriptors.
// Refused when the archive is opened: what contradicts its directory, two members of one name,
// members that claim more than deflate can reach or share their bytes with others.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "datasets/readers/byte_stream.h"

struct zip;

namespace restage {

class ZipFile {
 public:
  struct Member {
    std::string name;
    uint64_t packed = 0, size = 0;  ///< bytes in the file, bytes unpacked
    uint16_t method = 0;
    bool encrypted = false;
  };

  /// Reads the directory only. InputError: not zip, cut short, contradicting itself.
  explicit ZipFile(std::string path);

  const std::string& path() const { return path_; }
  const std::vector<Member>& members() const { return members_; }
  const Member* find(const std::string& name) const;  ///< null: no such member

  /// The unpacked bytes; their checksum is compared when the last one has been read. InputError:
  /// encrypted, or packed in another way than deflate.
  std::unique_ptr<ByteStream> open(const Member& member) const;

 private:
  std::string path_;
  std::shared_ptr<zip> archive_;  ///< also of the streams that were opened
  std::vector<Member> members_;
};

}  // namespace restage
