// Numbered folders of meshes or clouds: frame_000000.ply, frame_000001.ply, ...
#pragma once

#include <string>
#include <vector>

#include "autograd/base/temporary.h"
#include "nn/geometry/mesh_file.h"

namespace restage {

/// Writes one file per frame into a folder that appears whole, at commit(), or not at all: frames
/// go to a hidden folder beside it that is renamed in the end and removed when commit() is not
/// reached. A folder of that name is replaced if it is empty or holds nothing but frames that we
/// wrote: the name is a frame's and the file begins with our comment (mesh_file.h). Anything else
/// in it, a user's own frame_000001.ply too, is an InputError before any work. Memory: one frame.
/// Disk full: WorkError.
class FrameFolderWriter {
 public:
  /// `faces` are those of every frame; empty for clouds, whose point count may change.
  FrameFolderWriter(std::string folder, std::vector<Triangle> faces,
                    MeshFormat format = MeshFormat::ply);

  void push(const Points& vertices) { push(vertices, faces_); }
  /// A frame with faces of its own.
  void push(const Points& vertices, const std::vector<Triangle>& faces);
  void commit();
  size_t frames() const { return frames_; }

 private:
  std::string folder_;
  Temporary temporary_;
  std::vector<Triangle> faces_;
  MeshFormat format_;
  size_t frames_ = 0;
};

}  // namespace restage
