// `restage data build RECIPE`: the open benchmark as a folder (docs/benchmark.md).
#pragma once

#include <string>

#include "datasets/benchmark/recipe.h"

namespace restage {

struct BenchmarkSummary {
  size_t files = 0;
  uint64_t bytes = 0;
};

/// Builds `out` from a data folder (docs/formats.md: body/ and cmu/). It appears whole or not at
/// all; it may be there already if it is empty. `recipe_text` is kept in it as recipe.yaml. The
/// bytes depend on recipe, text and data only. InputError: the recipe or the data is wrong, `out`
/// is taken. WorkError: disk full. Interrupted: stopped by a signal, nothing is left.
BenchmarkSummary build_benchmark(const BenchmarkRecipe& recipe, const std::string& recipe_text,
                                 const std::string& where, const std::string& data,
                                 const std::string& out);

}  // namespace restage
