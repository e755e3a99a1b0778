// Online retargeting (spec 3.6): clouds of A go in one by one, poses of B come out, in constant
// memory. What depends on the target alone is computed once.
#pragma once

#include <optional>
#include <span>

#include "infer/deformer.h"
#include "infer/extraction.h"
#include "nn/weights/bundle.h"

namespace restage {

struct RetargetOptions {
  double fps = kFps;   ///< of the source; other rates are resampled to 30
  bool force = false;  ///< accept a target that does not look like a T-pose
  uint64_t seed = 0;   ///< of the choice of points
  int samples = 1;     ///< choices of points per frame that are averaged
  /// Seconds in which B's path, a sum of velocities, goes back to A's in proportion to the legs, so
  /// that errors do not add up. 0: never, as in the papers (docs/method.md, "Drift").
  double anchor = 0.25;
};

/// B in one frame.
struct RetargetedFrame {
  Pose pose;        ///< local rotations, pelvis in the world
  Joints joints;    ///< posed, world
  Points vertices;  ///< posed, world, in the target's order
};

/// Seconds that the parts of one push() took.
struct FrameTimes {
  double extract = 0, motion = 0, deformation = 0;
};

class Retargeter {
 public:
  /// `models` must hold all stages and outlive the object. `where` names the target in errors.
  /// InputError: a target whose shoulder-wrist lines are more than 30 degrees from +-x.
  Retargeter(const ModelSet& models, Mesh target, const std::string& where,
             const RetargetOptions& options);
  /// The same from known rest joints of the target instead of extracted ones.
  Retargeter(const ModelSet& models, Mesh target, const Joints& rest,
             const RetargetOptions& options);

  /// One frame of A. At 30 fps each gives one frame of B, else those of the 30 fps grid that it
  /// ends. They live until the next call: a steady frame takes no memory.
  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source);
  /// The same from joints of A in the world.
  std::span<const RetargetedFrame> push_joints(const Joints& joints);
  /// The target's surface in a pose of choice: skinning weights and offsets of the models. `dense`:
  /// nothing is left out, to compare with.
  Points pose_vertices(const Pose& pose, bool dense = false) const;
  /// Forgets the motion so far.
  void restart();

  const Mesh& target() const { return target_; }
  const Joints& rest() const { return rest_; }
  const Eigen::Matrix<float, Eigen::Dynamic, kJoints, Eigen::RowMajor>& weights() const {
    return weights_;
  }
  /// Joints extracted from the last cloud.
  const Joints& source_joints() const { return last_source_; }
  /// What the last push() took.
  const FrameTimes& times() const { return times_; }

 private:
  void prepare();
  void step(const Joints& a, RetargetedFrame* out);
  void advance(const Joints& a, Pose* pose);
  void sum_path(const Joints& a, const Vec3& velocity);
  void deform(const Pose& pose, const PosedSkeleton& posed, Points* out, bool dense = false) const;

  const ModelSet& models_;
  Mesh target_;
  RetargetOptions options_;
  JointExtractor extractor_;
  Joints rest_;
  Eigen::Matrix<float, Eigen::Dynamic, kJoints, Eigen::RowMajor> weights_;
  Tensor rest_tensor_;  // relative to the rest pelvis
  std::optional<Deformer> deformer_;
  // How the models were trained:
  enum class Path { velocity, relative, absolute } path_ = Path::velocity;
  bool remove_heading_ = false, keep_root_rotation_ = true;
  SmrmState state_;
  std::optional<Joints> previous_;  ///< A on the 30 fps grid, one step ago
  std::optional<Joints> received_;  ///< A as last pushed
  Joints last_source_;
  Vec3 start_a_ = Vec3::Zero(), start_b_ = Vec3::Zero();  ///< pelvis in the first frame
  Vec3 root_b_ = Vec3::Zero();
  Vec3 centre_a_ = Vec3::Zero(), centre_b_ = Vec3::Zero();  ///< what paths are scaled about
  double legs_a_ = 0;                                       ///< mean leg length of A so far
  int64_t frame_ = 0, grid_ = 0;         ///< source frames received, grid frames produced
  std::vector<RetargetedFrame> frames_;  ///< of the last push, and room for more
  FrameTimes times_;
};

}  // namespace restage
