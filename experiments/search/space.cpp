#include "experiments/search/space.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace restage::search {
namespace {

constexpr int kMostDraws = 2000;  ///< of a point, before chance is said to find none

/// Numbers of a file that others share must not depend on the locale.
double five_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return std::strtod(text, nullptr);
}

Point draw(const Space& space, Rng& rng) {
  Point out;
  for (const Dimension& dimension : space) out.push_back(value_at(dimension, rng.uniform()));
  return out;
}

bool contains(const std::vector<Point>& points, const Point& point) {
  return std::find(points.begin(), points.end(), point) != points.end();
}

}  // namespace

double rounded(const Dimension& dimension, double value) {
  if (dimension.kind == Dimension::Kind::choice)
    return std::clamp(std::floor(value), 0.0, static_cast<double>(dimension.choices.size()) - 1);
  const double at = dimension.whole() ? std::round(value) : five_digits(value);
  return std::clamp(at, dimension.low, dimension.high);
}

double value_at(const Dimension& dimension, double place) {
  if (dimension.kind == Dimension::Kind::choice)
    return rounded(dimension, place * static_cast<double>(dimension.choices.size()));
  // The ends of whole numbers are met as often as those between them.
  const double half = dimension.whole() ? 0.5 : 0;
  const double low = dimension.low - half, high = dimension.high + half;
  const double value = dimension.logarithmic()
                           ? std::exp(std::log(low) + place * (std::log(high) - std::log(low)))
                           : low + place * (high - low);
  return rounded(dimension, value);
}

std::string number_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

ConfigNode node_of(const Dimension& dimension, double value) {
  ConfigNode out;
  if (dimension.kind == Dimension::Kind::choice) {
    out = dimension.choices.at(static_cast<size_t>(value));
  } else {
    out.kind = ConfigNode::Kind::scalar;
    out.text = number_text(value);
  }
  out.place = out.key_place = dimension.place;
  return out;
}

double size_of(const Space& space) {
  double out = 1;
  for (const Dimension& dimension : space) {
    if (dimension.kind == Dimension::Kind::choice)
      out *= static_cast<double>(dimension.choices.size());
    else if (dimension.whole())
      out *= dimension.high - dimension.low + 1;
    else if (dimension.low < dimension.high)
      return INFINITY;
  }
  return out;
}

std::optional<Point> random_point(const Space& space, Rng& rng, const std::vector<Point>& taken) {
  for (int i = 0; i < kMostDraws; ++i)
    if (Point point = draw(space, rng); !contains(taken, point)) return point;
  return std::nullopt;
}

std::vector<Point> random_points(const Space& space, uint64_t seed, int count) {
  Rng rng(RngKey{seed, 0}.fold("random search"));
  std::vector<Point> out;
  while (std::ssize(out) < count) {
    auto point = random_point(space, rng, out);
    if (!point) break;
    out.push_back(std::move(*point));
  }
  return out;
}

std::vector<Point> latin_points(const Space& space, uint64_t seed, int count) {
  Rng rng(RngKey{seed, 0}.fold("latin hypercube"));
  const auto n = static_cast<size_t>(count);
  std::vector<Point> wanted(n, Point(space.size()));
  for (size_t d = 0; d < space.size(); ++d) {
    std::vector<size_t> part(n);
    for (size_t i = 0; i < n; ++i) part[i] = i;
    for (size_t i = n; i > 1; --i) std::swap(part[i - 1], part[rng.below(i)]);
    for (size_t i = 0; i < n; ++i)
      wanted[i][d] = value_at(
          space[d], (static_cast<double>(part[i]) + rng.uniform()) / static_cast<double>(n));
  }
  std::vector<Point> out;
  for (Point& point : wanted)
    if (!contains(out, point)) out.push_back(std::move(point));
  while (out.size() < n) {
    auto point = random_point(space, rng, out);
    if (!point) break;
    out.push_back(std::move(*point));
  }
  return out;
}

}  // namespace restage::search
