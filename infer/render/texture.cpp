#include "infer/render/texture.h"

#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "autograd/base/format.h"
#include "infer/render/srgb.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_MAX_DIMENSIONS 16384
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace restage {
namespace {

constexpr int kLongest = 16384;  // pixels along a side of a file
constexpr int64_t kMostPixels = int64_t{64} << 20;

struct Decoded {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;
  std::string fault;  ///< empty: none
};

bool is_size(int width, int height, int64_t* room, Decoded& out) {
  out.width = width;
  out.height = height;
  const int64_t pixels = int64_t{width} * height;
  if (width > 0 && height > 0 && width <= kLongest && height <= kLongest && pixels <= kMostPixels) {
    if (room == nullptr || (*room -= pixels) >= 0) return true;
    out.fault = "the file's pictures have too many pixels";
    return false;
  }
  out.fault = format("it has %d x %d pixels", width, height);
  return false;
}

void take(Decoded& out, uint8_t* pixels, void (*release)(void*)) {
  if (pixels == nullptr) {
    out.fault = "its bytes are damaged";
    return;
  }
  const std::unique_ptr<uint8_t, void (*)(void*)> held(pixels, release);
  out.rgba.assign(pixels, pixels + size_t{4} * static_cast<size_t>(out.width) *
                                       static_cast<size_t>(out.height));
}

Decoded decoded(std::string_view bytes, int64_t* room) {
  Decoded out;
  const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
  int width = 0, height = 0;
  if (bytes.size() > size_t{1} << 30) {
    out.fault = "it has more than a gigabyte";
  } else if (bytes.starts_with("RIFF")) {
    if (WebPGetInfo(data, bytes.size(), &width, &height) == 0)
      out.fault = "it is no PNG, JPEG or WebP picture";
    else if (is_size(width, height, room, out))
      take(out, WebPDecodeRGBA(data, bytes.size(), &width, &height), WebPFree);
  } else {
    const int size = static_cast<int>(bytes.size());
    int channels = 0;
    if (stbi_info_from_memory(data, size, &width, &height, &channels) == 0)
      out.fault = bytes.empty() ? "it has no bytes" : "it is no PNG, JPEG or WebP picture";
    else if (is_size(width, height, room, out))
      take(out, stbi_load_from_memory(data, size, &width, &height, &channels, 4), stbi_image_free);
  }
  return out;
}

/// Texel `i` of `n`, as the edges repeat, mirror or hold the picture.
int wrapped(int i, int n, Texture::Wrap how) {
  if (how == Texture::Wrap::clamp) return std::clamp(i, 0, n - 1);
  const int period = how == Texture::Wrap::mirror ? 2 * n : n;
  i %= period;
  if (i < 0) i += period;
  return i < n ? i : period - 1 - i;
}

/// Linear light of each of the 256 values.
const std::array<float, 256>& light_of_bytes() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> out{};
    for (size_t k = 0; k < out.size(); ++k) out[k] = srgb_to_linear(static_cast<float>(k) / 255);
    return out;
  }();
  return table;
}

}  // namespace

std::optional<TexturePicture> TexturePicture::decode(std::string_view bytes, std::string* why,
                                                     int side, int64_t* room) {
  Decoded picture = decoded(bytes, room);
  *why = picture.fault;
  if (!picture.fault.empty()) return std::nullopt;
  return TexturePicture(picture.width, picture.height, std::move(picture.rgba), side);
}

TexturePicture::TexturePicture(int width, int height, std::vector<uint8_t> rgba, int side) {
  Level level{width, height, std::move(rgba)};
  while (std::max(level.width, level.height) > side) level = halved(level);
  levels_.push_back(std::move(level));
  while (levels_.back().width > 1 || levels_.back().height > 1)
    levels_.push_back(halved(levels_.back()));
}

