// A small software renderer: perspective camera, depth buffer, smooth-shaded surfaces, clouds as
// little spheres, a ground with grid and soft shadows, ambient occlusion from the depth buffer.
#pragma once

#include <vector>

#include "infer/render/image.h"
#include "nn/geometry/body.h"

namespace restage {

/// Looks at `target` from `distance` metres; azimuth 0 looks along -z (a T-pose from the front) and
/// grows towards +x; angles in radians, `view` is the vertical opening angle.
struct Camera {
  Point target = Point::Zero();
  float azimuth = 0, elevation = 0, distance = 4, view = 0.5f;
};

/// Linear light, 0..1.
using Colour = Eigen::Vector3f;
/// From 8-bit sRGB, e.g. 0xd98c5f.
Colour colour_of(uint32_t srgb);

struct SceneStyle {
  Colour background = colour_of(0xf7f8fa), ground = colour_of(0xe9ebef), grid = colour_of(0xcfd4dc);
};

/// Draws in this order: begin(), any number of draw_*(), image(). Points that are not finite and
/// triangles that touch one, or reach behind the camera, are left out.
class Canvas {
 public:
  /// Every pixel is the mean of `samples` x `samples`.
  Canvas(int width, int height, int samples = 3, SceneStyle style = {});

  /// Clears and draws the ground, level at height `floor`, fading away from `camera.target`;
  /// `casts` is what throws shadows on it (surface or cloud).
  void begin(const Camera& camera, float floor, const Points& casts,
             const std::vector<Triangle>& faces);
  void draw_mesh(const Points& vertices, const std::vector<Triangle>& faces, const Colour& colour);
  void draw_cloud(const Points& points, const Colour& colour);
  Image image();

 private:
  struct Projected {
    float x, y, z;  ///< samples from the upper left; z metres before the camera, <= 0: not visible
  };
  Projected project(const Point& p) const;
  void fill_triangle(const Projected* corners, const Point* normals, const Colour& colour);
  void fill_sphere(const Projected& centre, float radius, float size, const Colour& colour);
  Colour shade(const Point& normal, const Colour& colour) const;
  Colour ground_at(const Point& at, float floor, const std::vector<float>& shadow) const;
  void occlude();
  float& depth(int x, int y) { return depth_[y * width_ + x]; }
  Colour& pixel(int x, int y) { return light_[y * width_ + x]; }

  int width_, height_, samples_;  ///< in samples
  SceneStyle style_;
  Camera camera_;
  Eigen::Matrix3f axes_;  ///< rows: right, up, towards the eye
  Point eye_;
  float focus_ = 1;  ///< samples per (metre / metre)
  std::vector<Colour> light_;
  std::vector<float> depth_;
};

}  // namespace restage
