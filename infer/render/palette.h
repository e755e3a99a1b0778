// Few colours in the place of many, for GIF.
#pragma once

#include <cstdint>
#include <vector>

#include "infer/render/image.h"

namespace restage {

class Palette {
 public:
  /// At most `count` colours (1 to 256) that are near those of the pictures: the box of colours
  /// that is spread widest is halved until there are as many (Heckbert's median cut, 1982). The
  /// most frequent colour stays exactly as it is.
  Palette(const std::vector<Image>& pictures, size_t count);
  const std::vector<Rgb>& colours() const { return colours_; }

  /// Numbers of colours, row by row. Where no colour is near, neighbouring pixels have colours
  /// whose mean is: an ordered dither, so that what does not change keeps its pixels.
  std::vector<uint8_t> indices(const Image& picture);

 private:
  uint8_t nearest(const Rgb& colour);

  std::vector<Rgb> colours_;
  std::vector<int16_t> known_;  ///< nearest colour by the upper 6 bits of each channel; -1: unknown
};

}  // namespace restage
