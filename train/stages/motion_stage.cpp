#include "train/stages/motion_stage.h"

#include <cmath>
#include <map>

#include "autograd/base/log.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "datasets/readers/errors.h"
#include "nn/metrics/metrics.h"
#include "nn/models/closed_form_motion.h"

namespace restage {
namespace {

/// What must be known of the training by whoever uses the network.
Settings settings_of(const MotionStageConfig& c) {
  Settings out{{"remove_heading", c.windows.remove_heading ? "true" : "false"}};
  if (c.windows.steady_heading) out["steady_heading"] = "true";
  for (const auto& [name, value] : config_names(Translation{}))
    if (value == c.windows.translation) out["translation"] = name;
  return out;
}

WindowConfig held_out(WindowConfig c, int64_t frames) {
  c.frames = static_cast<int>(frames);
  c.self_share = 0;
  c.noise = 0;
  c.mirror = false;
  c.truth = true;
  return c;
}

/// If self samples have a pass of their own, none of the cycle's windows is one, and all of the
/// other windows are.
WindowConfig windows_of_cycle(const MotionStageConfig& c) {
  WindowConfig w = c.windows;
  if (c.self_first_pass) w.self_share = 0;
  return w;
}
WindowConfig windows_of_self(const MotionStageConfig& c) {
  WindowConfig w = c.windows;
  w.self_share = 1 - c.paired_share;
  w.truth = c.paired_share > 0;
  return w;
}

MotionBatch motion_batch(const WindowBatch& w) {
  return {w.joints_a, w.input_a,   w.trans_a, w.input_trans_a, w.rest_a,   w.rest_b,
          w.sixd_a,   w.self_mask, w.turns,   w.uncertainty,   w.standing, w.reframed};
}

/// The batch of one pass whose answer is known: the motion of A itself, or the true motion of B.
MotionBatch supervised_batch(const WindowBatch& w) {
  if (!w.truth_b.defined()) return motion_batch(w);
  return {w.truth_b,      w.input_a,   w.truth_trans_b, w.input_trans_a, w.rest_b,   w.rest_b,
          w.truth_sixd_b, w.self_mask, w.turns,         w.uncertainty,   w.standing, w.reframed};
}

AnswersConfig asked_for(const MotionStageConfig& c, int64_t sequences) {
  AnswersConfig out = c.answers;
  out.tracks.sequences = out.tracks.sequences == 0 ? 0 : sequences;
  return out;
}

/// Mean and deviation per column of rows of width n; deviations are at least `least`.
MotionStatistics::Columns columns(const std::vector<Tensor>& parts, int64_t n, double least) {
  std::vector<double> s(static_cast<size_t>(n), 0.0), q(s);
  int64_t rows = 0;
  for (const Tensor& t : parts) {
    const float* x = t.data<float>();
    for (int64_t i = 0; i < t.numel(); ++i) {
      s[i % n] += x[i];
      q[i % n] += static_cast<double>(x[i]) * x[i];
    }
    rows += t.numel() / n;
  }
  for (size_t i = 0; i < s.size(); ++i) {
    s[i] /= static_cast<double>(rows);
    q[i] =
        std::max(least, std::sqrt(std::max(0.0, q[i] / static_cast<double>(rows) - s[i] * s[i])));
  }
  return {Tensor::from<double>({n}, s).cast(DType::f32),
          Tensor::from<double>({n}, q).cast(DType::f32)};
}

/// Sum of a metric over the windows [n, t, 22, 3] of a batch.
template <class Metric>
double window_error(Metric metric, const Tensor& predicted, const Tensor& truth,
                    metrics::Alignment::Mode mode) {
  double out = 0;
  for (int64_t s = 0; s < truth.size(0); ++s) {
    const Tensor p = predicted.rows(s, s + 1).cast(DType::f64),
                 t = truth.rows(s, s + 1).cast(DType::f64);
    const metrics::Track a{p.data<double>(), truth.size(1), kJoints},
        b{t.data<double>(), truth.size(1), kJoints};
    out += metric(a, b, {mode, true}).value_or(std::nan(""));
  }
  return out;
}

Tensor first_frames(const Tensor& x, int64_t frames) { return slice(Var(x), 1, 0, frames).value; }

/// Sums over windows of what an answer gets wrong: joints in metres (and metres per squared frame),
/// local rotations as the mean length of the difference of their two columns.
struct Judged {
  double pa = 0, local = 0, acceleration = 0, rotation = 0;
  /// `late`: by how many frames the answer comes after its input.
  void add(const MotionOutput& answer, const WindowBatch& b, int64_t late) {
    using Mode = metrics::Alignment::Mode;
    const int64_t t = b.truth_b.size(1);
    const MotionOutput out = frames_of(answer, late, t);
    const Tensor &joints = out.joints.value, truth = first_frames(b.truth_b, t - late);
    pa += window_error(metrics::mean_distance, joints, truth, Mode::frame);
    local += window_error(metrics::mean_distance, joints, truth, Mode::none);
    acceleration += window_error(metrics::acceleration_error, joints, truth, Mode::none);
    rotation +=
        rotation_loss(out.rotations, first_frames(b.truth_sixd_b, t - late), Measure::distance)
            .value.item() *
        static_cast<double>(truth.size(0));
  }
};

}  // namespace

struct MotionStage::Windows {
  Windows(const MotionStage& s)
      : seen(ask(s.train_, "train", s.config_.answers, s.given_, seed(s, "motion.answers"),
                 s.answers_, s.team())),
        held_out_seen(ask(s.validation_, "validation",
                          asked_for(s.config_, s.config_.validation_windows), s.given_, 1,
                          s.answers_, s.team())),
        cycle(s.train_, windows_of_cycle(s.config_), seed(s, "motion.windows"), tracks(seen)),
        self(s.train_, windows_of_self(s.config_), seed(s, "motion.self"), tracks(seen)),
        validation(s.validation_, held_out(s.config_.windows, s.config_.validation_frames), 1,
                   tracks(held_out_seen)) {}
  static uint64_t seed(const MotionStage& s, const char* name) {
    return sampler_seed(s.seed_, name);
  }
  static const std::vector<JointTrack>* tracks(const std::vector<JointTrack>& of) {
    return of.empty() ? nullptr : &of;
  }
  const std::vector<JointTrack> seen, held_out_seen;
  const WindowSampler cycle, self, validation;
};

std::vector<std::string> MotionStage::reads(const Config& config) {
  if (config.answers.tracks.sequences == 0) return {};
  return {"skeleton"};
}

double MotionStage::shorten(Config& config) {
  constexpr int64_t kAsked = 8;  // sequences
  int64_t &learned = config.answers.tracks.sequences, &judged = config.validation_windows;
  if (learned == 0) return 1;
  const int64_t all = learned + judged;
  learned = std::min(learned, kAsked);
  judged = std::min(judged, kAsked);
  return static_cast<double>(all) / static_cast<double>(learned + judged);
}

namespace {
OptimiserConfig of_discriminator(const MotionStageConfig& c) {
  OptimiserConfig out = c.optimiser;
  out.kind = OptimiserConfig::Kind::adam;
  out.adam = c.discriminator_adam;
  out.groups.clear();
  return out;
}
}  // namespace

MotionStage::MotionStage(const Config& config, const StageInput& in)
    : Stage("motion", config.optimiser, in.device),
      config_(config),
      model_(add_network<MotionModel>(config.model, RngKey{in.seed, 0}.fold("motion.init"),
                                      with_joints(settings_of(config), in))),
      discriminator_(add_network<Discriminator>(
          "discriminator", "smrm/discriminator", model_type("smrm/discriminator").training,
          RngKey{in.seed, 0}.fold("discriminator.init"), {}, false)),
      optimiser_(add_optimiser("optimiser", {"motion"}, config.optimiser)),
      discriminator_optimiser_(
          add_optimiser("discriminator_optimiser", {"discriminator"}, of_discriminator(config))),
      train_(in.train),
      validation_(in.validation),
      seed_(in.seed),
      given_(in.given),
      answers_(in.answers),
      key_(RngKey{in.seed, 0}.fold("motion.step")) {
  const int64_t late = model_->latency();
  if (late > 0 && (config.windows.self_share < 1 || !config.self_first_pass))
    throw InputError("motion.sizes.latency", "is for passes whose answer is known, not for cycles",
                     "set windows.self_share to 1 and self_first_pass to true");
  if (config.windows.frames < late + 3 || config.validation_frames < 2 * late + 3)
    throw InputError("motion.sizes.latency",
                     cat("of ", late, " leaves nothing of windows of ", config.windows.frames,
                         " frames (validation: ", config.validation_frames, ")"),
                     "give longer windows.frames and validation_frames");
  // So that a mistake in them is reported at once.
  if (config.answers.tracks.sequences == 0) windows();
  model_->standardise(statistics());
  move_module(*model_, device());
}

const MotionStage::Windows& MotionStage::windows() const {
  std::call_once(asked_, [&] { windows_ = std::make_shared<const Windows>(*this); });
  return *windows_;
}

MotionStatistics MotionStage::statistics() const {
  std::vector<Tensor> joints, rest, trans, rotations;
  const WindowSampler sampler(train_, windows_of_cycle(config_),
                              sampler_seed(seed_, "motion.windows"));
  for (int64_t i = 0; i < 32; ++i) {
    const WindowBatch b = sampler.batch(i * 16, 16);
    joints.push_back(b.joints_a);
    rest.push_back(b.rest_a);
    trans.push_back(b.trans_a);
    rotations.push_back(b.sixd_a);
  }
  return {columns(joints, 3 * kJoints, 0.01), columns(rest, 3 * kJoints, 0.01),
          columns(trans, 3, 0.05), columns(rotations, 6 * kJoints, 0.01)};
}

void MotionStage::update_discriminator(const RngKey& step, double rate, const Drawn& batch,
                                       NamedValues* values) {
  if (balance_ <= config_.balance_limit) return;
  const Differentiated d = parts(*discriminator_optimiser_, [&](const MicroBatch& part) {
    const WindowBatch& windows = batch(part).windows;
    double score = 0;
    Differentiated out = differentiate(part.key(step), [&](Context& ctx) {
      Context plain;  // the generator gets no gradient from this step
      MotionState state;
      const MotionOutput fake =
          model_->forward(plain, motion_batch(windows).seen(windows.rest_b), &state);
      const DiscriminatorLosses l =
          discriminator_losses(ctx, *discriminator_, windows.real_b, windows.real_trans_b,
                               windows.rest_b, fake.joints.value, fake.trans.value, windows.rest_b);
      score = l.fake_score;
      return l.total;
    });
    out.values = {score};
    return out;
  });
  balance_ = 0.99 * balance_ + 0.01 * d.values[0];
  discriminator_optimiser_->step(d.gradients, rate);
  values->push_back({"discriminator", d.loss});
}

int64_t MotionStage::cycle_windows() const {
  const int64_t n = config_.optimiser.batch;
  if (!config_.self_first_pass) return n;
  return n - std::llround(config_.windows.self_share * static_cast<double>(n));
}

MotionStage::Batch MotionStage::batch(int64_t step, const MicroBatch& part) const {
  // Self samples are shared among the micro-batches as evenly as can be; the other windows are for
  // the cycle.
  const int64_t self = self_windows(), n = part.count(config_.optimiser.batch);
  const int64_t from = self * part.index / part.of, to = self * (part.index + 1) / part.of;
  Batch out;
  out.self = to - from;
  out.cycle = n - out.self;
  if (out.cycle > 0)
    out.windows =
        windows().cycle.batch(drawn(step) * cycle_windows() + part.index * n - from, out.cycle);
  if (out.self > 0) out.own = windows().self.batch(drawn(step) * self + from, out.self);
  return out;
}

NamedTensors MotionStage::examples(int64_t step) const {
  const Batch b = batch(step);
  NamedTensors out;
  for (const auto& [kind, windows] : {std::pair("cycle.", &b.windows), std::pair("self.", &b.own)})
    for (auto& [name, tensor] : named_tensors(*windows)) out.emplace_back(kind + name, tensor);
  return out;
}

/// The loss of a network that brings one: a mean over the windows of both kinds.
Var MotionStage::loss_of_own(Context& ctx, const OwnTraining& own, const Batch& b) const {
  const auto part = [&](const WindowBatch& windows, const Var& rest, int64_t count) {
    const MotionInput in = motion_batch(windows).seen(rest);
    NamedVars batch;
    for (const auto& [name, tensor] : named_tensors(windows)) batch.emplace_back(name, Var(tensor));
    const NamedVars input = {{"joints", in.joints},
                             {"trans", in.trans},
                             {"rest", in.rest},
                             {"turns", in.turns},
                             {"uncertainty", in.uncertainty},
                             {"reframed", in.reframed}};
    return scale(own.loss(ctx, input, batch),
                 static_cast<double>(count) / static_cast<double>(b.self + b.cycle));
  };
  if (b.cycle == 0) return part(b.own, b.own.rest_b, b.self);
  const Var cycle = part(b.windows, b.windows.rest_b, b.cycle);
  return b.self == 0 ? cycle : part(b.own, b.own.rest_b, b.self) + cycle;
}

Differentiated MotionStage::learn(const RngKey& key, const Batch& b, bool judged) {
  const double self_part = static_cast<double>(b.self) / static_cast<double>(b.self + b.cycle);
  MotionLosses l, s;
  Differentiated out = differentiate(key, [&](Context& ctx) {
    Var total;
    if (const OwnTraining* own = own_loss(model_)) return loss_of_own(ctx, *own, b);
    if (b.self > 0) {
      s = self_losses(ctx, *model_, supervised_batch(b.own), config_.weights);
      total = scale(s.total, self_part);
    }
    if (b.cycle > 0) {
      l = motion_losses(ctx, *model_, judged ? discriminator_ : nullptr, motion_batch(b.windows),
                        config_.weights);
      const Var rest = scale(l.total, 1 - self_part);
      total = b.self > 0 ? total + rest : rest;
    }
    return total;
  });
  // Scales a mean over the windows of one kind in this micro-batch so that the mean over
  // micro-batches is the mean over all windows of that kind.
  const auto value = [&](const Var& v, int64_t here, int64_t all) {
    const double part = static_cast<double>(here * config_.optimiser.batch) /
                        static_cast<double>(std::max<int64_t>(1, all * (b.self + b.cycle)));
    return v.value.defined() ? part * v.value.cpu().item() : 0;
  };
  const auto of_cycle = [&](const Var& v) { return value(v, b.cycle, cycle_windows()); };
  out.values = {of_cycle(l.cycle), of_cycle(l.rotation), of_cycle(l.smoothness),
                self_windows() > 0 ? value(s.self, b.self, self_windows()) : of_cycle(l.self),
                of_cycle(l.adversarial)};
  return out;
}

NamedValues MotionStage::step(int64_t step) {
  const OptimiserConfig& o = config_.optimiser;
  const double rate = learning_rate(o.schedule, step, o.steps);
  std::map<int64_t, Batch> drawn;  // the two rounds of a step may ask for the same micro-batch
  std::mutex several_ask;
  const Drawn batch_of = [&](const MicroBatch& part) -> const Batch& {
    const std::lock_guard lock(several_ask);
    const auto [at, fresh] = drawn.try_emplace(part.index);
    if (fresh) {
      at->second =
          ahead_.take(may_draw_ahead(), step, part, [this](auto... of) { return batch(of...); });
      for (WindowBatch* b : {&at->second.windows, &at->second.own}) *b = moved(*b, device());
    }
    return at->second;
  };
  const auto number = static_cast<uint64_t>(step);
  const int64_t cycle = cycle_windows();
  const bool own = own_loss(model_) != nullptr;
  const bool judged = adversarial() && cycle / micro_batches() > 1 && !own;
  NamedValues values;
  if (judged)
    update_discriminator(key_.fold("discriminator").fold(number), rate, batch_of, &values);
  const Differentiated d = parts(*optimiser_, [&](const MicroBatch& part) {
    return learn(part.key(key_.fold(number)), batch_of(part), judged);
  });
  optimiser_->step(d.gradients, rate, step);
  values.insert(values.begin(), {"loss", d.loss});
  if (judged) {
    // softplus(-x) = -log sigmoid(x): the batch's mean score, recovered from the loss.
    balance_ = 0.99 * balance_ + 0.01 * std::exp(-d.values[4]);
    values.push_back({"adversarial", d.values[4]});
  }
  if (cycle > 0 && !own) {
    values.push_back({"cycle", d.values[0]});
    values.push_back({"rotation", d.values[1]});
    values.push_back({"smoothness", d.values[2]});
  }
  if (!own) values.push_back({"self", d.values[3]});
  values.push_back({"rate", rate});
  return values;
}

NamedValues MotionStage::validate() {
  Context ctx;
  Judged network, closed_form;
  double cycle = 0;
  const int64_t n = config_.validation_windows;
  const Windows& made = windows();  // by all processes of a team together
  in_validation(n, 16, [&](int64_t i, int64_t some) {
    const WindowBatch b = made.validation.batch(i, some);
    const WindowBatch there = moved(b, device());
    MotionState forth, back, none;
    const MotionOutput to_b = model_->forward(ctx, motion_batch(there).seen(there.rest_b), &forth);
    const MotionOutput to_a =
        on_host(model_->forward(ctx, {to_b.joints, to_b.trans, there.rest_a, {}, {}}, &back));
    const int64_t late = model_->latency(), t = b.joints_a.size(1);
    network.add(on_host(to_b), b, late);
    closed_form.add(ClosedFormMotion({}, {}).forward(ctx, motion_batch(b).seen(b.rest_b), &none), b,
                    0);
    cycle += window_error(metrics::mean_distance, frames_of(to_a, 2 * late, t).joints.value,
                          first_frames(b.joints_a, t - 2 * late), metrics::Alignment::Mode::none);
  });
  const auto count = static_cast<double>(n);
  return {{"pa_mpjpe", network.pa / count},
          {"local_mpjpe", network.local / count},
          {"cycle_mpjpe", cycle / count},
          {"acceleration", network.acceleration / count},
          {"rotation", network.rotation / count},
          {"closed_form_pa_mpjpe", closed_form.pa / count},
          {"closed_form_acceleration", closed_form.acceleration / count},
          {"closed_form_rotation", closed_form.rotation / count}};
}

std::vector<std::string> MotionStage::figures() {
  return {"pa_mpjpe",
          "local_mpjpe",
          "cycle_mpjpe",
          "acceleration",
          "rotation",
          "closed_form_pa_mpjpe",
          "closed_form_acceleration",
          "closed_form_rotation"};
}

std::vector<Shown> MotionStage::show() {
  constexpr int64_t kMoments = 8;
  const WindowBatch b = windows().validation.batch(0, 1);
  Context ctx;
  MotionState state;
  const WindowBatch there = moved(b, device());
  const Tensor answer =
      model_->forward(ctx, motion_batch(there).seen(there.rest_b), &state).joints.value.cpu();
  const int64_t late = model_->latency(), t = b.joints_a.size(1) - late;
  std::vector<int64_t> moments;
  const int64_t count = std::min(kMoments, t);
  for (int64_t k = 0; k < count; ++k)
    moments.push_back(k * (t - 1) / std::max<int64_t>(1, count - 1));
  std::vector<int64_t> answered = moments;
  for (int64_t& frame : answered) frame += late;
  return {skeletons_of("source", b.joints_a, moments), skeletons_of("answer", answer, answered),
          skeletons_of("truth", b.truth_b, moments)};
}

void MotionStage::save_more(TensorFile& file) const {
  file.tensors["balance"] = Tensor::from<double>({1}, {balance_});
}

void MotionStage::load_more(const TensorFile& file, const std::string& where) {
  const Tensor* balance = file.find("balance");
  if (balance == nullptr || balance->numel() != 1)
    throw InputError(where, "'balance' is missing", "resume from an undamaged checkpoint");
  balance_ = balance->item();
}

}  // namespace restage
