#include "datasets/readers/zip.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string_view>

#include "autograd/base/error.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

constexpr const char* kAgain = "it is damaged: copy or export it again";
constexpr uint64_t kMaxDirectory = uint64_t{16} << 20;  // some 100,000 members
constexpr uint64_t kMostFold = 1032;                    // deflate's best: 1032 bytes from one
enum : uint16_t { kEncrypted = 1, kDescriptor = 8, kStored = 0, kDeflate = 8 };

[[noreturn]] void damaged(const std::string& path, const std::string& what) {
  throw InputError(path, what, kAgain);
}

/// Little-endian numbers at fixed places of a record.
class Record {
 public:
  explicit Record(std::string_view bytes) : bytes_(bytes) {}
  uint16_t u16(size_t at) const { return static_cast<uint16_t>(number(at, 2)); }
  uint32_t u32(size_t at) const { return static_cast<uint32_t>(number(at, 4)); }
  uint64_t u64(size_t at) const { return number(at, 8); }

 private:
  uint64_t number(size_t at, size_t bytes) const {
    uint64_t out = 0;
    for (size_t i = 0; i < bytes; ++i)
      out |= uint64_t{static_cast<unsigned char>(bytes_[at + i])} << (8 * i);
    return out;
  }
  std::string_view bytes_;
};

/// A short piece of the file; whoever asks has checked n.
std::string bytes_at(FileStream& file, uint64_t begin, uint64_t n) {
  std::string out(static_cast<size_t>(n), '\0');
  file.rewind();
  file.skip(begin);
  file.read(out.data(), out.size());
  return out;
}

struct Directory {
  uint64_t begin = 0, size = 0, entries = 0;
};

/// The end record, found from the end of the file: its comment must reach exactly that far.
std::optional<size_t> end_record(std::string_view tail) {
  constexpr size_t kRecord = 22;
  if (tail.size() < kRecord) return std::nullopt;
  for (size_t at = tail.size() - kRecord + 1; at-- > 0;)
    if (tail.substr(at, 4) == "PK\5\6" &&
        Record(tail.substr(at)).u16(20) == tail.size() - at - kRecord)
      return at;
  return std::nullopt;
}

Directory zip64_directory(FileStream& file, uint64_t end) {
  const std::string& path = file.where();
  if (end < 20) damaged(path, "lacks its zip64 directory");
  const std::string locator = bytes_at(file, end - 20, 20);
  const uint64_t at = Record(locator).u64(8);
  if (!locator.starts_with("PK\6\7") || at > end - 20 || end - 20 - at < 56)
    damaged(path, "lacks its zip64 directory");
  const std::string bytes = bytes_at(file, at, 56);
  if (!bytes.starts_with("PK\6\6")) damaged(path, "lacks its zip64 directory");
  const Record record(bytes);
  return {record.u64(48), record.u64(40), record.u64(32)};
}

Directory find_directory(FileStream& file) {
  const std::string& path = file.where();
  const uint64_t size = file.size();
  const uint64_t tail_size = std::min<uint64_t>(size, 22 + 0xffff);
  const std::string tail = bytes_at(file, size - tail_size, tail_size);
  const std::optional<size_t> at = end_record(tail);
  if (!at) {
    if (size < 4 || bytes_at(file, 0, 4) != "PK\3\4")
      throw InputError(path, "is no zip archive", "give a .npz file as numpy writes it");
    damaged(path, "has no directory at its end");
  }
  const Record record(std::string_view(tail).substr(*at));
  const uint64_t end = size - tail_size + *at;
  Directory out{record.u32(16), record.u32(12), record.u16(10)};
  if (record.u16(4) != 0 && record.u16(4) != 0xffff)
    throw InputError(path, "is one part of a split archive", "join the parts");
  if (out.begin == 0xffffffff || out.size == 0xffffffff || out.entries == 0xffff)
    out = zip64_directory(file, end);
  if (out.size > end || out.begin > end - out.size || out.size > kMaxDirectory ||
      out.entries > out.size / 46)
    damaged(path, "has an impossible directory");
  return out;
}

