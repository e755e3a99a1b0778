// Samples of networks that pose a mesh without a skeleton: windows of a source's body, a target's
// mesh, and the target in the source's poses (spec 9).
#pragma once

#include "autograd/tensor/tensor.h"
#include "datasets/corpus.h"
#include "datasets/sampling/frames.h"
#include "datasets/sampling/thin_mesh.h"

namespace restage {

enum class Identity { rest, posed };

struct TransferConfig {
  int frames = 1;                      ///< of a window
  int points = 1024;                   ///< of the source, drawn from its vertices; 0: all of them
  int vertices = 0;                    ///< that bodies are thinned to (thin_mesh.h); 0: all
  Identity identity = Identity::rest;  ///< the target's mesh: in T-pose, or in any pose (NPT)
  double heading = 180;  ///< windows are turned about y by up to so many degrees to either side
  bool shuffle = true;   ///< the source's points and the target's vertices come in random orders
  int frame_step = 1;    ///< frames of the motion from one of a window to the next
};

/// float32, metres. The middle of the bounding box of each mesh and of each frame is the origin.
struct TransferBatch {
  Tensor pose;      ///< [N, T, P, 3]
  Tensor identity;  ///< [N, V, 3]
  Tensor truth;     ///< [N, T, V, 3] in the identity's order
  /// i32 [N, F, 3] of the identity's vertices. Where meshes have different numbers of faces, 0 0 0
  /// fills up the rows of those with fewer.
  Tensor faces;

  /// named_tensors() and moved() of it.
  template <class F>
  void each(F&& f) {
    f("pose", pose);
    f("identity", identity);
    f("truth", truth);
    f("faces", faces);
  }
};

class TransferSampler {
 public:
  /// Keeps a reference to `corpus`. InputError: settings out of range, no motion of that length,
  /// bodies without faces or, where they are not thinned, with other numbers of vertices, more
  /// points than vertices. `like`: bodies of a mesh that it knows keep the same vertices as there.
  TransferSampler(const Corpus& corpus, const TransferConfig& config, uint64_t seed,
                  const TransferSampler* like = nullptr);

  /// Samples number first ... first + n - 1. Sample i is a function of (corpus, config, seed, i): a
  /// random body in a random window of all motions, and another body.
  TransferBatch batch(int64_t first, int64_t n) const;
  int64_t vertices() const { return std::ssize(meshes_.front().kept); }
  /// Those that the first body keeps.
  const std::vector<int32_t>& kept() const { return meshes_.front().kept; }
  /// Whether all bodies have the same faces, so that their vertices correspond.
  bool corresponding() const { return meshes_.size() == 1; }
  int64_t points() const { return config_.points > 0 ? config_.points : vertices(); }

 private:
  void find_meshes(const TransferSampler* like);
  void fill(TransferBatch& batch, int64_t row, const RngKey& key) const;

  const Corpus& corpus_;
  TransferConfig config_;
  RngKey key_;
  FrameIndex frames_;
  std::vector<const Mesh*> wholes_;  ///< of the first body of each topology
  std::vector<ThinMesh> meshes_;     ///< one for each topology
  std::vector<size_t> mesh_of_;      ///< of each body
  int64_t faces_ = 0;                ///< of the mesh with the most
};

/// Moves points so that the middle of their bounding box is the origin; where it was.
Point centre_box(Points& points);

}  // namespace restage
