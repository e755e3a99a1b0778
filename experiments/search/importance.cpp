#include "experiments/search/importance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "autograd/base/rng.h"

namespace restage::search {
namespace {

constexpr int kTrees = 64;
constexpr size_t kLeastInLeaf = 2;

struct Span {
  int low, high;  ///< levels low to high - 1
};

/// A box of levels and the mean of the results in it.
struct Leaf {
  std::vector<Span> box;
  double value;
};

struct Split {
  double gain = 0;
  size_t factor = 0;
  int level = 0;  ///< the first level of the upper part
};

class Tree {
 public:
  Tree(const std::vector<Factor>& factors, const std::vector<double>& results, Rng rng)
      : factors_(factors), results_(results), rng_(rng) {
    std::vector<size_t> drawn(results.size());  // with repetition
    for (size_t& trial : drawn) trial = rng_.below(results.size());
    std::vector<Span> box;
    for (const Factor& factor : factors) box.push_back({0, factor.levels});
    grow(std::move(drawn), std::move(box));
  }

  /// Adds the shares of the variance over all boxes.
  void add_shares(std::vector<double>* shares) const {
    double mean = 0, square = 0;
    for (const Leaf& leaf : leaves_) {
      mean += volume(leaf) * leaf.value;
      square += volume(leaf) * leaf.value * leaf.value;
    }
    const double variance = square - mean * mean;
    if (variance <= 1e-12 * square) return;
    for (size_t f = 0; f < factors_.size(); ++f) (*shares)[f] += effect(f, mean) / variance;
  }

 private:
  double share(const Span& span, size_t f) const {
    return static_cast<double>(span.high - span.low) / factors_[f].levels;
  }
  double volume(const Leaf& leaf) const {
    double out = 1;
    for (size_t f = 0; f < factors_.size(); ++f) out *= share(leaf.box[f], f);
    return out;
  }
  /// The variance of the means at the levels of a factor.
  double effect(size_t f, double mean) const {
    std::vector<double> at(static_cast<size_t>(factors_[f].levels));
    for (const Leaf& leaf : leaves_)
      for (int l = leaf.box[f].low; l < leaf.box[f].high; ++l)
        at[static_cast<size_t>(l)] += leaf.value * volume(leaf) / share(leaf.box[f], f);
    double out = 0;
    for (const double m : at) out += (m - mean) * (m - mean);
    return out / static_cast<double>(at.size());
  }

  Split best_split(const std::vector<size_t>& trials, size_t f, const Span& span) const {
    std::map<int, std::pair<double, size_t>> levels;  // sum and count
    double all = 0;
    for (const size_t t : trials) {
      auto& [sum, count] = levels[factors_[f].of_trial[t]];
      sum += results_[t];
      ++count;
      all += results_[t];
    }
    Split best{0, f, span.low};
    double sum = 0;
    size_t count = 0;
    int before = -1;
    for (const auto& [level, part] : levels) {
      const size_t above = trials.size() - count;
      if (count >= kLeastInLeaf && above >= kLeastInLeaf) {
        const double n = static_cast<double>(count), m = static_cast<double>(above);
        const double apart = sum / n - (all - sum) / m;
        const double gain = apart * apart * n * m / (n + m);
        // Between two levels that were tried, in the middle.
        if (gain > best.gain) best = {gain, f, (before + level + 1) / 2};
      }
      sum += part.first;
      count += part.second;
      before = level;
    }
    return best;
  }

  void grow(std::vector<size_t> trials, std::vector<Span> box) {
    Split best;
    for (size_t f = 0; f < factors_.size(); ++f) {
      // Now and then a factor is left out, so that trees differ.
      if (factors_.size() > 1 && rng_.below(6) == 0) continue;
      const Split one = best_split(trials, f, box[f]);
      if (one.gain > best.gain) best = one;
    }
    double sum = 0;
    for (const size_t t : trials) sum += results_[t];
    if (best.gain <= 1e-15 || best.level <= box[best.factor].low ||
        best.level >= box[best.factor].high) {
      leaves_.push_back({std::move(box), sum / static_cast<double>(trials.size())});
      return;
    }
    std::vector<size_t> low, high;
    for (const size_t t : trials)
      (factors_[best.factor].of_trial[t] < best.level ? low : high).push_back(t);
    std::vector<Span> upper = box;
    box[best.factor].high = upper[best.factor].low = best.level;
    grow(std::move(low), std::move(box));
    grow(std::move(high), std::move(upper));
  }

  const std::vector<Factor>& factors_;
  const std::vector<double>& results_;
  Rng rng_;
  std::vector<Leaf> leaves_;
};

Factor numbered(const std::vector<double>& values, std::vector<double> sorted) {
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  Factor out{static_cast<int>(sorted.size()), {}};
  for (const double value : values)
    out.of_trial.push_back(
        static_cast<int>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin()));
  return out;
}

}  // namespace

Factor factor_of_numbers(const std::vector<double>& values) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  return numbered(values, sorted);
}

Factor factor_of_names(const std::vector<int>& names, const std::vector<double>& results) {
  std::map<int, std::pair<double, double>> means;  // sum and count
  for (size_t i = 0; i < names.size(); ++i) {
    means[names[i]].first += results[i];
    means[names[i]].second += 1;
  }
  std::vector<std::pair<double, int>> order;
  for (const auto& [name, mean] : means) order.emplace_back(mean.first / mean.second, name);
  std::sort(order.begin(), order.end());
  std::map<int, int> level;
  for (size_t i = 0; i < order.size(); ++i) level[order[i].second] = static_cast<int>(i);
  Factor out{static_cast<int>(order.size()), {}};
  for (const int name : names) out.of_trial.push_back(level[name]);
  return out;
}

std::vector<double> importance(const std::vector<Factor>& factors,
                               const std::vector<double>& results, uint64_t seed) {
  std::vector<double> out(factors.size());
  if (std::ssize(results) < kLeastTrialsForImportance || factors.empty()) return out;
  const RngKey key = RngKey{seed, 0}.fold("importance");
  for (int t = 0; t < kTrees; ++t)
    Tree(factors, results, Rng(key.fold(static_cast<uint64_t>(t)))).add_shares(&out);
  for (double& share : out) share /= kTrees;
  return out;
}

}  // namespace restage::search
