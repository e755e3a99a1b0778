// Predictions in files beside their ground truth, and the references beside them: what `restage
// eval --pred` and the sets of the open benchmark share.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "datasets/schema.h"
#include "experiments/evaluation/world_map.h"
#include "nn/metrics/metrics.h"

namespace restage {

/// Names and scores of what needs no learning: "rest_pose", "source_unchanged", "closed_form".
using References = std::vector<std::pair<std::string, metrics::Evaluation>>;

/// A prediction, and where it is from (for errors). Of a file the joints are held, the vertices
/// read some frames at a time.
struct PredictionFile {
  std::string path;
  Prediction data;                   ///< of a file without its vertices
  std::vector<std::string> remarks;  ///< of a folder: what was left out, what is missing

  /// An HDF5 file, or a folder of meshes (mesh_frames.h).
  explicit PredictionFile(const std::string& name);
  PredictionFile(std::string name, Prediction made)
      : path(std::move(name)), data(std::move(made)) {}

  metrics::Track joints() const;
  metrics::Surfaces vertices() const;
  int64_t sequences() const { return std::ssize(data.sequence_offset) - 1; }
  /// Keeps every `step`-th frame of each sequence, from its first.
  void thin(int64_t step);
  /// Moves joints and vertices (WorldMap::carry()), and turns rotations.
  void carry(const WorldMap& map, bool rigid, double stretched = 1);

 private:
  using Read = std::function<void(int64_t first, int64_t count, std::vector<double>& out)>;
  Read read_;                                    // the vertices; empty: they are in `data`
  std::vector<int64_t> rows_;                    // of the file, frame by frame
  std::function<void(std::span<double>)> move_;  // of vertices that are read
};

/// InputError unless both have as many frames.
void check_same_frames(const PredictionFile& file, const PredictionFile& truth);

/// The sequences that `offset` cuts both into. `rotations` (as Prediction has them) may be empty.
std::vector<metrics::SequenceView> cut(const std::vector<int64_t>& offset,
                                       const metrics::Track& joints,
                                       const metrics::Surfaces& vertices,
                                       std::span<const double> rotations,
                                       const PredictionFile& truth);

/// What the references achieve on every sequence (nn/geometry/closed_form.h). `source`: its true
/// joints in the world, in the truth's frames; `rest`: the target's rest joints, one row, one for
/// each sequence or one for each frame, and maybe its vertices. InputError: no joints, other
/// numbers of frames.
References references(const PredictionFile& source, const PredictionFile& rest,
                      const PredictionFile& truth, const std::vector<int64_t>& offset,
                      std::span<const metrics::Metric> metrics);

/// These metrics for every `step`-th frame: frames that do not follow each other have no
/// acceleration.
std::vector<metrics::Metric> metrics_of_every(int64_t step,
                                              std::span<const metrics::Metric> metrics);

/// Joints of all frames of a track.
std::vector<Joints> joints_of(const metrics::Track& track);

}  // namespace restage
