#include "experiments/search/tpe.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace restage::search {
namespace {

constexpr int kCandidates = 24;
constexpr double kGoodShare = 0.1;
constexpr size_t kMostGood = 25;
constexpr size_t kFullWeight = 25;   ///< so many of the latest points count fully
constexpr double kBandwidth = 0.2;   ///< of a single kernel, in widths of the dimension
constexpr size_t kLeastResults = 2;  ///< below, nothing is known yet

/// Values as kernels see them: logarithms of a logarithmic dimension.
double inside(const Dimension& d, double value) {
  return d.logarithmic() ? std::log(value) : value;
}

struct Range {
  double low, high;
  double width() const { return high - low; }
};

/// What the kernels of a dimension may cover; whole numbers own half a step on both sides.
Range range_of(const Dimension& d) {
  const double half = d.whole() ? 0.5 : 0;
  return {inside(d, d.low - half), inside(d, d.high + half)};
}

/// The normal distribution between two places, as its standard deviations from the centre.
double mass(double from, double to) {
  // On the side where the two terms are small their difference keeps its digits.
  if (from > 0) return 0.5 * (std::erfc(from * M_SQRT1_2) - std::erfc(to * M_SQRT1_2));
  return 0.5 * (std::erfc(-to * M_SQRT1_2) - std::erfc(-from * M_SQRT1_2));
}

double log_of(double x) { return std::log(std::max(x, std::numeric_limits<double>::min())); }

/// A mixture with a kernel at each point and a broad one over the whole space.
class Density {
 public:
  Density(const Space& space, const std::vector<const Point*>& points)
      : space_(space), points_(points) {
    const double n = static_cast<double>(points.size());
    const double shrink = std::pow(std::max(n, 1.0), -1 / (static_cast<double>(space.size()) + 4));
    share_ = std::clamp(kBandwidth * shrink, 1 / std::min(100.0, n + 2), 1.0);
    for (size_t i = 0; i < points.size(); ++i) weights_.push_back(weight(i, points.size()));
    weights_.push_back(1);  // of the broad one
    for (const double w : weights_) sum_ += w;
  }

  Point draw(Rng& rng) const {
    double left = rng.uniform() * sum_;
    size_t k = 0;
    while (k + 1 < weights_.size() && (left -= weights_[k]) >= 0) ++k;
    Point out;
    for (size_t d = 0; d < space_.size(); ++d) out.push_back(draw(d, k, rng));
    return out;
  }

  double log_density(const Point& at) const {
    std::vector<double> terms;
    for (size_t k = 0; k < weights_.size(); ++k) {
      double term = std::log(weights_[k] / sum_);
      for (size_t d = 0; d < space_.size(); ++d) term += log_kernel(d, k, at[d]);
      terms.push_back(term);
    }
    const double most = *std::max_element(terms.begin(), terms.end());
    double sum = 0;
    for (const double term : terms) sum += std::exp(term - most);
    return most + std::log(sum);
  }

 private:
  /// Older points count less once there are many.
  static double weight(size_t i, size_t n) {
    if (n < kFullWeight || i + kFullWeight >= n) return 1;
    const double least = 1 / static_cast<double>(n), steps = static_cast<double>(n - kFullWeight);
    return least + (1 - least) * static_cast<double>(i) / steps;
  }
  bool broad(size_t k) const { return k == points_.size(); }

  double centre(size_t d, size_t k) const {
    const Range range = range_of(space_[d]);
    return broad(k) ? 0.5 * (range.low + range.high) : inside(space_[d], (*points_[k])[d]);
  }
  double deviation(size_t d, size_t k) const {
    return range_of(space_[d]).width() * (broad(k) ? 1 : share_);
  }
  /// Of a choice: how likely the kernel's own value is beside the others.
  double choice_share(size_t d, size_t k, double value) const {
    const auto n = static_cast<double>(space_[d].choices.size());
    if (broad(k)) return 1 / n;
    const double others = 1 / static_cast<double>(weights_.size());
    return (others + ((*points_[k])[d] == value ? 1 : 0)) / (n * others + 1);
  }

