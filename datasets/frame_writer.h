// Numbered folders of meshes or clouds: frame_000000.ply, frame_000001.ply, ...
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "autograd/base/temporary.h"
#include "nn/geometry/mesh_file.h"

namespace restage {

/// Writes one file per frame. The folder appears whole at commit(), or not at all: until then files
/// are written into a hidden folder beside it, which commit() renames, or which is removed if
/// commit() is not reached. A folder that is already there is replaced if it is empty or holds only
/// frames that a FrameFolderWriter wrote: files that have a frame's name and begin with our comment
/// (mesh_file.h). Any other file in the folder is an InputError in the constructor, also a user's
/// own frame_000001.ply. Memory: one frame. WorkError if the disk is full.
class FrameFolderWriter {
 public:
  /// `faces`: the triangles of every frame; empty for clouds, whose number of points may change
  /// from frame to frame.
  FrameFolderWriter(std::string folder, std::vector<Triangle> faces,
                    MeshFormat format = MeshFormat::ply);
  /// Frames whose bytes `made` makes of their vertices; they must begin with the comment of
  /// `format` as mesh_bytes() has it.
  using Make = std::function<std::string(const Points& vertices)>;
  FrameFolderWriter(std::string folder, MeshFormat format, Make made);

  void push(const Points& vertices) { push(vertices, faces_); }
  /// A frame that has other triangles than the rest. One without vertices shows nothing.
  void push(const Points& vertices, const std::vector<Triangle>& faces);
  void commit();
  size_t frames() const { return frames_; }

 private:
  std::string folder_;
  Temporary temporary_;
  std::vector<Triangle> faces_;
  MeshFormat format_;
  Make made_;
  size_t frames_ = 0;
};

}  // namespace restage