/// Sizes beyond 32 bits, from the extra field: only those that are 0xffffffff, in this order.
bool read_zip64(std::string_view extra, const std::vector<uint64_t*>& fields) {
  bool needed = false;
  for (const uint64_t* field : fields) needed = needed || *field == 0xffffffff;
  if (!needed) return true;
  while (extra.size() >= 4) {
    const size_t n = Record(extra).u16(2);
    const bool wanted = Record(extra).u16(0) == 1;
    if (n > extra.size() - 4) return false;
    std::string_view values = extra.substr(4, n);
    extra.remove_prefix(4 + n);
    if (!wanted) continue;
    for (uint64_t* field : fields) {
      if (*field != 0xffffffff) continue;
      if (values.size() < 8) return false;
      *field = Record(values).u64(0);
      values.remove_prefix(8);
    }
    return true;
  }
  return false;
}

/// One entry of the directory, cut off `rest`.
ZipFile::Member read_entry(std::string_view& rest, const std::string& path) {
  constexpr size_t kEntry = 46;
  if (rest.size() < kEntry || !rest.starts_with("PK\1\2")) damaged(path, "has a damaged directory");
  const Record record(rest);
  const size_t name = record.u16(28), extra = record.u16(30), comment = record.u16(32);
  if (rest.size() - kEntry < name + extra + comment) damaged(path, "has a damaged directory");
  ZipFile::Member out;
  out.name = rest.substr(kEntry, name);
  out.flags = record.u16(8);
  out.method = record.u16(10);
  out.crc = record.u32(16);
  out.packed = record.u32(20);
  out.size = record.u32(24);
  out.header = record.u32(42);
  if (!read_zip64(rest.substr(kEntry + name, extra), {&out.size, &out.packed, &out.header}))
    damaged(path, "has a damaged directory");
  rest.remove_prefix(kEntry + name + extra + comment);
  return out;
}

std::string named(const ZipFile::Member& member) {
  return "its member " + text::quote(member.name);
}

/// What deflate cannot do; a stored member is as long as it is.
void check_size(const ZipFile::Member& member, const std::string& path) {
  const bool possible = member.method == kStored ? member.size == member.packed
                                                 : member.size / kMostFold <= member.packed;
  if (!possible)
    throw InputError(path,
                     named(member) + " claims to unpack from " + std::to_string(member.packed) +
                         " to " + std::to_string(member.size) + " bytes, which cannot be",
                     kAgain);
}

/// The bytes of a member, unpacked as they are read.
class MemberStream : public ByteStream {
 public:
  MemberStream(const std::string& path, const ZipFile::Member& member)
      : ByteStream(path + ":" + text::quote(member.name), member.size),
        member_(member),
        in_(path, where(), member.data, member.packed) {
    if (member_.method == kDeflate && inflateInit2(&state_, -MAX_WBITS) != Z_OK)
      throw WorkError(where() + ": could not start to unpack; free some memory");
  }
  ~MemberStream() override {
    if (member_.method == kDeflate) inflateEnd(&state_);
  }

 protected:
  void do_read(char* out, size_t n) override {
    if (member_.method == kStored)
      in_.read(out, n);
    else
      unpack(out, n);
    crc_ = static_cast<uint32_t>(crc32_z(crc_, reinterpret_cast<const unsigned char*>(out), n));
    done_ += n;
    if (done_ < size()) return;
    char more = 0;
    if (member_.method == kDeflate &&
        (piece(&more, 1) != 0 || !ended_ || state_.avail_in + in_.left() > 0))
      damaged(where(), "holds more than the " + std::to_string(size()) + " bytes it claims");
    if (crc_ != member_.crc) damaged(where(), "has another checksum than the archive says");
  }
  void do_rewind() override {
    in_.rewind();
    if (member_.method == kDeflate) inflateReset(&state_);
    state_.avail_in = 0;
    ended_ = false;
    done_ = 0;
    crc_ = 0;
  }

