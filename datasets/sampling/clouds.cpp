#include "datasets/sampling/clouds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "autograd/base/parallel.h"
#include "datasets/readers/errors.h"
#include "datasets/sampling/dress.h"
#include "datasets/sampling/intruder.h"
#include "datasets/sampling/memory.h"
#include "datasets/sampling/partial.h"
#include "datasets/sampling/skirt.h"
#include "datasets/sampling/things.h"
#include "nn/geometry/skeleton.h"

namespace restage {
namespace {

constexpr size_t kNobody = static_cast<size_t>(-1);

CloudConfig checked(const CloudConfig& c) {
  check_setting("cloud", c.points >= 1 && c.points <= 1 << 20, "points", "1 to 1048576");
  check_setting("cloud", c.noise >= 0 && std::isfinite(c.noise), "noise", "metres, 0 or more");
  check_setting("cloud", c.tpose_share >= 0 && c.tpose_share <= 1, "tpose_share", "0 to 1");
  check_setting("cloud", c.tpose_heading >= 0 && c.tpose_heading <= 180, "tpose_heading",
                "0 to 180 degrees");
  check_setting("cloud", c.scale_jitter >= 0 && c.scale_jitter < 1, "scale_jitter", "0 to below 1");
  check_setting("cloud", c.frame_step >= 1, "frame_step", "1 or more");
  check_setting("cloud", c.recombined >= 0 && c.recombined <= 1, "recombined", "0 to 1");
  for (const double share : {c.dressed, c.one_camera, c.camera_ring, c.one_camera + c.camera_ring})
    check_setting("cloud", share >= 0 && share <= 1, "dressed, one_camera, camera_ring",
                  "0 to 1, and one_camera + camera_ring at most 1");
  check_setting("cloud", c.bend >= 0 && c.bend <= 90, "bend", "0 to 90 degrees");
  check_setting("cloud", c.intruder >= 0 && c.intruder <= 1, "intruder", "0 to 1");
  check_setting("cloud", c.remembered >= 0 && c.remembered <= 1, "remembered", "0 to 1");
  for (const double share : {c.things, c.cut_floor, c.smoothed, c.skirts})
    check_setting("cloud", share >= 0 && share <= 1, "things, cut_floor, smoothed, skirts",
                  "0 to 1");
  for (const double share : {c.ceiling, c.cropped, c.sparse, c.noisy, c.tilted, c.upright})
    check_setting("cloud", share >= 0 && share <= 1,
                  "ceiling, cropped, sparse, noisy, tilted, upright", "0 to 1");
  check_setting("cloud", c.noisy == 0 || (c.most_noise >= c.noise && c.most_noise <= 1),
                "most_noise", "metres, at least noise and at most 1");
  check_setting("cloud", c.ceiling == 0 || c.one_camera + c.camera_ring > 0, "ceiling",
                "0 where no camera sees a cloud, or give one_camera or camera_ring");
  check_setting("cloud", c.min_fraction > 0 && c.min_fraction <= 1, "min_fraction", "above 0 to 1");
  return c;
}

/// Numbers 0 ... distinct - 1, some of them repeated to make `n`, in random order.
std::vector<size_t> repeat_some(const RngKey& key, size_t distinct, size_t n) {
  std::vector<size_t> order(distinct);
  std::iota(order.begin(), order.end(), size_t{0});
  if (distinct == n) return order;
  Rng rng(key);
  while (order.size() < n) order.push_back(rng.below(distinct));
  for (size_t i = n; i > 1; --i) std::swap(order[i - 1], order[rng.below(i)]);
  return order;
}

/// As many of the points as `share` of those that are seen take the place of some of these.
void replace_some(double share, Points from, Rng& rng, Points& points, std::vector<size_t>& which) {
  const size_t n =
      std::min(from.size(), static_cast<size_t>(share * static_cast<double>(points.size())));
  for (size_t k = 0; k < n; ++k) {
    std::swap(from[k], from[k + rng.below(from.size() - k)]);
    const size_t i = rng.below(points.size());
    points[i] = from[k];
    which[i] = kNobody;
  }
}

/// The half of a surface's points that somebody sees who stands in the direction `side`.
void keep_half(double side, Points& points) {
  const Point middle = centroid(points);
  const Point towards(static_cast<float>(std::cos(side)), 0, static_cast<float>(std::sin(side)));
  std::erase_if(points, [&](const Point& p) { return (p - middle).dot(towards) < 0; });
}

float lowest(const Points& points) {
  float out = std::numeric_limits<float>::max();
  for (const Point& p : points) out = std::min(out, p.y());
  return out;
}

/// The same, its frames earlier, but not before the first.
CloudSubject step_back(CloudSubject subject) {
  for (FrameRef* at : {&subject.at, &subject.limb_at})
    at->frame -= std::min(at->frame, subject.step_back);
  return subject;
}

/// Turns every joint but the pelvis about a random axis by a normally distributed angle: poses
/// between and around those that were recorded.
void bend(const RngKey& key, double angle, Pose* pose) {
  Rng rng(key);
  for (size_t j = 1; j < kJoints; ++j) {
    Vec3 axis;
    for (int c = 0; c < 3; ++c) axis[c] = rng.normal();
    const double by = angle * rng.normal();
    if (axis.norm() > 1e-9)
      pose->local[j] = pose->local[j] * Eigen::AngleAxisd(by, axis.normalized());
  }
}

}  // namespace

CloudSampler::CloudSampler(const Corpus& corpus, const CloudConfig& config, uint64_t seed)
    : corpus_(corpus),
      config_(checked(config)),
      key_(RngKey{seed, 0}.fold("clouds")),
      frames_(corpus.motions, 1, static_cast<size_t>(config_.frame_step)),
      own_(corpus),
      surfaces_(surface_samplers(corpus.bodies)) {
  if (surfaces_.empty()) throw InputError("", "no bodies to draw clouds from", "add bodies");
  if (config_.smoothed == 0) return;
  smoothings_.resize(corpus.bodies.size());
  parallel_for(std::ssize(smoothings_), 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i)
      smoothings_[static_cast<size_t>(i)] = smoothing(corpus_.bodies[static_cast<size_t>(i)].rest);
  });
}

