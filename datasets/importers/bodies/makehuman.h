// Bodies of the CC0 MakeHuman data (body/ of a data folder): shape targets, the game-engine rig
// folded to 22 joints, and the turn from the rest A-pose to the T-pose.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/geometry/body.h"

namespace restage {

namespace h5 {
class File;
}

/// One row of bodies.csv. Macro columns (gender, age, ...) lie in [0, 1]; columns with a '/' are
/// sliders in [-1, 1].
struct BodyRecipe {
  std::string id, split;
  std::map<std::string, double> values;
};

using TargetWeights = std::map<std::string, double>;  ///< shape target -> weight

/// InputError file:line for a missing column, a number out of range, an id given twice.
std::vector<BodyRecipe> read_recipes(const std::string& csv);

/// MakeHuman's macro rules (data folder's tools/body.py: macro_targets) and sliders.
TargetWeights recipe_targets(const BodyRecipe& recipe);

using JointWeights = std::array<double, kJoints>;

struct SkinnedSurface {
  std::vector<Vec3> vertices;
  std::vector<JointWeights> weights;          ///< one row per vertex
  std::vector<std::array<int32_t, 4>> quads;  ///< a triangle repeats its last vertex
};

/// The parametric model. Lengths inside are decimetres, A-pose, as in the file.
class MakeHuman {
 public:
  /// `folder` holds makehuman.h5 and clothes/. InputError: missing, damaged, another layout.
  explicit MakeHuman(const std::string& folder);

  /// A T-posed body, lowest skin vertex at y = 0: 13,380 vertices and 26,756 triangles. With a
  /// garment (a file of clothes/, without ending) its surface instead, fitted to and skinned like
  /// the body; joints and floor stay the body's. InputError: unknown slider target or garment.
  Body build(const BodyRecipe& recipe, const std::string& garment = "") const;
  /// A dressed character: the garment and the skin that it leaves bare (head, hands, feet ...), as
  /// one surface with its lowest vertex at y = 0; vertices of covered skin are left out.
  Body dress(const BodyRecipe& recipe, const std::string& garment) const;

 private:
  struct Target {
    size_t start, count;
  };
  void read_rig(const h5::File& file);
  void read_weights(const h5::File& file, const std::vector<size_t>& joint_of_bone);
  void read_targets(const h5::File& file);
  std::vector<Vec3> shape(const TargetWeights& targets) const;
  Vec3 bone_head(const std::vector<Vec3>& vertices, size_t bone) const;
  size_t bone_index(const std::string& name) const;
  Rotations t_pose_rotations(const std::vector<Vec3>& vertices, const Joints& joints) const;
  /// Shaped vertices and joints of a recipe, in the rest A-pose.
  std::vector<Vec3> shaped(const BodyRecipe& recipe, Joints& joints) const;
  PosedSkeleton t_pose(const std::vector<Vec3>& vertices, const Joints& joints) const;
  /// `hidden` (may be null): per vertex of the body, whether the garment covers it.
  SkinnedSurface fit_garment(const std::vector<Vec3>& vertices, const std::string& name,
                             std::vector<uint8_t>* hidden = nullptr) const;
  SkinnedSurface skin_of(const std::vector<Vec3>& vertices) const;

  std::string folder_, path_;
  std::vector<Vec3> base_;
  std::vector<std::array<int32_t, 4>> quads_;
  size_t skin_ = 0;  // vertices of the skin come first
  std::vector<std::string> bones_;
  std::vector<std::vector<int32_t>> heads_;  // per bone: its head is the mean of these vertices
  std::vector<JointWeights> weights_;        // per vertex, all vertices
  std::map<std::string, Target> targets_;
  std::vector<int32_t> target_vertex_;
  std::vector<int16_t> target_delta_;  // 3 per entry, 1/10,000 metre
};

}  // namespace restage
