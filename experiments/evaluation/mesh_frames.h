// A prediction of any program: a folder of meshes, one a frame.
#pragma once

#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

/// The vertices of all frames, read when they are asked for. All files (PLY, OBJ and others that
/// read_mesh() knows) have the same vertices in the same order; metres, y up.
class MeshFrames {
 public:
  /// A folder of frames is one sequence, frames in the order of the numbers in their names. A
  /// folder of such folders has a sequence in each, in natural order. InputError: no frames, or
  /// frames beside folders.
  explicit MeshFrames(const std::string& folder);
  int64_t frames() const { return std::ssize(files_); }
  int64_t vertex_count() const { return vertex_count_; }
  const std::vector<int64_t>& sequence_offset() const { return offset_; }
  const std::vector<Triangle>& faces() const { return faces_; }
  /// Files that were left out, numbers that are missing.
  const std::vector<std::string>& remarks() const { return remarks_; }
  /// Frames [first, first + count), count x V x 3. InputError naming the file: another number of
  /// vertices than the first, or one that is not finite.
  void read(int64_t first, int64_t count, std::vector<double>& out) const;

 private:
  std::vector<std::string> files_;
  std::vector<int64_t> offset_{0};
  std::vector<Triangle> faces_;
  std::vector<std::string> remarks_;
  int64_t vertex_count_ = 0;
};

}  // namespace restage
