// The answers of a skeleton stage's network to clouds of a corpus (datasets/sampling/tracks.h). The
// network is asked once: motion networks that learn on the same answers, such as those of the
// trials of a sweep, share them.
#pragma once

#include <optional>
#include <string>

#include "datasets/sampling/tracks.h"
#include "nn/config/rules.h"
#include "nn/weights/bundle.h"
#include "train/team.h"

namespace restage {

struct AnswersConfig {
  TrackConfig tracks;
  int views = 4;
  bool any_way_up = false;
};

template <class V>
void visit(V& v, AnswersConfig& c) {
  v("sequences", c.tracks.sequences,
    "performances that the skeleton stage's network is asked about; 0: true joints, with noise",
    at_least(0));
  v("frames", c.tracks.frames, "frames of each", at_least(2));
  v("views", c.views, "of each cloud, as retarget --samples", between(1, 256));
  v("any_way_up", c.any_way_up,
    "who lies or stands on the hands is shown upright, as 'restage retarget' does", added("false"));
  v("noise", c.tracks.clouds.noise, "Gaussian noise per coordinate of a cloud, metres",
    at_least(0));
  v("dressed", c.tracks.clouds.dressed, "part of the performers in clothes and hair",
    between(0, 1));
  v("one_camera", c.tracks.clouds.one_camera, "part that one depth camera sees", between(0, 1));
  v("camera_ring", c.tracks.clouds.camera_ring, "part that three to seven cameras see",
    between(0, 1));
  v("intruder", c.tracks.clouds.intruder, "part of what cameras see with somebody else's limb",
    between(0, 1));
}

/// A folder that keeps answers, and the identity of the data that they are about.
struct AnswerFolder {
  std::string path;
  std::string data;  ///< identity of the corpora (Identities::data)
};

/// The answers of `given`'s extractor about performances of a corpus; `split`: its name in the
/// data. With a folder, answers to the same question that are kept there are taken; otherwise one
/// process asks and keeps the answers while the others wait. A damaged file gives a warning and is
/// made again. Without a folder each process of a team asks about some sequences and tells the
/// others. The bits are the same either way.
std::vector<JointTrack> ask(const Corpus& corpus, const std::string& split,
                            const AnswersConfig& config, const Bundle& given, uint64_t seed,
                            const std::optional<AnswerFolder>& folder, Team& team = alone());

}  // namespace restage
