#include "infer/render/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "autograd/base/error.h"
#include "infer/render/clip.h"
#include "infer/render/rasteriser.h"
#include "infer/render/style.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr int kCaption = 24, kLine = 20, kWidest = 1800;
constexpr float kAround = 1.08f, kRim = 0.12f;  // room around the points: a factor, and metres
constexpr float kWidestCell = 1.5f;             // width of the widest cell, in heights of the cell
constexpr float kFarAway = 4.0f;  // a point this many times farther away than nine in ten points
                                  // may be out of view

/// The points of a figure that have to be in view.
Points framed_points(const Figure& figure) {
  Points out;
  for (size_t k = 0; k < figure.layers.size() && (figure.whole || k < figure.framed); ++k)
    for (const Point& p : figure.layers[k].points)
      if (p.allFinite()) out.push_back(p);
  if (figure.whole || out.empty()) return out;
  const Point centre = clip_centre(out);
  std::vector<float> away;
  for (const Point& p : out) away.push_back((p - centre).norm());
  const auto most = away.begin() + static_cast<std::ptrdiff_t>(away.size() * 9 / 10);
  std::nth_element(away.begin(), most, away.end());
  const float limit = kFarAway * *most;
  std::erase_if(out, [&](const Point& p) { return (p - centre).norm() > limit; });
  return out;
}

/// The camera of a figure, and half the width and half the height that the camera has to show,
/// metres.
struct FigureView {
  Camera camera;
  float aside = 0, tall = 0;
};

/// The view of a figure, in which `points`, its framed_points(), can be seen, and all heights from
/// `low` to `high` over the floor.
FigureView view_of(const Figure& figure, const Points& points, float low, float high) {
  FigureView out;
  Camera& camera = out.camera;
  camera.azimuth = radians(figure.azimuth);
  camera.elevation = radians(figure.elevation);
  camera.view = kView;
  if (!points.empty()) camera.target = box_of(points).center();
  camera.target.y() = figure.floor + 0.5f * (low + high);
  const float ca = std::cos(camera.azimuth), sa = std::sin(camera.azimuth),
              ce = std::cos(camera.elevation), se = std::sin(camera.elevation),
              nearer = std::tan(0.5f * kView);  // a point nearer to the camera needs more room
  const Point right(ca, 0, -sa), eye(sa * ce, se, ca * ce), up = eye.cross(right);
  out.tall = 0.5f * (high - low) * ce;
  for (const Point& p : points) {
    const Point off = p - camera.target;
    const float closer = nearer * off.dot(eye);
    out.aside =
        std::max(out.aside, std::abs(off.dot(right)) + kWidestCell * std::max(0.0f, closer));
    out.tall = std::max(out.tall, std::abs(off.dot(up)) + closer);
  }
  return out;
}

/// The height in metres of a cell that shows `view`, if the cell is `wide` times as wide as it is
/// high.
float cell_metres(const FigureView& view, float wide) {
  return 2 * kAround * std::max(view.tall, view.aside / wide) + kRim;
}

/// The views of all figures. Figures that share a scale have their floors at the same height of
/// their cells.
std::vector<FigureView> views_of(const std::vector<Figure>& figures) {
  std::vector<Points> points;
  float low = std::numeric_limits<float>::max(), high = -low;
  const auto levels = [](const Figure& figure, const Points& of, float& from, float& to) {
    for (const Point& p : of) {
      from = std::min(from, p.y() - figure.floor);
      to = std::max(to, p.y() - figure.floor);
    }
  };
  for (const Figure& figure : figures) {
    points.push_back(framed_points(figure));
    if (!figure.whole) levels(figure, points.back(), low, high);
  }
  std::vector<FigureView> out;
  for (size_t i = 0; i < figures.size(); ++i) {
    float from = low, to = high;
    if (figures[i].whole) {
      from = std::numeric_limits<float>::max(), to = -from;
      levels(figures[i], points[i], from, to);
    }
    if (from > to) from = to = 0;  // the figure has no finite point
    out.push_back(view_of(figures[i], points[i], from, to));
  }
  return out;
}

Image draw(const Figure& figure, Camera camera, float metres, int width, int height) {
  Canvas canvas(width, height);
  camera.distance = 0.5f * metres / std::tan(0.5f * kView);
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

/// The beginning of the text, as long as it is at most `width` pixels wide.
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
  const std::vector<FigureView> views = views_of(figures);
  FigureView shared;  // large enough for every figure that shares the scale
  for (size_t i = 0; i < figures.size(); ++i)
    if (!figures[i].whole || figures.size() == 1) {
      shared.aside = std::max(shared.aside, views[i].aside);
      shared.tall = std::max(shared.tall, views[i].tall);
    }
  const float metres = cell_metres(shared, kWidestCell);
  int wanted = static_cast<int>(static_cast<float>(options.cell_height) / metres *
                                (2 * kAround * shared.aside + kRim));
  for (const Figure& figure : figures)
    wanted = std::max(wanted, text_width(10, figure.caption) + 8);
  const int cell_width = std::clamp(wanted, options.cell_height / 2, options.cell_height * 3 / 2);
  const float wide = static_cast<float>(cell_width) / static_cast<float>(options.cell_height);
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
    const Figure& figure = figures[i];
    const FigureView& view = views[i];
    const float here = figure.whole ? cell_metres(view, wide) : metres;
    paste(sheet, draw(figure, view.camera, here, cell_width, options.cell_height), x, y);
    const std::string caption = fitting(10, figure.caption, cell_width - 4);
    draw_text(sheet, x + (cell_width - text_width(10, caption)) / 2, y + options.cell_height + 4,
              10, kPale, caption);
  }
  for (int i = 0; i < lines; ++i)
    draw_text(sheet, kMargin, top + rows * row_height + i * kLine + 6, 11, kInk,
              fitting(11, options.lines[i], room));
  return sheet;
}

}  // namespace restage
