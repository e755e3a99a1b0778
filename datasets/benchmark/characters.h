// The people of the benchmark: from sliders and garments to bodies.
#pragma once

#include "datasets/benchmark/recipe.h"
#include "datasets/importers/makehuman.h"

namespace restage {

/// `rows`: of bodies.csv. The body is of the split "test". InputError for an unknown row or
/// garment.
Body make_character(const CharacterRecipe& recipe, const MakeHuman& model,
                    const std::vector<BodyRecipe>& rows, const RngKey& key);

/// Pushes the scalp outwards by about `thickness`, in locks: an outline as hair has it. The face,
/// ears and neck stay.
void add_hair(Body& body, double thickness, const RngKey& key);

}  // namespace restage
