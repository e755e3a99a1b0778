#include "bench/joints/fit.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/parallel_each.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "datasets/sampling/augment.h"
#include "train/stage.h"

namespace restage::bench {
namespace {

using namespace joints_detail;

using Known = std::array<bool, kJoints>;

/// Sets of joints that are known or not known together, and how often they are.
struct Group {
  std::vector<int> joints;
  double share;
};
const std::vector<Group>& groups() {
  static const std::vector<Group> all = {{{kPelvis}, 0.5},
                                         {{kSpine1}, 0.3},
                                         {{kSpine2}, 0.3},
                                         {{kSpine3}, 0.3},
                                         {{kNeck}, 0.6},
                                         {{kHead}, 0.8},
                                         {{kLeftCollar, kRightCollar}, 0.3},
                                         {{kLeftFoot, kRightFoot}, 0.6}};
  return all;
}

Known which_known(const JointFaults& faults, Rng& rng) {
  Known out;
  out.fill(true);
  if (rng.uniform() >= faults.missing) return out;
  for (const Group& group : groups()) {
    const bool known = rng.uniform() < group.share;
    for (const int j : group.joints) out[static_cast<size_t>(j)] = known;
  }
  return out;
}

/// The ends of one limb, from its first hidden joint on.
std::vector<int> some_limb(Rng& rng) {
  static const std::vector<std::vector<int>> limbs = {{kLeftKnee, kLeftAnkle, kLeftFoot},
                                                      {kRightKnee, kRightAnkle, kRightFoot},
                                                      {kLeftAnkle, kLeftFoot},
                                                      {kRightAnkle, kRightFoot},
                                                      {kLeftElbow, kLeftWrist},
                                                      {kRightElbow, kRightWrist},
                                                      {kLeftWrist},
                                                      {kRightWrist},
                                                      {kHead}};
  return limbs[rng.below(limbs.size())];
}

/// A skeleton with bones of other lengths, the same to both sides.
Joints other_lengths(const Joints& rest, Rng& rng) {
  std::array<double, kJoints> factor;
  for (size_t j = 0; j < kJoints; ++j) {
    const auto twin = static_cast<size_t>(kMirror[j]);
    factor[j] = twin < j ? factor[twin] : std::exp(0.08 * rng.normal());
  }
  Joints out = rest;
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    out[j] = out[p] + factor[j] * (rest[j] - rest[p]);
  }
  return out;
}

}  // namespace

TurnExamples::TurnExamples(const Corpus& corpus, const JointFaults& faults, uint64_t seed)
    : corpus_(corpus), faults_(faults), key_(RngKey{seed, 0}.fold("turns")) {}