CloudSubject CloudSampler::subject(int64_t index) const {
  Rng rng(key_.fold(static_cast<uint64_t>(index)).fold("subject"));
  CloudSubject out;
  out.rest = rng.uniform() < config_.tpose_share;
  out.body = rng.below(corpus_.bodies.size());
  out.at = frames_.at(rng.below(frames_.count()));
  const double range = out.rest ? config_.tpose_heading * M_PI / 180 : M_PI;
  out.augmentation = draw_augmentation(rng, config_.heading ? range : 0.0, config_.mirror);
  out.scale = 1 + rng.uniform(-1.0, 1.0) * config_.scale_jitter;
  const double sensor = rng.uniform();
  if (!out.rest && sensor < config_.one_camera + config_.camera_ring)
    out.sensor = sensor < config_.one_camera ? Sensor::one_camera : Sensor::ring;
  out.dressed = rng.uniform() < config_.dressed;
  if (rng.uniform() < config_.recombined) {
    constexpr std::array<int, 6> kLimbs = {1, 2, 3, 3, 13, 14};  // legs, upper body, arms
    out.limb = kLimbs[rng.below(kLimbs.size())];
    out.limb_at = frames_.at(rng.below(frames_.count()));
  }
  if (rng.uniform() < config_.remembered) {
    out.memory = rng.uniform() < 0.5 ? CloudSubject::Memory::drawn : CloudSubject::Memory::asked;
    out.step_back = 1 + rng.below(3);
  }
  out.intruder = out.sensor != Sensor::none && rng.uniform() < config_.intruder;
  if (config_.bend > 0) {
    out.bend = config_.bend * M_PI / 180;
    out.bend_key = key_.fold(static_cast<uint64_t>(index)).fold("bend");
  }
  if (!out.rest) out.body = own_.or_own(out.body, out.at.motion, rng);
  Rng capture(key_.fold(static_cast<uint64_t>(index)).fold("capture"));
  out.thing = capture.uniform() < config_.things && !out.rest;
  out.cut_floor = capture.uniform() < config_.cut_floor && !out.rest;
  out.smoothed = capture.uniform() < config_.smoothed ? capture.uniform(0.2, 1.0) : 0;
  out.skirt = capture.uniform() < config_.skirts;
  make_harder(index, &out);
  return out;
}