  double draw(size_t d, size_t k, Rng& rng) const {
    const Dimension& dimension = space_[d];
    if (dimension.kind == Dimension::Kind::choice) {
      double left = rng.uniform();
      size_t c = 0;
      while (c + 1 < dimension.choices.size() &&
             (left -= choice_share(d, k, static_cast<double>(c))) >= 0)
        ++c;
      return static_cast<double>(c);
    }
    const Range range = range_of(dimension);
    double at = centre(d, k);
    for (int i = 0; i < 100; ++i) {  // at least every third falls inside
      const double x = centre(d, k) + deviation(d, k) * rng.normal();
      if (x < range.low || x > range.high) continue;
      at = x;
      break;
    }
    return rounded(dimension, dimension.logarithmic() ? std::exp(at) : at);
  }

  double log_kernel(size_t d, size_t k, double value) const {
    const Dimension& dimension = space_[d];
    if (dimension.kind == Dimension::Kind::choice) return std::log(choice_share(d, k, value));
    const Range range = range_of(dimension);
    if (range.width() <= 0) return 0;
    const double mu = centre(d, k), sigma = deviation(d, k);
    const double all = log_of(mass((range.low - mu) / sigma, (range.high - mu) / sigma));
    if (dimension.whole())
      return log_of(mass((inside(dimension, value - 0.5) - mu) / sigma,
                         (inside(dimension, value + 0.5) - mu) / sigma)) -
             all;
    const double z = (inside(dimension, value) - mu) / sigma;
    return -0.5 * z * z - std::log(sigma * std::sqrt(2 * M_PI)) - all;
  }

  const Space& space_;
  std::vector<const Point*> points_;
  std::vector<double> weights_;
  double sum_ = 0;
  double share_ = 1;  ///< a kernel's deviation, in widths of its dimension
};

/// Good and bad, each in the order of asking. What runs or has failed is bad.
struct Halves {
  std::vector<const Point*> good, bad;
};

Halves divide(const std::vector<Told>& told) {
  std::vector<size_t> ranked;
  for (size_t i = 0; i < told.size(); ++i)
    if (told[i].value && std::isfinite(*told[i].value)) ranked.push_back(i);
  size_t over = 0;
  for (const Told& one : told) over += one.value.has_value();
  std::stable_sort(ranked.begin(), ranked.end(),
                   [&](size_t a, size_t b) { return *told[a].value < *told[b].value; });
  const auto tenth = static_cast<size_t>(std::ceil(kGoodShare * static_cast<double>(over)));
  ranked.resize(std::min({ranked.size(), tenth, kMostGood}));
  Halves out;
  for (size_t i = 0; i < told.size(); ++i) {
    const bool good = std::find(ranked.begin(), ranked.end(), i) != ranked.end();
    (good ? out.good : out.bad).push_back(&told[i].point);
  }
  return out;
}

}  // namespace

std::optional<Point> propose(const Space& space, const std::vector<Told>& told,
                             const TpeOptions& options) {
  Rng rng(RngKey{options.seed, 0}.fold("tpe").fold(told.size()));
  std::vector<Point> taken;
  for (const Told& one : told) taken.push_back(one.point);
  if (told.size() < static_cast<size_t>(options.startup)) {
    const std::vector<Point> design = latin_points(space, options.seed, options.startup);
    for (size_t i = told.size(); i < design.size(); ++i)
      if (std::find(taken.begin(), taken.end(), design[i]) == taken.end()) return design[i];
  }
  const auto known = static_cast<size_t>(std::count_if(
      told.begin(), told.end(), [](const Told& t) { return t.value && std::isfinite(*t.value); }));
  if (known < kLeastResults) return random_point(space, rng, taken);
  const Halves halves = divide(told);
  const Density good(space, halves.good), bad(space, halves.bad);
  std::optional<Point> best;
  double most = 0;
  for (int i = 0; i < kCandidates; ++i) {
    Point candidate = good.draw(rng);
    if (std::find(taken.begin(), taken.end(), candidate) != taken.end()) continue;
    const double gain = good.log_density(candidate) - bad.log_density(candidate);
    if (best && gain <= most) continue;
    most = gain;
    best = std::move(candidate);
  }
  return best ? best : random_point(space, rng, taken);
}

}  // namespace restage::search
