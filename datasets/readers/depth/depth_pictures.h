// Recordings of one depth camera: a folder of PNG files of 16 bits, or arrays (NPZ, NPY).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/readers/byte_stream.h"
#include "datasets/readers/depth/intrinsics.h"

namespace restage {

struct DepthPicture {
  int width = 0, height = 0;
  std::vector<float> depth;  ///< metres, row by row from the top; 0: nothing was seen
  std::string source;        ///< file, or "file:frame number" (from 0) where it holds several
};

class DepthPictures {
 public:
  virtual ~DepthPictures() = default;
  /// InputError: it cannot be read.
  virtual DepthPicture picture(int64_t frame) const = 0;
  virtual int64_t frames() const = 0;
  virtual std::optional<double> fps() const = 0;  ///< nothing if nothing says it
  /// Beside the pictures in the same file; nothing if there are none.
  virtual std::optional<Intrinsics> intrinsics() const { return std::nullopt; }
  virtual std::string kind() const = 0;    ///< "16-bit PNG"
  double scale() const { return scale_; }  ///< metres a unit
  virtual std::vector<std::string> files() const = 0;
  virtual std::vector<std::string> remarks() const { return {}; }

 protected:
  double scale_ = 0.001;
};

/// A folder of PNG files in natural order (or of a folder `depth` in it, as TUM and Redwood have
/// them), a single PNG, an NPZ with depth pictures [F, H, W] or [H, W], such an NPY. `scale`:
/// metres a unit; 0: 0.001 for whole numbers, 1 for others. Where all names are times in seconds,
/// milli-, micro- or nanoseconds that rise evenly, these give the rate. 0, NaN and 65535 are no
/// depth. InputError: there are none.
std::unique_ptr<DepthPictures> open_depth_pictures(const std::string& path, double scale,
                                                   uint64_t max_memory = kMaxMemory);

/// Whether a folder, or a folder `depth` in it, holds depth pictures (PNG of 16 bits) and nothing
/// that could be frames by itself; or an NPZ has depth pictures and no clouds.
bool holds_depth_pictures(const std::string& path, uint64_t max_memory = kMaxMemory);

}  // namespace restage
