#include "datasets/readers/packed_text.h"

#include <lzma.h>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"

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
      throw InputError(path, "unpacks to more than " + std::to_string(limit >> 20) + " MiB",
                       "cut the recording into shorter files");
    if (state == LZMA_STREAM_END) return out;
    if (state != LZMA_OK)
      throw InputError(path, "is no whole xz file", "give the text or an undamaged .xz file");
  }
}

}  // namespace

std::string read_packed_text(const std::string& path, uint64_t limit) {
  std::string text = read_file(path, limit);
  constexpr std::string_view kXz = "\xFD\x37zXZ";
  return text.starts_with(kXz) ? unpack_xz(text, path, limit) : text;
}

}  // namespace restage