void CloudSampler::make_harder(int64_t index, CloudSubject* subject) const {
  Rng rng(key_.fold(static_cast<uint64_t>(index)).fold("harder"));
  const bool tilted = rng.uniform() < config_.tilted, upright = rng.uniform() < config_.upright;
  subject->ceiling = rng.uniform() < config_.ceiling;
  subject->cropped = rng.uniform() < config_.cropped && !subject->rest;
  subject->sparse = rng.uniform() < config_.sparse;
  const double root = rng.uniform(std::sqrt(config_.noise), std::sqrt(config_.most_noise));
  if (rng.uniform() < config_.noisy) subject->noise = root * root;
  if (subject->rest) return;
  if (upright) subject->shown = standing_turn(true_joints(*subject));
  if (tilted) subject->shown = draw_tilt(rng) * subject->shown;
}

Pose CloudSampler::pose(const CloudSubject& subject) const {
  const Body& body = corpus_.bodies.at(subject.body);
  const auto at = [&](const FrameRef& frame) {
    return pose_on(corpus_.motions.at(frame.motion), body, frame.frame);
  };
  Pose out = at(subject.at);
  if (subject.limb >= 0) {
    const Pose other = at(subject.limb_at);
    std::array<bool, kJoints> hangs{};
    for (int j = 0; j < kJoints; ++j) {
      hangs[j] = j == subject.limb || (kParents[j] >= 0 && hangs[kParents[j]]);
      if (hangs[j]) out.local[j] = other.local[j];
    }
  }
  if (subject.bend > 0) bend(subject.bend_key, subject.bend, &out);
  return out;
}

CloudSampler::Drawn CloudSampler::draw(const CloudSubject& subject, const SurfaceSamples& samples,
                                       const RngKey& key) const {
  const Body& body = corpus_.bodies.at(subject.body);
  Drawn out{{}, {}, body.joints, {}};
  out.turns.fill(Mat3::Identity());
  const SurfaceSampler& surface = surfaces_[subject.body];
  Points picked;
  if (subject.rest) {
    picked = samples.rest_vertices(body);
  } else {
    const Pose posed = pose(subject);
    picked = pose_surface(body, posed, &samples.vertices);
    const PosedSkeleton skeleton = forward_kinematics(body.joints, posed);
    out.joints = skeleton.joints;
    out.turns = skeleton.global;
  }
  out.points = samples.on(picked);
  if (subject.smoothed > 0) {
    const Points& whole = smoothings_.at(subject.body);
    Points some;
    for (const int32_t v : samples.vertices) some.push_back(whole[static_cast<size_t>(v)]);
    some = samples.on(some);
    std::array<float, kJoints> weights;
    for (size_t i = 0; i < out.points.size(); ++i) {
      samples.skin_weights(body, i, false, weights.data());
      Mat3 turn = Mat3::Zero();
      for (size_t j = 0; j < kJoints; ++j) turn += double{weights[j]} * out.turns[j];
      out.points[i] += (subject.smoothed * turn * some[i].cast<double>()).cast<float>();
    }
  }
  if (subject.dressed || subject.sensor != Sensor::none)
    out.normals = surface.normals(samples, picked);
  if (subject.dressed) {
    Rng rng(key);
    const Outfit outfit = draw_outfit(rng, body.joints);
    const Points rest = samples.on_rest(body);
    std::array<float, kJoints> weights;
    for (size_t i = 0; i < out.points.size(); ++i) {
      samples.skin_weights(body, i, false, weights.data());
      out.points[i] += outfit.thickness(weights.data(), rest[i]) * out.normals[i];
    }
  }
  if (subject.skirt) add_skirt(subject, samples, key.fold("skirt"), &out);
  augment(subject.augmentation, out.points);
  augment(subject.augmentation, out.normals);
  for (Point& p : out.points) p *= static_cast<float>(subject.scale);
  out.joints = augmented(subject.augmentation, out.joints);
  out.turns = augmented(subject.augmentation, out.turns);
  for (Vec3& joint : out.joints) joint *= subject.scale;
  return out;
}

void CloudSampler::add_skirt(const CloudSubject& subject, const SurfaceSamples& samples,
                             const RngKey& key, Drawn* drawn) const {
  constexpr std::array<size_t, 5> kCovered = {0, 1, 2, 4, 5};  // hips to ankles, no feet
  Rng rng(key);
  const Skirt skirt = draw_skirt(rng);
  std::vector<bool> legs(drawn->points.size());
  std::array<float, kJoints> weights;
  for (size_t i = 0; i < legs.size(); ++i) {
    samples.skin_weights(corpus_.bodies.at(subject.body), i, false, weights.data());
    float share = 0;
    for (const size_t j : kCovered) share += weights[j];
    legs[i] = share >= 0.5f;
  }
  put_on(skirt, drawn->joints, legs, rng, drawn->points, drawn->normals);
}

