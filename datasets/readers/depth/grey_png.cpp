#include "datasets/readers/depth/grey_png.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <memory>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/text/text.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_MAX_DIMENSIONS 16384
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace restage {
namespace {

constexpr uint64_t kLargestPng = uint64_t{1} << 28;  // bytes of a file
constexpr int64_t kMostDepthPixels = int64_t{1} << 25;
constexpr std::string_view kPngBegins = "\x89PNG\r\n\x1a\n";
constexpr size_t kBitsAt = 24, kColourAt = 25;  // in the first chunk, IHDR

}  // namespace

bool is_png_name(const std::string& path) { return text::ends_in(path, {".png"}); }

bool is_grey_png(const std::string& path) {
  std::array<char, 26> head{};
  std::ifstream in(path, std::ios::binary);
  return in.read(head.data(), head.size()) &&
         std::string_view(head.data(), kPngBegins.size()) == kPngBegins && head[kBitsAt] == 16 &&
         head[kColourAt] == 0;
}

GreyPicture read_grey_png(const std::string& path) {
  const std::string bytes = read_file(path, kLargestPng);
  if (!bytes.starts_with(kPngBegins)) refuse_foreign_content(bytes, path);
  if (!bytes.starts_with(kPngBegins) || bytes.size() <= kColourAt)
    throw InputError(path, bytes.empty() ? "is empty" : "is no PNG",
                     "give depth pictures, PNG of 16 bits");
  if (bytes[kBitsAt] != 16 || bytes[kColourAt] != 0)
    throw InputError(path,
                     bytes[kColourAt] == 0 ? "is a picture of 8 bits, not of depth"
                                           : "is a picture of colours, not of depth",
                     "give depth pictures, PNG of one channel of 16 bits");
  const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  GreyPicture out;
  int channels = 0;
  if (stbi_info_from_memory(data, size, &out.width, &out.height, &channels) == 0 ||
      int64_t{out.width} * out.height > kMostDepthPixels)
    throw InputError(path, "is damaged, or too large a picture", "save it again");
  const std::unique_ptr<uint16_t, void (*)(void*)> pixels(
      stbi_load_16_from_memory(data, size, &out.width, &out.height, &channels, 1), stbi_image_free);
  if (!pixels) throw InputError(path, "is a damaged PNG", "save it again");
  out.values.assign(pixels.get(), pixels.get() + static_cast<size_t>(out.width) *
                                                     static_cast<size_t>(out.height));
  return out;
}

}  // namespace restage
