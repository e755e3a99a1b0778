#include "datasets/sampling/windows.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "autograd/base/parallel.h"
#include "datasets/readers/errors.h"
#include "datasets/sampling/normals.h"
#include "nn/geometry/contact.h"

namespace restage {
namespace {

WindowConfig checked(const WindowConfig& c) {
  check_setting("window", c.frames >= 2 && c.frames <= 100000, "frames", "2 to 100000");
  check_setting("window", c.self_share >= 0 && c.self_share <= 1, "self_share", "0 to 1");
  check_setting("window", c.noise >= 0 && std::isfinite(c.noise), "noise", "metres, 0 or more");
  check_setting("window", c.noise_correlation >= 0 && c.noise_correlation < 1, "noise_correlation",
                "0 to below 1");
  return c;
}

/// A body performing part of a motion.
struct Window {
  Joints rest;
  std::vector<Pose> poses;
  std::vector<Joints> joints;  ///< world
  std::vector<Vec3> path() const {
    std::vector<Vec3> out;
    for (const Joints& x : joints) out.push_back(x[0]);
    return out;
  }
};

Window perform(const Body& body, const Motion& motion, size_t first, int frames,
               const Augmentation& augmentation) {
  Window out;
  out.rest = augmented_rest(augmentation, body.joints);
  for (size_t f = first; f < first + static_cast<size_t>(frames); ++f) {
    out.poses.push_back(augmented(augmentation, pose_on(motion, body, f)));
    out.joints.push_back(forward_kinematics(out.rest, out.poses.back()).joints);
  }
  return out;
}

/// True joints as an extractor may see them: every joint, the pelvis too, with noise of its own.
std::vector<Joints> noisy(const std::vector<Joints>& joints, const RngKey& key, double sigma,
                          double correlation) {
  std::vector<Joints> out = joints;
  if (sigma == 0) return out;
  const double fresh = std::sqrt(1 - correlation * correlation);
  Joints noise;
  for (size_t t = 0; t < out.size(); ++t)
    for (size_t j = 0; j < kJoints; ++j) {
      const Vec3 draw = sigma * normal3(key, t * kJoints + j).cast<double>();
      noise[j] = t == 0 ? draw : Vec3(correlation * noise[j] + fresh * draw);
      out[t][j] += noise[j];
    }
  return out;
}

/// What takes every frame's heading away, if that is wanted.
std::vector<Mat3> turns_of(const std::vector<Joints>& seen, const WindowConfig& c) {
  Heading heading(c.steady_heading);
  std::vector<Mat3> out;
  for (const Joints& x : seen)
    out.push_back(c.remove_heading ? turn_about_y(-heading(x)) : Mat3(Mat3::Identity()));
  return out;
}

float* row_of(Tensor& tensor, int64_t row) {
  return tensor.data<float>() + row * (tensor.numel() / tensor.size(0));
}

void put(float* to, const Vec3& x) {
  for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(x[c]);
}

void put_joints(float* to, const Joints& joints, const Mat3& turn = Mat3::Identity()) {
  for (size_t j = 0; j < kJoints; ++j) put(to + 3 * j, turn * (joints[j] - joints[0]));
}

void put_joints(float* to, const std::vector<Joints>& frames, const std::vector<Mat3>& turns) {
  for (size_t t = 0; t < frames.size(); ++t) put_joints(to + 3 * kJoints * t, frames[t], turns[t]);
}

void put_rotations(float* to, const Rotations& global, const Mat3& turn) {
  for (size_t j = 0; j < kJoints; ++j) matrix_at(to + 9 * j) = (turn * global[j]).cast<float>();
}

void put_path(float* to, const std::vector<Vec3>& path) {
  for (size_t t = 0; t < path.size(); ++t) put(to + 3 * t, path[t]);
}

void put_translation(float* to, const std::vector<Vec3>& path, Translation kind,
                     const std::vector<Mat3>& turns) {
  for (size_t t = 0; t < path.size(); ++t) {
    if (kind == Translation::velocity) {
      const size_t later = std::max<size_t>(t, 1);
      put(to + 3 * t, kFps * turns[t] * (path[later] - path[later - 1]));
    } else {
      put(to + 3 * t,
          turns[t] * (kind == Translation::relative ? Vec3(path[t] - path[0]) : path[t]));
    }
  }
}

void put_sixd(float* to, const std::vector<Pose>& poses, const std::vector<Mat3>& turns) {
  for (size_t t = 0; t < poses.size(); ++t)
    for (size_t j = 0; j < kJoints; ++j) {
      const Mat3 r = j == 0 ? Mat3(turns[t] * poses[t].local[j]) : poses[t].local[j];
      put(to, r.col(0));
      put(to + 3, r.col(1));
      to += 6;
    }
}

void put_standing(float* to, const std::vector<Joints>& frames) {
  for (const auto& feet : standing_feet(frames))
    for (const bool stands : feet) *to++ = stands ? 1.0f : 0.0f;
}

/// What all frames of all tracks know.
bool all_know(const std::vector<JointTrack>* tracks, bool (*knows)(const SeenJoints&)) {
  return tracks != nullptr && std::all_of(tracks->begin(), tracks->end(), [&](const auto& track) {
           return std::all_of(track.frames.begin(), track.frames.end(), knows);
         });
}

WindowBatch make_batch(int64_t n, int64_t t, bool truth) {
  WindowBatch b;
  for (Tensor* x : {&b.joints_a, &b.input_a, &b.real_b}) *x = Tensor::empty({n, t, kJoints, 3});
  for (Tensor* x : {&b.trans_a, &b.input_trans_a, &b.real_trans_b}) *x = Tensor::empty({n, t, 3});
  for (Tensor* x : {&b.rest_a, &b.rest_b}) *x = Tensor::empty({n, kJoints, 3});
  b.sixd_a = Tensor::empty({n, t, 6 * kJoints});
  b.self_mask = Tensor::empty({n});
  b.standing = Tensor::empty({n, t, 2});
  if (!truth) return b;
  b.truth_b = Tensor::empty({n, t, kJoints, 3});
  b.truth_sixd_b = Tensor::empty({n, t, 6 * kJoints});
  for (Tensor* x : {&b.truth_trans_b, &b.root_a, &b.truth_root_b}) *x = Tensor::empty({n, t, 3});
  return b;
}

}  // namespace

WindowSampler::WindowSampler(const Corpus& corpus, const WindowConfig& config, uint64_t seed,
                             const std::vector<JointTrack>* tracks)
    : corpus_(corpus),
      config_(checked(config)),
      key_(RngKey{seed, 0}.fold("windows")),
      frames_(corpus.motions, static_cast<size_t>(config.frames)),
      own_(corpus),
      tracks_(tracks),
      know_turns_(all_know(tracks, [](const SeenJoints& f) { return f.turns.has_value(); })),
      know_uncertainty_(
          all_know(tracks, [](const SeenJoints& f) { return f.uncertainty.has_value(); })) {
  if (tracks != nullptr)
    check_setting("window",
                  !tracks->empty() && std::all_of(tracks->begin(), tracks->end(),
                                                  [&](const JointTrack& track) {
                                                    return std::ssize(track.frames) >=
                                                           config.frames;
                                                  }),
                  "frames", "at most those of the answers' sequences");
  if (corpus.bodies.empty()) throw InputError("", "no bodies to draw windows from", "add bodies");
  if (corpus.bodies.size() == 1 && config_.self_share < 1)
    throw InputError("",
                     "one body alone ('" + corpus.bodies[0].id + "', of " + corpus.bodies[0].split +
                         ") cannot be retargeted to another",
                     "add bodies to that split");
}

FrameRef WindowSampler::place(Rng& rng) const {
  if (!config_.per_motion) return frames_.at(rng.below(frames_.count()));
  const size_t k = rng.below(frames_.motions());
  FrameRef out = frames_.first(k);
  out.frame = rng.below(frames_.places(k));
  return out;
}

WindowSubject WindowSampler::subject(int64_t index) const {
  Rng rng(key_.fold(static_cast<uint64_t>(index)).fold("subject"));
  const size_t bodies = corpus_.bodies.size();
  WindowSubject out;
  out.self = rng.uniform() < config_.self_share;
  out.body_a = rng.below(bodies);
  if (tracks_ != nullptr) {
    out.track = &(*tracks_)[rng.below(tracks_->size())];
    out.body_a = out.track->body;
  }
  // Any other body: skip over A.
  const size_t other = bodies > 1 ? rng.below(bodies - 1) : 0;
  out.body_b = out.self ? out.body_a : other + (other >= out.body_a ? 1 : 0);
  out.clip = place(rng);
  if (out.track != nullptr) {
    const auto later = out.track->frames.size() - static_cast<size_t>(config_.frames) + 1;
    out.clip = {out.track->motion, out.track->first + rng.below(later)};
  }
  out.real = place(rng);
  out.augmentation = draw_augmentation(rng, config_.heading ? M_PI : 0.0, config_.mirror);
  // B is one body in one sample, so its real window is mirrored with it.
  out.real_augmentation = draw_augmentation(rng, config_.heading ? M_PI : 0.0, false);
  out.real_augmentation.mirror = out.augmentation.mirror;
  if (out.track != nullptr) return out;
  const size_t drawn = std::exchange(out.body_a, own_.or_own(out.body_a, out.clip.motion, rng));
  if (out.self) out.body_b = out.body_a;
  if (!out.self && out.body_b == out.body_a) out.body_b = drawn;
  return out;
}

void WindowSampler::fill(WindowBatch& batch, int64_t row, int64_t index) const {
  const WindowSubject s = subject(index);
  const Body &body_a = corpus_.bodies[s.body_a], &body_b = corpus_.bodies[s.body_b];
  const Motion& clip = corpus_.motions[s.clip.motion];
  const Window a = perform(body_a, clip, s.clip.frame, config_.frames, s.augmentation);
  const Window real = perform(body_b, corpus_.motions[s.real.motion], s.real.frame, config_.frames,
                              s.real_augmentation);
  std::vector<Joints> seen = a.joints;
  const auto frame = [&](size_t t) -> const SeenJoints& {
    return s.track->frames[s.clip.frame - s.track->first + t];
  };
  for (size_t t = 0; s.track != nullptr && t < seen.size(); ++t)
    seen[t] = augmented(s.augmentation, frame(t).joints);
  seen = noisy(seen, key_.fold(static_cast<uint64_t>(index)).fold("noise"), config_.noise,
               config_.noise_correlation);
  std::vector<Vec3> path = a.path(), seen_path = path;
  if (config_.noisy_translation)
    for (size_t t = 0; t < path.size(); ++t) seen_path[t] = seen[t][0];

  const std::vector<Mat3> turns = turns_of(seen, config_);
  const std::vector<Mat3> own_turns = turns_of(real.joints, config_);
  put_joints(row_of(batch.joints_a, row), a.joints, turns);
  put_joints(row_of(batch.input_a, row), seen, turns);
  for (size_t t = 0; batch.turns.defined() && t < seen.size(); ++t)
    put_rotations(row_of(batch.turns, row) + 9 * kJoints * t,
                  augmented(s.augmentation, *frame(t).turns), turns[t]);
  for (size_t t = 0; batch.uncertainty.defined() && t < seen.size(); ++t)
    for (size_t j = 0; j < kJoints; ++j)
      row_of(batch.uncertainty, row)[kJoints * t + j] = static_cast<float>(
          (*frame(t).uncertainty)[s.augmentation.mirror ? static_cast<size_t>(kMirror[j]) : j]);
  for (size_t t = 0; batch.reframed.defined() && t < turns.size(); ++t)
    matrix_at(row_of(batch.reframed, row) + 9 * t) =
        (turns[t] * turns[std::max<size_t>(t, 1) - 1].transpose()).cast<float>();
  put_translation(row_of(batch.trans_a, row), path, config_.translation, turns);
  put_translation(row_of(batch.input_trans_a, row), seen_path, config_.translation, turns);
  put_joints(row_of(batch.rest_a, row), a.rest);
  put_joints(row_of(batch.rest_b, row), real.rest);
  put_sixd(row_of(batch.sixd_a, row), a.poses, turns);
  put_standing(row_of(batch.standing, row), a.joints);
  *row_of(batch.self_mask, row) = s.self ? 1.0f : 0.0f;
  put_joints(row_of(batch.real_b, row), real.joints, own_turns);
  put_translation(row_of(batch.real_trans_b, row), real.path(), config_.translation, own_turns);
  if (!config_.truth) return;

  const Window b = perform(body_b, clip, s.clip.frame, config_.frames, s.augmentation);
  put_joints(row_of(batch.truth_b, row), b.joints, turns);
  put_translation(row_of(batch.truth_trans_b, row), b.path(), config_.translation, turns);
  put_sixd(row_of(batch.truth_sixd_b, row), b.poses, turns);
  put_path(row_of(batch.root_a, row), path);
  put_path(row_of(batch.truth_root_b, row), b.path());
}

WindowBatch WindowSampler::batch(int64_t first, int64_t n) const {
  WindowBatch out = make_batch(n, config_.frames, config_.truth);
  if (know_turns_) out.turns = Tensor::empty({n, config_.frames, kJoints, 3, 3});
  if (know_uncertainty_) out.uncertainty = Tensor::empty({n, config_.frames, kJoints});
  if (config_.remove_heading) out.reframed = Tensor::empty({n, config_.frames, 3, 3});
  parallel_for(n, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) fill(out, i, first + i);
  });
  return out;
}

}  // namespace restage