CloudSampler::Seen CloudSampler::see(const CloudSubject& subject, size_t n, const RngKey& scene,
                                     const RngKey& key) const {
  Seen out;
  out.samples = surfaces_[subject.body].draw(key.fold("surface"), candidates(subject.sensor, n));
  Drawn drawn = draw(subject, out.samples, scene.fold("outfit"));
  out.joints = drawn.joints;
  out.turns = drawn.turns;
  out.points = std::move(drawn.points);
  out.which.resize(out.points.size());
  std::iota(out.which.begin(), out.which.end(), size_t{0});
  if (subject.sensor != Sensor::none)
    out.points = sensed({subject.sensor, subject.ceiling}, out.points, drawn.normals, n,
                        scene.fold("cameras"), key.fold("sensor"), &out.which);
  const float floor = lowest(out.points);
  if (subject.thing)
    put_thing(scene.fold("thing"), key.fold("thing"), subject.sensor != Sensor::none, &out);
  if (subject.intruder) intrude(scene.fold("intruder"), key.fold("intruder"), &out);
  if (subject.cut_floor)
    keep_beyond(Point::UnitY(),
                floor + static_cast<float>(Rng(scene.fold("floor")).uniform(0.01, 0.08)),
                out.points, out.which);
  if (subject.cropped) {
    Rng rng(scene.fold("cut"));
    cut_away(draw_cut(rng), out.points, out.which);
  }
  if (subject.sparse) {
    Rng rng(scene.fold("sparse"));
    thin_out(rng, n, out.points, out.which);
  }
  add_noise(key.fold("noise"), subject.noise > 0 ? subject.noise : config_.noise, out.points);
  if (!subject.shown.isIdentity(0)) turn(subject.shown, &out);
  return out;
}

void CloudSampler::turn(const Mat3& by, Seen* seen) {
  for (Point& p : seen->points) p = by.cast<float>() * p;
  for (Vec3& joint : seen->joints) joint = by * joint;
  for (Mat3& own : seen->turns) own = by * own;
}

/// A few points of the person make way for those of a limb: as many as a camera near it would see
/// of it, on the side that it sees.
void CloudSampler::intrude(const RngKey& scene, const RngKey& key, Seen* seen) const {
  Rng scene_rng(scene), rng(key);
  const Intruder intruder = draw_intruder(scene_rng, corpus_.bodies.size());
  const double share = scene_rng.uniform(0.03, 0.12), side = scene_rng.uniform(-M_PI, M_PI);
  const Body& body = corpus_.bodies[intruder.body];
  const SurfaceSamples samples = surfaces_[intruder.body].draw(key.fold("limb"), 1500);
  const Points rest = samples.on_rest(body);
  Points limb;
  std::array<float, kJoints> weights;
  for (size_t i = 0; i < rest.size(); ++i) {
    samples.skin_weights(body, i, false, weights.data());
    if (hangs_on(intruder.joint, weights) >= 0.5f) limb.push_back(rest[i]);
  }
  put_intruder(intruder, centroid(seen->points).cast<double>(), limb);
  keep_half(side, limb);
  replace_some(share, std::move(limb), rng, seen->points, seen->which);
}

/// `cameras`: only one side of the thing is seen.
void CloudSampler::put_thing(const RngKey& scene, const RngKey& key, bool cameras,
                             Seen* seen) const {
  Rng scene_rng(scene), rng(key);
  const Thing thing = draw_thing(scene_rng);
  const double share = scene_rng.uniform(0.02, 0.15), side = scene_rng.uniform(-M_PI, M_PI);
  Points points =
      thing_points(thing, seen->joints, lowest(seen->points), 2 * seen->points.size(), rng);
  if (cameras) keep_half(side, points);
  replace_some(share, std::move(points), rng, seen->points, seen->which);
}

Points CloudSampler::cloud(const CloudSubject& subject, size_t n, const RngKey& scene,
                           const RngKey& key) const {
  return see(subject, n, scene, key).points;
}

Joints CloudSampler::true_joints(const CloudSubject& subject) const {
  const Body& body = corpus_.bodies.at(subject.body);
  Joints out =
      augmented(subject.augmentation,
                subject.rest ? body.joints : forward_kinematics(body.joints, pose(subject)).joints);
  for (Vec3& joint : out) joint = subject.shown * (joint * subject.scale);
  return out;
}

