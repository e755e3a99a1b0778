#include "datasets/sampling/tracks.h"

#include "autograd/base/interrupt.h"
#include "autograd/base/parallel.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

/// Clouds of one performance: the same clothes and cameras in all frames.
std::vector<Points> clouds_of(const CloudSampler& sampler, const CloudSubject& start, size_t frames,
                              const TrackConfig& config, const RngKey& key) {
  std::vector<Points> out(frames);
  parallel_for(std::ssize(out), 1, [&](int64_t from, int64_t to) {
    for (int64_t f = from; f < to; ++f) {
      CloudSubject subject = start;
      subject.at.frame += static_cast<size_t>(f);
      const RngKey own = key.fold(static_cast<uint64_t>(f));
      Rng rng(own.fold("points"));
      const auto n = static_cast<size_t>(config.least) +
                     rng.below(static_cast<uint64_t>(config.most - config.least) + 1);
      out[static_cast<size_t>(f)] = sampler.cloud(subject, n, key.fold("scene"), own);
    }
  });
  return out;
}

}  // namespace

std::vector<JointTrack> make_tracks(const Corpus& corpus, const TrackConfig& config, uint64_t seed,
                                    const Extract& extract, Share share) {
  check_setting("track", config.frames >= 2 && config.frames <= 100000, "frames", "2 to 100000");
  check_setting("track", config.sequences >= 0, "sequences", "0 or more");
  check_setting("track", config.least >= 64 && config.most >= config.least, "least, most",
                "64 or more points");
  const CloudSampler sampler(corpus, config.clouds, seed);
  const FrameIndex places(corpus.motions, static_cast<size_t>(config.frames));
  const RngKey key = RngKey{seed, 0}.fold("tracks");
  std::vector<JointTrack> out(static_cast<size_t>(config.sequences));
  for (size_t i = 0; i < out.size(); ++i) {
    throw_if_stopped();
    const RngKey own = key.fold(i);
    Rng rng(own);
    CloudSubject subject = sampler.subject(static_cast<int64_t>(i));
    const size_t k = rng.below(places.motions());
    subject.rest = false;
    subject.limb = -1;
    subject.at = places.first(k);
    subject.at.frame = rng.below(places.places(k));
    subject.augmentation.mirror = false;
    subject.scale = 1;
    out[i] = {subject.body, subject.at.motion, subject.at.frame, {}};
    if (static_cast<int64_t>(i) % share.step != share.first) continue;
    const Mat3 back = turn_about_y(-subject.augmentation.heading);
    const auto clouds =
        clouds_of(sampler, subject, static_cast<size_t>(config.frames), config, own);
    SeenJoints seen;
    for (size_t f = 0; f < clouds.size(); ++f) {
      seen = extract(clouds[f], own.fold("extract").fold(f), f > 0 ? &seen : nullptr);
      out[i].frames.push_back(turned(back, seen));
    }
  }
  return out;
}

}  // namespace restage
