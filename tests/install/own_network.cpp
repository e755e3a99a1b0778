// A network, a loss and a system of one's own, trained and used with the installed library
// (docs/extending.md). Not a line of the library knows them.
#include "own_network.h"

#include <cmath>
#include <cstdio>

#include "autograd/base/parallel.h"
#include "autograd/gradcheck/gradcheck.h"
#include "autograd/kernels/kernel.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "datasets/sampling/transfers.h"
#include "infer/systems.h"
#include "infer/transfer.h"
#include "nn/config/config.h"
#include "nn/config/rules.h"
#include "nn/layers/linear.h"
#include "nn/models/registry.h"
#include "nn/models/skeleton.h"
#include "nn/models/transfer.h"
#include "train/stages/supervised_stage.h"
#include "train/training/training.h"

namespace mine {

using namespace restage;

struct ShiftConfig {
  int64_t width = 8;
};

template <class V>
void visit(V& v, ShiftConfig& c) {
  v("width", c.width, "units of the hidden layer", between(1, 1024));
}

/// Moves each vertex by what a small network makes of the vertex and of the pose's highest
/// coordinates.
struct Shift : TransferModel {
  using Config = ShiftConfig;
  Shift(const ShiftConfig& c, const Init& init)
      : in(6, c.width, init.sub("in")), out(c.width, 3, init.sub("out")) {}
  Var forward(Context& ctx, const TransferInput& x) override {
    const int64_t n = x.pose.size(0), t = x.pose.size(1), v = x.identity.size(1);
    const auto at_each = [&](const Var& y, const Shape& one) {
      return expand(reshape(y, one), {n, t, v, 3});
    };
    const Var mesh = at_each(x.identity, {n, 1, v, 3});
    const Var pose = at_each(max(x.pose, 2), {n, t, 1, 3});
    return mesh + out(ctx, in(ctx, concat({mesh, pose}, 3), Activation::relu));
  }
  void visit(Fields& f) override {
    f("in", in);
    f("out", out);
  }
  const char* kind() const override { return "Shift"; }
  Linear in, out;
};

struct PooledConfig {
  int64_t width = 32, points = 128;
};

template <class V>
void visit(V& v, PooledConfig& c) {
  v("width", c.width, "units of the hidden layers", between(1, 1024));
  v("points", c.points, "points per cloud", between(1, 4096));
}

/// An extractor: each point by itself, the largest over all points, the joints.
struct Pooled : SkeletonModel {
  using Config = PooledConfig;
  Pooled(const PooledConfig& c, const Init& init)
      : each(3, c.width, init.sub("each")),
        joints(c.width, 3 * kJoints, init.sub("joints")),
        points_(c.points) {}
  SkeletonOutput forward(Context& ctx, const SkeletonInput& in) override {
    const Var whole = max(each(ctx, in.cloud, Activation::relu), 1);
    SkeletonOutput out;
    out.joints = reshape(joints(ctx, whole), {in.cloud.size(0), kJoints, 3});
    return out;
  }
  int64_t points() const override { return points_; }
  void visit(Fields& f) override {
    f("each", each);
    f("joints", joints);
  }
  const char* kind() const override { return "Pooled"; }
  Linear each, joints;

 private:
  int64_t points_;
};

/// A kernel of one's own, number by number: x^2 / (1 + x^2), the loss of Geman and McClure, in
/// which far-off points count little; with `gy`, the gradient for x.
struct GemanMcClureArgs {
  const Tensor& x;
  const Tensor* gy;
  Tensor& out;
};

template <class T>
void run_geman_mcclure(const GemanMcClureArgs& a) {
  const T *x = a.x.data<T>(), *gy = a.gy ? a.gy->data<T>() : nullptr;
  T* out = a.out.data<T>();
  parallel_for(a.x.numel(), 1 << 14, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) {
      const T one = 1 + x[i] * x[i];
      out[i] = gy ? gy[i] * 2 * x[i] / (one * one) : x[i] * x[i] / one;
    }
  });
}

void geman_mcclure_on_cpu(const GemanMcClureArgs& a) {
  a.x.dtype() == DType::f64 ? run_geman_mcclure<double>(a) : run_geman_mcclure<float>(a);
}

/// The op of this kernel.
struct GemanMcClure {
  static constexpr const char* name = "geman_mcclure";
  static constexpr const char* letters = "x[...]";
  void check(Inputs x) const { require_floats(name, letters, x); }
  Tensor forward(Inputs x, Saved& saved) const {
    Tensor y = empty_like(x[0]);
    launch(GemanMcClureArgs{x[0], nullptr, y});
    saved.keep({x[0]});
    return y;
  }
  Grads backward(const Saved& saved, const Tensor& gy, Needs) const {
    Tensor gx = empty_like(gy);
    launch(GemanMcClureArgs{saved[0], &gy, gx});
    return {gx};
  }
};

Var geman_mcclure(const Var& x) { return call(GemanMcClure{}, {x}); }

gradcheck::OpSamples op_samples() {
  using namespace gradcheck;
  OpSamples out = samples_for<GemanMcClure>();
  const auto build = [](Args x) { return geman_mcclure(x[0]); };
  out.add("[2, 1, 3]", {random({2, 1, 3}, 1)}, build);
  out.add("nothing", {random({0, 3}, 1)}, build);
  out.large("many", {random({300, 300}, 2)}, build);
  out.error("integers", {Tensor::from<int32_t>({2}, {1, 2})}, build);
  out.random = [build](Rng& rng) {
    const auto n = static_cast<int64_t>(1 + rng.below(5));
    return Sample{"random", {random({n, 2}, rng.below(1000))}, build};
  };
  return out;
}

