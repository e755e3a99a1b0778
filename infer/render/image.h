// Pictures of 8 bits per channel, small text on them, PNG and JPEG.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace restage {

using Rgb = std::array<uint8_t, 3>;

struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;  ///< rows from the top
  Image() = default;
  Image(int w, int h, Rgb fill);
  Rgb at(int x, int y) const;
};

/// Copies `part` into `image` with the upper left corner of `part` at (x, y). Pixels of `part` that
/// lie outside `image` are left out.
void paste(Image& image, const Image& part, int x, int y);
void fill_rectangle(Image& image, int x, int y, int width, int height, Rgb colour);
/// Draws smooth text whose upper left corner is at (x, y) and whose capitals are about `size`
/// pixels high. The font has ASCII only; any other character is drawn as '?'.
void draw_text(Image& image, int x, int y, double size, Rgb colour, std::string_view text);
/// The width of the text in pixels.
int text_width(double size, std::string_view text);

std::string png_bytes(const Image& image);
/// The file appears whole or not at all.
void write_png(const std::string& path, const Image& image);
/// Likewise; a quarter of the bytes, and small text stays readable.
void write_jpeg(const std::string& path, const Image& image);

}  // namespace restage
