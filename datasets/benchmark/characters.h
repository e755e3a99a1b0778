// The people of the benchmark: from sliders and garments to bodies.
#pragma once

#include "datasets/benchmark/recipe.h"
#include "datasets/importers/bodies/makehuman.h"

namespace restage {

/// `rows`: of bodies.csv. The body is of the split "test". InputError for an unknown row or
/// garment.
Body make_character(const CharacterRecipe& recipe, const MakeHuman& model,
                    const std::vector<BodyRecipe>& rows, const RngKey& key);

}  // namespace restage
