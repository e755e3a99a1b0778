// A small software renderer with a perspective camera and a depth buffer. It draws smooth-shaded
// surfaces in one colour or with materials, clouds as little spheres, and a ground with a grid and
// soft shadows; the depth buffer gives ambient occlusion.
#pragma once

#include <cmath>
#include <vector>

#include "infer/render/image.h"
#include "infer/render/texture.h"
#include "nn/geometry/appearance.h"
#include "nn/geometry/body.h"

namespace restage {

/// A camera that looks at the point `target` from `distance` metres. At azimuth 0 the camera looks
/// along -z and sees a T-pose from the front; a growing azimuth moves the camera towards +x. `view`
/// is the vertical opening angle. Angles are in radians.
struct Camera {
  Point target = Point::Zero();
  float azimuth = 0, elevation = 0, distance = 4, view = 0.5f;
};

/// Red, green and blue as linear light, 0 to 1.
using Colour = Eigen::Vector3f;
/// The colour of an 8-bit sRGB number such as 0xd98c5f.
Colour colour_of(uint32_t srgb);

struct SceneStyle {
  Colour background = colour_of(0xf7f8fa), ground = colour_of(0xe9ebef), grid = colour_of(0xcfd4dc);
};

/// A picture is drawn by begin(), then any number of draw_mesh(), draw_surface() and draw_cloud(),
/// then image().
/// Points that are not finite are left out; so are triangles with such a corner, and triangles that
/// reach behind the camera.
class Canvas {
 public:
  /// `width` and `height` in pixels. Every pixel is the mean of `samples` x `samples` samples.
  Canvas(int width, int height, int samples = 3, SceneStyle style = {});

  /// Clears the picture and draws a level ground at height `floor`, which fades away from
  /// `camera.target`. The surface or cloud `casts`, `faces` throws its shadow on the ground.
  void begin(const Camera& camera, float floor, const Points& casts,
             const std::vector<Triangle>& faces);
  void draw_mesh(const Points& vertices, const std::vector<Triangle>& faces, const Colour& colour);
  /// With its materials. What is seen through must be drawn last: it hides nothing behind it that
  /// is drawn later. `pictures`: decode_pictures() of `look`.
  using Pictures = std::vector<std::optional<TexturePicture>>;
  void draw_surface(const Points& vertices, const std::vector<Triangle>& faces,
                    const Appearance& look, const Pictures& pictures);
  void draw_cloud(const Points& points, const Colour& colour);
  Image image();

 private:
  struct Projected {
    /// x and y: samples from the picture's upper left corner. z: metres before the camera; 0 or
    /// less for a point that cannot be seen.
    float x, y, z;
    /// Whether it can be drawn: coordinates that are no numbers, or overflow, cannot.
    bool in_front() const { return z > 0 && std::isfinite(x + y + z); }
  };
  Projected project(const Point& p) const;
  struct Facet;
  /// paint(shares of the corners in the picture, distance): colour and opacity of a sample.
  template <class Paint>
  void fill_triangle(const Projected* corners, const Paint& paint);
  std::vector<Facet> facets(const Points& vertices, const std::vector<Triangle>& faces,
                            const Appearance& look) const;
  static float texels_of(const Facet& facet, const Appearance& look, const Texture& texture,
                         const TexturePicture& picture);
  void fill_sphere(const Projected& centre, float radius, float size, const Colour& colour);
  Colour shade(const Point& normal, const Colour& colour) const;
  Colour ground_at(const Point& at, float floor, const std::vector<float>& shadow) const;
  void occlude();
  float& depth(int x, int y) { return depth_[y * width_ + x]; }
  Colour& pixel(int x, int y) { return light_[y * width_ + x]; }

  int width_, height_;  ///< of the picture, in samples
  int samples_;         ///< in a pixel, along each axis
  SceneStyle style_;
  Camera camera_;
  Eigen::Matrix3f axes_;  ///< rows: right, up, towards the eye
  Point eye_;
  float focus_ = 1;  ///< samples that something takes which is as wide as it is far away
  std::vector<Colour> light_;
  std::vector<float> depth_;
};

}  // namespace restage
