#include "datasets/sampling/evaluation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "autograd/base/parallel.h"
#include "datasets/readers/errors.h"
#include "datasets/sampling/dress.h"
#include "datasets/sampling/intruder.h"
#include "datasets/sampling/scanner.h"

namespace restage {
namespace {

/// 0 ... n - 1 in random order.
std::vector<size_t> shuffled(Rng& rng, size_t n) {
  std::vector<size_t> out(n);
  std::iota(out.begin(), out.end(), size_t{0});
  for (size_t i = n; i > 1; --i) std::swap(out[i - 1], out[rng.below(i)]);
  return out;
}

ScanConfig checked(const ScanConfig& scan) {
  if (scan.least < 1 || scan.most < scan.least || scan.most > 1 << 24 || !(scan.noise >= 0))
    throw InputError("", "scan settings are out of range",
                     "use 1 <= least <= most points and noise of 0 or more metres");
  return scan;
}

}  // namespace

std::vector<CloudSubject> evaluation_clouds(const Corpus& corpus, size_t count, uint64_t seed) {
  const FrameIndex frames(corpus.motions);
  Rng rng(RngKey{seed, 0}.fold("evaluation clouds"));
  std::vector<CloudSubject> out(count);
  for (size_t i = 0; i < count; ++i) {
    out[i].body = i % std::max<size_t>(1, corpus.bodies.size());
    // Strata of equal length over all frames, one random frame in each.
    const double at = (static_cast<double>(i) + rng.uniform()) / static_cast<double>(count);
    const auto place = static_cast<uint64_t>(at * static_cast<double>(frames.count()));
    out[i].at = frames.at(std::min(place, frames.count() - 1));
    out[i].augmentation = draw_augmentation(rng, M_PI, false);
  }
  return out;
}

std::vector<CloudSubject> evaluation_tposes(const Corpus& corpus, size_t per_body, double heading,
                                            uint64_t seed) {
  Rng rng(RngKey{seed, 0}.fold("evaluation tposes"));
  std::vector<CloudSubject> out;
  for (size_t body = 0; body < corpus.bodies.size(); ++body)
    for (size_t k = 0; k < per_body; ++k) {
      CloudSubject subject;
      subject.body = body;
      subject.rest = true;
      subject.augmentation = draw_augmentation(rng, heading * M_PI / 180, false);
      out.push_back(subject);
    }
  return out;
}

namespace {

/// A limb of one of the bodies beside somebody whose middle is `middle`.
Mesh intruding_limb(const Corpus& corpus, const RngKey& scene, const Vec3& middle) {
  Rng rng(scene.fold("intruder"));
  const Intruder intruder = draw_intruder(rng, corpus.bodies.size());
  Mesh out = limb_of(corpus.bodies[intruder.body], intruder.joint);
  put_intruder(intruder, middle, out.vertices);
  return out;
}

void append(const Mesh& part, Mesh* whole) {
  const auto first = static_cast<int32_t>(whole->vertices.size());
  whole->vertices.insert(whole->vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const Triangle& t : part.faces)
    whole->faces.push_back({t[0] + first, t[1] + first, t[2] + first});
}

}  // namespace

std::vector<CloudSubject> following(const Corpus& corpus, const std::vector<CloudSubject>& subjects,
                                    size_t count, size_t frames) {
  std::vector<CloudSubject> out;
  for (size_t i = 0; i < count; ++i) {
    CloudSubject s = subjects[i * subjects.size() / count];
    const size_t length = corpus.motions.at(s.at.motion).frames();
    const size_t first = std::min(s.at.frame, length - std::min(length, frames));
    for (size_t f = 0; f < frames; ++f) {
      s.at.frame = std::min(first + f, length - 1);
      out.push_back(s);
    }
  }
  return out;
}

CloudBatch evaluation_scans(const Corpus& corpus, const std::vector<CloudSubject>& subjects,
                            const EvaluationScans& how, uint64_t seed) {
  const auto n = std::ssize(subjects);
  const int points = how.points;
  CloudBatch out;
  out.points = Tensor::empty({n, points, 3});
  out.joints = Tensor::empty({n, kJoints, 3});
  out.centres = Tensor::empty({n, 3});
  const auto at = [](Tensor& t, int64_t i) { return t.data<float>() + i * t.numel() / t.size(0); };
  parallel_for(n, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) {
      const auto frame = static_cast<size_t>(i) % how.frames,
                 first = static_cast<size_t>(i) - frame;
      const RngKey scene = RngKey{seed, 0}.fold("evaluation scans").fold(first / how.frames);
      const CloudSubject& s = subjects[static_cast<size_t>(i)];
      const Body body = dressed(corpus.bodies.at(s.body), scene.fold("outfit"));
      const auto pose_of = [&](const CloudSubject& subject) {
        return pose_on(corpus.motions.at(subject.at.motion), body, subject.at.frame);
      };
      Rng rng(scene);
      const Vec3 centre = pose_of(subjects[first]).root + Vec3(0, 0.1, 0);
      const auto ring = camera_ring(how.cameras, rng.uniform(2.2, 3.2), rng.uniform(0, 2 * M_PI),
                                    centre, {0.2, 1.2, 2.0});
      const Pose pose = pose_of(s);
      Mesh surface{pose_surface(body, pose), body.rest.faces};
      if (how.intruder) append(intruding_limb(corpus, scene, pose.root), &surface);
      Points cloud =
          scan_surface(surface, ring, {}, (frame == 0 ? scene : scene.fold(frame)).fold("scan"));
      for (size_t k = 0; k < cloud.size(); ++k)
        std::swap(cloud[k], cloud[k + rng.below(cloud.size() - k)]);
      const size_t distinct = std::min<size_t>(cloud.size(), static_cast<size_t>(points));
      if (distinct == 0)
        throw InputError("body '" + body.id + "'", "no camera sees it",
                         "give bodies of a person's size in metres");
      cloud.resize(distinct);
      while (std::ssize(cloud) < points) cloud.push_back(cloud[rng.below(distinct)]);
      const Point middle = centroid(cloud);
      Eigen::Map<Point>(at(out.centres, i)) = middle;
      for (int64_t k = 0; k < points; ++k)
        Eigen::Map<Point>(at(out.points, i) + 3 * k) = cloud[static_cast<size_t>(k)] - middle;
      const Joints joints = forward_kinematics(body.joints, pose).joints;
      for (size_t j = 0; j < kJoints; ++j)
        Eigen::Map<Point>(at(out.joints, i) + 3 * j) =
            (joints[j] - middle.cast<double>()).cast<float>();
    }
  });
  return out;
}

