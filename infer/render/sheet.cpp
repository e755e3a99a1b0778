#include "infer/render/sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/format.h"
#include "infer/render/rasteriser.h"
#include "infer/render/stand.h"
#include "infer/render/style.h"

namespace restage {
namespace {

constexpr int kLabel = 14, kTimes = 34;

struct SheetFrame {
  const Points* points;
  Point centre;  // clip_centre(), or the focus of a close-up
};

struct Layout {
  std::vector<std::vector<SheetFrame>> cells;  // [clip][column]
  std::vector<size_t> moments;
  std::vector<float> floors;
  // Extent that the scale has to leave room for, metres: half the width of the widest figure about
  // its centre, and the height of the tallest one over its floor.
  float half_width = 0.3f, high = 0.5f;
  float before = 0;  // how far figures reach from their centre to the camera, metres
};

std::vector<size_t> moments_of(const std::vector<Clip>& clips, int columns) {
  size_t length = clips[0].frames.size();
  for (const Clip& clip : clips) length = std::min(length, clip.frames.size());
  const size_t count = std::min(length, static_cast<size_t>(std::max(1, columns)));
  std::vector<size_t> moments;
  for (size_t k = 0; k < count; ++k)
    moments.push_back(count == 1 ? length / 2 : k * (length - 1) / (count - 1));
  return moments;
}

Camera camera_of(const SheetOptions& options) {
  Camera camera;
  camera.azimuth = radians(options.azimuth);
  camera.elevation = radians(options.elevation);
  return camera;
}

Layout lay_out(const std::vector<Clip>& clips, const SheetOptions& options) {
  Layout layout;
  layout.moments = moments_of(clips, options.columns);
  const double azimuth = options.azimuth * std::numbers::pi / 180;
  const Point right(static_cast<float>(std::cos(azimuth)), 0,
                    static_cast<float>(-std::sin(azimuth)));
  for (const Clip& clip : clips) {
    const float floor = clip_floor(clip);
    layout.floors.push_back(floor);
    layout.cells.emplace_back();
    for (const size_t moment : layout.moments) {
      const Points& points = clip.frames[moment];
      const Point centre = options.close_up > 0 ? clip.focus.at(moment) : clip_centre(points);
      layout.cells.back().push_back({&points, centre});
      Camera camera = camera_of(options);
      camera.target = centre;
      layout.before = std::max(layout.before, before_target(camera, points, !clip.faces.empty()));
      const ClipReach reach = clip_reach(points, floor);
      for (const Point& p : points) {
        if (!p.allFinite()) continue;
        const float aside = std::abs(right.dot(p - centre)), height = p.y() - floor;
        layout.half_width = std::max(layout.half_width, std::min(aside, reach.aside));
        layout.high = std::max(layout.high, std::min(height, reach.high));
      }
    }
  }
  return layout;
}

Image draw_cell(const Clip& clip, const SheetFrame& frame, float floor, uint32_t colour, int width,
                const Layout& layout, const SheetOptions& options) {
  Canvas canvas(width, options.cell_height);
  Camera camera = camera_of(options);
  const auto reach = static_cast<float>(options.close_up);
  const float tall = reach > 0 ? 2 * reach : 1.16f * layout.high + 0.12f;
  camera.target = frame.centre;
  if (reach <= 0) camera.target.y() = floor + 0.5f * layout.high - 0.01f * tall;
  stand_outside(camera, tall, layout.before);
  canvas.begin(camera, floor, *frame.points, clip.faces);
  if (clip.faces.empty())
    canvas.draw_cloud(*frame.points, colour_of(colour));
  else
    canvas.draw_mesh(*frame.points, clip.faces, colour_of(colour));
  return canvas.image();
}

Rgb bytes_of(uint32_t colour) {
  return {static_cast<uint8_t>(colour >> 16), static_cast<uint8_t>(colour >> 8),
          static_cast<uint8_t>(colour)};
}

}  // namespace

Image contact_sheet(const std::vector<Clip>& clips, const SheetOptions& options) {
  check_clips("", clips);
  const Layout layout = lay_out(clips, options);
  const double per_metre = options.cell_height / (1.16 * layout.high + 0.12);
  const int figure_width =
      std::clamp(static_cast<int>(per_metre * (2.0 * layout.half_width + 0.16)),
                 options.cell_height / 2, options.cell_height * 3 / 2);
  const int cell_width = options.close_up > 0 ? options.cell_height : figure_width;
  const int columns = static_cast<int>(layout.moments.size()),
            rows = static_cast<int>(clips.size());
  const int top = kMargin + (options.title.empty() ? 0 : kTitle),
            row_height = kLabel + options.cell_height;
  Image sheet(2 * kMargin + columns * cell_width, top + rows * row_height + kTimes, kPaper);
  if (!options.title.empty()) draw_text(sheet, kMargin, kMargin - 4, 14, kInk, options.title);
  for (int r = 0; r < rows; ++r) {
    const auto clip = static_cast<size_t>(r);
    const int y = top + r * row_height;
    for (int c = 0; c < columns; ++c)
      paste(sheet,
            draw_cell(clips[clip], layout.cells[clip][c], layout.floors[clip], kClipColours[clip],
                      cell_width, layout, options),
            kMargin + c * cell_width, y + kLabel);
    fill_rectangle(sheet, kMargin, y + 4, 12, 12, bytes_of(kClipColours[clip]));
    draw_text(sheet, kMargin + 20, y + 4, 12, kInk, clips[clip].label);
  }
  for (int c = 0; c < columns && options.fps > 0; ++c) {
    const std::string time = format("%.2f s", static_cast<double>(layout.moments[c]) / options.fps);
    draw_text(sheet, kMargin + c * cell_width + (cell_width - text_width(10, time)) / 2,
              top + rows * row_height + 8, 10, kPale, time);
  }
  return sheet;
}

void write_contact_sheet(const std::string& path, const std::vector<Clip>& clips,
                         const SheetOptions& options) {
  write_png(path, contact_sheet(clips, options));
}

}  // namespace restage
