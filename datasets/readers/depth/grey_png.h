// Depth pictures as PNG: one channel of 16 bits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace restage {

struct GreyPicture {
  int width = 0, height = 0;
  std::vector<uint16_t> values;  ///< row by row from the top
};

bool is_png_name(const std::string& path);

/// Whether a file begins as a PNG of one channel of 16 bits does. False for what cannot be read.
bool is_grey_png(const std::string& path);

/// InputError: no PNG, a picture of colours or of 8 bits, a damaged or huge one.
GreyPicture read_grey_png(const std::string& path);

}  // namespace restage
