#include "datasets/sampling/code_windows.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/parallel.h"
#include "datasets/sampling/code_spaces.h"

namespace restage {
namespace {

void write_points(float* to, const Points& points, const Point& origin) {
  for (size_t i = 0; i < points.size(); ++i) Eigen::Map<Point>(to + 3 * i) = points[i] - origin;
}

/// Surface points of a pose of a body and, behind them, some of its vertices.
struct PosedSamples {
  Points cloud, vertices;
};
PosedSamples pose_samples(const Body& body, const Pose& pose, const SurfaceSamples& samples,
                          const std::vector<int32_t>& vertices) {
  std::vector<int32_t> all = samples.vertices;
  all.insert(all.end(), vertices.begin(), vertices.end());
  Points posed = pose_surface(body, pose, &all);
  const auto from = posed.begin() + static_cast<std::ptrdiff_t>(samples.vertices.size());
  PosedSamples out{{}, Points(from, posed.end())};
  posed.erase(from, posed.end());
  out.cloud = samples.on(posed);
  return out;
}

}  // namespace

CodeWindowSampler::CodeWindowSampler(const Corpus& corpus, const CodeWindowConfig& config,
                                     std::vector<int32_t> vertices, uint64_t seed)
    : corpus_(corpus),
      config_(config),
      vertices_(std::move(vertices)),
      key_(RngKey{seed, 0}.fold("code windows")),
      frames_(corpus.motions, static_cast<size_t>(std::max(
                                  1, (config.frames - 1) * std::max(1, config.frame_step) + 1))),
      surfaces_(surface_samplers(corpus.bodies)) {
  if (corpus.bodies.empty()) throw InputError("", "no bodies to draw from", "add bodies");
  check_setting("window", config_.frames >= 2 && config_.frames <= 1024, "frames", "2 to 1024");
  check_setting("window", config_.frame_step >= 1, "frame_step", "1 or more");
  check_setting("window", config_.points >= 1 && config_.points <= 1 << 16, "points", "1 to 65536");
  for (const Body& body : corpus_.bodies)
    for (const int32_t v : vertices_)
      if (v < 0 || static_cast<size_t>(v) >= body.rest.vertices.size())
        throw InputError("", "body '" + body.id + "' has no vertex " + std::to_string(v),
                         "give bodies of one topology");
}

CodeWindowSampler::Subject CodeWindowSampler::subject(int64_t index) const {
  Rng rng(key_.fold(static_cast<uint64_t>(index)).fold("subject"));
  Subject out;
  out.body = rng.below(corpus_.bodies.size());
  out.at = frames_.at(rng.below(frames_.count()));
  out.turn = config_.heading * M_PI / 180 * (2 * rng.uniform() - 1);
  return out;
}

/// Of frame `frame` of the window; the pelvis where the body rests.
Pose CodeWindowSampler::pose(const Subject& subject, int frame) const {
  const Body& body = corpus_.bodies[subject.body];
  const size_t number = subject.at.frame + static_cast<size_t>(frame * config_.frame_step);
  Pose out = pose_on(corpus_.motions[subject.at.motion], body, number);
  out.local[0] = turn_about_y(subject.turn) * out.local[0];
  out.root = body.joints[0];
  return out;
}

void CodeWindowSampler::fill(CodeWindowBatch& batch, int64_t row, int64_t index) const {
  const Subject who = subject(index);
  const RngKey key = key_.fold(static_cast<uint64_t>(index));
  const Body& body = corpus_.bodies[who.body];
  const auto count = static_cast<size_t>(config_.points);
  const int64_t p = config_.points, v = std::ssize(vertices_);
  for (int t = 0; t < config_.frames; ++t) {
    const SurfaceSamples samples =
        surfaces_[who.body].draw(key.fold("frame").fold(static_cast<uint64_t>(t)), count);
    const PosedSamples posed = pose_samples(body, pose(who, t), samples, vertices_);
    const int64_t place = row * config_.frames + t;
    write_points(batch.clouds.data<float>() + place * p * 3, posed.cloud, centroid(posed.cloud));
    write_points(batch.truth.data<float>() + place * v * 3, posed.vertices, Point::Zero());
  }
  const Points rest = surfaces_[who.body].draw(key.fold("rest"), count).on_rest(body);
  write_points(batch.rest.data<float>() + row * p * 3, rest, centroid(rest));
  batch.body.data<int32_t>()[row] = static_cast<int32_t>(who.body);
}

CodeWindowBatch CodeWindowSampler::batch(int64_t first, int64_t n) const {
  CodeWindowBatch out;
  out.clouds = Tensor::empty({n, config_.frames, config_.points, 3});
  out.rest = Tensor::empty({n, config_.points, 3});
  out.truth = Tensor::empty({n, config_.frames, std::ssize(vertices_), 3});
  out.body = Tensor::empty({n}, DType::i32);
  parallel_for(n, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) fill(out, i, first + i);
  });
  return out;
}

Tensor CodeWindowSampler::poses(int64_t first, int64_t n) const {
  Tensor out = Tensor::empty({n, config_.frames, 3 * kJoints});
  parallel_for(n, 16, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) {
      const Subject who = subject(first + i);
      std::array<Vec3, kJoints> before;
      for (int t = 0; t < config_.frames; ++t) {
        const Pose now = pose(who, t);
        float* row = out.data<float>() + (i * config_.frames + t) * 3 * kJoints;
        for (size_t j = 0; j < kJoints; ++j) {
          const Eigen::AngleAxisd turn{Quat(now.local[j])};
          const Vec3 said = turn.angle() * turn.axis();
          before[j] = t == 0 ? said : without_jump(said, before[j]);
          Eigen::Map<Point>(row + 3 * j) = before[j].cast<float>();
        }
      }
    }
  });
  return out;
}

}  // namespace restage