/// Every texel is the mean of four (of the light, weighted by opacity).
TexturePicture::Level TexturePicture::halved(const Level& level) {
  Level out{std::max(1, level.width / 2), std::max(1, level.height / 2), {}};
  out.rgba.resize(size_t{4} * static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  const auto& light = light_of_bytes();
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      Rgba sum = Rgba::Zero();
      Eigen::Vector3f plain = Eigen::Vector3f::Zero();
      for (int k = 0; k < 4; ++k) {
        const int sx = std::min(2 * x + k % 2, level.width - 1),
                  sy = std::min(2 * y + k / 2, level.height - 1);
        const uint8_t* from =
            &level.rgba[4 * (static_cast<size_t>(sy) * static_cast<size_t>(level.width) +
                             static_cast<size_t>(sx))];
        const Eigen::Vector3f colour(light[from[0]], light[from[1]], light[from[2]]);
        const float opacity = static_cast<float>(from[3]) / 255;
        sum.head<3>() += opacity * colour;
        sum[3] += opacity;
        plain += colour;
      }
      uint8_t* to = &out.rgba[4 * (static_cast<size_t>(y) * static_cast<size_t>(out.width) +
                                   static_cast<size_t>(x))];
      for (int c = 0; c < 3; ++c)
        to[c] = static_cast<uint8_t>(std::lround(
            255 *
            linear_to_srgb(std::clamp(sum[3] > 0 ? sum[c] / sum[3] : plain[c] / 4, 0.0f, 1.0f))));
      to[3] = static_cast<uint8_t>(std::lround(255 * sum[3] / 4));
    }
  return out;
}

Rgba TexturePicture::texel(const Level& level, const Texture& how, int x, int y) const {
  const auto column = static_cast<size_t>(wrapped(x, level.width, how.across)),
             row = static_cast<size_t>(wrapped(y, level.height, how.down));
  const uint8_t* p = &level.rgba[4 * (row * static_cast<size_t>(level.width) + column)];
  const auto& light = light_of_bytes();
  return {light[p[0]], light[p[1]], light[p[2]], static_cast<float>(p[3]) / 255};
}

Rgba TexturePicture::in_level(const Level& level, const Texture& how, const Uv& place) const {
  // Far beyond the picture's edges numbers have no fractions left; int holds what is left.
  constexpr float kFarTexel = 1e8f;
  const float x = std::clamp(place.x() * static_cast<float>(level.width) - 0.5f, -kFarTexel,
                             kFarTexel),
              y = std::clamp(place.y() * static_cast<float>(level.height) - 0.5f, -kFarTexel,
                             kFarTexel);
  const float fx = std::floor(x), fy = std::floor(y);
  const int i = static_cast<int>(fx), j = static_cast<int>(fy);
  const float u = x - fx, v = y - fy;
  return (1 - v) * ((1 - u) * texel(level, how, i, j) + u * texel(level, how, i + 1, j)) +
         v * ((1 - u) * texel(level, how, i, j + 1) + u * texel(level, how, i + 1, j + 1));
}

Rgba TexturePicture::at(const Texture& how, const Uv& at, float texels) const {
  const Uv place = how.transform * Eigen::Vector3f(at.x(), at.y(), 1);
  if (!place.allFinite()) return Rgba::Ones();
  if (how.nearest && !(texels > 1)) {
    const auto cell = [](float x, int n) {
      return static_cast<int>(std::floor(std::clamp(x * static_cast<float>(n), -1e8f, 1e8f)));
    };
    return texel(levels_[0], how, cell(place.x(), width()), cell(place.y(), height()));
  }
  const float last = static_cast<float>(levels_.size() - 1);
  const float level = texels > 1 ? std::min(std::log2(texels), last) : 0;
  const auto low = static_cast<size_t>(level);
  const float share = level - static_cast<float>(low);
  const Rgba near = in_level(levels_[low], how, place);
  if (share <= 0 || low + 1 >= levels_.size()) return near;
  return near + share * (in_level(levels_[low + 1], how, place) - near);
}

std::vector<std::optional<TexturePicture>> decode_pictures(const Appearance& look,
                                                           std::vector<std::string>& remarks) {
  constexpr size_t kMostPictures = 1024;
  int64_t pixels = int64_t{1} << 28;  // pixels of all: some ten seconds of decoding
  int side = TexturePicture::kMostSide;
  for (size_t room = 16; room < look.pictures.size() && side > 256; room *= 4) side /= 2;
  std::vector<std::optional<TexturePicture>> out;
  for (const PictureFile& file : look.pictures) {
    std::string why;
    out.push_back(TexturePicture::decode(file.bytes, &why, side, &pixels));
    // What has no bytes was spoken of by whoever read the file.
    if (!out.back() && !file.bytes.empty())
      remarks.push_back("the picture '" + file.name + "' is not drawn: " + why);
    if (out.size() == kMostPictures) break;
  }
  if (out.size() < look.pictures.size())
    remarks.push_back(
        format("only %zu of %zu pictures are drawn", out.size(), look.pictures.size()));
  out.resize(look.pictures.size());
  return out;
}

}  // namespace restage
