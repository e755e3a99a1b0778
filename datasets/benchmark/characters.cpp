#include "datasets/benchmark/characters.h"

#include <algorithm>

#include "autograd/base/error.h"
#include "datasets/sampling/dress.h"

namespace restage {
namespace {

BodyRecipe recipe_of(const CharacterRecipe& c, const std::vector<BodyRecipe>& rows) {
  BodyRecipe out;
  if (c.body.empty()) {
    const ShapeRecipe& s = c.shape;
    out.values = {{"gender", s.gender}, {"age", s.age},       {"muscle", s.muscle},
                  {"weight", s.weight}, {"height", s.height}, {"proportions", s.proportions},
                  {"african", 1.0},     {"asian", 1.0},       {"caucasian", 1.0}};
  } else {
    const auto row =
        std::find_if(rows.begin(), rows.end(), [&](const BodyRecipe& r) { return r.id == c.body; });
    if (row == rows.end())
      throw InputError("bodies.csv", "has no body '" + c.body.substr(0, 40) + "'",
                       "name one of its rows");
    out = *row;
  }
  out.id = c.id;
  out.split = "test";
  return out;
}

}  // namespace

Body make_character(const CharacterRecipe& c, const MakeHuman& model,
                    const std::vector<BodyRecipe>& rows, const RngKey& key) {
  const BodyRecipe recipe = recipe_of(c, rows);
  Body body = c.garment.empty() ? model.build(recipe) : model.dress(recipe, c.garment);
  add_hair(body, c.hair, key.fold("hair").fold(c.id));
  return body;
}

}  // namespace restage
