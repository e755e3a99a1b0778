// The user's own SMPL, SMPL-H or SMPL-X body model (.npz): people as vectors of shape numbers
// ("betas"), and the skeletons that AMASS motions are recorded on.
//
// Read are v_template [V, 3], shapedirs [V, 3, B], J_regressor [J, V], weights [V, J],
// kintree_table [2, J], f [T, 3] and posedirs [V, 3, 9 (J - 1)], as plain arrays. Surfaces are the
// model's own for all poses of the 22 joints; fingers, jaw and eyes rest. Source: Loper et al.
// 2015, Romero et al. 2017, Pavlakos et al. 2019.
#pragma once

#include <string>
#include <vector>

#include "datasets/readers/arrays/npz.h"
#include "nn/geometry/body.h"

namespace restage {

enum class SmplFamily { smpl, smplh, smplx };  ///< 24, 52 and 55 joints; the first 22 are ours
const char* to_string(SmplFamily family);      ///< "SMPL", "SMPL-H", "SMPL-X"

using Betas = std::vector<double>;

class SmplModel {
 public:
  /// InputError: no such model, another skeleton, arrays that do not fit each other, pickles.
  explicit SmplModel(const std::string& path, uint64_t max_memory = kMaxMemory)
      : SmplModel(Npz(path, max_memory)) {}
  explicit SmplModel(const Npz& file);

  const std::string& path() const { return path_; }
  SmplFamily family() const { return family_; }
  size_t vertices() const { return template_.size(); }
  /// Shape numbers it knows; further ones of a person are left out, missing ones are zero.
  size_t shapes() const { return shapes_; }

  /// The 22 joints at zero rotations: metres, y up, facing +z, in the model's own frame.
  Joints joints(const Betas& betas) const;
  /// Reads the model's pose blend shapes, which body() then hands on; a model may have none. They
  /// are as large as all the rest together, so whoever needs joints alone leaves this out.
  void read_blend_shapes(const Npz& file);
  bool has_blend_shapes() const { return blend_shapes_ != nullptr; }

  /// A T-posed body, lowest vertex at y = 0. Weights of hands, jaw and eyes count for the wrists
  /// and the head. Without id and split.
  Body body(const Betas& betas) const;

 private:
  void read_template(const Npz& file);
  void read_skeleton(const Npz& file);
  void read_regressor();
  void read_weights(const Npz& file);
  void read_faces(const Npz& file);
  Vec3 vertex(size_t v, const Betas& betas) const;

  std::string path_;
  SmplFamily family_ = SmplFamily::smpl;
  NpyArray directions_, regressor_;  // [V, 3, B] and [J, V], as they lie in the file
  std::vector<Vec3> template_;
  size_t shapes_ = 0;
  std::vector<int> parents_;                           // of all joints
  std::vector<std::vector<uint32_t>> joint_vertices_;  // that each of the 22 is a mean of
  Eigen::Matrix<float, Eigen::Dynamic, kJoints, Eigen::RowMajor> weights_;
  std::vector<Triangle> faces_;
  std::shared_ptr<const PoseBlendShapes> blend_shapes_;
};

/// Whether an archive is a body model, and which; the latter throws InputError for an unknown one.
bool is_smpl_model(const Npz& file);
SmplFamily smpl_family(const Npz& file);

/// The people of a file: `betas` [B] or [P, B] of an NPZ (also AMASS clips, shape.npz and stagei
/// files), or an NPY. InputError: none there, not finite.
std::vector<Betas> read_betas(const std::string& path, uint64_t max_memory = kMaxMemory);

}  // namespace restage
