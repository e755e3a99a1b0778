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
constexpr int kFitHeadings = 8, kTurns = kUps * kFitHeadings;  // headings further apart than where
                                                               // the fitted model is asked
constexpr size_t kBatch = 32;
constexpr double kRate = 0.05, kDecay = 1e-5;

Eigen::Matrix3f fit_turn(int i) {
  return hypothesis(i / kFitHeadings, i % kFitHeadings * (kHeadings / kFitHeadings));
}

int true_turn() {
  for (int i = 0; i < kTurns; ++i)
    if (fit_turn(i).isIdentity(1e-4f)) return i;
  return -1;
}

/// One scan under all turns: what is seen, what kinds it is taken for, and the probabilities less
/// the truth.
struct Example {
  std::array<Places, kTurns> seen;
  std::array<std::array<float, kKinds>, kTurns> kinds;
  std::array<float, kTurns> error;
  double loss = 0;
};

void examine(const Points& scan, double turned, std::span<const float> coefficients, int truth,
             Example& out) {
  const Eigen::Matrix3f start = turn_about_y(turned).cast<float>();
  float most = -1e30f, total = 0;
  for (int i = 0; i < kTurns; ++i) {
    look(scan, fit_turn(i) * start, out.seen[static_cast<size_t>(i)]);
    out.error[static_cast<size_t>(i)] = score(coefficients, out.seen[static_cast<size_t>(i)],
                                              out.kinds[static_cast<size_t>(i)].data());
    most = std::max(most, out.error[static_cast<size_t>(i)]);
  }
  for (float& e : out.error) total += (e = std::exp(e - most));
  for (float& e : out.error) e /= total;
  float& right = out.error[static_cast<size_t>(truth)];
  out.loss = -std::log(std::max(right, 1e-9f));
  right -= 1;
}

/// Mean gradient of the coefficients of kind `k`.
void add_gradient(const std::vector<Example>& batch, int64_t k,
                  const std::vector<float>& coefficients, std::vector<float>& gradient) {
  float* to = gradient.data() + k * kPlaces;
  for (int i = 0; i < kPlaces; ++i)
    to[i] = static_cast<float>(kDecay) * coefficients[static_cast<size_t>(k * kPlaces + i)];
  for (const Example& e : batch)
    for (size_t t = 0; t < e.seen.size(); ++t) {
      const float error = e.error[t] * e.kinds[t][static_cast<size_t>(k)] / kBatch;
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

}  // namespace

std::vector<float> fit_orientation_prior(const ScanMaker& scans, const FitOptions& options,
                                         void (*say)(const std::string&)) {
  std::vector<Points> clouds(options.scans);
  parallel_for(static_cast<int64_t>(clouds.size()), 64, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i)
      clouds[static_cast<size_t>(i)] =
          normalised(scans.make(static_cast<uint64_t>(i)).points).points;
  });
  std::vector<float> coefficients(kKinds * kPlaces), gradient(coefficients.size());
  std::vector<size_t> order(clouds.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::vector<Example> batch(kBatch);
  Adam adam(coefficients.size());
  Rng rng(RngKey{options.seed, 0}.fold("fit orientation"));
  const int truth = true_turn();
  Places first;  // kinds start as different scans, else they would stay alike
  for (size_t k = 0; kKinds > 1 && k < kKinds; ++k) {
    look(clouds[rng.below(clouds.size())], fit_turn(truth), first);
    for (size_t i = 0; i < first.place.size(); ++i)
      coefficients[k * kPlaces + static_cast<size_t>(first.place[i])] = 4 * first.share[i];
  }
  const size_t steps = order.size() / kBatch;
  for (int epoch = 0; epoch < options.epochs; ++epoch) {
    for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.below(i)]);
    double loss = 0;
    for (size_t step = 0; step < steps; ++step) {
      std::array<double, kBatch> turned;
      for (double& t : turned) t = rng.uniform(-5, 5) * kPi / 180;  // another heading each epoch
      parallel_for(kBatch, 4, [&](int64_t begin, int64_t end) {
        for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i)
          examine(clouds[order[step * kBatch + i]], turned[i], coefficients, truth, batch[i]);
      });
      for (const Example& e : batch) loss += e.loss;
      parallel_for(kKinds, 1, [&](int64_t begin, int64_t end) {
        for (int64_t k = begin; k < end; ++k) add_gradient(batch, k, coefficients, gradient);
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
