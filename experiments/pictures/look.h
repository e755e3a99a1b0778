// Where a camera looks: at whole figures, or close at a part of a body.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "infer/render/clip.h"
#include "nn/geometry/skeleton.h"

namespace restage {

struct Look {
  /// "head", "hands", "left-hand", "right-hand", "feet", or a joint's name; empty: whole figures.
  std::string part;
  std::optional<double> within;  ///< metres to either side; nothing: as the part needs
};

/// InputError: there is no such part.
void check_look(const Look& look);

struct Aim {
  std::vector<Point> focus;  ///< Clip::focus
  double close_up = 0;       ///< metres to either side: SheetOptions, FilmOptions::close_up
};

/// A close-up of `look` in every frame; nothing of both where whole figures are asked for. Heads,
/// hands and feet of a surface are shown whole, however large they are on this body. `frames`: of
/// `clip`.
Aim aim_at(const std::vector<Joints>& frames, const Look& look, const Clip& clip);

/// Where hips and shoulders face, degrees from +z to +x.
double facing(const Joints& joints);

}  // namespace restage
