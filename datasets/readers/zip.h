// Zip archives, read member by member: stored and deflate, zip64, data descriptors.
// The central directory is the truth; whatever contradicts it is refused when the archive is
// opened: members that overlap or lie outside, two of one name, sizes that a local header gives
// differently or that deflate cannot reach. (libzip and minizip check none of these, so this is
// our own parser of the directory; zlib unpacks.)
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "datasets/readers/byte_stream.h"

namespace restage {

class ZipFile {
 public:
  struct Member {
    std::string name;
    uint16_t flags = 0, method = 0;
    uint32_t crc = 0;
    uint64_t packed = 0, size = 0;  ///< bytes in the file, bytes unpacked
    uint64_t header = 0, data = 0;  ///< where its local header and its bytes begin
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
  void read_directory();
  void read_local_headers(FileStream& file, uint64_t directory);

  std::string path_;
  std::vector<Member> members_;
};

}  // namespace restage
