// The numbers of a depth camera that make points of its pixels.
#pragma once

#include <optional>
#include <string>

#include "datasets/readers/arrays/npy.h"

namespace restage {

/// A pinhole camera: the pixel in column u and row v that sees depth z (metres, along the optical
/// axis) is the point ((u - cx) z / fx, (v - cy) z / fy, z), x right, y down, z forward. Pixels.
struct Intrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  int width = 0, height = 0;  ///< of the pictures that they are of; 0: not said
  /// A second size of the same camera's pictures that the file tells (Record3D's dw, dh); 0: none.
  int other_width = 0, other_height = 0;
  double fps = 0;     ///< stated beside them; 0: not
  std::string where;  ///< file, or empty: given as numbers
};

/// Four numbers (FX,FY,CX,CY), else a file: text of four numbers or of nine (a matrix, by rows or
/// by columns); JSON with `intrinsic_matrix` (Open3D, Azure), `K` (Record3D), `camera_matrix`, or
/// fx, fy, cx and cy (RealSense: ppx, ppy), at the top or in a part that is named after the camera.
/// InputError: none of these, numbers that no camera has.
Intrinsics read_intrinsics(const std::string& numbers_or_file);

/// Of an array of four or nine numbers; of several matrices the first. InputError as above.
Intrinsics intrinsics_of(const NpyArray& array);

/// The same for pictures of this size: scaled where the file tells both sizes. InputError naming
/// both sizes where they differ; where none is known, if the optical axis is far from the middle of
/// the picture (but not with `force`).
Intrinsics fitted_to(const Intrinsics& camera, int width, int height, const std::string& picture,
                     bool force);

}  // namespace restage
