// Combines the answers of an extractor to several views of a cloud into one (docs/method.md,
// "Views", "Memory").
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "nn/geometry/skeleton.h"

namespace restage {

/// A cloud in which nobody can be found: too few points, values that are not finite, points so far
/// away that no joints can be computed, or nobody whom the network can make out.
class UnusableCloud : public InputError {
 public:
  using InputError::InputError;
};

/// What is seen of somebody in a cloud.
struct SeenJoints {
  SeenJoints() = default;
  SeenJoints(const Joints& known) : joints(known) {}
  Joints joints{};  ///< metres
  // If the model gives them (SkeletonOutput): the mean over the views.
  std::optional<Rotations> turns;                          ///< from the T-pose
  std::optional<std::array<double, kJoints>> uncertainty;  ///< metres
  /// Which way the body's left was when the extractor was last sure of it, and how many frames ago.
  std::optional<Vec3> left;
  int since = 0;
  /// For how many frames in a row most views of the legs, of the arms, were exchanged by
  /// keep_limbs().
  std::array<int, 2> exchanged{};
  /// Turns the cloud's frame into the one in which the extractor saw somebody stand
  /// (docs/method.md, "Any way up"). Exactly the identity for who stands.
  Mat3 upright = Mat3::Identity();
};
SeenJoints turned(const Mat3& turn, const SeenJoints& seen);

inline constexpr double kNearby = 0.05;  ///< metres
/// How sure an answer is: the chance of a joint to be within kNearby of where it is seen, by its
/// uncertainty (metres); the mean over the 22 joints.
double confidence(const std::array<double, kJoints>& uncertainty);
/// The geometric mean of the joints' uncertainties, metres.
double mean_uncertainty(const std::array<double, kJoints>& uncertainty);

/// The radius around each joint within which the true joint should be nine times in ten, by the
/// uncertainties (metres).
std::array<double, kJoints> radius_of_90(const std::array<double, kJoints>& uncertainty);

/// The answer to one view, in the cloud's frame.
struct View {
  using Columns = Eigen::Matrix<double, 3, 2>;
  Joints joints;
  std::array<Columns, kJoints> turns;  ///< columns as the model gives them, not orthonormal
  std::array<double, kJoints> log_uncertainty;  ///< logarithms of metres
};

/// Joints: the mean, from eight views on without a quarter of the values of each coordinate at
/// either end. `turns`, `uncertainty`: whether the model gives them. UnusableCloud naming `source`:
/// joints that are not finite. `values`: room for a coordinate of each view.
SeenJoints combined(const std::vector<View>& views, bool turns, bool uncertainty,
                    const std::string& source, std::vector<double>& values);

/// An extractor that takes the front of a person for the back gives every limb the name of the
/// other side, and is unsure. While it is unsure, for half a second at most, the sides of a view
/// are exchanged if its left points where `before` was sure to have the right.
void keep_sides(const SeenJoints& before, std::vector<View>* views);
/// Legs and arms that cross: an extractor may call the left one the right one, in some views or in
/// all. The joints below the hips, and those below the shoulders, of a view whose two sides lie
/// clearly nearer to where the frame before had the other ones are exchanged. For two seconds at
/// most: what most views say for longer is believed. Returns SeenJoints::exchanged of this frame.
std::array<int, 2> keep_limbs(const SeenJoints& before, std::vector<View>* views);
/// Notes in an answer where its left is: as the answer itself says if it is sure, else as `before`
/// says (null: nothing), turned a little towards the answer.
void remember_sides(const SeenJoints* before, SeenJoints* answer);

}  // namespace restage
