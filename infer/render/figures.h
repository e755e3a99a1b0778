// A sheet of single figures (bodies, poses, scans), each in its own cell, with a caption.
#pragma once

#include <string>
#include <vector>

#include "infer/render/image.h"
#include "nn/geometry/body.h"

namespace restage {

/// A cloud or a surface in one colour (sRGB).
struct FigureLayer {
  Points points;
  std::vector<Triangle> faces;  ///< empty: a cloud
  uint32_t colour = 0x4a8bc9;
};

/// Metres, y up. The view is chosen so that the first `framed` layers can be seen, except a few
/// points that are far away.
struct Figure {
  std::vector<FigureLayer> layers;
  std::string caption;
  double azimuth = 32, elevation = 9;  ///< degrees, as SheetOptions
  float floor = 0;
  size_t framed = 1;
  bool whole =
      false;  ///< the cell has its own scale, at which every point of all layers is in view
};

struct FigureSheetOptions {
  int columns = 8, cell_height = 260;
  std::string title;               ///< a line at the top; empty: none
  std::vector<std::string> lines;  ///< under the figures
};

/// All figures are drawn at the same scale, except those that are `whole`. InputError if there are
/// no figures, or if a figure has no points.
Image figure_sheet(const std::vector<Figure>& figures, const FigureSheetOptions& options = {});

}  // namespace restage
