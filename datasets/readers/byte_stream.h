// Bytes one after the other: a file, or an unpacked member of an archive. Nobody has to hold them
// all.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace restage {

/// What unpacking one compressed file may take, unless the user says otherwise (--max-memory).
inline constexpr uint64_t kMaxMemory = 4'000'000'000;

class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Exactly n bytes. InputError if there are fewer, or if they are damaged.
  void read(char* out, size_t n);
  /// The next n bytes as a vector that grows with what is really there: a length that a file
  /// claims takes no memory.
  std::vector<char> take(uint64_t n);
  void skip(uint64_t n);
  void rewind();  ///< read() gives the first byte again

  uint64_t size() const { return size_; }  ///< of an archive's member: as declared, and checked
  uint64_t left() const { return size_ - position_; }
  const std::string& where() const { return where_; }  ///< "file" or "file:member", for messages

 protected:
  ByteStream(std::string where, uint64_t size) : where_(std::move(where)), size_(size) {}
  virtual void do_read(char* out, size_t n) = 0;  ///< n > 0, within size()
  virtual void do_skip(uint64_t n);
  virtual void do_rewind() = 0;

 private:
  std::string where_;
  uint64_t size_, position_ = 0;
};

/// A regular file. InputError: missing, a folder.
class FileStream : public ByteStream {
 public:
  explicit FileStream(const std::string& path);

 protected:
  void do_read(char* out, size_t n) override;
  void do_skip(uint64_t n) override;
  void do_rewind() override;

 private:
  std::ifstream file_;
};

/// Bytes of a regular file. InputError: missing, a folder, a device.
uint64_t file_size_of(const std::string& path);

}  // namespace restage
