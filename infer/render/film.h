// Pictures of the frames of one clip, all by one camera: for a picture, or for an animation.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "infer/render/clip.h"
#include "infer/render/image.h"
#include "infer/render/rasteriser.h"

namespace restage {

struct FilmOptions {
  int height = 480;               ///< pixels
  int width = 0;                  ///< pixels; 0: as wide as the figure needs, and even
  double azimuth = 32;            ///< degrees from the front towards the body's left
  double elevation = 9;           ///< degrees
  double close_up = 0;            ///< metres shown on all sides of Clip::focus; 0: whole figures
  double zoom = 1;                ///< everything is seen so many times as large
  std::optional<Rgb> background;  ///< empty: of our paper
};

class Film {
 public:
  /// The camera follows the figure calmly over the ground, from one direction and at one scale.
  /// `clip` must outlive the film. InputError: see check_clips(). A remark for each picture of the
  /// figure's materials that cannot be decoded.
  Film(const Clip& clip, const FilmOptions& options, std::vector<std::string>& remarks);

  /// Both figures at one scale and by one camera, in pictures of one size: for films of the same
  /// options.
  static void share(Film& a, Film& b);

  int width() const { return width_; }
  int height() const { return options_.height; }
  /// Draws these frames, several at a time, and gives them in this order.
  void draw(const std::vector<size_t>& frames, const std::function<void(const Image&)>& take) const;

 private:
  void set_size();
  Camera camera_at(const Point& target) const;
  Image draw(const Points& points, const Point& centre) const;
  Canvas::Pictures pictures_;
  SceneStyle style_;
  const Clip& clip_;
  FilmOptions options_;
  int width_ = 0, samples_ = 2;
  std::vector<Point> centres_;
  float before_ = 0;  ///< metres: how far the figure reaches from the centre to the camera
  float floor_ = 0, high_ = 0.5f, aside_ = 0.3f;  ///< metres: height, half the width of the figure
};

}  // namespace restage
