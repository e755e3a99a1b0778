#include "experiments/adapt/adapt.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/frames/memory_frames.h"
#include "nn/geometry/box.h"
#include "nn/geometry/steady_bones.h"
#include "nn/losses/measure.h"
#include "train/optim/optimiser.h"
#include "train/stage.h"

namespace restage {
namespace teaching {
namespace {

constexpr size_t kMostPoints = 8192;   // of a cloud that is kept
constexpr int64_t kFewestFrames = 24;  // that teach, and
constexpr size_t kFewestHeldOut = 10;  // that judge
constexpr double kReach = 0.1;         // seconds before and after that smooth a frame
constexpr float kFarthest = 20;        // metres: nobody's cloud is so large
constexpr double kTurns = 0.05, kUncertainty = 0.01;  // weights of the losses beside the joints'
constexpr double kLeastGain = 0.02, kMostLoss = 1.05;

struct Cloud {
  Frame frame;  ///< without points if it has a fault
  std::optional<InputError> fault;
  SeenJoints taught;
  bool usable = false;
};

struct Sequence {
  SourceRecord record;  ///< without units and axes: the clouds are metres, y up
  std::vector<Cloud> clouds;
  size_t taught = 0;  ///< so many from the beginning; the others are held out
};

Sequence read(Source& source, const AdaptOptions& options, const RngKey& key) {
  Sequence out;
  out.record = source.record();
  out.record.scale = 1;
  out.record.up = "y";
  out.record.sequence.reset();
  Rng rng(key);
  while (auto cloud = source.next()) {
    Cloud& kept = out.clouds.emplace_back();
    kept.frame = std::move(cloud->frame);
    kept.fault = cloud->fault;
    kept.frame.faces.clear();
    Points& points = kept.frame.points;
    if (!points.empty() && !(box_of(points).sizes().maxCoeff() < kFarthest)) {
      kept.fault = InputError(kept.frame.source, "holds points more than 20 m apart",
                              "mend it with 'restage doctor --fix'");
      points.clear();
    }
    for (size_t i = 0; i < std::min(points.size(), kMostPoints); ++i)
      std::swap(points[i], points[i + rng.below(points.size() - i)]);
    points.resize(std::min(points.size(), kMostPoints));
    points.shrink_to_fit();  // a minute of large clouds would be gigabytes
  }
  out.taught = static_cast<size_t>((1 - options.held_out) * static_cast<double>(out.clouds.size()));
  return out;
}

/// What many views of each cloud say together.
void look(SkeletonModel& model, Sequence& sequence, double fps, const AdaptOptions& options,
          const RngKey& key) {
  constexpr double kRemembering = 8;  // frames a second, as retargeting
  JointExtractor extract(model, {.samples = options.samples, .any_size = true, .any_way_up = true});
  const SeenJoints* before = nullptr;
  for (size_t i = 0; i < sequence.taught; ++i) {
    throw_if_stopped();
    Cloud& cloud = sequence.clouds[i];
    try {
      if (cloud.fault) throw *cloud.fault;
      check_frame(cloud.frame.points, cloud.frame.source);
      cloud.taught = extract(cloud.frame.points, cloud.frame.source, key.fold(i),
                             fps > kRemembering ? before : nullptr);
      cloud.usable = !cloud.taught.uncertainty ||
                     confidence(*cloud.taught.uncertainty) >= options.min_confidence;
      before = &cloud.taught;
    } catch (const InputError& fault) {
      cloud.fault = fault;
      before = nullptr;
    }
  }
}

/// A parabola through the usable frames around `at`, by weighted least squares, at that frame.
Vec3 smooth(const Sequence& s, size_t at, size_t reach, size_t joint) {
  Mat3 a = Mat3::Zero(), b = Mat3::Zero();
  const size_t from = at > reach ? at - reach : 0, to = std::min(s.taught, at + reach + 1);
  size_t seen = 0;
  for (size_t i = from; i < to; ++i) {
    const SeenJoints& x = s.clouds[i].taught;
    if (!s.clouds[i].usable) continue;
    const double t = static_cast<double>(i) - static_cast<double>(at);
    const double sure = x.uncertainty ? 1 / std::max((*x.uncertainty)[joint], 1e-4) : 1;
    const Vec3 power(1, t, t * t);
    a += sure * sure * power * power.transpose();
    b += sure * sure * power * x.joints[joint].transpose();
    ++seen;
  }
  if (seen < 4) return s.clouds[at].taught.joints[joint];
  return a.ldlt().solve(b).row(0).transpose();
}

/// Takes from the joints what cannot be true of a person: trembling, and bones that change.
void correct(Sequence& s, double fps) {
  const auto reach = static_cast<size_t>(std::lround(kReach * fps));
  std::vector<Joints> calm(s.taught);
  for (size_t i = 0; i < s.taught; ++i)
    for (size_t j = 0; s.clouds[i].usable && j < kJoints; ++j) calm[i][j] = smooth(s, i, reach, j);
  SteadyBones bones;
  for (const bool known : {false, true})  // the second time with the lengths of the whole sequence
    for (size_t i = 0; i < s.taught; ++i) {
      SeenJoints& x = s.clouds[i].taught;
      if (!s.clouds[i].usable) continue;
      const Joints held = bones(calm[i], x.uncertainty);
      if (known) x.joints = held;
    }
}

struct Examples {
  Tensor points, past, joints, turns, trust, uncertainty;
};

/// Writes one example: some points of a cloud, turned and perhaps mirrored, and what was taught.
class ExampleWriter {
 public:
  ExampleWriter(const SkeletonModel& model, int64_t batch) {
    const auto room = [&](int64_t a, int64_t b) {
      return Tensor::zeros({batch, a, b}, DType::f32);
    };
    made.points = room(model.points(), 3), made.past = room(kJoints, 4);
    made.joints = room(kJoints, 3), made.turns = room(kJoints, 6);
    made.trust = Tensor::zeros({batch, kJoints}, DType::f32);
    made.uncertainty = Tensor::zeros({batch, kJoints}, DType::f32);
  }
  void write(int64_t row, const Cloud& cloud, const Cloud* before, Rng& rng) {
    const int64_t n = made.points.size(1);
    even_.arrange(cloud.frame.points);
    even_.choose(static_cast<size_t>(n), rng.uniform(), &chosen_);
    Vec3 centre = Vec3::Zero();
    for (const Point& p : chosen_) centre += p.cast<double>() / static_cast<double>(n);
    const Mat3 turn = turn_about_y(kAllAround * rng.uniform());
    const bool mirror = rng.below(2) == 1;
    const auto side = [&](Vec3 v) {
      if (mirror) v.x() = -v.x();
      return v;
    };
    const auto seen = [&](const Vec3& v) { return side(turn * (v - centre)); };
    float* to = made.points.data<float>() + row * n * 3;
    for (const Point& p : chosen_) to = put(seen(p.cast<double>()), to);
    const bool remembers = before != nullptr && before->usable && rng.below(2) == 1;
    for (size_t j = 0; j < kJoints; ++j) {
      const size_t from = mirror ? static_cast<size_t>(kMirror[j]) : j;
      const int64_t at = row * kJoints + static_cast<int64_t>(j);
      const SeenJoints& x = cloud.taught;
      const double radius = x.uncertainty ? (*x.uncertainty)[from] : 0.01;
      put(seen(x.joints[from]), made.joints.data<float>() + 3 * at);
      made.trust.data<float>()[at] = static_cast<float>(trust_of(radius));
      made.uncertainty.data<float>()[at] = static_cast<float>(std::log(std::max(radius, 1e-5)));
      if (x.turns) {
        Mat3 r = turn * (*x.turns)[from];
        if (mirror) r.row(0) *= -1, r.col(0) *= -1;
        Eigen::Map<Eigen::Matrix<float, 3, 2>>(made.turns.data<float>() + 6 * at) =
            r.leftCols<2>().cast<float>();
      }
      if (!remembers) continue;
      float* past = put(seen(before->taught.joints[from]), made.past.data<float>() + 4 * at);
      const auto& of_before = before->taught.uncertainty;
      *past = static_cast<float>(of_before ? trust_of((*of_before)[from]) : 1.0);
    }
  }
  Examples made;

