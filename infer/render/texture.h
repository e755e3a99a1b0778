// Pictures of a surface, decoded, and what is seen of them at a place.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nn/geometry/appearance.h"

namespace restage {

/// A picture and its halves, quarters, ... down to one texel, so that it can be seen from afar
/// without flicker.
class TexturePicture {
 public:
  static constexpr int kMostSide = 2048;
  /// PNG, JPEG or WebP of at most 16,384 x 16,384 and 64 million pixels; kept with at most `side`
  /// on each side. Nothing if it cannot be decoded, and then `why` says why not. `room`: pixels
  /// that may still be decoded; the picture's are taken off.
  static std::optional<TexturePicture> decode(std::string_view bytes, std::string* why,
                                              int side = kMostSide, int64_t* room = nullptr);
  /// `rgba`: sRGB and opacity, rows from the top.
  TexturePicture(int width, int height, std::vector<uint8_t> rgba, int side = kMostSide);

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  /// The colour at texture coordinates `at`, by linear interpolation between texels. `texels`: how
  /// many texels of the whole picture, along one axis, the sample covers.
  Rgba at(const Texture& how, const Uv& at, float texels) const;

 private:
  struct Level {
    int width, height;
    std::vector<uint8_t> rgba;
  };
  static Level halved(const Level& level);
  Rgba texel(const Level& level, const Texture& how, int x, int y) const;
  Rgba in_level(const Level& level, const Texture& how, const Uv& place) const;

  std::vector<Level> levels_;
};

/// All pictures of an appearance, in its order; nothing in the place of one that cannot be decoded.
/// A remark for each of these. The more there are, the smaller they are kept: together they take
/// less than 400 MB. Beyond 1,024 pictures, or 268 million pixels of all, there are none.
std::vector<std::optional<TexturePicture>> decode_pictures(const Appearance& look,
                                                           std::vector<std::string>& remarks);

}  // namespace restage
