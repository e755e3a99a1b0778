// What `restage view` is asked for, and which options contradict one another.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "experiments/pictures/rows.h"
#include "experiments/pictures/view.h"
#include "infer/render/image.h"

namespace restage::cli {

inline constexpr const char* kRemembered = "source";

struct ViewOptions {
  ShowRequest request;
  std::string out, size, side, background, title;
  std::string compare;  ///< a path, or kRemembered
  Comparison beside;
  std::optional<double> fps, zoom, azimuth;
  std::optional<int64_t> every, columns;

  bool rows = false;  ///< also where nothing is beside the file (render)

  /// What is shown alike: two characters or recordings, and in an animation any two files.
  bool two_takes() const;
  bool compares() const { return rows || !compare.empty() || !beside.truth.empty(); }
};

enum class ViewKind { picture, sheet, webp, gif, page };

ViewKind kind_of(const ViewOptions& o);
inline bool is_animation(ViewKind kind) { return kind == ViewKind::webp || kind == ViewKind::gif; }
/// InputError for what is out of range, what the kind of picture has no use for, and what belongs
/// to others that are not there.
void check_view(const ViewOptions& o, ViewKind kind);

/// Degrees from the front towards the body's left.
double azimuth_of(const ViewOptions& o);
/// "640x480" as width and height.
std::pair<int, int> parse_size(const std::string& text);
Rgb parse_colour(const std::string& text);

}  // namespace restage::cli
