// Where a search looks: the keys that it varies and the values that each may take; and designs that
// need no results, random points and Latin hypercubes. The same seed gives the same points.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "autograd/base/rng.h"
#include "nn/config/config_tree.h"

namespace restage::search {

/// One key and its values.
struct Dimension {
  enum class Kind { uniform, log_uniform, integer, log_integer, choice };
  std::string key;  ///< dotted and full
  Kind kind = Kind::uniform;
  double low = 0, high = 1;              ///< both ends belong to it; unused by a choice
  std::vector<ConfigNode> choices = {};  ///< of a choice
  ConfigPlace place = {};                ///< of the key

  bool whole() const { return kind == Kind::integer || kind == Kind::log_integer; }
  bool logarithmic() const { return kind == Kind::log_uniform || kind == Kind::log_integer; }
};
using Space = std::vector<Dimension>;

/// As written in sweep files, in the order of Dimension::Kind.
inline constexpr const char* kDimensionKinds[] = {"uniform", "log_uniform", "integer",
                                                  "log_integer", "choice"};

/// A value for each dimension; of a choice, its index.
using Point = std::vector<double>;

/// The value at a place between 0 and 1 along the dimension (on a logarithmic one, of its
/// logarithm). Numbers are rounded to five digits, so that what is written is what was meant.
double value_at(const Dimension& dimension, double place);
/// `value`, rounded as value_at() rounds and moved into the dimension.
double rounded(const Dimension& dimension, double value);
/// A number as text that reads back to the same bits.
std::string number_text(double value);
/// The value as a node of a configuration, placed at the dimension's key.
ConfigNode node_of(const Dimension& dimension, double value);

/// How many different points there are; infinite with a continuous dimension.
double size_of(const Space& space);

/// A point that is not among `taken`. Nothing if there is none left, or if chance finds none in
/// many draws.
std::optional<Point> random_point(const Space& space, Rng& rng, const std::vector<Point>& taken);
/// Different points, as many as there are up to `count`. The first ones are the same for any count.
std::vector<Point> random_points(const Space& space, uint64_t seed, int count);
/// A Latin hypercube (McKay et al. 1979): each dimension is cut into `count` equal parts and every
/// part is used once. Points that come out equal (of few whole numbers or choices) are replaced by
/// random ones.
std::vector<Point> latin_points(const Space& space, uint64_t seed, int count);

}  // namespace restage::search
