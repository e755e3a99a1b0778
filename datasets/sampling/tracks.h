// What an extractor answers to clouds of people performing clips: input of a motion network's
// training that has the errors of the real thing, which simulated noise has not (docs/method.md,
// "Past SMRM").
#pragma once

#include <functional>
#include <vector>

#include "datasets/corpus.h"
#include "datasets/sampling/clouds.h"
#include "nn/models/extraction.h"

namespace restage {

/// Part of a performance as somebody saw it.
struct JointTrack {
  size_t body = 0, motion = 0, first = 0;  ///< indices into the corpus, the first frame
  std::vector<SeenJoints> frames;          ///< in the world
};

struct TrackConfig {
  int64_t sequences = 0;  ///< 0: no tracks
  int frames = 60;
  int least = 600, most = 1400;  ///< points of a cloud
  CloudConfig clouds;            ///< noise, dressed, one_camera, camera_ring: each of a whole track
};

/// What is seen in a cloud, in its frame; `key` for what is random, `before`: what was seen in the
/// frame before, null in the first.
using Extract =
    std::function<SeenJoints(const Points& cloud, const RngKey& key, const SeenJoints* before)>;

/// Those of many things that somebody makes: number first, first + step, ...
struct Share {
  int64_t first = 0, step = 1;
};

/// Track i is a function of (corpus, config, seed, i, extract). `extract` is called from one
/// thread. Tracks that are not in the `share` have their place, and no frames. InputError: no
/// motion, settings out of range.
std::vector<JointTrack> make_tracks(const Corpus& corpus, const TrackConfig& config, uint64_t seed,
                                    const Extract& extract, Share share = {});

}  // namespace restage