/// `to`: 22 x 4 numbers, zero so far.
void CloudSampler::fill_past(const Row& row, const Point& centre, float* to) const {
  if (row.subject.memory == CloudSubject::Memory::none) return;
  Rng rng(row.key.fold("memory"));
  CloudSubject other = row.subject;
  other.at = frames_.at(rng.below(frames_.count()));
  const Memory memory = draw_memory(rng, true_joints(step_back(row.subject)), true_joints(other));
  for (int j = 0; j < kJoints; ++j) {
    Eigen::Map<Point>(to + 4 * j) = (memory.joints[j] - centre.cast<double>()).cast<float>();
    to[4 * j + 3] = static_cast<float>(memory.trust[j]);
  }
}

void CloudSampler::fill(const Row& row, int64_t i, CloudBatch& to) const {
  const auto n = static_cast<size_t>(config_.points);
  Rng rng(row.key.fold("count"));
  const auto least = static_cast<size_t>(std::ceil(config_.min_fraction * config_.points));
  const Seen seen = see(row.subject, least + rng.below(n - least + 1), row.scene, row.key);
  const std::vector<size_t> order = repeat_some(row.key.fold("repeat"), seen.points.size(), n);
  Points chosen;
  for (const size_t k : order) chosen.push_back(seen.points[k]);

  const Point centre = centroid(chosen);
  const auto at = [&](Tensor& t) { return t.data<float>() + i * (t.numel() / t.size(0)); };
  float *points = at(to.points), *joints = at(to.joints);
  Eigen::Map<Point>(at(to.centres)) = centre;
  for (size_t k = 0; k < n; ++k) Eigen::Map<Point>(points + 3 * k) = chosen[k] - centre;
  for (int j = 0; j < kJoints; ++j)
    Eigen::Map<Point>(joints + 3 * j) = (seen.joints[j] - centre.cast<double>()).cast<float>();
  for (size_t k = 0; to.weights.defined() && k < n; ++k) {
    float* weights = at(to.weights) + k * kJoints;
    if (seen.which[order[k]] == kNobody) {
      std::fill_n(weights, kJoints, 0.0f);
      continue;
    }
    seen.samples.skin_weights(corpus_.bodies[row.subject.body], seen.which[order[k]],
                              row.subject.augmentation.mirror, weights);
  }
  for (int j = 0; to.turns.defined() && j < kJoints; ++j)
    Eigen::Map<Eigen::Matrix<float, 3, 2>>(at(to.turns) + 6 * j) =
        seen.turns[j].leftCols<2>().cast<float>();
  if (to.past.defined()) fill_past(row, centre, at(to.past));
}

CloudBatch CloudSampler::make(const std::vector<Row>& rows) const {
  const auto n = std::ssize(rows);
  CloudBatch out;
  out.points = Tensor::empty({n, config_.points, 3});
  out.joints = Tensor::empty({n, kJoints, 3});
  out.centres = Tensor::empty({n, 3});
  if (config_.skin_weights) out.weights = Tensor::empty({n, config_.points, kJoints});
  if (config_.rotations) out.turns = Tensor::empty({n, kJoints, 6});
  if (config_.remembered > 0) out.past = Tensor::zeros({n, kJoints, 4});
  for (int64_t i = 0; i < n; ++i)
    if (rows[static_cast<size_t>(i)].subject.memory == CloudSubject::Memory::asked)
      out.asked.push_back(i);
  parallel_for(n, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) fill(rows[static_cast<size_t>(i)], i, out);
  });
  return out;
}

CloudBatch CloudSampler::batch(int64_t first, int64_t n) const {
  std::vector<Row> rows;
  for (int64_t i = first; i < first + n; ++i) {
    const RngKey key = key_.fold(static_cast<uint64_t>(i));
    rows.push_back({subject(i), key, key});
  }
  return make(rows);
}

CloudBatch CloudSampler::before(int64_t first, const CloudBatch& batch) const {
  std::vector<Row> rows;
  for (const int64_t i : batch.asked) {
    const RngKey key = key_.fold(static_cast<uint64_t>(first + i));
    rows.push_back({step_back(subject(first + i)), key, key.fold("before")});
  }
  return make(rows);
}

CloudBatch CloudSampler::clouds(const std::vector<CloudSubject>& subjects) const {
  std::vector<Row> rows;
  for (const CloudSubject& s : subjects) {
    const RngKey key = key_.fold(rows.size());
    rows.push_back({s, key, key});
  }
  return make(rows);
}

}  // namespace restage
