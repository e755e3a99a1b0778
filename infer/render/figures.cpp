#include "infer/render/figures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/error.h"
#include "infer/render/clip.h"
#include "infer/render/rasteriser.h"

namespace restage {
namespace {

constexpr Rgb kPaper = {0xf7, 0xf8, 0xfa}, kInk = {0x2b, 0x30, 0x38}, kPale = {0x7a, 0x83, 0x90};
constexpr int kMargin = 22, kTitle = 34, kCaption = 24, kLine = 20, kWidest = 1800;
constexpr float kView = 0.36f;                        // a long lens: little perspective
constexpr float kMostAside = 1.6f, kMostHigh = 3.2f;  // stray points may lie anywhere

float radians(double degrees) { return static_cast<float>(degrees * std::numbers::pi / 180); }

/// What all cells show, metres.
struct Extent {
  float aside = 0.3f, high = 0.5f;
};

Extent extent_of(const std::vector<Figure>& figures) {
  Extent out;
  for (const Figure& figure : figures) {
    const Point centre = clip_centre(figure.layers[0].points);
    for (const Point& p : figure.layers[0].points) {
      if (!p.allFinite()) continue;
      const Point off = p - centre;
      out.aside = std::max(out.aside, std::min(std::hypot(off.x(), off.z()), kMostAside));
      out.high = std::max(out.high, std::min(p.y() - figure.floor, kMostHigh));
    }
  }
  return out;
}

Image draw(const Figure& figure, const Extent& extent, int width, int height) {
  Canvas canvas(width, height);
  Camera camera;
  camera.azimuth = radians(figure.azimuth);
  camera.elevation = radians(figure.elevation);
  camera.view = kView;
  const float tall = 1.16f * std::max(extent.high, extent.aside) + 0.12f;
  camera.distance = 0.5f * tall / std::tan(0.5f * kView);
  const Point centre = clip_centre(figure.layers[0].points);
  camera.target = {centre.x(), figure.floor + 0.5f * extent.high, centre.z()};
  const FigureLayer& first = figure.layers[0];
  canvas.begin(camera, figure.floor, first.points, first.faces);
  for (const FigureLayer& layer : figure.layers) {
    if (layer.faces.empty())
      canvas.draw_cloud(layer.points, colour_of(layer.colour));
    else
      canvas.draw_mesh(layer.points, layer.faces, colour_of(layer.colour));
  }
  return canvas.image();
}

/// As much of the text as fits.
std::string fitting(double size, std::string text, int width) {
  while (!text.empty() && text_width(size, text) > width) text.pop_back();
  return text;
}

}  // namespace

Image figure_sheet(const std::vector<Figure>& figures, const FigureSheetOptions& options) {
  if (figures.empty()) throw InputError("", "there is nothing to draw", "give at least one figure");
  for (const Figure& figure : figures)
    if (figure.layers.empty() || figure.layers[0].points.empty())
      throw InputError("", "\"" + figure.caption + "\" is empty", "leave such figures out");
  const Extent extent = extent_of(figures);
  const double per_metre =
      options.cell_height / (1.16 * std::max(extent.high, extent.aside) + 0.12);
  int wanted = static_cast<int>(per_metre * (2.0 * extent.aside + 0.16));
  for (const Figure& figure : figures)
    wanted = std::max(wanted, text_width(10, figure.caption) + 8);
  const int cell_width = std::clamp(wanted, options.cell_height / 2, options.cell_height * 3 / 2);
  const int count = static_cast<int>(figures.size()), columns = std::min(count, options.columns),
            rows = (count + columns - 1) / columns;
  const int top = kMargin + (options.title.empty() ? 0 : kTitle),
            row_height = options.cell_height + kCaption,
            lines = static_cast<int>(options.lines.size());
  int width = std::max(2 * kMargin + columns * cell_width,
                       std::min(2 * kMargin + text_width(14, options.title), kWidest));
  for (const std::string& line : options.lines)
    width = std::max(width, std::min(2 * kMargin + text_width(11, line), kWidest));
  Image sheet(width, top + rows * row_height + lines * kLine + kMargin, kPaper);
  const int room = width - 2 * kMargin;
  draw_text(sheet, kMargin, kMargin - 4, 14, kInk, fitting(14, options.title, room));
  for (int i = 0; i < count; ++i) {
    const int x = kMargin + i % columns * cell_width, y = top + i / columns * row_height;
    const Figure& figure = figures[static_cast<size_t>(i)];
    paste(sheet, draw(figure, extent, cell_width, options.cell_height), x, y);
    const std::string caption = fitting(10, figure.caption, cell_width - 4);
    draw_text(sheet, x + (cell_width - text_width(10, caption)) / 2, y + options.cell_height + 4,
              10, kPale, caption);
  }
  for (int i = 0; i < lines; ++i)
    draw_text(sheet, kMargin, top + rows * row_height + i * kLine + 6, 11, kInk,
              fitting(11, options.lines[static_cast<size_t>(i)], room));
  return sheet;
}

}  // namespace restage
