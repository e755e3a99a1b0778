#include "bench/doctor/fit.h"

#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "autograd/base/parallel.h"
#include "autograd/base/rng.h"
#include "datasets/doctor/orientation_model.h"

namespace restage::bench {
namespace {

using namespace doctor_detail;

constexpr double kPi = 3.14159265358979323846;
constexpr int kFitHeadings = 8;  // headings further apart than where the fitted model is asked
constexpr int kUp = 2;           // +y is the true one
constexpr size_t kDrawn = 8;     // of the 40 turns under other up axes; they count five times
constexpr size_t kTurns = kFitHeadings + kDrawn;
constexpr size_t kBatch = 32;
constexpr double kRate = 0.05;

Eigen::Matrix3f fit_turn(int up, int heading) {
  return hypothesis(up, heading * (kHeadings / kFitHeadings));
}

size_t true_turn() {
  size_t i = 0;
  while (!fit_turn(kUp, static_cast<int>(i)).isIdentity(1e-4f)) ++i;
  return i;
}

/// One scan under some turns: what is seen, what kinds it is taken for, and the probabilities less
/// the truth.
struct Example {
  std::array<Places, kTurns> seen;
  std::array<std::vector<float>, kTurns> kinds;
  std::array<float, kTurns> error;
  double loss = 0;
};

void examine(const Points& scan, Rng rng, size_t n_kinds, std::span<const float> coefficients,
             size_t truth, Example& out) {
  // Another heading each time.
  const Eigen::Matrix3f start = turn_about_y(rng.uniform(-5, 5) * kPi / 180).cast<float>();
  constexpr uint64_t kOthers = (kUps - 1) * kFitHeadings / kDrawn;
  float most = -1e30f, total = 0;
  for (size_t t = 0; t < kTurns; ++t) {
    int up = kUp, heading = static_cast<int>(t);
    if (t >= kFitHeadings) {  // one of each five neighbours in the list of the others
      const auto other = static_cast<int>(kOthers * (t - kFitHeadings) + rng.below(kOthers));
      up = other / kFitHeadings;
      if (up >= kUp) ++up;
      heading = other % kFitHeadings;
    }
    look(scan, fit_turn(up, heading) * start, out.seen[t]);
    out.kinds[t].resize(n_kinds);
    out.error[t] = score(coefficients, out.seen[t], out.kinds[t].data());
    if (t >= kFitHeadings) out.error[t] += std::log(static_cast<float>(kOthers));
    most = std::max(most, out.error[t]);
  }
  for (float& e : out.error) total += (e = std::exp(e - most));
  for (float& e : out.error) e /= total;
  float& right = out.error[truth];
  out.loss = -std::log(std::max(right, 1e-9f));
  right -= 1;
}

/// Mean gradient of the coefficients of kind `k`.
void add_gradient(const std::vector<Example>& batch, size_t k, double decay,
                  const std::vector<float>& coefficients, std::vector<float>& gradient) {
  float* to = gradient.data() + k * kPlaces;
  for (size_t i = 0; i < kPlaces; ++i)
    to[i] = static_cast<float>(decay) * coefficients[k * kPlaces + i];
  for (const Example& e : batch)
    for (size_t t = 0; t < e.seen.size(); ++t) {
      const float error = e.error[t] * e.kinds[t][k] / kBatch;
      if (std::abs(error) < 1e-7f) continue;
      for (size_t i = 0; i < e.seen[t].place.size(); ++i)
        to[e.seen[t].place[i]] += error * e.seen[t].share[i];
    }
}

class Adam {
 public:
  explicit Adam(size_t n) : mean_(n), square_(n) {}
  void step(std::vector<float>& x, const std::vector<float>& gradient, double rate) {
    ++steps_;
    const double a = 1 - std::pow(0.9, steps_), b = 1 - std::pow(0.999, steps_);
    for (size_t i = 0; i < x.size(); ++i) {
      mean_[i] = 0.9 * mean_[i] + 0.1 * gradient[i];
      square_[i] = 0.999 * square_[i] + 0.001 * gradient[i] * gradient[i];
      x[i] -= static_cast<float>(rate * (mean_[i] / a) / (std::sqrt(square_[i] / b) + 1e-8));
    }
  }

 private:
  std::vector<double> mean_, square_;
  int steps_ = 0;
};

/// Kinds start as different scans, else they would stay alike.
void start_kinds(const std::vector<Points>& clouds, size_t kinds, size_t truth, Rng& rng,
                 std::vector<float>& coefficients) {
  Places first;
  for (size_t k = 0; kinds > 1 && k < kinds; ++k) {
    look(clouds[rng.below(clouds.size())], fit_turn(kUp, static_cast<int>(truth)), first);
    for (size_t i = 0; i < first.place.size(); ++i)
      coefficients[k * kPlaces + static_cast<size_t>(first.place[i])] = 4 * first.share[i];
  }
}

}  // namespace

std::vector<float> fit_orientation_prior(const std::vector<Points>& clouds,
                                         const FitOptions& options,
                                         void (*say)(const std::string&)) {
  std::vector<float> coefficients(options.kinds * kPlaces), gradient(coefficients.size());
  std::vector<size_t> order(clouds.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::vector<Example> batch(kBatch);
  Adam adam(coefficients.size());
  const RngKey key = RngKey{options.seed, 0}.fold("fit orientation");
  Rng rng(key);
  const size_t truth = true_turn();
  start_kinds(clouds, options.kinds, truth, rng, coefficients);
  const size_t steps = order.size() / kBatch;
  for (int epoch = 0; epoch < options.epochs; ++epoch) {
    for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.below(i)]);
    double loss = 0;
    for (size_t step = 0; step < steps; ++step) {
      parallel_for(kBatch, 4, [&](int64_t begin, int64_t end) {
        for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
          const size_t at = step * kBatch + i;
          examine(clouds[order[at]], Rng(key.fold(static_cast<uint64_t>(epoch)).fold(at)),
                  options.kinds, coefficients, truth, batch[i]);
        }
      });
      for (const Example& e : batch) loss += e.loss;
      parallel_for(static_cast<int64_t>(options.kinds), 1, [&](int64_t begin, int64_t end) {
        for (auto k = static_cast<size_t>(begin); k < static_cast<size_t>(end); ++k)
          add_gradient(batch, k, options.decay, coefficients, gradient);
      });
      const double done =
          (epoch + static_cast<double>(step) / static_cast<double>(steps)) / options.epochs;
      adam.step(coefficients, gradient, kRate * (0.5 + 0.5 * std::cos(kPi * done)) + 1e-5);
    }
    say("epoch " + std::to_string(epoch + 1) + ": mean -log p(true turn) " +
        std::to_string(loss / static_cast<double>(steps * kBatch)));
  }
  return coefficients;
}

}  // namespace restage::bench
