#include "infer/render/film.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/parallel_each.h"
#include "infer/render/sheet.h"
#include "infer/render/srgb.h"
#include "infer/render/stand.h"
#include "infer/render/style.h"

namespace restage {
namespace {

constexpr size_t kTogether = 8;             // frames that are drawn at a time, at most
constexpr int64_t kMostSamples = 24 << 20;  // of them all, so that they take below a gigabyte

/// A ground and a grid that can be told from the background, whether that is bright or dark.
SceneStyle style_on(const Rgb& background) {
  SceneStyle out;
  for (int k = 0; k < 3; ++k)
    out.background[k] =
        srgb_to_linear(static_cast<float>(background[static_cast<size_t>(k)]) / 255);
  const bool dark = out.background.sum() < 0.6f;
  out.ground = dark ? Colour(out.background + Colour::Constant(0.012f)) : 0.9f * out.background;
  out.grid = dark ? Colour(out.background + Colour::Constant(0.045f)) : 0.7f * out.background;
  return out;
}

}  // namespace

Film::Film(const Clip& clip, const FilmOptions& options, std::vector<std::string>& remarks)
    : clip_(clip), options_(options) {
  check_clips("", {clip});
  if (options.background) style_ = style_on(*options.background);
  if (clip.look) pictures_ = decode_pictures(*clip.look, remarks);
  floor_ = clip_floor(clip);
  const bool close = options.close_up > 0 && !clip.focus.empty();
  if (!close) options_.close_up = 0;
  for (size_t f = 0; f < clip.frames.size(); ++f)
    centres_.push_back(close ? clip.focus[f] : clip_centre(clip.frames[f]));
  centres_ = calm_centres(centres_, clip.fps);
  const float a = radians(options.azimuth);
  const Point right(std::cos(a), 0, -std::sin(a));
  for (size_t f = 0; f < clip.frames.size(); ++f) {
    before_ = std::max(before_,
                       before_target(camera_at(centres_[f]), clip.frames[f], !clip.faces.empty()));
    const ClipReach reach = clip_reach(clip.frames[f], floor_);
    for (const Point& p : clip.frames[f]) {
      if (!p.allFinite()) continue;
      aside_ = std::max(aside_, std::min(std::abs(right.dot(p - centres_[f])), reach.aside));
      high_ = std::max(high_, std::min(p.y() - floor_, reach.high));
    }
  }
  set_size();
}

void Film::set_size() {
  const bool close = options_.close_up > 0;
  const double per_metre = options_.height / (1.16 * high_ + 0.12);
  const int wide = static_cast<int>(per_metre * (2.0 * aside_ + 0.16));
  const int fitting =
      close ? options_.height : std::clamp(wide, options_.height / 2, options_.height * 16 / 9);
  width_ = options_.width > 0 ? options_.width : (fitting + 1) / 2 * 2;
  const int64_t pixels = int64_t{width_} * options_.height;
  samples_ = pixels > kMostSamples / 4                                ? 1
             : pixels > (int64_t{1} << 20) || clip_.frames.size() > 1 ? 2
                                                                      : 3;
}

void Film::draw(const std::vector<size_t>& frames,
                const std::function<void(const Image&)>& take) const {
  const int64_t one = int64_t{width_} * options_.height * samples_ * samples_;
  const size_t together = std::clamp(static_cast<size_t>(kMostSamples / one), size_t{1}, kTogether);
  for (size_t at = 0; at < frames.size(); at += together) {
    const size_t count = std::min(together, frames.size() - at);
    std::vector<Points> points;  // the store of frames is for one thread
    for (size_t k = 0; k < count; ++k) points.push_back(clip_.frames[frames[at + k]]);
    std::vector<Image> images(count);
    parallel_each(static_cast<int64_t>(count), 1, [&](int64_t k) {
      images[k] = draw(points[k], centres_[frames[at + static_cast<size_t>(k)]]);
    });
    for (const Image& image : images) take(image);
  }
}

void Film::share(Film& a, Film& b) {
  for (float Film::*extent : {&Film::high_, &Film::aside_, &Film::before_})
    a.*extent = b.*extent = std::max(a.*extent, b.*extent);
  for (Film* film : {&a, &b}) film->set_size();
}

Camera Film::camera_at(const Point& target) const {
  Camera camera;
  camera.azimuth = radians(options_.azimuth);
  camera.elevation = radians(options_.elevation);
  camera.target = target;
  return camera;
}

Image Film::draw(const Points& points, const Point& centre) const {
  Canvas canvas(width_, options_.height, samples_, style_);
  Camera camera = camera_at(centre);
  const auto reach = static_cast<float>(options_.close_up);
  const float whole =
      std::max(1.16f * high_ + 0.12f, (2 * aside_ + 0.16f) * static_cast<float>(options_.height) /
                                          static_cast<float>(width_));
  const float upright =
      std::max(1.0f, static_cast<float>(options_.height) / static_cast<float>(width_));
  const float tall = (reach > 0 ? 2 * reach * upright : whole) / static_cast<float>(options_.zoom);
  if (reach <= 0) camera.target.y() = floor_ + 0.5f * high_ - 0.01f * tall;
  stand_outside(camera, tall, before_);
  canvas.begin(camera, floor_, points, clip_.faces);
  const Colour plain = colour_of(kClipColours[0]);
  if (clip_.faces.empty())
    canvas.draw_cloud(points, plain);
  else if (clip_.look)
    canvas.draw_surface(points, clip_.faces, *clip_.look, pictures_);
  else
    canvas.draw_mesh(points, clip_.faces, plain);
  return canvas.image();
}

}  // namespace restage
