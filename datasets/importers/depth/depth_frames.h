// Pictures of a depth camera as clouds of the person before it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/depth/background.h"
#include "datasets/importers/report.h"
#include "datasets/readers/depth/depth_pictures.h"
#include "datasets/readers/frames/frame_folder.h"

namespace restage {

/// Points in metres, y up: (x, -y, -z) of the camera's axes, which looks along -z from the origin.
/// Who faces the camera faces +z. Every k-th pixel of every k-th row gives a point, so that a frame
/// has 20,000 at most. Without `keep_background` the person alone is left, of a grid that is looked
/// at twice as finely; and where the floor is in view, it is turned level and is y = 0.
class DepthFrames : public FrameSource {
 public:
  /// InputError: no picture can be read, a camera of other pictures, depths that no room has.
  DepthFrames(std::unique_ptr<DepthPictures> pictures, const Intrinsics& camera,
              bool keep_background, bool force);
  std::optional<Frame> next() override;
  void skip() override { at_ = std::min(at_ + 1, frames()); }
  void rewind() override;
  int64_t frames() const override { return pictures_->frames(); }
  double fps() const override;
  std::vector<std::string> remarks() const override;
  bool states_fps() const { return pictures_->fps() || camera_.fps > 0; }
  /// Whether all frames so far could be read, and are background.
  bool saw_nobody() const { return background_ && !somebody_ && !faulty_; }
  void tell(ImportReport& report) const;  ///< of the camera and its pictures

 private:
  PicturePoints points_of(const DepthPicture& picture) const;
  void look_around();

  std::unique_ptr<DepthPictures> pictures_;
  Intrinsics camera_;
  int width_ = 0, height_ = 0, step_ = 1;
  std::optional<Background> background_;    // none: it is kept
  bool somebody_ = false, faulty_ = false;  // in the frames so far
  int64_t at_ = 0;
};

}  // namespace restage
