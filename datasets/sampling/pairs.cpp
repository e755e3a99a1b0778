#include "datasets/sampling/pairs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/parallel.h"
#include "datasets/sampling/dress.h"
#include "datasets/sampling/normals.h"

namespace restage {
namespace {

void write(float* to, const Points& points, const Vec3& origin) {
  const Point o = origin.cast<float>();
  for (size_t i = 0; i < points.size(); ++i) Eigen::Map<Point>(to + 3 * i) = points[i] - o;
}

}  // namespace

PairSampler::PairSampler(const Corpus& corpus, const PairConfig& config, uint64_t seed)
    : corpus_(corpus),
      config_(config),
      key_(RngKey{seed, 0}.fold("pairs")),
      frames_(corpus.motions, 1, static_cast<size_t>(std::max(1, config.frame_step))),
      surfaces_(surface_samplers(corpus.bodies)) {
  if (surfaces_.empty()) throw InputError("", "no bodies to draw pairs from", "add bodies");
  check_setting("pair", config_.points >= 1 && config_.points <= 1 << 20, "points", "1 to 1048576");
  check_setting("pair", config_.frame_step >= 1, "frame_step", "1 or more");
}

PairBatch PairSampler::make(int64_t n) const {
  PairBatch out;
  out.rest_points = Tensor::empty({n, config_.points, 3});
  out.posed_points = Tensor::empty({n, config_.points, 3});
  out.rest_joints = Tensor::empty({n, kJoints, 3});
  out.local = Tensor::empty({n, kJoints, 3, 3});
  out.axis_angle = Tensor::empty({n, 3 * kJoints});
  out.seen_points = Tensor::empty({n, config_.points, 3});
  out.seen_joints = Tensor::empty({n, kJoints, 3});
  if (config_.skin_weights) out.weights = Tensor::empty({n, config_.points, kJoints});
  return out;
}

void PairSampler::fill(PairBatch& batch, int64_t row, const RngKey& key, size_t body_index,
                       const Pose& pose, const Augmentation& augmentation) const {
  const Body& body = corpus_.bodies.at(body_index);
  const SurfaceSamples samples =
      surfaces_[body_index].draw(key.fold("surface"), static_cast<size_t>(config_.points));
  Points rest = samples.on_rest(body), posed = samples.on_pose(body, pose);
  augment({0.0, augmentation.mirror}, rest);
  augment(augmentation, posed);
  const Joints joints = augmented_rest(augmentation, body.joints);
  const Pose turned = augmented(augmentation, pose);
  write(batch.rest_points.data<float>() + row * config_.points * 3, rest, joints[0]);
  write(batch.posed_points.data<float>() + row * config_.points * 3, posed, turned.root);
  for (int j = 0; j < kJoints; ++j) {
    const int64_t at = row * kJoints + j;
    matrix_at(batch.local.data<float>() + 9 * at) = turned.local[j].cast<float>();
    const Eigen::AngleAxisd turn{Quat(turned.local[j])};
    Eigen::Map<Point>(batch.axis_angle.data<float>() + 3 * at) =
        (turn.angle() * turn.axis()).cast<float>();
    Eigen::Map<Point>(batch.rest_joints.data<float>() + 3 * at) =
        (joints[j] - joints[0]).cast<float>();
  }
  show(batch, row, key.fold("seen"), body_index, samples, augmentation);
}

/// The networks' view of the pair, and the skin weights that are asked of them.
void PairSampler::show(PairBatch& batch, int64_t row, const RngKey& key, size_t body_index,
                       const SurfaceSamples& samples, const Augmentation& augmentation) const {
  const Body& body = corpus_.bodies[body_index];
  const size_t n = samples.size();
  Rng rng(key);
  const bool clothes = rng.uniform() < config_.dressed;
  const Outfit outfit = clothes ? draw_outfit(rng, body.joints) : Outfit{};
  const Points picked = samples.rest_vertices(body);
  Points seen = samples.on(picked), normals;
  std::array<float, kJoints> weights;
  if (clothes) normals = surfaces_[body_index].normals(samples, picked);
  for (size_t i = 0; i < n && (clothes || config_.skin_weights); ++i) {
    samples.skin_weights(body, i, false, weights.data());
    if (clothes) seen[i] += outfit.thickness(weights.data(), seen[i]) * normals[i];
    if (!config_.skin_weights) continue;
    float* to =
        batch.weights.data<float>() + (row * config_.points + static_cast<int64_t>(i)) * kJoints;
    for (int j = 0; j < kJoints; ++j) to[augmentation.mirror ? kMirror[j] : j] = weights[j];
  }
  augment({0.0, augmentation.mirror}, seen);
  Joints joints = augmented_rest(augmentation, body.joints);
  for (size_t j = 0; j < kJoints; ++j)
    joints[j] += config_.joint_noise * normal3(key.fold("joints"), j).cast<double>();
  write(batch.seen_points.data<float>() + row * config_.points * 3, seen, joints[0]);
  for (size_t j = 0; j < kJoints; ++j)
    Eigen::Map<Point>(batch.seen_joints.data<float>() +
                      3 * (row * kJoints + static_cast<int64_t>(j))) =
        (joints[j] - joints[0]).cast<float>();
}

PairBatch PairSampler::batch(int64_t first, int64_t n) const {
  PairBatch out = make(n);
  parallel_for(n, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) {
      const RngKey key = key_.fold(static_cast<uint64_t>(first + i));
      Rng rng(key.fold("subject"));
      const size_t body = rng.below(corpus_.bodies.size());
      const FrameRef at = frames_.at(rng.below(frames_.count()));
      const Augmentation augmentation =
          draw_augmentation(rng, config_.heading ? M_PI : 0.0, config_.mirror);
      const Pose pose = pose_on(corpus_.motions[at.motion], corpus_.bodies[body], at.frame);
      fill(out, i, key, body, pose, augmentation);
    }
  });
  return out;
}

PairBatch PairSampler::pair(int64_t index, size_t body, const Pose& pose) const {
  PairBatch out = make(1);
  fill(out, 0, key_.fold(static_cast<uint64_t>(index)), body, pose, Augmentation{});
  return out;
}

}  // namespace restage
