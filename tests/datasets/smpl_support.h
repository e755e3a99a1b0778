// A body model and AMASS clips small enough to write by hand: a vertex at every joint and six more.
#pragma once

#include <string>
#include <vector>

#include "datasets/importers/bodies/smpl.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/tiny_body.h"

namespace restage::test {

/// Rest joints of all joints of a family: ours, then hands, jaw and eyes near wrists and head.
struct TinySmpl {
  SmplFamily family = SmplFamily::smplh;
  size_t shapes = 4;  ///< columns of shapedirs

  size_t joints() const {
    return family == SmplFamily::smpl ? 24 : family == SmplFamily::smplh ? 52 : 55;
  }
  size_t vertices() const { return joints() + 6; }

  std::vector<int> parents() const {
    std::vector<int> out(kParents.begin(), kParents.end());
    if (family == SmplFamily::smpl) {  // two hands
      out.insert(out.end(), {20, 21});
      return out;
    }
    if (family == SmplFamily::smplx) out.insert(out.end(), {15, 15, 15});  // jaw and eyes
    for (const int wrist : {20, 21})
      for (int finger = 0; finger < 5; ++finger)
        for (int bone = 0; bone < 3; ++bone)
          out.push_back(bone == 0 ? wrist : static_cast<int>(out.size()) - 1);
    return out;
  }

  /// Of the mean person; the pelvis is not at the origin, as in the real ones.
  std::vector<Vec3> template_vertices() const {
    const Joints rest = testing::tiny_joints();
    std::vector<Vec3> out(rest.begin(), rest.end());
    const std::vector<int> parent = parents();
    for (size_t j = kJoints; j < joints(); ++j)
      out.push_back(out[static_cast<size_t>(parent[j])] +
                    Vec3(parent[j] == 21 ? -0.03 : 0.03, 0.001 * static_cast<double>(j), 0));
    for (const Vec3& x : {Vec3(0.1, -0.31, 0.1), Vec3(-0.1, -0.3, 0.1), Vec3(0, 1.6, 0.1),
                          Vec3(0.2, 1, 0), Vec3(-0.2, 1, 0), Vec3(0, 1, 0.15)})
      out.push_back(x);
    return out;
  }

  double direction(size_t vertex, size_t axis, size_t shape) const {
    return 0.01 * std::sin(1.0 + 3.0 * static_cast<double>(vertex) + static_cast<double>(axis) +
                           7.0 * static_cast<double>(shape));
  }

  /// Metres for feature `k` of 9 (J - 1), as posedirs has it.
  double bend(size_t vertex, size_t axis, size_t k) const {
    return 0.01 * std::cos(5.0 * static_cast<double>(vertex) + 2.0 * static_cast<double>(axis) +
                           0.7 * static_cast<double>(k));
  }

  std::vector<Vec3> shaped(const Betas& betas) const {
    std::vector<Vec3> out = template_vertices();
    for (size_t v = 0; v < out.size(); ++v)
      for (size_t axis = 0; axis < 3; ++axis)
        for (size_t b = 0; b < betas.size(); ++b)
          out[v][static_cast<int>(axis)] += betas[b] * direction(v, axis, b);
    return out;
  }

  double weight(size_t vertex, size_t joint) const {
    if (vertex < joints()) return vertex == joint ? 1.0 : 0.0;
    return joint == 0 ? 0.25 : joint == joints() - 1 ? 0.75 : 0.0;  // the last hangs from a wrist
  }

