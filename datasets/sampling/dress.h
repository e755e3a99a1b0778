// Clothes and hair, roughly: extractors and the doctor's model have to know people who are not
// naked.
#pragma once

#include <array>

#include "autograd/base/rng.h"
#include "datasets/corpus.h"

namespace restage {

/// How far clothes stand out from the skin: a thickness for each joint's part of the body, in
/// folds.
struct Outfit {
  std::array<double, kJoints> thick{};  ///< metres
  Point wave = Point::Zero();           ///< folds over the rest surface, radians per metre
  float phase = 0;
  double hair = 0;              ///< over the scalp, metres
  Point skull = Point::Zero();  ///< its middle, at rest
  /// Over a point of the skin whose 22 weights are given, metres.
  float thickness(const float* weights, const Point& at_rest) const;
};

/// A shirt, trousers or shorts, shoes; up to 5 cm. No hair.
Outfit draw_outfit(Rng& rng);
/// The same, and hair on most heads, for somebody with these rest joints.
Outfit draw_outfit(Rng& rng, const Joints& rest);

/// The body with its skin pushed outwards by a random outfit, and with hair on most heads. Joints
/// and weights stay.
Body dressed(const Body& body, const RngKey& key);

/// The same people, all dressed.
Corpus dressed(const Corpus& corpus, uint64_t seed);

/// Pushes the scalp outwards by about `thickness`, in locks: an outline as hair has it. The face,
/// ears and neck stay.
void add_hair(Body& body, double thickness, const RngKey& key);

}  // namespace restage
