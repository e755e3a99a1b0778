#include "train/stages/skeleton_stage.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "nn/losses/measure.h"

namespace restage {
namespace {

/// The head of the uncertainty learns apart from the other layers, so this weight only decides how
/// much its gradient counts when gradients are clipped; Adam makes up for its size.
constexpr double kUncertaintyWeight = 0.01;
constexpr size_t kFollowed = 12;  // frames of a validation sequence

/// Lengths of vectors along the last axis, metres.
Var lengths(const Var& d) { return smooth_length(d, 1e-8); }

CloudConfig with_points(CloudConfig c, const SkeletonModel& model) {
  c.points = static_cast<int>(model.points());
  return c;
}

CloudConfig training_clouds(const SkeletonStageConfig& c, const SkeletonModel& model) {
  CloudConfig out = with_points(c.clouds, model);
  out.skin_weights = c.vote_weight > 0 || c.segmentation_weight > 0;
  out.rotations = c.orientation_weight > 0;
  return out;
}

/// Some rows of a tensor, along its leading axis.
Tensor rows_of(const Tensor& t, const std::vector<int64_t>& rows) {
  Shape shape = t.shape();
  shape.set(0, std::ssize(rows));
  Tensor out = Tensor::empty(shape);
  const int64_t width = t.numel() / t.size(0);
  for (size_t i = 0; i < rows.size(); ++i)
    std::copy_n(t.data<float>() + rows[i] * width, width,
                out.data<float>() + static_cast<int64_t>(i) * width);
  return out;
}

/// Sum of the angles between rotations given as two columns [n, 22, 6].
double total_angle(const Tensor& a, const Tensor& b) {
  const auto matrices = [](const Tensor& sixd) {
    return sixd_to_matrix(Var(sixd.reshape({sixd.size(0), kJoints, 6}))).value;
  };
  const Tensor x = matrices(a), y = matrices(b);
  double out = 0;
  for (int64_t k = 0; k < x.numel(); k += 9) {
    double trace = 0;
    for (int64_t i = 0; i < 9; ++i)
      trace += static_cast<double>(x.data<float>()[k + i]) * y.data<float>()[k + i];
    out += std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0));
  }
  return out;
}

/// Held-out clouds keep the noise and count of training, without mirror images.
CloudConfig held_out(CloudConfig c, const SkeletonModel& model) {
  c = with_points(c, model);
  c.mirror = false;
  c.scale_jitter = 0;
  c.dressed = c.one_camera = c.camera_ring = c.recombined = c.intruder = c.remembered = c.bend = 0;
  c.things = c.cut_floor = c.smoothed = c.skirts = 0;
  c.ceiling = c.cropped = c.sparse = c.noisy = c.tilted = c.upright = 0;
  c.rotations = true;
  return c;
}

}  // namespace

SkeletonStage::SkeletonStage(const Config& config, const StageInput& in)
    : SupervisedStage("skeleton", config.optimiser, in),
      config_(config),
      model_(add_network<SkeletonModel>(config.model, RngKey{in.seed, 0}.fold("skeleton.init"),
                                        with_joints({}, in))),
      posed_(evaluation_clouds(in.validation, static_cast<size_t>(config.validation_clouds), 1)),
      tposes_(evaluation_tposes(in.validation, 4, config.clouds.tpose_heading, 1)) {
  sampler_.emplace(in.train, training_clouds(config, *model_),
                   sampler_seed(in.seed, "skeleton.clouds"));
  held_out_.emplace(in.validation, held_out(config.clouds, *model_), 1);
  begin({"skeleton"});
  const auto scans = [&](EvaluationScans how) {
    how.points = static_cast<int>(model_->points());
    return evaluation_scans(in.validation, posed_, how, 1);
  };
  if (config.clouds.one_camera > 0) one_camera_ = scans({});
  if (config.clouds.camera_ring > 0) ring_ = scans({.cameras = 6});
  if (config.clouds.intruder > 0) intruded_ = scans({.intruder = true});
  if (config.clouds.remembered > 0)
    followed_ = evaluation_scans(
        in.validation,
        following(in.validation, posed_, static_cast<size_t>(config.validation_clouds + 7) / 8,
                  kFollowed),
        {.points = static_cast<int>(model_->points()), .frames = kFollowed}, 1);
}

namespace {

Var bone_lengths(const Var& joints) {
  return lengths(reshape(bone_vectors(joints), {joints.size(0), kJoints - 1, 3}));
}

}  // namespace

