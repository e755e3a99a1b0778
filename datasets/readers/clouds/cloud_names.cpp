#include "datasets/readers/clouds/cloud_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <string_view>
#include <vector>

#include "autograd/base/words.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

/// What clouds are called, the surest first.
constexpr std::array<std::string_view, 29> kClouds = {
    "points",      "vertices",      "verts",        "v_posed",      "xyz",    "pointcloud",
    "point_cloud", "cloud",         "pc",           "pcl",          "pcd",    "pts",
    "coords",      "positions",     "scan_verts",   "scan_points",  "scan",   "v",
    "vertex",      "scan_vertices", "pointclouds",  "point_clouds", "clouds", "pcs",
    "pcds",        "lidar",         "lidar_points", "human_points", "scans"};

/// Whole names of something else.
constexpr std::string_view kOtherNames[] = {
    "k",      "k_fullimg",  "cam_k",        "cam_int",    "camera_matrix", "n",
    "vn",     "f",          "uv",           "j3d",        "kp3d",          "j_posed",
    "v_cano", "v_template", "trans",        "transl",     "pose",          "poses",
    "betas",  "shape",      "shapes",       "beta",       "theta",         "thetas",
    "rotmat", "rotmats",    "global_trans", "root_trans", "root_orient",   "global_orient"};

/// Words of names: what every point has beside its place, and points that are no surface.
constexpr std::string_view kBesidePoints[] = {
    "normal",    "normals",  "color",      "colors",    "colour",     "colours",   "rgb",
    "rgba",      "face",     "faces",      "triangle",  "triangles",  "label",     "labels",
    "weights",   "velocity", "velocities", "vel",       "joint",      "joints",    "keypoint",
    "keypoints", "kp",       "kpts",       "marker",    "markers",    "uvs",       "flow",
    "mask",      "masks",    "intrinsics", "intrinsic", "extrinsics", "extrinsic", "intrins"};

/// Words of names: the path of one point, rotations, what instruments measured, numbers of a body
/// model. Beside a word of points they say whose points these are.
constexpr std::string_view kPathsAndSignals[] = {
    "trans",  "transl",       "translation",  "translations",  "trajectory",    "traj",
    "root",   "pelvis",       "hip",          "hips",          "com",           "cop",
    "zmp",    "centroid",     "cam",          "camera",        "gyro",          "gyroscope",
    "acc",    "accel",        "acceleration", "accelerations", "accelerometer", "imu",
    "mag",    "magnetometer", "gravity",      "force",         "forces",        "grf",
    "torque", "moment",       "moments",      "omega",         "pose",          "poses",
    "rot",    "rots",         "rotation",     "rotations",     "euler",         "eulers",
    "angle",  "angles",       "orient",       "orientation",   "orientations",  "quat",
    "quats",  "betas"};
constexpr std::string_view kOfPoints[] = {
    "point", "points", "pts", "vertex", "vertices", "verts", "cloud", "clouds",  "pointcloud",
    "pcl",   "pcd",    "xyz", "scan",   "scans",    "mesh",  "depth", "surface", "posed"};

/// "rootPos3D" as root, pos and d.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> out(1);
  bool small = false;
  for (const char c : name) {
    const bool letter = std::isalpha(static_cast<unsigned char>(c)) != 0;
    const bool capital = std::isupper(static_cast<unsigned char>(c)) != 0;
    if ((!letter || (capital && small)) && !out.back().empty()) out.emplace_back();
    if (letter) out.back() += lower_case({&c, 1});
    small = letter && !capital;
  }
  return out;
}

bool holds(std::span<const std::string_view> list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

}  // namespace

bool are_depth_pictures(const std::string& name, const std::vector<int64_t>& shape) {
  constexpr int64_t kLeast = 8;  // pixels
  const std::vector<std::string> words = words_of(name);
  const auto is_depth = [](const std::string& word) { return word == "depth" || word == "depths"; };
  const auto is_points = [&](const std::string& word) {
    return !is_depth(word) && holds(kOfPoints, word);
  };
  if (std::none_of(words.begin(), words.end(), is_depth) ||
      std::any_of(words.begin(), words.end(), is_points))
    return false;
  std::vector<int64_t> sizes = shape;
  if (!sizes.empty() && sizes.back() == 1) sizes.pop_back();
  return (sizes.size() == 2 || sizes.size() == 3) && sizes.back() >= kLeast &&
         sizes[sizes.size() - 2] >= kLeast;
}

std::optional<size_t> cloud_rank(const std::string& name) {
  const auto at = std::find(kClouds.begin(), kClouds.end(), lower_case(name));
  if (at == kClouds.end()) return std::nullopt;
  return static_cast<size_t>(at - kClouds.begin());
}

bool is_no_cloud(const std::string& name, bool one_frame) {
  if (holds(kOtherNames, lower_case(name))) return true;
  const std::vector<std::string> words = words_of(name);
  const auto any = [&](std::span<const std::string_view> list) {
    return std::any_of(words.begin(), words.end(),
                       [&](const std::string& word) { return holds(list, word); });
  };
  const bool numbered = !name.empty() && std::isdigit(static_cast<unsigned char>(name.back()));
  return any(kBesidePoints) || (one_frame && !numbered && any(kPathsAndSignals) && !any(kOfPoints));
}

}  // namespace restage
