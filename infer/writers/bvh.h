// BVH writer: the motion of the skeleton alone, for programs that cannot read a skinned surface.
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
  /// What joints are called; an empty name: as in kJointNames.
  std::array<std::string, kJoints> names = {};
  double units_per_metre = 100.0;  ///< BVH knows no unit; centimetres are what most programs expect
};

/// Writes frame by frame; memory does not grow. With all angles zero the skeleton stands in the
/// T-pose of `rest`. Only the root has positions (6 channels). Rotations are in degrees, channels Z
/// Y X, so the local rotation is R = Rz Ry Rx. Several triples of angles give the same rotation;
/// the triple nearest to that of the frame before is written, so that curves have no jumps of 360
/// degrees. Nothing appears at `path` before commit(). WorkError if a pose is not finite or the
/// disk is full.
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
  std::array<int, kJoints> order_{};  ///< the joints in the file's order (depth first)
  std::array<Vec3, kJoints> last_{};  ///< angles z, y, x in the frame before, radians
  long count_at_ = 0;                 ///< position in the file of the number of frames
  size_t frames_ = 0;
};

/// The angles (z, y, x), radians, with Rz Ry Rx = `rotation`; of all solutions the one nearest to
/// `near`.
Vec3 euler_zyx(const Mat3& rotation, const Vec3& near);

}  // namespace restage