 private:
  static float* put(const Vec3& v, float* to) {
    Eigen::Map<Point>{to} = v.cast<float>();
    return to + 3;
  }
  EvenPoints even_;
  Points chosen_;
};

Var loss(SkeletonModel& model, Context& ctx, const Examples& e) {
  const SkeletonOutput out = model.forward(ctx, {e.points, e.past});
  const int64_t n = e.points.size(0);
  const auto of = [&](const SkeletonAnswer& answer) {
    Var total = mean_all(smooth_length(answer.joints - Var(e.joints), 1e-8) * Var(e.trust));
    if (answer.turns.value.defined()) {
      const auto columns = [&](const Var& x) { return reshape(x, {n, 2 * kJoints, 3}); };
      const Var apart = columns(answer.turns) - columns(Var(e.turns));
      total = total + scale(mean_all(smooth_length(apart, 1e-8)), kTurns);
    }
    if (answer.uncertainty.value.defined())
      total = total + scale(mse(answer.uncertainty, Var(e.uncertainty)), kUncertainty);
    return total;
  };
  Var total = of(out);
  for (const SkeletonAnswer& before : out.before) total = total + of(before);
  return total;
}

void teach(SkeletonModel& model, const std::vector<Sequence>& sequences,
           const AdaptOptions& options, const RngKey& key) {
  std::vector<std::pair<const Cloud*, const Cloud*>> frames;
  for (const Sequence& s : sequences)
    for (size_t i = 0; i < s.taught; ++i)
      if (s.clouds[i].usable) frames.emplace_back(&s.clouds[i], i > 0 ? &s.clouds[i - 1] : nullptr);
  OptimiserConfig how;
  how.clip = 1;
  Optimiser optimiser({{"skeleton", &model}}, how);
  ExampleWriter writer(model, options.batch);
  for (int64_t step = 0; step < options.steps; ++step) {
    throw_if_stopped();
    Rng rng(key.fold(static_cast<uint64_t>(step)));
    writer.made.past = Tensor::zeros(writer.made.past.shape(), DType::f32);
    for (int64_t i = 0; i < options.batch; ++i) {
      const auto& [cloud, before] = frames[rng.below(frames.size())];
      writer.write(i, *cloud, before, rng);
    }
    const Differentiated d =
        differentiate(key.fold("step").fold(static_cast<uint64_t>(step)),
                      [&](Context& ctx) { return loss(model, ctx, writer.made); });
    const double done = static_cast<double>(step) / static_cast<double>(options.steps);
    optimiser.step(d.gradients, options.rate * 0.5 * (1 + std::cos(3.141592653589793 * done)));
    if (step % 50 == 0)
      log_debug("step " + std::to_string(step) + " of " + std::to_string(options.steps) +
                ", loss " + std::to_string(d.loss));
  }
}

/// Whether assess() can use the frame.
bool fit(const Cloud& cloud) {
  try {
    check_frame(cloud.frame.points, cloud.frame.source);
    return !cloud.fault && cloud.frame.points.size() >= kLeastDistinctPoints;
  } catch (const InputError&) {
    return false;
  }
}

AdaptFigures judge(const std::vector<Sequence>& sequences, const Bundle& weights,
                   const std::string& name, uint64_t seed) {
  AdaptFigures out;
  double count = 0, sure = 0;
  bool says = false;
  for (const Sequence& s : sequences) {
    const auto held = std::span(s.clouds).subspan(s.taught);
    if (held.size() < kFewestHeldOut) continue;
    if (std::none_of(held.begin(), held.end(), [](const Cloud& c) { return fit(c); })) continue;
    Source source(s.record, std::make_unique<MemoryFrames>(
                                held.size(), [&held](size_t i) { return held[i].frame; }));
    const Assessment found = assess(source, weights, name, {.seed = seed, .samples = 1});
    if (!found.jitter || !found.bone_length_sd || !found.surface) continue;
    out.bone_length_sd += *found.bone_length_sd, out.jitter += *found.jitter;
    out.surface += *found.surface, out.swaps += found.swaps;
    says = says || found.confidence;
    sure += found.confidence.value_or(0);
    ++count;
  }
  if (count == 0)
    throw InputError(
        sequences.front().record.path,
        "has too few frames with a person in its held-out part to judge what was learned",
        "give longer sequences");
  for (double* x : {&out.bone_length_sd, &out.jitter, &out.surface, &out.swaps}) *x /= count;
  if (says) out.confidence = sure / count;
  return out;
}

void compare(Adapted* out) {
  double sum = 0, worst = 0;
  for (const auto of :
       {&AdaptFigures::bone_length_sd, &AdaptFigures::jitter, &AdaptFigures::surface}) {
    const double ratio = std::max(out->after.*of, 1e-9) / std::max(out->before.*of, 1e-9);
    sum += std::log(ratio) / 3;
    worst = std::max(worst, ratio);
  }
  out->gain = 1 - std::exp(sum);
  out->gained =
      out->gain >= kLeastGain && worst <= kMostLoss && out->after.swaps <= out->before.swaps;
}

void count(const Cloud& cloud, Adapted* out) {
  if (cloud.usable) {
    ++out->taught;
  } else if (out->left_out++ == 0) {
    out->why =
        cloud.fault ? cloud.fault->what() : cloud.frame.source + ": the extractor is not sure";
  }
}

Adapted run(std::vector<std::unique_ptr<Source>>& sources, Bundle& weights,
            const std::string& weights_name, const AdaptOptions& options) {
  auto& model = weights.need_as<SkeletonModel>("skeleton", weights_name);
  const RngKey key = RngKey{options.seed, 0}.fold("adapt");
  std::vector<Sequence> sequences;
  Adapted out;
  for (size_t i = 0; i < sources.size(); ++i) {
    Sequence& s = sequences.emplace_back(read(*sources[i], options, key.fold("points").fold(i)));
    look(model, s, sources[i]->fps(), options, key.fold("look").fold(i));
    correct(s, sources[i]->fps());
    out.held_out += std::ssize(s.clouds) - static_cast<int64_t>(s.taught);
    for (size_t k = 0; k < s.taught; ++k) count(s.clouds[k], &out);
  }
  if (out.taught < kFewestFrames)
    throw InputError(sources.front()->record().path,
                     "has " + std::to_string(out.taught) +
                         " frames in which a person is surely found, too few to learn from" +
                         (out.why.empty() ? "" : " (the first without: " + out.why + ")"),
                     "give at least " + std::to_string(kFewestFrames) +
                         ", better a minute; or a lower --min-confidence");
  out.before = judge(sequences, weights, weights_name, options.seed);
  teach(model, sequences, options, key.fold("teach"));
  out.after = judge(sequences, weights, weights_name, options.seed);
  compare(&out);
  return out;
}

}  // namespace
}  // namespace teaching

Adapted adapt(std::vector<std::unique_ptr<Source>>& sequences, Bundle& weights,
              const std::string& weights_name, const AdaptOptions& options) {
  return teaching::run(sequences, weights, weights_name, options);
}

}  // namespace restage