Var SkeletonStage::loss_of(const SkeletonAnswer& answer, const CloudBatch& batch) const {
  Var total = config_.loss == Measure::mse ? mse(answer.joints, Var(batch.joints))
                                           : mean_all(lengths(answer.joints - Var(batch.joints)));
  if (config_.bone_weight > 0)
    total = total + scale(mse(bone_lengths(answer.joints), bone_lengths(Var(batch.joints))),
                          config_.bone_weight);
  if (answer.turns.value.defined() && batch.turns.defined()) {
    const Var columns =
        reshape(answer.turns - Var(batch.turns), {batch.turns.size(0), 2 * kJoints, 3});
    total = total + scale(mean_all(lengths(columns)), config_.orientation_weight);
  }
  if (answer.uncertainty.value.defined()) {
    const Tensor error = lengths(Var(answer.joints.value) - Var(batch.joints)).value;
    const Var in_s = Var(error) * exp(neg(answer.uncertainty));
    total = total + scale(mean_all(scale(answer.uncertainty, 3) + in_s), kUncertaintyWeight);
  }
  return total;
}

Var SkeletonStage::loss(Context& ctx, const CloudBatch& batch, int64_t, Tensor*) const {
  if (const OwnTraining* own = own_loss(model_))
    return own->loss(ctx, {{"cloud", batch.points}, {"past", batch.past}}, as_vars(batch));
  const SkeletonOutput out = model_->forward(ctx, {batch.points, batch.past});
  Var total = loss_of(out, batch);
  for (const SkeletonAnswer& before : out.before) total = total + loss_of(before, batch);
  if (!out.centres.defined() || !batch.weights.defined()) return total;
  return total + voting_loss(out, batch);
}

Var SkeletonStage::voting_loss(const SkeletonOutput& out, const CloudBatch& batch) const {
  const int64_t n = batch.points.size(0), c = out.centres.size(1);
  const Var moved_by = gather(Var(batch.weights), out.centres);  // [n, c, 22] skin weights
  Var total(Tensor::zeros({}, DType::f32, batch.points.device()));
  if (config_.vote_weight > 0) {
    const Var miss = lengths(out.votes - Var(batch.joints.reshape({n, 1, kJoints, 3})));
    total =
        total + scale(sum_all(miss * moved_by), config_.vote_weight / static_cast<double>(n * c));
  }
  if (config_.segmentation_weight > 0) {
    const Var log_share = log(add_scalar(softmax(out.segmentation), 1e-8));
    total = total - scale(sum_all(log_share * moved_by),
                          config_.segmentation_weight / static_cast<double>(n * c));
  }
  return total;
}

/// Where a cloud asks for a memory, it gets what this model says of the frame before. So errors of
/// this frame and of the frame before are alike, which memories drawn at random would not teach.
void SkeletonStage::complete(int64_t step, const MicroBatch& part, CloudBatch* clouds) const {
  if (clouds->asked.empty()) return;
  const CloudBatch before = sampler_->before(first_of(step, part), *clouds);
  Context ctx;
  const SkeletonAnswer answer =
      on_host(model_->forward(ctx, {before.points.to(device()), before.past.to(device())}));
  // The step itself will find the op that makes a value infinite, and name it.
  const std::span joints(answer.joints.value.data<float>(),
                         static_cast<size_t>(answer.joints.value.numel()));
  if (!std::all_of(joints.begin(), joints.end(), [](float x) { return std::isfinite(x); })) return;
  const Tensor past = remembered(answer, before.centres, rows_of(clouds->centres, clouds->asked));
  const int64_t row = 4 * kJoints;
  for (size_t k = 0; k < clouds->asked.size(); ++k)
    std::copy_n(past.data<float>() + static_cast<int64_t>(k) * row, row,
                clouds->past.data<float>() + clouds->asked[k] * row);
}

SkeletonErrors skeleton_errors(SkeletonModel& model, const CloudBatch& clouds) {
  Context ctx;
  const Device device = device_of(model);
  double joints = 0, turns = 0, outside = 0;
  bool gives_turns = false, gives_uncertainty = false;
  const int64_t n = clouds.points.size(0);
  in_validation(n, 16, [&](int64_t i, int64_t some) {
    const int64_t to = i + some;
    const SkeletonAnswer out = on_host(model.forward(ctx, clouds.points.rows(i, to).to(device)));
    const Tensor truth = clouds.joints.rows(i, to);
    joints += mean_distance(out.joints.value, truth) * static_cast<double>(some);
    gives_turns = out.turns.value.defined() && clouds.turns.defined();
    gives_uncertainty = out.uncertainty.value.defined();
    if (gives_turns) turns += total_angle(out.turns.value, clouds.turns.rows(i, to));
    const Tensor error = lengths(out.joints - Var(truth)).value;
    for (int64_t k = 0; gives_uncertainty && k < error.numel(); ++k)
      outside +=
          error.data<float>()[k] > kNinety * std::exp(out.uncertainty.value.data<float>()[k]);
  });
  const auto count = static_cast<double>(n * kJoints);
  SkeletonErrors mean{joints / static_cast<double>(n), {}, {}};
  if (gives_turns) mean.turns = turns / count;
  if (gives_uncertainty) mean.outside = outside / count;
  return mean;
}

