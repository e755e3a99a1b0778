#include "datasets/readers/arrays/zip.h"

#include <zip.h>

#include <algorithm>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr const char* kCopyAgain = "it is damaged: copy or export it again";
constexpr uint64_t kMostFold = 1032;   // deflate's best: 1032 bytes from one
constexpr uint64_t kLocalHeader = 30;  // bytes before the name of every member

[[noreturn]] void damaged(const std::string& where, const std::string& what) {
  throw InputError(where, what, kCopyAgain);
}

[[noreturn]] void refuse(const std::string& path, int code) {
  if (code == ZIP_ER_NOZIP)
    throw InputError(path, "is no zip archive, or cut short",
                     "give a .npz file as numpy writes it");
  if (code == ZIP_ER_EXISTS) damaged(path, "holds two members of one name");
  if (code == ZIP_ER_INCONS) damaged(path, "contradicts the directory at its end");
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  const std::string why = zip_error_strerror(&error);
  zip_error_fini(&error);
  damaged(path, "cannot be read as a zip archive (" + why + ")");
}

/// What deflate cannot do; a stored member is as long as it is.
void check_size(const ZipFile::Member& member, const std::string& path) {
  const bool possible = member.method == ZIP_CM_STORE ? member.size == member.packed
                                                      : member.size / kMostFold <= member.packed;
  if (!possible)
    damaged(path, cat("its member ", text::quote(member.name), " claims to unpack from ",
                      member.packed, " to ", member.size, " bytes, which cannot be"));
}

/// The bytes of a member, unpacked as they are read.
class MemberStream : public ByteStream {
 public:
  MemberStream(const std::string& path, std::shared_ptr<zip> archive, uint64_t index,
               const ZipFile::Member& member)
      : ByteStream(path + ":" + text::quote(member.name), member.size),
        archive_(std::move(archive)),
        index_(index) {
    do_rewind();
  }

 protected:
  void do_read(char* out, size_t n) override {
    for (size_t got = 0; n > 0; out += got, n -= got, done_ += got) {
      got = piece(out, n);
      if (got == 0) damaged(where(), cat("unpacks to fewer than the ", size(), " bytes it claims"));
    }
    char more = 0;
    if (done_ == size() && piece(&more, 1) > 0)  // at the end libzip compares the checksum
      damaged(where(), cat("holds more than the ", size(), " bytes it claims"));
  }
  void do_rewind() override {
    file_ = {zip_fopen_index(archive_.get(), index_, 0), &zip_fclose};
    if (!file_) damaged(where(), "cannot be unpacked");
    done_ = 0;
  }

 private:
  /// Up to n bytes; none at the end.
  size_t piece(char* out, size_t n) {
    const zip_int64_t got = zip_fread(file_.get(), out, n);
    if (got >= 0) return static_cast<size_t>(got);
    const int code = zip_error_code_zip(zip_file_get_error(file_.get()));
    if (code == ZIP_ER_CRC) damaged(where(), "has another checksum than the archive says");
    if (code == ZIP_ER_INCONS) return 0;  // another length, which do_read() names
    damaged(where(), "holds damaged packed data");
  }

  std::shared_ptr<zip> archive_;
  uint64_t index_, done_ = 0;
  std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file_{nullptr, &zip_fclose};
};

}  // namespace

ZipFile::ZipFile(std::string path) : path_(std::move(path)) {
  const uint64_t bytes = file_size_of(path_);
  int code = ZIP_ER_NOZIP;  // libzip takes an empty file for an archive
  if (bytes > 0)
    archive_.reset(zip_open(path_.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code),
                   [](zip* archive) { zip_discard(archive); });
  if (!archive_) refuse(path_, code);
  const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
  uint64_t left = bytes;  // of the file, for further members
  for (zip_int64_t i = 0; i < count; ++i) {
    zip_stat_t stat;
    if (zip_stat_index(archive_.get(), i, ZIP_FL_ENC_RAW, &stat) != 0)
      damaged(path_, "has a damaged directory");
    members_.push_back({stat.name, stat.comp_size, stat.size, stat.comp_method,
                        stat.encryption_method != ZIP_EM_NONE});
    check_size(members_.back(), path_);
    const uint64_t header = kLocalHeader + members_.back().name.size();
    if (stat.comp_size > left || header > left - stat.comp_size)
      damaged(path_, "its member " + text::quote(stat.name) + " overlaps another");
    left -= header + stat.comp_size;
  }
}

const ZipFile::Member* ZipFile::find(const std::string& name) const {
  const auto at = std::find_if(members_.begin(), members_.end(),
                               [&](const Member& member) { return member.name == name; });
  return at == members_.end() ? nullptr : &*at;
}

std::unique_ptr<ByteStream> ZipFile::open(const Member& member) const {
  const std::string named = "its member " + text::quote(member.name);
  if (member.encrypted)
    throw InputError(path_, named + " is encrypted", "save it without a password");
  if (member.method != ZIP_CM_STORE && member.method != ZIP_CM_DEFLATE)
    throw InputError(path_, cat(named, " is packed by method ", member.method),
                     "save it with numpy's savez or savez_compressed");
  return std::make_unique<MemberStream>(path_, archive_, &member - members_.data(), member);
}

}  // namespace restage
