// The contact sheet: rows are clips, columns are moments.
#pragma once

#include "infer/render/clip.h"
#include "infer/render/image.h"

namespace restage {

struct SheetOptions {
  int columns = 8;         ///< moments, spread evenly over the common length (at most its frames)
  int cell_height = 300;   ///< pixels
  double azimuth = 32;     ///< degrees from the front towards the body's left
  double elevation = 9;    ///< degrees
  double close_up = 0;     ///< metres to either side of the clips' focus; 0: whole figures
  double fps = kFps;       ///< for the times under the columns; 0: none
  std::string title = {};  ///< one line at the top; empty: none
};

/// All cells of a column have the same camera, which follows the figure of its own clip level over
/// the ground; the scale is the same in all cells, so sizes compare. Clips as check_clips() wants
/// them, else InputError.
Image contact_sheet(const std::vector<Clip>& clips, const SheetOptions& options = {});
/// contact_sheet() as PNG; appears whole or not at all.
void write_contact_sheet(const std::string& path, const std::vector<Clip>& clips,
                         const SheetOptions& options = {});

/// Colours (sRGB) of the first, second and third clip, here and on the page.
inline constexpr uint32_t kClipColours[3] = {0x4a8bc9, 0xe8a06c, 0x86bd96};

}  // namespace restage