 private:
  void unpack(char* out, size_t n) {
    while (n > 0) {
      const size_t got = piece(out, n);
      if (got == 0)
        damaged(where(),
                "unpacks to fewer than the " + std::to_string(size()) + " bytes it claims");
      out += got;
      n -= got;
    }
  }
  /// Up to n bytes; none at the end of the packed data.
  size_t piece(char* out, size_t n) {
    state_.next_out = reinterpret_cast<unsigned char*>(out);
    state_.avail_out = static_cast<unsigned>(std::min<size_t>(n, 1u << 30));
    const unsigned wanted = state_.avail_out;
    while (!ended_ && state_.avail_out == wanted) {
      if (state_.avail_in == 0 && in_.left() > 0) {
        state_.avail_in = static_cast<unsigned>(std::min<uint64_t>(in_.left(), buffer_.size()));
        in_.read(buffer_.data(), state_.avail_in);
        state_.next_in = reinterpret_cast<unsigned char*>(buffer_.data());
      }
      const int code = inflate(&state_, Z_NO_FLUSH);
      ended_ = code == Z_STREAM_END;
      if (code == Z_BUF_ERROR) break;  // the packed data ends without its end mark
      if (code != Z_OK && !ended_) damaged(where(), "holds damaged packed data");
    }
    return wanted - state_.avail_out;
  }

  ZipFile::Member member_;
  FileStream in_;
  z_stream state_{};
  std::array<char, 1 << 16> buffer_;
  bool ended_ = false;
  uint64_t done_ = 0;
  uint32_t crc_ = 0;
};

}  // namespace

ZipFile::ZipFile(std::string path) : path_(std::move(path)) { read_directory(); }

void ZipFile::read_directory() {
  FileStream file(path_);
  const Directory directory = find_directory(file);
  const std::string bytes = bytes_at(file, directory.begin, directory.size);
  std::string_view rest = bytes;
  std::set<std::string> names;
  for (uint64_t i = 0; i < directory.entries; ++i) {
    members_.push_back(read_entry(rest, path_));
    if (!names.insert(members_.back().name).second)
      throw InputError(path_, "holds two members " + text::quote(members_.back().name), kAgain);
    check_size(members_.back(), path_);
  }
  if (!rest.empty()) damaged(path_, "has a damaged directory");
  read_local_headers(file, directory.begin);
}

/// Finds where each member's bytes begin, and that no two share any.
void ZipFile::read_local_headers(FileStream& file, uint64_t directory) {
  constexpr uint64_t kHeader = 30;
  std::vector<Member*> order;
  for (Member& member : members_) order.push_back(&member);
  std::sort(order.begin(), order.end(),
            [](const Member* a, const Member* b) { return a->header < b->header; });
  uint64_t free = 0;  // the first byte that belongs to no member so far
  for (Member* member : order) {
    const auto inside = [&](uint64_t n) {
      return n <= directory && member->header <= directory - n;
    };
    if (member->header < free) damaged(path_, named(*member) + " overlaps another");
    if (!inside(kHeader)) damaged(path_, named(*member) + " lies outside of the file");
    const std::string head = bytes_at(file, member->header, kHeader);
    const Record record(head);
    const uint64_t name = record.u16(26), extra = record.u16(28);
    if (!head.starts_with("PK\3\4") || !inside(kHeader + name + extra))
      damaged(path_, named(*member) + " has no header");
    const std::string fields = bytes_at(file, member->header + kHeader, name + extra);
    uint64_t packed = record.u32(18), size = record.u32(22);
    const bool whole = read_zip64(std::string_view(fields).substr(name), {&size, &packed});
    const bool same = (record.u16(6) & kDescriptor) != 0 ||  // the sizes follow the bytes
                      (whole && packed == member->packed && size == member->size);
    if (fields.substr(0, name) != member->name || record.u16(8) != member->method || !same)
      damaged(path_, named(*member) + " contradicts the directory");
    member->data = member->header + kHeader + name + extra;
    if (member->packed > directory - member->data)
      damaged(path_, named(*member) + " lies outside of the file");
    free = member->data + member->packed;
  }
}

const ZipFile::Member* ZipFile::find(const std::string& name) const {
  const auto at = std::find_if(members_.begin(), members_.end(),
                               [&](const Member& member) { return member.name == name; });
  return at == members_.end() ? nullptr : &*at;
}

std::unique_ptr<ByteStream> ZipFile::open(const Member& member) const {
  if ((member.flags & kEncrypted) != 0)
    throw InputError(path_, named(member) + " is encrypted", "save it without a password");
  if (member.method != kStored && member.method != kDeflate)
    throw InputError(path_, named(member) + " is packed by method " + std::to_string(member.method),
                     "save it with numpy's savez or savez_compressed");
  return std::make_unique<MemberStream>(path_, member);
}

}  // namespace restage
