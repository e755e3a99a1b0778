// Cloth around both legs at once: a skirt, the lower part of a dress or of a coat. Training clouds
// have it because the legs below it cannot be seen (dress.h has clothes that follow the skin).
#pragma once

#include <vector>

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// Places along the legs: 0 is the height of the hips, 1 that of the knees, 2 that of the ankles.
struct Skirt {
  double hem = 1;    ///< where it ends; it begins a little above the hips
  double ease = 0;   ///< metres between the widest part of the body above and the cloth
  double flare = 0;  ///< metres that the radius gains from one place to the next
  double folds = 0;  ///< depth of the folds at the hem, metres
  int fold_count = 8;
  double phase = 0;
};
Skirt draw_skirt(Rng& rng);

/// Points under the skirt of somebody with these joints make way for points of the skirt, one for
/// one, as far down the legs and about the same leg; normals point outwards. The cloth is
/// taut between the legs. `legs`: which points are of legs or hips; no others move.
void put_on(const Skirt& skirt, const Joints& joints, const std::vector<bool>& legs, Rng& rng,
            Points& points, Points& normals);

}  // namespace restage
