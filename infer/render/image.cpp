#include "infer/render/image.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace restage {
namespace {

constexpr std::string_view kFont =
#include "infer/render/hershey.inc"
    ;
constexpr double kCapital = 21.0, kTop = -12.0;  // height and top of capitals, in the font's units

struct Stroke {
  double x0, y0, x1, y1;
};

std::string_view glyph(char c) {
  if (c < 32 || c > 126) c = '?';
  size_t start = 0;
  for (int k = 32; k < c; ++k) start = kFont.find('\n', start) + 1;
  return kFont.substr(start, kFont.find('\n', start) - start);
}

/// Adds the lines of which the text is drawn to `strokes` (null: none), in pixels from the text's
/// upper left corner. Returns the width of the text in pixels.
double strokes_of(std::string_view text, double size, std::vector<Stroke>* strokes) {
  const double scale = size / kCapital;
  double pen = 0;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xc0) == 0x80)
      continue;  // a later byte of a UTF-8 character
    const std::string_view g = glyph(c);
    const double left = g[0] - 'R', right = g[1] - 'R';
    bool down = false;
    double x = 0, y = 0;
    for (size_t k = 2; strokes != nullptr && k + 1 < g.size(); k += 2) {
      if (g[k] == ' ') {
        down = false;
        continue;
      }
      const double to_x = pen + scale * (g[k] - 'R' - left), to_y = scale * (g[k + 1] - 'R' - kTop);
      if (down) strokes->push_back({x, y, to_x, to_y});
      x = to_x, y = to_y, down = true;
    }
    pen += scale * (right - left);
  }
  return pen;
}

double distance(const Stroke& s, double x, double y) {
  const double dx = s.x1 - s.x0, dy = s.y1 - s.y0, square = dx * dx + dy * dy;
  const double t =
      square > 0 ? std::clamp(((x - s.x0) * dx + (y - s.y0) * dy) / square, 0.0, 1.0) : 0;
  return std::hypot(x - s.x0 - t * dx, y - s.y0 - t * dy);
}

void blend(Image& image, int x, int y, Rgb colour, double share) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  uint8_t* pixel = &image.rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(image.width) +
                                   static_cast<size_t>(x))];
  for (size_t k = 0; k < 3; ++k)
    pixel[k] = static_cast<uint8_t>(std::lround(pixel[k] + share * (colour[k] - pixel[k])));
}

/// What the encoder calls with each piece of a file.
void append(void* context, void* data, int size) {
  static_cast<std::string*>(context)->append(static_cast<const char*>(data),
                                             static_cast<size_t>(size));
}

}  // namespace

Image::Image(int w, int h, Rgb fill) : width(w), height(h) {
  rgb.resize(3 * static_cast<size_t>(w) * static_cast<size_t>(h));
  for (size_t k = 0; k < rgb.size(); ++k) rgb[k] = fill[k % 3];
}

Rgb Image::at(int x, int y) const {
  const size_t k =
      3 * (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x));
  return {rgb[k], rgb[k + 1], rgb[k + 2]};
}

void paste(Image& image, const Image& part, int x, int y) {
  for (int row = std::max(0, -y); row < part.height && y + row < image.height; ++row)
    for (int column = std::max(0, -x); column < part.width && x + column < image.width; ++column)
      blend(image, x + column, y + row, part.at(column, row), 1.0);
}

void fill_rectangle(Image& image, int x, int y, int width, int height, Rgb colour) {
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) blend(image, x + column, y + row, colour, 1.0);
}

void draw_text(Image& image, int x, int y, double size, Rgb colour, std::string_view text) {
  std::vector<Stroke> strokes;
  strokes_of(text, size, &strokes);
  const double pen = std::max(0.55, 0.055 * size);  // half the width of a line
  std::vector<double> nearest;
  const int width = text_width(size, text) + 4, height = static_cast<int>(1.6 * size) + 4;
  nearest.assign(static_cast<size_t>(width) * static_cast<size_t>(height), 1e9);
  for (const Stroke& s : strokes) {
    const int x0 = std::max(0, static_cast<int>(std::min(s.x0, s.x1) - pen) - 1);
    const int y0 = std::max(0, static_cast<int>(std::min(s.y0, s.y1) - pen) - 1);
    for (int v = y0; v < std::min<double>(height, std::max(s.y0, s.y1) + pen + 2); ++v)
      for (int u = x0; u < std::min<double>(width, std::max(s.x0, s.x1) + pen + 2); ++u) {
        double& least = nearest[v * width + u];
        least = std::min(least, distance(s, u + 0.5, v + 0.5));
      }
  }
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      blend(image, x + u, y + v, colour, std::clamp(pen + 0.5 - nearest[v * width + u], 0.0, 1.0));
}

int text_width(double size, std::string_view text) {
  return static_cast<int>(std::ceil(strokes_of(text, size, nullptr)));
}

std::string png_bytes(const Image& image) {
  std::string bytes;
  if (stbi_write_png_to_func(append, &bytes, image.width, image.height, 3, image.rgb.data(),
                             3 * image.width) == 0)
    throw WorkError("png: the picture could not be encoded; make it smaller");
  return bytes;
}

void write_png(const std::string& path, const Image& image) {
  write_file_atomically(path, png_bytes(image));
}

void write_jpeg(const std::string& path, const Image& image) {
  constexpr int kQuality = 85;  // of 100
  std::string bytes;
  if (stbi_write_jpg_to_func(append, &bytes, image.width, image.height, 3, image.rgb.data(),
                             kQuality) == 0)
    throw WorkError("jpeg: the picture could not be encoded; make it smaller");
  write_file_atomically(path, bytes);
}

}  // namespace restage