  std::vector<std::pair<std::string, std::string>> arrays() const {
    const auto v = static_cast<int64_t>(vertices()), j = static_cast<int64_t>(joints());
    const std::vector<Vec3> rest = template_vertices();
    std::vector<double> flat, directions, bends, regressor, weights;
    for (size_t i = 0; i < vertices(); ++i) {
      for (size_t axis = 0; axis < 3; ++axis) {
        for (size_t k = 0; k < 9 * (joints() - 1); ++k) bends.push_back(bend(i, axis, k));
        flat.push_back(rest[i][static_cast<int>(axis)]);
        for (size_t b = 0; b < shapes; ++b) directions.push_back(direction(i, axis, b));
      }
      for (size_t k = 0; k < joints(); ++k) weights.push_back(weight(i, k));
    }
    for (size_t k = 0; k < joints(); ++k)
      for (size_t i = 0; i < vertices(); ++i) regressor.push_back(i == k ? 1.0 : 0.0);
    std::vector<uint32_t> tree;  // the root's parent as signed -1 that lost its sign
    for (const int p : parents()) tree.push_back(static_cast<uint32_t>(p));
    for (size_t k = 0; k < joints(); ++k) tree.push_back(static_cast<uint32_t>(k));
    return {{"v_template", npy<double>({v, 3}, flat)},
            {"shapedirs", npy<double>({v, 3, static_cast<int64_t>(shapes)}, directions)},
            {"posedirs", npy<double>({v, 3, 9 * (j - 1)}, bends)},
            {"dynamic", npy_of(npy_header("|O", {}), "a pickle that nobody reads")},
            {"J_regressor", npy<double>({j, v}, regressor)},
            {"weights", npy<double>({v, j}, weights)},
            {"kintree_table", npy<uint32_t>({2, j}, tree)},
            {"f", npy<uint32_t>({2, 3}, {0, 1, 2, 2, 1, static_cast<uint32_t>(v - 1)})}};
  }
  std::string file() const { return npz(arrays()); }
};

/// A motion whose joints turn at constant rates about fixed axes and whose root moves on a line, so
/// that resampling is exact. World z up, as AMASS.
struct TinyClip {
  SmplFamily family = SmplFamily::smplh;
  int64_t frames = 121;
  double fps = 120;
  std::string rate_key = "mocap_framerate", gender = "female";
  Betas betas = {0.5, -1, 0.25, 2};
  bool type = false;  ///< say surface_model_type

  int64_t width() const { return family == SmplFamily::smplx ? 165 : 156; }
  /// Axis-angle of a joint; the root's axis is z so that the body stays upright.
  Vec3 turn(int j, double t) const {
    if (j == 0) return Vec3(0, 0, 0.9 * t);
    const Vec3 axis(std::sin(1.0 + j), std::cos(2.0 * j), 0.5);
    return axis.normalized() * (0.3 + 0.05 * j) * t;
  }
  /// SMPL rests y up: the world's root rotation brings it to z up first.
  Mat3 root(double t) const {
    return Eigen::AngleAxisd(0.9 * t, Vec3::UnitZ()).toRotationMatrix() *
           Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()).toRotationMatrix();
  }
  Vec3 trans(double t) const { return {0.4 * t, -0.7 * t, 0.05 * t + 0.3}; }

  std::vector<std::pair<std::string, std::string>> arrays() const {
    std::vector<double> poses, moved;
    for (int64_t f = 0; f < frames; ++f) {
      const double t = static_cast<double>(f) / fps;
      const Eigen::AngleAxisd first(root(t));
      for (int64_t i = 0; i < width() / 3; ++i) {
        const Vec3 a = i == 0        ? Vec3(first.angle() * first.axis())
                       : i < kJoints ? turn(static_cast<int>(i), t)
                                     : Vec3(9, 9, 9);  // fingers, which nobody reads
        poses.insert(poses.end(), a.data(), a.data() + 3);
      }
      const Vec3 x = trans(t);
      moved.insert(moved.end(), x.data(), x.data() + 3);
    }
    std::vector<std::pair<std::string, std::string>> out = {
        {"poses", npy<double>({frames, width()}, poses)},
        {"trans", npy<double>({frames, 3}, moved)},
        {"betas", npy<double>({static_cast<int64_t>(betas.size())}, betas)},
        {"gender", npy_text(gender)},
        {rate_key, npy<double>({}, {fps})},
        {"marker_labels", npy_of(npy_header("|O", {3}), "a pickle")}};
    if (type)
      out.emplace_back("surface_model_type",
                       npy_text(family == SmplFamily::smplx ? "smplx" : "smplh"));
    return out;
  }
  std::string file() const { return npz(arrays()); }
};

}  // namespace restage::test