std::vector<EvalSequence> evaluation_sequences(const Corpus& corpus, size_t count, size_t frames,
                                               uint64_t seed) {
  const size_t bodies = corpus.bodies.size(), motions = corpus.motions.size();
  if (bodies < 2 || motions == 0)
    throw InputError("",
                     cat(bodies, " bodies and ", motions, " motions make no retargeting sequence"),
                     "give at least two bodies and one motion in this split");
  Rng rng(RngKey{seed, 0}.fold("evaluation sequences"));
  const std::vector<size_t> order = shuffled(rng, motions);
  const OwnBodies own(corpus);
  std::vector<EvalSequence> out(count);
  for (size_t i = 0; i < count; ++i) {
    EvalSequence& s = out[i];
    s.motion = order[i % motions];
    const size_t length = corpus.motions[s.motion].frames();
    if (length == 0)
      throw InputError("", "motion '" + corpus.motions[s.motion].id + "' has no frames",
                       "leave it out of the data");
    s.frames = std::clamp<size_t>(frames, 1, length);
    s.first = rng.below(length - s.frames + 1);
    s.body_a = rng.below(bodies);
    s.body_a = own.of(s.motion).value_or(s.body_a);
    s.body_b = rng.below(bodies - 1);
    if (s.body_b >= s.body_a) ++s.body_b;
  }
  return out;
}

Performance::Performance(const Corpus& corpus, const EvalSequence& sequence, const ScanConfig& scan,
                         uint64_t seed)
    : a_(corpus.bodies.at(sequence.body_a)),
      b_(corpus.bodies.at(sequence.body_b)),
      motion_(corpus.motions.at(sequence.motion)),
      sequence_(sequence),
      scan_(checked(scan)),
      key_(RngKey{seed, 0}
               .fold("performance")
               .fold(sequence.body_a)
               .fold(sequence.body_b)
               .fold(sequence.motion)
               .fold(sequence.first)),
      surface_a_(a_),
      surface_b_(b_) {
  if (sequence.first + sequence.frames > motion_.frames())
    throw ShapeError("Performance: sequence ends after motion '" + motion_.id + "'");
}

size_t Performance::frame(size_t i) const {
  if (i >= sequence_.frames)
    throw ShapeError(cat("Performance: frame ", i, " of ", sequence_.frames));
  return sequence_.first + i;
}

Pose Performance::pose_a(size_t i) const { return pose_on(motion_, a_, frame(i)); }
Pose Performance::pose_b(size_t i) const { return pose_on(motion_, b_, frame(i)); }

Joints Performance::joints_a(size_t i) const {
  return forward_kinematics(a_.joints, pose_a(i)).joints;
}

Joints Performance::joints_b(size_t i) const {
  return forward_kinematics(b_.joints, pose_b(i)).joints;
}

Rotations Performance::rotations_b(size_t i) const { return to_global(pose_b(i).local); }

Points Performance::vertices_a(size_t i) const { return pose_surface(a_, pose_a(i)); }
Points Performance::vertices_b(size_t i) const { return pose_surface(b_, pose_b(i)); }

Points Performance::cloud(size_t i) const {
  const RngKey key = key_.fold("frame").fold(i);
  Rng rng(key.fold("count"));
  const uint64_t n = static_cast<uint64_t>(scan_.least) +
                     rng.below(static_cast<uint64_t>(scan_.most - scan_.least) + 1);
  const Pose pose = pose_a(i);
  Points out = surface_a_.draw(key.fold("surface"), n).on_pose(a_, pose);
  if (scan_.hole > 0) {
    const Point centre = surface_a_.draw(key_.fold("hole"), 1).on_pose(a_, pose)[0];
    const auto radius = static_cast<float>(scan_.hole);
    std::erase_if(out, [&](const Point& p) { return (p - centre).norm() < radius; });
  }
  add_noise(key.fold("noise"), scan_.noise, out);
  return out;
}

Points Performance::target_cloud(size_t points) const {
  const RngKey key = key_.fold("target");
  const size_t n = points > 0 ? points : static_cast<size_t>((scan_.least + scan_.most) / 2);
  Points out = surface_b_.draw(key.fold("surface"), n).on_rest(b_);
  add_noise(key.fold("noise"), scan_.noise, out);
  return out;
}

}  // namespace restage