/// A stage with a loss of its own: points count by their distances, far-off ones little.
struct ShiftStageConfig {
  ModelChoice model{"mine/shift"};
  double weight = 1;
  OptimiserConfig optimiser;
};

template <class V>
void visit(V& v, ShiftStageConfig& c) {
  visit_choice(v, c.model);
  v("weight", c.weight, "of the loss", at_least(0));
  v("optimiser", c.optimiser, "steps, batch, rate");
}

class ShiftStage final : public SupervisedStage<TransferSampler> {
 public:
  using Config = ShiftStageConfig;
  static std::vector<std::string> reads(const Config&) { return {}; }
  ShiftStage(const Config& c, const StageInput& in)
      : SupervisedStage("shift", c.optimiser, in),
        weight_(c.weight),
        model_(add_network<TransferModel>(c.model, RngKey{in.seed, 0}, {{"points", "20"}})) {
    sampler_.emplace(in.train, TransferConfig{.points = 20, .vertices = 40}, in.seed);
    begin({"transfer"});
  }
  NamedValues validate() override { return {{"loss", 0}}; }

 private:
  Var loss(Context& ctx, const TransferBatch& b, int64_t, Tensor*) const override {
    const Var made = model_->forward(ctx, {b.pose, b.identity});
    const Var distances = smooth_length(made - Var(b.truth), 1e-8);
    return scale(mean_all(geman_mcclure(distances)), weight_);
  }

  double weight_;
  TransferModel* model_;
};

/// Notes the first and the last loss, and how often the stage was validated.
struct Watch final : TrainObserver {
  void on_step(const Stage&, int64_t done, const NamedValues& figures) override {
    last = figures[0].second;
    if (done == 1) first = last;
  }
  void on_validation(Stage&, int64_t, const NamedValues&) override { ++validations; }
  double first = 0, last = 0;
  int validations = 0;
};

bool checks_an_op() {
  backend(Device{}).add<GemanMcClureArgs, geman_mcclure_on_cpu>();
  gradcheck::register_op(op_samples());
  const gradcheck::Report report = gradcheck::check(gradcheck::all_samples().back());
  std::printf("%s", report.text().c_str());
  return report.ok() && report.compared > 0;
}

bool finds_joints() {
  register_model(model_of<Pooled>("mine/pooled", "skeleton", "the largest over all points"));
  TrainConfig config;
  read_config(parse_yaml("name: joints\n"
                         "stages: [skeleton]\n"
                         "data: {bodies: {train: 2, validation: 1, test: 1},"
                         " motions: {train: 2, validation: 1, test: 1}}\n"
                         "skeleton: {model: mine/pooled, validation_clouds: 4,"
                         " optimiser: {steps: 60, batch: 8, schedule: {rate: 0.01}}}\n",
                         "joints.yaml"),
              config);
  const TrainingData data(config.data);
  RunDir run = RunDir::create("runs", config.name, resolved_yaml(config), "{}", config.trained());
  Watch watch;
  const Bundle weights = train_run(run, config, data, {.observers = {&watch}});
  save_bundle(run.dir() + "/weights.safetensors", weights);
  std::printf("loss of my extractor: %.4f, then %.4f\n", watch.first, watch.last);
  return watch.last < 0.8 * watch.first &&
         load_bundle(run.dir()).find_as<Pooled>("skeleton") != nullptr;
}

bool trains_and_answers() {
  register_model(model_of<Shift>("mine/shift", "transfer", "moves vertices a little"));
  register_stage(stage_of<ShiftStage>("shift", "a stage of mine", {"transfer"}, {"loss"}));
  register_system({.name = "mine",
                   .help = "my system",
                   .roles = {"transfer"},
                   .own_skin = false,
                   .make = [](SystemInput in) -> std::unique_ptr<System> {
                     return std::make_unique<Transfer>(in.weights, in.weights_name,
                                                       std::move(in.target), in.target_name,
                                                       in.options);
                   }});
  TrainConfig config;
  read_config(parse_yaml("name: mine\n"
                         "stages: [shift]\n"
                         "data: {bodies: {train: 2, validation: 1, test: 1},"
                         " motions: {train: 2, validation: 1, test: 1}}\n"
                         "shift: {sizes: {width: 16}, optimiser: {steps: 60, batch: 4,"
                         " schedule: {rate: 0.01}}}\n",
                         "mine.yaml"),
              config);
  const TrainingData data(config.data);
  RunDir run = RunDir::create("runs", config.name, resolved_yaml(config), "{}", config.stages);
  Watch watch;
  const auto make = [&](const std::string& name, Bundle* so_far) {
    return make_stage(config, name, data, so_far);
  };
  const Bundle weights = train(run, config.stages, config.loop, make, {.observers = {&watch}});
  std::printf("loss of my network: %.4f, then %.4f\n", watch.first, watch.last);
  const Body& body = data.train.bodies[0];
  SystemInput input;
  input.weights = weights;
  input.weights_name = "my weights";
  input.target = body.rest;
  input.target_name = body.id;
  const auto system = make_system(system_type("mine"), std::move(input));
  Points moved;
  system->push(body.rest.vertices, "a cloud",
               [&](const RetargetedFrame& f) { moved = f.vertices; });
  return watch.last < 0.8 * watch.first && watch.validations > 0 &&
         moved.size() == body.rest.vertices.size();
}

}  // namespace mine
