#include "infer/render/gallery.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/error.h"
#include "infer/render/clip.h"
#include "infer/render/rasteriser.h"

namespace restage {
namespace {

constexpr Rgb kPaper = {0xf7, 0xf8, 0xfa}, kInk = {0x2b, 0x30, 0x38};
constexpr int kMargin = 14, kLabel = 16, kTitle = 26;
constexpr float kView = 0.36f;  // a long lens, as on contact sheets

Image draw(const Figure& figure, const GalleryOptions& options) {
  Canvas canvas(options.cell_width, options.cell_height);
  const Point centre = clip_centre(figure.shape.vertices);
  const auto radians = [](double degrees) {
    return static_cast<float>(degrees * std::numbers::pi / 180);
  };
  Camera camera;
  camera.azimuth = radians(options.azimuth);
  camera.elevation = radians(options.elevation);
  camera.view = kView;
  const auto tall = static_cast<float>(options.height);
  camera.distance = 0.5f * tall / std::tan(0.5f * kView);
  camera.target = {centre.x(), figure.floor + 0.46f * tall, centre.z()};
  canvas.begin(camera, figure.floor, figure.shape.vertices, figure.shape.faces);
  if (figure.shape.faces.empty())
    canvas.draw_cloud(figure.shape.vertices, colour_of(figure.colour));
  else
    canvas.draw_mesh(figure.shape.vertices, figure.shape.faces, colour_of(figure.colour));
  return canvas.image();
}

}  // namespace

Image gallery(const std::vector<Figure>& figures, const GalleryOptions& options) {
  if (figures.empty()) throw InputError("", "there is nothing to draw", "give some figures");
  const int count = static_cast<int>(figures.size());
  const int columns = std::clamp(options.columns, 1, count);
  const int rows = (count + columns - 1) / columns;
  const int top = kMargin + (options.title.empty() ? 0 : kTitle);
  Image sheet(2 * kMargin + columns * options.cell_width,
              top + rows * (options.cell_height + kLabel) + kMargin, kPaper);
  if (!options.title.empty()) draw_text(sheet, kMargin, kMargin - 2, 12, kInk, options.title);
  for (int i = 0; i < count; ++i) {
    const Figure& figure = figures[static_cast<size_t>(i)];
    const int x = kMargin + i % columns * options.cell_width;
    const int y = top + i / columns * (options.cell_height + kLabel);
    paste(sheet, draw(figure, options), x, y);
    const int room = std::max(0, (options.cell_width - text_width(7, figure.label)) / 2);
    draw_text(sheet, x + room, y + options.cell_height + 3, 7, kInk, figure.label);
  }
  return sheet;
}

}  // namespace restage
