// Virtual depth cameras: what a rig of cameras, or one, sees of a surface. Unlike points drawn by
// area (surface.h), such clouds have holes where nothing looks, and errors that depend on the view.
#pragma once

#include <vector>

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"

namespace restage {

/// A pinhole camera that measures depth, one value per pixel. Metres, radians.
struct DepthCamera {
  Vec3 eye = Vec3(0, 1, 3), target = Vec3(0, 1, 0);
  double view = 1.0;  ///< vertical opening angle
  int width = 160, height = 160;
};

/// Errors of a depth camera, as structured-light and time-of-flight sensors have them.
struct ScannerNoise {
  double base = 0.001;      ///< standard deviation along the ray at distance 0, metres
  double growth = 0.0015;   ///< grows by this times the squared distance
  double dropout = 0.02;    ///< pixels without answer
  double grazing = 0.25;    ///< surfaces seen flatter than this cosine answer ever more rarely
  double mixed = 0.3;       ///< share of pixels at outlines that mix front and back
  double edge = 0.05;       ///< a step in depth from here on is an outline, metres
  double behind = 0.3;      ///< what an outline mixes with where nothing stands behind it, metres
  double outliers = 0.002;  ///< points anywhere about the subject, as a share of the others
};

/// All points that the cameras measure on `surface`, camera by camera, row by row. Back faces hide
/// what is behind them like front faces. A function of its arguments alone. InputError if a camera
/// has no pixels or looks nowhere.
Points scan_surface(const Mesh& surface, const std::vector<DepthCamera>& cameras,
                    const ScannerNoise& noise, const RngKey& key);

/// `count` cameras evenly around the vertical through `centre` at `radius`, the first at `azimuth`
/// (0: before a body that faces +z), at the heights in turn; all look at `centre`.
std::vector<DepthCamera> camera_ring(int count, double radius, double azimuth, const Vec3& centre,
                                     const std::vector<double>& heights,
                                     const DepthCamera& model = {});

}  // namespace restage
