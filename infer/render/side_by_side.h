// Pictures of two clips side by side, in step: one clock, one scale, one camera.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "infer/render/film.h"

namespace restage {

class SideBySide {
 public:
  /// The camera follows each figure, from one direction and at one scale. The clips' labels stand
  /// below them. `options`: sizes are of the whole picture. The clips must outlive this and have as
  /// many frames. Errors and remarks as Film's.
  SideBySide(const Clip& left, const Clip& right, const FilmOptions& options,
             std::vector<std::string>& remarks);

  int width() const { return width_; }
  int height() const { return options_.height; }
  /// As Film::draw().
  void draw(const std::vector<size_t>& frames, const std::function<void(const Image&)>& take) const;

 private:
  Image together(const Image& left, const Image& right) const;

  FilmOptions options_;
  std::array<std::string, 2> labels_;
  Film left_, right_;
  int width_ = 0;
};

}  // namespace restage
