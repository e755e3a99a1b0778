#include "experiments/sweep/statistics.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

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

double average(const std::map<std::string, double>& sequences,
               const std::vector<std::string>& names) {
  double sum = 0;
  for (const std::string& name : names) sum += sequences.at(name);
  return sum / static_cast<double>(names.size());
}

double square(double x) { return x * x; }

double variance(const std::vector<double>& x) {
  double sum = 0, squares = 0;
  for (const double v : x) sum += v;
  const auto n = static_cast<double>(x.size());
  for (const double v : x) squares += square(v - sum / n);
  return squares / (n - 1);
}

/// Names of the sequences on which every trial has a value.
std::vector<std::string> shared_sequences(const Sample& sample) {
  std::vector<std::string> out;
  for (const auto& one : sample[0].sequences)
    if (std::all_of(sample.begin(), sample.end(), [&](const Repetition& r) {
          const auto found = r.sequences.find(one.first);
          return found != r.sequences.end() && present(found->second);
        }))
      out.push_back(one.first);
  return out;
}

/// Mean squares of a two-way table: of trials and sequences, and of what is left.
std::vector<Part> parts_of(const Sample& sample) {
  const std::vector<std::string> names = shared_sequences(sample);
  const int n = static_cast<int>(sample.size()), s = static_cast<int>(names.size());
  std::vector<double> rows, columns(names.size());
  for (const Repetition& r : sample) rows.push_back(r.mean);
  for (size_t k = 0; k < names.size(); ++k)
    for (const Repetition& r : sample) columns[k] += r.sequences.at(names[k]) / n;
  if (n == 1 && s < 2) return {};
  if (n == 1) return {{variance(columns) / s, s - 1}};
  if (s < 2) return {{variance(rows) / n, n - 1}};
  double all = 0, left = 0;
  for (const double c : columns) all += c / s;
  for (const Repetition& r : sample) {
    const double own = average(r.sequences, names);
    for (size_t k = 0; k < names.size(); ++k)
      left += square(r.sequences.at(names[k]) - own - columns[k] + all);
  }
  const double cells = static_cast<double>(n) * s;
  left /= (n - 1) * (s - 1);
  return {{std::max(0.0, s * variance(rows) - left) / cells, n - 1},
          {std::max(0.0, n * variance(columns) - left) / cells, s - 1},
          {left / cells, (n - 1) * (s - 1)}};
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

// Abramowitz and Stegun, 26.7.3 and 26.7.4.
double student(double t, int freedom) {
  const double angle = std::atan(t / std::sqrt(freedom)), s = std::sin(angle), c = std::cos(angle);
  const bool odd = freedom % 2 == 1;
  double term = odd ? c : 1, sum = freedom == 1 ? 0 : term;
  for (int k = odd ? 3 : 2; k < freedom; k += 2) sum += term *= c * c * (k - 1) / k;
  return odd ? (angle + s * sum) * 2 / M_PI : s * sum;
}

double student_quantile(double share, int freedom) {
  double low = 0, high = 1;
  while (student(high, freedom) < share && high < 1e15) high *= 2;
  for (int i = 0; i < 100 && high - low > 1e-14 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (student(middle, freedom) < share ? low : high) = middle;
  }
  return high;
}

double Estimate::half_width(double alpha) const {
  double sum = 0;
  for (const Part& part : parts)
    if (part.variance > 0) sum += square(student_quantile(1 - alpha, part.freedom)) * part.variance;
  return std::sqrt(sum);
}

double Estimate::p_beyond(double border) const {
  if (parts.empty() || !mean) return 1;
  const double away = std::abs(*mean - border);
  double inside = 0, beyond = 1;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (inside + beyond);
    (half_width(middle) > away ? inside : beyond) = middle;
  }
  return beyond;
}

Estimate estimate(const Sample& all) {
  constexpr double kAlpha = 0.05;
  const Sample sample = measured(all);
  Estimate out;
  out.n = static_cast<int>(sample.size());
  if (sample.empty()) return out;
  std::vector<double> means;
  for (const Repetition& r : sample) means.push_back(r.mean);
  double sum = 0;
  for (const double mean : means) sum += mean;
  out.mean = sum / out.n;
  if (out.n > 1) out.deviation = std::sqrt(variance(means));
  out.parts = parts_of(sample);
  if (out.parts.empty()) return out;
  const double half = out.half_width(kAlpha);
  out.low = *out.mean - half;
  out.high = *out.mean + half;
  return out;
}

}  // namespace restage::tables
