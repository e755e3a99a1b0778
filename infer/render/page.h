// One self-contained HTML page that plays clips side by side: no network, opens from disk.
#pragma once

#include "infer/render/clip.h"

namespace restage {

struct PageOptions {
  double fps = kFps;
  std::string title = "restage";
  /// The page stays below about this size: first frames are left out (up to every fourth is kept;
  /// the page interpolates surfaces), then surfaces are thinned, then more frames go. What was done
  /// stands at the foot of the page.
  size_t max_bytes = 30'000'000;
  size_t max_points = 2048;  ///< of a cloud, per frame
};

/// The page as text. Positions are stored as 16-bit steps of the clip's bounding box (a walk over
/// 6 m: 0.1 mm). Draws with WebGL, or a 2D canvas where there is none. The part of an address after
/// '#' may hold 2d, dark, light and frame=N, joined by '&'. Clips as check_clips() wants them, else
/// InputError. Points of a cloud more than 4 m from its middle are left out.
std::string page_html(const std::vector<Clip>& clips, const PageOptions& options = {});
/// Appears whole or not at all.
void write_page(const std::string& path, const std::vector<Clip>& clips,
                const PageOptions& options = {});

}  // namespace restage
