#include "datasets/readers/text/packed_text.h"

#include <lzma.h>
#include <zlib.h>

#include <memory>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"

namespace restage {
namespace {

constexpr uint64_t kDecoderMemory = uint64_t{80} << 20;  // xz -9 needs 65 MiB

std::string unpack_xz(const std::string& packed, const std::string& path, uint64_t limit) {
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, kDecoderMemory, LZMA_CONCATENATED) != LZMA_OK)
    throw WorkError(path + ": could not start the xz decoder; free some memory");
  const struct Guard {
    lzma_stream* stream;
    ~Guard() { lzma_end(stream); }
  } guard{&stream};
  std::string out, piece(size_t{1} << 20, '\0');
  stream.next_in = reinterpret_cast<const uint8_t*>(packed.data());
  stream.avail_in = packed.size();
  while (true) {
    stream.next_out = reinterpret_cast<uint8_t*>(piece.data());
    stream.avail_out = piece.size();
    const lzma_ret state = lzma_code(&stream, LZMA_FINISH);
    out.append(piece, 0, piece.size() - stream.avail_out);
    if (out.size() > limit)
      throw InputError(path, cat("unpacks to more than ", limit >> 20, " MiB"),
                       "cut the recording into shorter files");
    if (state == LZMA_STREAM_END) return out;
    if (state == LZMA_MEMLIMIT_ERROR)
      throw InputError(
          path,
          cat("takes more than ", kDecoderMemory >> 20, " MiB to unpack, beyond what xz -9 needs"),
          "pack it again, or give the text");
    if (state != LZMA_OK)
      throw InputError(path, "is no whole xz file", "give the text or an undamaged .xz file");
  }
}

}  // namespace

std::optional<std::string> read_gz(const std::string& path, uint64_t limit) {
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  std::string out, piece(size_t{1} << 16, '\0');
  for (int got = 1; file && got > 0 && out.size() <= limit;) {
    got = gzread(file.get(), piece.data(), static_cast<unsigned>(piece.size()));
    // Of a file that was cut, only closing tells.
    if (got == 0 && gzeof(file.get()) && gzclose(file.release()) == Z_OK) return out;
    if (got > 0) out.append(piece, 0, static_cast<size_t>(got));
  }
  return std::nullopt;
}

std::string read_packed_text(const std::string& path, uint64_t limit) {
  std::string text = read_file(path, limit);
  constexpr std::string_view kXz = "\xFD\x37zXZ";
  if (text.starts_with(kXz)) text = unpack_xz(text, path, limit);
  refuse_foreign_content(text, path);
  return text;
}

}  // namespace restage
