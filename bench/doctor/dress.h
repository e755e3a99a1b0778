// Clothes and hair, roughly: the doctor's model has to know people who are not naked.
#pragma once

#include "autograd/base/rng.h"
#include "datasets/corpus.h"

namespace restage::bench {

/// The body with its skin pushed outwards as a random outfit would (shirt, trousers or shorts,
/// shoes; up to 5 cm, in folds) and with hair on most heads. Joints and weights stay.
Body dressed(const Body& body, const RngKey& key);

/// The same people, all dressed.
Corpus dressed(const Corpus& corpus, uint64_t seed);

}  // namespace restage::bench
