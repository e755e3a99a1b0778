// BVH writer: the skeleton's motion for programs that read no skins.
#pragma once

#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "autograd/base/atomic_file.h"
#include "nn/geometry/skeleton.h"

namespace restage {

struct BvhWriterOptions {
  double fps = kFps;
  double units_per_metre = 100.0;  ///< BVH knows no unit; centimetres are what most programs expect
};

/// Writes frame by frame; memory does not grow. Zero pose = the T-pose of `rest`, no rest
/// rotations. Only the root has positions (6 channels); rotations are in degrees, channels Z Y X,
/// i.e. local R = Rz Ry Rx. Of the equivalent angles those nearest to the frame before are written,
/// so that curves have no jumps of 360 degrees. Nothing appears at `path` before commit().
/// WorkError if a pose is not finite or the disk is full.
class BvhWriter {
 public:
  BvhWriter(std::string path, const Joints& rest, BvhWriterOptions options = {});
  void push(const Pose& pose);
  void commit();
  size_t frames() const { return frames_; }

 private:
  void write(const std::string& text);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  BvhWriterOptions options_;
  AtomicFile file_;
  std::unique_ptr<std::FILE, Close> out_;
  std::array<int, kJoints> order_{};  ///< joints as listed in the file (depth first)
  std::array<Vec3, kJoints> last_{};  ///< z, y, x of the frame before, radians
  long count_at_ = 0;                 ///< where the number of frames stands
  size_t frames_ = 0;
};

/// Angles (z, y, x) in radians with R = Rz Ry Rx, the solution nearest to `near`.
Vec3 euler_zyx(const Mat3& rotation, const Vec3& near);

}  // namespace restage
