#include "bench/doctor/fit.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "autograd/base/parallel_each.h"
#include "autograd/base/rng.h"
#include "autograd/ops/reduce.h"
#include "train/optim/optimiser.h"
#include "train/stage.h"

namespace restage::bench {
namespace {

using namespace doctor_detail;

constexpr double kPi = 3.14159265358979323846;
constexpr int kFitHeadings = 8;  // headings further apart than where the fitted network is asked
constexpr int kUp = 2;           // +y is the true one
constexpr int kOthers = (kUps - 1) * kFitHeadings;  // turns under other up axes
constexpr int kDrawn = 8;                           // of them; each stands for five
constexpr int kTurns = kFitHeadings + kDrawn;
constexpr int64_t kBatch = 32;
constexpr int kWarmUp = 100;  // steps

Eigen::Matrix3f fit_turn(int up, int heading) {
  return hypothesis(up, heading * (kHeadings / kFitHeadings));
}

int true_turn() {
  int i = 0;
  while (!fit_turn(kUp, i).isIdentity(1e-4f)) ++i;
  return i;
}

/// The scan, turned and leaning a little, other each time, under kTurns turns: rows of kPlaces.
void look_around(const Points& scan, double tilt, Rng rng, float* rows) {
  const double degree = kPi / 180, ahead = rng.normal() * tilt, aside = rng.normal() * tilt;
  const Eigen::Matrix3f start =
      (turn_about_y(rng.uniform(-7.5, 7.5) * degree) *
       Eigen::AngleAxisd(ahead * degree, Vec3::UnitX()).toRotationMatrix() *
       Eigen::AngleAxisd(aside * degree, Vec3::UnitZ()).toRotationMatrix())
          .cast<float>();
  for (int t = 0; t < kTurns; ++t, rows += kPlaces) {
    int up = kUp, heading = t;
    if (t >= kFitHeadings) {  // one of each five neighbours in the list of the others
      constexpr int kEach = kOthers / kDrawn;
      const int other =
          kEach * (t - kFitHeadings) + static_cast<int>(rng.below(static_cast<uint64_t>(kEach)));
      up = other / kFitHeadings;
      if (up >= kUp) ++up;
      heading = other % kFitHeadings;
    }
    look(scan, fit_turn(up, heading) * start, std::span<float, kPlaces>(rows, kPlaces));
  }
}

/// How many turns each of the kTurns stands for.
double stands_for(int turn) {
  return turn < kFitHeadings ? 1 : static_cast<double>(kOthers) / kDrawn;
}

struct Batch {
  Tensor seen = Tensor::empty({kBatch, kTurns, kPlaces});
  Tensor truth = Tensor::empty({kBatch, kTurns});  ///< probabilities
};

Var cross_entropy(Context& ctx, const OrientationNet& net, const Batch& batch) {
  Tensor weight = Tensor::empty({1, kTurns});
  for (int t = 0; t < kTurns; ++t)
    weight.data<float>()[t] = static_cast<float>(std::log(stands_for(t)));
  const Var scores = reshape(net(ctx, batch.seen), {kBatch, kTurns}) + Var(weight);
  return scale(sum_all(log(add_scalar(softmax(scores), 1e-9)) * Var(batch.truth)), -1.0 / kBatch);
}

/// What is seen of a unit cloud is small numbers: the usual start would hardly tell clouds apart.
void start(OrientationNet& net, const RngKey& key) {
  Tensor& first = net.layers[0].weight.value;
  first = Init{key}.uniform(first.shape(), 0.5, "first");
}

void fill(const std::function<FitExample(uint64_t)>& example, uint64_t first, double tilt,
          const RngKey& key, Batch& batch) {
  static const int right = true_turn();
  parallel_each(kBatch, 1, [&](int64_t i) {
    const auto number = static_cast<uint64_t>(i);
    const FitExample e = example(first + number);
    look_around(e.points, tilt, Rng(key.fold(number)),
                batch.seen.data<float>() + i * kTurns * kPlaces);
    float* truth = batch.truth.data<float>() + i * kTurns;
    for (int t = 0; t < kTurns; ++t)
      truth[t] = e.person ? (t == right ? 1.0f : 0.0f)
                          : static_cast<float>(stands_for(t) / (kFitHeadings + kOthers));
  });
}

}  // namespace

void fit_orientation_net(const std::function<FitExample(uint64_t)>& example,
                         const FitOptions& options, void (*say)(const std::string&),
                         OrientationNet& net) {
  const RngKey key = RngKey{options.seed, 0}.fold("fit orientation");
  start(net, key);
  Optimiser adam({{"", &net}}, {});
  Batch batch;
  const int64_t a_line = std::max<int64_t>(options.steps / 10, 1);
  double loss = 0;
  for (int64_t step = 0; step < options.steps; ++step) {
    const auto number = static_cast<uint64_t>(step);
    const RngKey now = key.fold(number);
    fill(example, number * kBatch, options.tilt, now, batch);
    const Differentiated d =
        differentiate(now, [&](Context& ctx) { return cross_entropy(ctx, net, batch); });
    const double done = static_cast<double>(step) / static_cast<double>(options.steps),
                 warm = std::min(1.0, static_cast<double>(step + 1) / kWarmUp);
    adam.step(d.gradients, options.rate * warm * (0.5 + 0.5 * std::cos(kPi * done)));
    loss += d.loss;
    if ((step + 1) % a_line == 0) {
      say("step " + std::to_string(step + 1) + " of " + std::to_string(options.steps) +
          ": cross-entropy " + std::to_string(loss / static_cast<double>(a_line)));
      loss = 0;
    }
  }
}

}  // namespace restage::bench
