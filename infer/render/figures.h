// A sheet of single figures: bodies, poses, scans, each in a cell of its own with a caption.
#pragma once

#include <string>
#include <vector>

#include "infer/render/image.h"
#include "nn/geometry/body.h"

namespace restage {

/// Points or a surface of one colour (sRGB).
struct FigureLayer {
  Points points;
  std::vector<Triangle> faces;  ///< empty: a cloud
  uint32_t colour = 0x4a8bc9;
};

/// Metres, y up. The view contains the first `framed` layers, but for a few points far away.
struct Figure {
  std::vector<FigureLayer> layers;
  std::string caption;
  double azimuth = 32, elevation = 9;  ///< degrees, as SheetOptions
  float floor = 0;
  size_t framed = 1;
  bool whole = false;  ///< a scale of its own, at which every point of all layers is in view
};

struct FigureSheetOptions {
  int columns = 8, cell_height = 260;
  std::string title;               ///< a line at the top; empty: none
  std::vector<std::string> lines;  ///< under the figures
};

/// The scale is the same in all cells but those that are `whole`. InputError if there are no
/// figures, or one is empty.
Image figure_sheet(const std::vector<Figure>& figures, const FigureSheetOptions& options = {});

}  // namespace restage
