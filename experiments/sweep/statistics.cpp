#include "experiments/sweep/statistics.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "autograd/base/rng.h"

namespace restage::tables {
namespace {

bool present(double x) { return std::isfinite(x); }

/// Those that have a mean.
Sample measured(const Sample& sample) {
  Sample out;
  std::copy_if(sample.begin(), sample.end(), std::back_inserter(out),
               [](const Repetition& r) { return present(r.mean); });
  return out;
}

double average(const std::map<std::string, double>& sequences) {
  double sum = 0, count = 0;
  for (const auto& [name, value] : sequences)
    if (present(value)) sum += value, count += 1;
  return count > 0 ? sum / count : std::nan("");
}

/// Values beside a mask of what is there, [trials, sequences]. Rows are shifted so that their
/// averages are the means as told; a trial without sequences has its mean in every column.
struct Matrix {
  Eigen::MatrixXd values, mask;
};

Matrix matrix_of(const Sample& sample) {
  std::set<std::string> names;
  for (const Repetition& r : sample)
    for (const auto& [name, value] : r.sequences)
      if (present(value)) names.insert(name);
  const auto columns = static_cast<Eigen::Index>(std::max<size_t>(1, names.size()));
  const auto rows = static_cast<Eigen::Index>(sample.size());
  Matrix m{Eigen::MatrixXd::Zero(rows, columns), Eigen::MatrixXd::Zero(rows, columns)};
  for (Eigen::Index k = 0; k < rows; ++k) {
    const Repetition& r = sample[static_cast<size_t>(k)];
    const double own = average(r.sequences);
    if (!present(own)) {
      m.values.row(k).setConstant(r.mean);
      m.mask.row(k).setOnes();
      continue;
    }
    Eigen::Index s = 0;
    for (const std::string& name : names) {
      const auto found = r.sequences.find(name);
      if (found != r.sequences.end() && present(found->second)) {
        m.values(k, s) = found->second + (r.mean - own);
        m.mask(k, s) = 1;
      }
      ++s;
    }
  }
  return m;
}

void draw_counts(const RngKey& key, Eigen::MatrixXf* counts) {
  counts->setZero();
  Rng rng(key);
  const auto n = static_cast<uint64_t>(counts->cols());
  for (Eigen::Index r = 0; r < counts->rows(); ++r)
    for (uint64_t i = 0; i < n; ++i) (*counts)(r, static_cast<Eigen::Index>(rng.below(n))) += 1;
}

}  // namespace

Sample paired_difference(const Sample& a, const Sample& b) {
  std::map<std::string, const Repetition*> others;
  for (const Repetition& r : b)
    if (present(r.mean)) others.emplace(r.key, &r);
  Sample out;
  for (const Repetition& r : measured(a)) {
    const auto other = others.find(r.key);
    if (other == others.end() || other->second == nullptr) continue;
    Repetition difference{r.key, r.mean - other->second->mean, {}};
    for (const auto& [name, value] : r.sequences) {
      const auto same = other->second->sequences.find(name);
      if (same != other->second->sequences.end() && present(value) && present(same->second))
        difference.sequences[name] = value - same->second;
    }
    // Sequences that only one of the two has say nothing about the difference.
    const bool all = difference.sequences.size() == r.sequences.size() &&
                     difference.sequences.size() == other->second->sequences.size();
    if (!all && !difference.sequences.empty()) difference.mean = average(difference.sequences);
    out.push_back(std::move(difference));
    other->second = nullptr;
  }
  return out;
}

double largest_contradiction(const Sample& sample) {
  double largest = 0;
  for (const Repetition& r : sample) {
    const double own = average(r.sequences);
    const double scale = std::max(std::abs(own), std::abs(r.mean));
    if (present(own) && present(r.mean) && scale > 0)
      largest = std::max(largest, std::abs(own - r.mean) / scale);
  }
  return largest;
}

double quantile(std::span<const double> sorted, double q) {
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(at);
  if (below + 1 >= sorted.size()) return sorted.back();
  const double low = sorted[below], high = sorted[below + 1];
  return low + (at - static_cast<double>(below)) * (high - low);
}

const Bootstrap::Draws& Bootstrap::draws(Eigen::Index trials, Eigen::Index sequences) {
  const auto [at, is_new] = draws_.try_emplace({trials, sequences});
  Draws& d = at->second;
  if (is_new) {
    d.trials.resize(resamples_, trials);
    d.sequences.resize(resamples_, sequences);
    const RngKey key = RngKey{seed_}.fold("bootstrap");
    draw_counts(key.fold("trials"), &d.trials);
    draw_counts(key.fold("sequences"), &d.sequences);
  }
  return d;
}

Estimate Bootstrap::estimate(const Sample& all) {
  const Sample sample = measured(all);
  Estimate out;
  out.n = static_cast<int>(sample.size());
  if (sample.empty()) return out;
  const auto n = static_cast<double>(sample.size());
  double sum = 0, squares = 0;
  for (const Repetition& r : sample) sum += r.mean;
  out.mean = sum / n;
  for (const Repetition& r : sample) squares += (r.mean - *out.mean) * (r.mean - *out.mean);
  if (out.n > 1) out.deviation = std::sqrt(squares / (n - 1));

  const Matrix m = matrix_of(sample);
  if (m.values.size() == 1) return out;
  const Draws& d = draws(m.values.rows(), m.values.cols());
  // Of every resample and trial: the sum over the drawn sequences, and how many there were.
  const Eigen::MatrixXd drawn = d.sequences.cast<double>();
  const Eigen::MatrixXd sums = drawn * m.values.transpose(), counts = drawn * m.mask.transpose();
  std::vector<double> means;
  means.reserve(static_cast<size_t>(resamples_));
  for (Eigen::Index r = 0; r < sums.rows(); ++r) {
    double total = 0, weight = 0;
    for (Eigen::Index k = 0; k < sums.cols(); ++k) {
      if (counts(r, k) == 0) continue;
      const auto times = static_cast<double>(d.trials(r, k));
      total += times * sums(r, k) / counts(r, k);
      weight += times;
    }
    if (weight > 0) means.push_back(total / weight);
  }
  if (means.empty()) return out;
  std::sort(means.begin(), means.end());
  out.low = quantile(means, 0.025);
  out.high = quantile(means, 0.975);
  return out;
}

}  // namespace restage::tables
