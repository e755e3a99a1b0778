// An HTML page that plays clips side by side. The page is one file, needs no network and opens from
// disk.
#pragma once

#include "infer/render/clip.h"

namespace restage {

struct PageOptions {
  double fps = kFps;  ///< of the clips
  std::string title = "restage";
  std::vector<std::string> notes = {};  ///< lines of text at the foot
  /// Size below which the page stays, about. If the clips are too large, frames are left out first
  /// (at least every fourth frame stays; the page interpolates surfaces between frames), then
  /// surfaces get fewer vertices, then more frames are left out. The foot of the page says what was
  /// left out.
  size_t max_bytes = 30'000'000;
  size_t max_points = 2048;   ///< of a cloud, in a frame
  bool labels_below = false;  ///< labels stand under the clips, not over them
  /// The page shows the first frame, and then what its server sends (live/server.h): places of the
  /// one clip's vertices, of which none may have been left out.
  bool live = false;
  /// Of a live page: of each vertex of the clip its vertex in what the server sends, which has
  /// `sent` vertices; empty: they are the same.
  std::vector<int32_t> live_vertex = {};
  size_t sent = 0;
};

/// The page as text. Positions are stored as 16-bit fractions of the clip's bounding box; for a
/// walk over 6 m a step is 0.1 mm. Points of a cloud that are more than 4 m from the cloud's middle
/// are left out. The page draws with WebGL; where there is no WebGL, with a 2D canvas. After '#',
/// the page's address may hold the words 2d, dark, light and frame=N, joined by '&'. InputError:
/// see check_clips().
std::string page_html(const std::vector<Clip>& clips, const PageOptions& options = {});
/// The file appears whole or not at all.
void write_page(const std::string& path, const std::vector<Clip>& clips,
                const PageOptions& options = {});

}  // namespace restage