void TurnExamples::fill(int64_t index, float* seen, float* truth) const {
  Rng rng(key_.fold(static_cast<uint64_t>(index)));
  const Motion& motion = corpus_.motions[rng.below(corpus_.motions.size())];
  const auto middle = static_cast<int64_t>(rng.below(motion.frames()));
  const bool own = rng.uniform() < 0.25;
  Body who;
  const Body& drawn = corpus_.bodies[rng.below(corpus_.bodies.size())];
  who.joints = other_lengths(own ? motion.rest : drawn.joints, rng);
  Augmentation augmentation = draw_augmentation(rng, M_PI, true);
  const Known known = which_known(faults_, rng);
  std::array<Vec3, kJoints> off;
  const double far = rng.uniform() < faults_.other ? faults_.off : 0;
  for (Vec3& x : off) x = far * Vec3(rng.normal(), rng.normal(), rng.normal());
  const double noise = rng.uniform() < faults_.noise ? faults_.most_noise * rng.uniform() : 0;
  Known hidden{};
  if (rng.uniform() < faults_.hidden)
    for (const int j : some_limb(rng)) hidden[static_cast<size_t>(j)] = true;
  const int hidden_from = static_cast<int>(rng.below(9)) - 8,
            hidden_to = hidden_from + 1 + static_cast<int>(rng.below(16));
  const bool late = rng.uniform() < faults_.late;
  std::array<SeenFrame, kMoments.size()> frames;
  std::array<const SeenFrame*, kMoments.size()> around{};
  Rotations global;
  for (size_t m = 0; m < kMoments.size(); ++m) {
    const int64_t at = middle + kMoments[m];
    if (at < 0 || at >= static_cast<int64_t>(motion.frames()) || (late && kMoments[m] > 0))
      continue;
    const Pose pose = augmented(augmentation, pose_on(motion, who, static_cast<size_t>(at)));
    const PosedSkeleton posed = forward_kinematics(augmented_rest(augmentation, who.joints), pose);
    if (m == 0) global = posed.global;
    around[m] = &frames[m];
    for (size_t j = 0; j < kJoints; ++j) {
      const Vec3 shake(rng.normal(), rng.normal(), rng.normal());
      if (!known[j] || (hidden[j] && kMoments[m] >= hidden_from && kMoments[m] < hidden_to))
        continue;
      frames[m][j] = posed.joints[j] + posed.global[j] * off[j] + noise * shake;
    }
  }
  const Trunk trunk = trunk_of(frames[0]).value_or(Trunk{Mat3::Identity(), Vec3::Zero()});
  fill_input(around, trunk, std::max(0.1, trunk_length(frames[0])), seen);
  for (size_t j = 0; j < kJoints; ++j)
    matrix_at(truth + 9 * j) = (trunk.axes.transpose() * global[j]).cast<float>();
}

TurnBatch TurnExamples::batch(int64_t first, int64_t n) const {
  TurnBatch out{Tensor::empty({n, kInputs}), Tensor::empty({n, kJoints, 3, 3})};
  parallel_each(n, 8, [&](int64_t i) {
    fill(first + i, out.seen.data<float>() + i * kInputs,
         out.truth.data<float>() + i * kJoints * 9);
  });
  return out;
}

namespace {

/// The mean error of the turns, and of what the network believes of them: of log(e) that makes a
/// Laplace distribution of width e likeliest.
Var turn_loss(Context& ctx, const TurnNet& net, const TurnBatch& batch) {
  const TurnAnswer answer = answer_of(net(ctx, batch.seen));
  const Var apart = matrix_to_sixd(answer.turns) - matrix_to_sixd(Var(batch.truth));
  const Var error = smooth_length(apart, 1e-4);
  const Var believed = Var(error.value) * exp(scale(answer.log_error, -1)) + answer.log_error;
  return mean_all(error) + scale(mean_all(believed), 0.05);
}

}  // namespace

void fit_turn_net(const TurnExamples& examples, const TurnFitOptions& options,
                  const std::function<void(const std::string&)>& say, TurnNet& net) {
  const RngKey key = RngKey{options.seed, 0}.fold("fit turns");
  OptimiserConfig config;
  config.kind = OptimiserConfig::Kind::muon;
  config.clip = 1;
  Optimiser optimiser({{"", &net}}, config);
  const int64_t a_line = std::max<int64_t>(options.steps / 20, 1);
  double loss = 0;
  for (int64_t step = 0; step < options.steps; ++step) {
    const TurnBatch batch = examples.batch(step * options.batch, options.batch);
    const Differentiated d =
        differentiate(key.fold(static_cast<uint64_t>(step)),
                      [&](Context& ctx) { return turn_loss(ctx, net, batch); });
    const double done = static_cast<double>(step) / static_cast<double>(options.steps),
                 warm = std::min(1.0, static_cast<double>(step + 1) / 200);
    optimiser.step(d.gradients, options.rate * warm * (0.5 + 0.5 * std::cos(M_PI * done)));
    loss += d.loss;
    if ((step + 1) % a_line == 0) {
      say(format("step %lld of %lld: loss %.4f", static_cast<long long>(step + 1),
                 static_cast<long long>(options.steps), loss / static_cast<double>(a_line)));
      loss = 0;
    }
  }
}

}  // namespace restage::bench
