// Animated pictures for a README or a chat: WebP and GIF.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "infer/render/image.h"

namespace restage {

/// Takes pictures of one size and makes a file of them that plays for ever.
class AnimationWriter {
 public:
  virtual ~AnimationWriter() = default;
  /// The next picture. WorkError: it has another size, or the library fails.
  virtual void push(const Image& image) = 0;
  /// The file's bytes; once, after one picture at least.
  virtual std::string finish() = 0;
};

/// Lossy, in colours without loss of their number. `fps`: above 0, at most 1000.
std::unique_ptr<AnimationWriter> webp_writer(double fps);
/// 255 colours, chosen from `samples` (at least one picture of the animation), with an ordered
/// dither that stands still from picture to picture; only what changes is stored. `fps`: above 0,
/// at most kGifFps.
std::unique_ptr<AnimationWriter> gif_writer(double fps, const std::vector<Image>& samples);
/// The format counts hundredths of a second, and browsers slow down what lasts less than two.
inline constexpr double kGifFps = 50;

}  // namespace restage