Tensor remembered(const SkeletonAnswer& answer, const Tensor& centres, const Tensor& now) {
  const Tensor& joints = answer.joints.value;
  Tensor out = Tensor::zeros({joints.size(0), kJoints, 4});
  for (int64_t k = 0; k < joints.size(0) * kJoints; ++k) {
    const int64_t n = k / kJoints;
    float* to = out.data<float>() + 4 * k;
    for (int64_t c = 0; c < 3; ++c)
      to[c] = joints.data<float>()[3 * k + c] + centres.data<float>()[3 * n + c] -
              now.data<float>()[3 * n + c];
    to[3] = static_cast<float>(
        answer.uncertainty.value.defined()
            ? trust_of(std::exp(static_cast<double>(answer.uncertainty.value.data<float>()[k])))
            : 1.0);
  }
  return out;
}

double followed_error(SkeletonModel& model, const CloudBatch& clouds, int64_t frames,
                      Device device) {
  const int64_t sequences = clouds.points.size(0) / frames;
  SkeletonAnswer answer;
  double sum = 0;
  std::vector<int64_t> rows;
  in_validation(frames, 1, [&](int64_t f, int64_t) {
    const std::vector<int64_t> before = std::exchange(rows, {});
    for (int64_t s = 0; s < sequences; ++s) rows.push_back(s * frames + f);
    const Tensor past =
        f == 0 ? Tensor()
               : remembered(answer, rows_of(clouds.centres, before), rows_of(clouds.centres, rows));
    Context ctx;
    answer =
        on_host(model.forward(ctx, {rows_of(clouds.points, rows).to(device), past.to(device)}));
    sum += mean_distance(answer.joints.value, rows_of(clouds.joints, rows));
  });
  return sum / static_cast<double>(frames);
}

NamedValues SkeletonStage::validate() {
  NamedValues out;
  std::optional<double> turns, miscalibration;  // over the kinds of clouds, the worst
  const auto worst = [](std::optional<double>& of, double x) { of = std::max(of.value_or(x), x); };
  const auto put = [&](const char* name, const CloudBatch& clouds) {
    if (!clouds.points.defined()) return;
    const SkeletonErrors errors = skeleton_errors(*model_, clouds);
    out.push_back({name, 1e3 * errors.joints});
    if (errors.turns) worst(turns, *errors.turns * 180 / M_PI);
    if (errors.outside) worst(miscalibration, std::abs(*errors.outside - 0.1));
  };
  put("joint_error_mm", held_out_->clouds(posed_));
  put("tpose_joint_error_mm", held_out_->clouds(tposes_));
  put("ring_joint_error_mm", ring_);
  put("one_camera_joint_error_mm", one_camera_);
  put("intruder_joint_error_mm", intruded_);
  if (followed_.points.defined())
    out.push_back(
        {"followed_joint_error_mm",
         1e3 * followed_error(*model_, followed_, static_cast<int64_t>(kFollowed), device())});
  if (turns) out.push_back({"turn_error_degrees", *turns});
  if (miscalibration) out.push_back({"miscalibration", *miscalibration});
  return out;
}

std::vector<std::string> SkeletonStage::figures() {
  std::vector<std::string> out{"joint_error_mm", "tpose_joint_error_mm"};
  const auto add = [&](const char* name, const Tensor& measured) {
    if (measured.defined()) out.emplace_back(name);
  };
  add("ring_joint_error_mm", ring_.points);
  add("one_camera_joint_error_mm", one_camera_.points);
  add("intruder_joint_error_mm", intruded_.points);
  add("followed_joint_error_mm", followed_.points);
  Context ctx;  // what the model says beside joints, an answer shows
  const SkeletonOutput one =
      model_->forward(ctx, held_out_->clouds({posed_.front()}).points.to(device()));
  add("turn_error_degrees", one.turns.value);
  add("miscalibration", one.uncertainty.value);
  return out;
}

std::vector<Shown> SkeletonStage::show() {
  const int64_t n = shown_of(std::ssize(posed_));
  const CloudBatch clouds = held_out_->clouds({posed_.begin(), posed_.begin() + n});
  Context ctx;
  const Tensor answer = model_->forward(ctx, clouds.points.to(device())).joints.value.cpu();
  return {clouds_of("cloud", clouds.points, spaced(n)), skeletons_of("joints", answer, spaced(n)),
          skeletons_of("true joints", clouds.joints, spaced(n))};
}

}  // namespace restage
