// Many figures on one sheet, each in a cell of its own, all at one scale.
#pragma once

#include <string>
#include <vector>

#include "infer/render/image.h"
#include "nn/geometry/body.h"

namespace restage {

/// A surface, or a cloud when it has no faces. World metres, y up.
struct Figure {
  std::string label;
  Mesh shape;
  uint32_t colour = 0x4a8bc9;  ///< sRGB
  float floor = 0;             ///< height of the ground under it
};

struct GalleryOptions {
  int columns = 11, cell_width = 132, cell_height = 138;  ///< pixels
  double height = 2.15;                                   ///< metres that a cell shows
  double azimuth = 28;  ///< degrees from the front towards the body's left
  double elevation = 8;
  std::string title;  ///< one line at the top; empty: none
};

/// InputError if there are no figures.
Image gallery(const std::vector<Figure>& figures, const GalleryOptions& options = {});

}  // namespace restage
