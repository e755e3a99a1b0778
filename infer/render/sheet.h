// The contact sheet: rows are clips, columns are moments.
#pragma once

#include "infer/render/clip.h"
#include "infer/render/image.h"

namespace restage {

struct SheetOptions {
  int columns = 8;         ///< moments, spread evenly over the length of the shortest clip
  int cell_height = 300;   ///< pixels
  double azimuth = 32;     ///< degrees from the front towards the body's left
  double elevation = 9;    ///< degrees
  double close_up = 0;     ///< metres shown to either side of Clip::focus; 0: whole figures
  double fps = kFps;       ///< of the clips, for the times under the columns; 0: no times
  std::string title = {};  ///< a line at the top; empty: no line
};

/// In every cell the camera looks from the same direction, at the same scale, and follows the
/// figure over the ground, so that sizes can be compared. InputError: see check_clips().
Image contact_sheet(const std::vector<Clip>& clips, const SheetOptions& options = {});
/// Writes contact_sheet() as PNG; the file appears whole or not at all.
void write_contact_sheet(const std::string& path, const std::vector<Clip>& clips,
                         const SheetOptions& options = {});

/// Colours (sRGB) of the first, second and third clip, on sheets and on pages.
inline constexpr uint32_t kClipColours[3] = {0x4a8bc9, 0xe8a06c, 0x86bd96};

}  // namespace restage
