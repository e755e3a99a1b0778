// What an extractor remembers of the frame before when it is trained on single clouds.
#pragma once

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// Joints as an extractor may have answered them to the frame before, and its trust in them.
struct Memory {
  Joints joints;                        ///< metres
  std::array<double, kJoints> trust{};  ///< as SkeletonInput::past has it
};

/// `truth` with errors as long as a drawn uncertainty says: of the whole body 3 to 60 mm, of a
/// joint about that, and errors of neighbours alike. One memory in sixteen has left and right
/// exchanged, one in thirty is `elsewhere`: an extractor must not follow it for ever.
Memory draw_memory(Rng& rng, const Joints& truth, const Joints& elsewhere);

}  // namespace restage
