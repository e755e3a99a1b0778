#include "train/stages/codes_stage.h"

#include <algorithm>
#include <numeric>

#include "autograd/base/log.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "datasets/sampling/code_spaces.h"
#include "datasets/sampling/thin_mesh.h"
#include "nn/losses/measure.h"

namespace restage {
namespace {

constexpr double kNoLength = 1e-12;  // under the root of lengths: they have a derivative at zero

CodeWindowConfig windows_of(const CodesStageConfig& c) {
  CodeWindowConfig out = c.windows;
  out.frames = static_cast<int>(c.model.sizes.as<H4dConfig>().frames);
  return out;
}

/// Vertices that the loss looks at: the same in training and validation.
std::vector<int32_t> looked_at(const StageInput& in, int64_t count) {
  if (in.train.bodies.empty()) throw InputError("", "no bodies to train on", "add bodies");
  require_topology(in.train.bodies, in.train.bodies.front());
  require_topology(in.validation.bodies, in.train.bodies.front());
  return thin_mesh(in.train.bodies.front().rest, static_cast<size_t>(count)).kept;
}

/// Rows `which` of x [v, ...].
Tensor rows_of(const Tensor& x, const std::vector<int32_t>& which) {
  Shape shape{std::ssize(which)};
  for (int i = 1; i < x.rank(); ++i) shape.push_back(x.size(i));
  Tensor out = Tensor::empty(shape);
  const int64_t width = x.numel() / x.size(0);
  for (size_t i = 0; i < which.size(); ++i)
    std::copy_n(x.data<float>() + which[i] * width, width,
                out.data<float>() + static_cast<int64_t>(i) * width);
  return out;
}

Tensor rows_of(const Tensor& x, const Tensor& which) {
  return rows_of(x, which.cpu().to_vector<int32_t>());
}

Tensor shapes_of(const Corpus& corpus, const LinearBody& body) {
  std::vector<float> all;
  for (const Body& b : corpus.bodies) {
    const std::vector<float> shape = nearest_shape(body.mean, body.directions, b.rest.vertices);
    all.insert(all.end(), shape.begin(), shape.end());
  }
  return Tensor::from<float>({std::ssize(corpus.bodies), body.directions.size(2)}, all);
}

/// Warns where a second stage is wanted, but none is trained.
void check_second_stage(const CodesStageConfig& c) {
  const bool built = c.model.sizes.as<H4dConfig>().aux > 0;
  if (built && c.aux_from >= c.optimiser.steps)
    log_warning("codes.aux_from is not before the last step: the second stage is not trained");
  if (!built && c.aux_from > 0)
    log_warning("codes.aux_from says nothing without codes.sizes.aux: there is no second stage");
}

Var length_of_difference(const Var& shape, const Tensor& truth) {
  return mean_all(smooth_length(shape - Var(truth), kNoLength));
}

}  // namespace

CodesStage::CodesStage(const Config& config, const StageInput& in)
    : SupervisedStage("codes", config.optimiser, in),
      config_(config),
      train_(in.train),
      validation_(in.validation) {
  sampler_.emplace(in.train, windows_of(config), looked_at(in, config.vertices),
                   sampler_seed(in.seed, "codes.windows"));
  held_out_.emplace(in.validation, windows_of(config), sampler_->vertices(), 1);
  model_ = make_network(config, in);
  begin({"codes"}, config.steps_per_batch);
}

/// The network, with the body and the basis of the training's data. It is as large as the data ask
/// for: three numbers of pose for each joint, and no more directions than there are.
H4d* CodesStage::make_network(const Config& config, const StageInput& in) {
  check_second_stage(config);
  AnyConfig sizes = config.model.sizes;
  auto& c = sizes.as<H4dConfig>();
  if (c.pose != 3 * kJoints)
    throw InputError("",
                     "codes.sizes.pose is " + std::to_string(c.pose) +
                         ", and a pose of the data has " + std::to_string(3 * kJoints) + " numbers",
                     "leave sizes.pose out");
  if (c.root >= c.motion)
    throw InputError("", "codes.sizes.root leaves no numbers of motion to the other joints",
                     "give a smaller root, or a larger motion");
  const LinearBody body = fit_linear_body(in.train.bodies, c.shape);
  const MotionBasis basis =
      fit_motion_basis(sampler_->poses(0, config.basis_windows), c.root, c.motion - c.root);
  c.shape = body.directions.size(2);
  c.root = basis.root.size(0);
  c.motion = c.root + basis.joints.size(0);
  c.vertices = body.mean.size(0);
  c.faces = std::ssize(in.train.bodies.front().rest.faces);
  const auto& asked = config.model.sizes.as<H4dConfig>();
  if (c.shape < asked.shape || c.motion < asked.motion)
    log_info("codes: the data have " + std::to_string(c.shape) + " directions of shape and " +
             std::to_string(c.motion) + " of motion");
  H4d* out = add_network<H4d>(config.model.role, config.model.name, sizes,
                              RngKey{in.seed, 0}.fold("codes"),
                              {{"points", std::to_string(config.windows.points)}});
  out->space.set(body, in.train.bodies.front().rest.faces, basis);
  return out;
}

const CodesStage::Meaning& CodesStage::meaning() {
  if (meaning_) return *meaning_;
  LinearBody body = model_->space.body();
  for (Tensor* t : {&body.mean, &body.directions, &body.weights}) *t = t->cpu();
  Meaning& out = meaning_.emplace();
  out.shapes = shapes_of(train_, body);
  for (Tensor* t : {&body.mean, &body.directions, &body.weights})
    *t = rows_of(*t, sampler_->vertices()).to(device());
  out.body = body;
  out.basis = model_->space.basis();
  return out;
}

/// Which body a window shows is looked up in the host's memory.
CodeWindowBatch CodesStage::taken_there(const CodeWindowBatch& here) const {
  CodeWindowBatch there = moved(here, device());
  there.body = here.body;
  return there;
}

CodesStage::Made CodesStage::make(Context& ctx, const CodeWindowBatch& there, bool rest,
                                  bool corrected) const {
  H4d::Codes codes = model_->codes(ctx, Var(there.clouds));
  if (!corrected) codes.aux = {};
  const Var poses = model_->poses(ctx, codes, meaning_->basis);
  Made out{pose_body(meaning_->body, codes.shape, poses), codes.shape, {}};
  if (rest) out.rest = model_->id_encoder(ctx, Var(there.rest));
  return out;
}

Var CodesStage::loss(Context& ctx, const CodeWindowBatch& there, int64_t step,
                     Tensor* answer) const {
  const CodesLossConfig& l = config_.loss;
  const Tensor shapes = rows_of(meaning_->shapes, there.body).to(device());
  const Made made = make(ctx, there, l.rest_shape > 0, step >= config_.aux_from);
  *answer = made.vertices.value;
  Var total = scale(mean_all(abs(made.vertices - Var(there.truth))), l.vertices) +
              scale(length_of_difference(made.shape, shapes), l.shape);
  if (l.rest_shape > 0)
    total = total + scale(length_of_difference(made.rest, shapes), l.rest_shape);
  return total;
}

NamedValues CodesStage::step(int64_t step) {
  meaning();
  return SupervisedStage::step(step);
}

/// Distances of vertices in the windows, and of the body that the T-pose's shape gives.
NamedValues CodesStage::validate() {
  const Meaning& m = meaning();
  Context ctx;
  double distance = 0, shape = 0;
  const int64_t n = config_.validation_windows;
  in_validation(n, 1, [&](int64_t i, int64_t) {
    const CodeWindowBatch windows = held_out_->batch(i, 1);
    const Made made = make(ctx, moved(windows, device()), true, true);
    distance += mean_distance(made.vertices.value.cpu(), windows.truth) / static_cast<double>(n);
    const Points& vertices =
        validation_.bodies[static_cast<size_t>(windows.body.data<int32_t>()[0])].rest.vertices;
    Tensor truth = Tensor::empty({1, std::ssize(sampler_->vertices()), 3});
    for (float* to = truth.data<float>(); const int32_t v : sampler_->vertices())
      to = std::copy_n(vertices[static_cast<size_t>(v)].data(), 3, to);
    const Tensor rest = shaped(m.body.mean, m.body.directions, made.rest).value.cpu();
    shape += mean_distance(rest, truth) / static_cast<double>(n);
  });
  return {{"distance_mm", 1e3 * distance}, {"shape_mm", 1e3 * shape}};
}

std::vector<Shown> CodesStage::show() {
  meaning();
  const int64_t n = shown_of(config_.validation_windows);
  const CodeWindowBatch windows = held_out_->batch(0, n);
  Context ctx;
  const Tensor made = make(ctx, moved(windows, device()), false, true).vertices.value.cpu();
  const int64_t t = made.size(1);
  const std::vector<int64_t> last = spaced(n, t - 1, t);  // frames
  return {clouds_of("cloud", windows.clouds, last), clouds_of("body of its codes", made, last),
          clouds_of("true body", windows.truth, last)};
}

}  // namespace restage
