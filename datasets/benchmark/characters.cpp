#include "datasets/benchmark/characters.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/error.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

constexpr Eigen::Index kHead = 15;

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

/// 0 on the face and below, 1 on top and behind, seen from the middle of the skull.
double hairiness(const Point& direction) {
  const double up = direction.y(), ahead = direction.z();
  const double line = up - 0.9 * ahead - 0.05;  // from the forehead down behind the ears
  return std::clamp(3.0 * line, 0.0, 1.0);
}

}  // namespace

void add_hair(Body& body, double thickness, const RngKey& key) {
  if (!(thickness > 0)) return;
  const auto on_head = [&](size_t v) { return body.weights(v, kHead) > 0.9f; };
  Points& x = body.rest.vertices;
  Box head;
  for (size_t v = 0; v < x.size(); ++v)
    if (on_head(v)) head.extend(x[v]);
  const Point low = head.min(), high = head.max();
  if (!(high.y() > low.y())) return;
  Point middle = 0.5f * (low + high);
  middle.y() = high.y() - 0.45f * (high.y() - low.y());
  Rng rng(key);
  Eigen::Matrix<double, 6, 3> waves;  // locks: a few waves over the skull
  std::array<double, 6> phase;
  for (int k = 0; k < 6; ++k) {
    for (int c = 0; c < 3; ++c) waves(k, c) = 9.0 * rng.normal();
    phase[k] = rng.uniform(0, 2 * std::numbers::pi);
  }
  for (size_t v = 0; v < x.size(); ++v) {
    if (!on_head(v)) continue;
    const Point way = (x[v] - middle).normalized();
    double lock = 0;
    for (int k = 0; k < 6; ++k)
      lock += std::sin(waves.row(k).dot(way.cast<double>()) + phase[k]) / 6;
    const double out = thickness * hairiness(way) * (1 + 0.8 * lock);
    x[v] += static_cast<float>(out) * way;
  }
}

Body make_character(const CharacterRecipe& c, const MakeHuman& model,
                    const std::vector<BodyRecipe>& rows, const RngKey& key) {
  const BodyRecipe recipe = recipe_of(c, rows);
  Body body = c.garment.empty() ? model.build(recipe) : model.dress(recipe, c.garment);
  add_hair(body, c.hair, key.fold("hair").fold(c.id));
  return body;
}

}  // namespace restage
