// Online retargeting (spec 3.6): clouds of A go in one by one, poses of B come out, in constant
// memory. What depends on the target alone is computed once.
#pragma once

#include <optional>
#include <span>

#include "infer/foot_lock.h"
#include "infer/surface.h"
#include "infer/system.h"
#include "infer/waiting.h"
#include "nn/models/extraction.h"
#include "nn/models/motion.h"
#include "nn/weights/bundle.h"

namespace restage {

struct RetargetOptions {
  double fps = kFps;   ///< of the source; other rates are resampled to 30
  bool force = false;  ///< accept a target that does not look like a T-pose
  uint64_t seed = 0;   ///< of the choice of points
  int samples = 4;     ///< views of a frame that are averaged (nn/models/extraction.h)
  /// Seconds in which B's path, a sum of velocities, goes back to A's in proportion to the legs, so
  /// that errors do not add up. 0: never, as in the papers (docs/method.md, "Drift").
  double anchor = 0.25;
  /// Frames of less confidence than this are not guessed: the target keeps the pose that was shown
  /// before, or its rest pose, and comes back in kReturnFrames frames (infer/waiting.h). 0: every
  /// frame is answered.
  double min_confidence = 0;
  /// Feet that stand are held where they landed, by weights that say which do.
  bool foot_lock = true;
};

/// Our chain of three networks. Extractor and motion network work where they are (move_networks());
/// the surface is the CPU's.
class Retargeter final : public System {
 public:
  /// `weights` come from the file `weights_name` (for errors) and need at least a model for
  /// skeleton and one for motion. Without `deformation.weights` frames have no vertices, without
  /// offsets skinning is all. `where` names the target. InputError: a model that is missing, a
  /// setting that is unknown, a target whose shoulder-wrist lines are more than 30 degrees from
  /// +-x.
  Retargeter(const Bundle& weights, const std::string& weights_name, Mesh target,
             const std::string& where, const RetargetOptions& options);
  /// The same from known rest joints of the target instead of extracted ones; the source is then
  /// given by push_joints() unless there is a model for skeleton.
  Retargeter(const Bundle& weights, const std::string& weights_name, Mesh target,
             const Joints& rest, const RetargetOptions& options);

  /// At 30 fps each cloud gives one frame, else those of the 30 fps grid that it ends; of a network
  /// that looks ahead (MotionModel::latency) those so many frames before. A steady frame takes no
  /// memory.
  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) override;
  void miss() override;
  /// The same from joints of A in the world, and what else is seen of them.
  std::span<const RetargetedFrame> push_joints(const SeenJoints& seen);
  /// The frames of a gap at the end, and those that the network has not answered yet: the source
  /// stands still in the end.
  std::span<const RetargetedFrame> finish() override;
  void restart() override;

  const Mesh& target() const override { return target_; }
  const SystemRig* rig() const override { return rig_ ? &*rig_ : nullptr; }
  Points posed(const Pose& pose) const override { return surface_ ? (*surface_)(pose) : Points(); }
  const Joints* target_joints() const override { return &rest_; }
  const Joints& rest() const { return rest_; }
  /// Whether every cloud is answered at once, by one frame of its own moment.
  bool frame_by_frame() const;
  /// Null without a model for `deformation.weights`.
  const Surface* surface() const { return surface_ ? &*surface_ : nullptr; }
  const Joints* source_joints() const override { return &last_source_; }
  FrameTimes times() const override { return times_; }

 private:
  void prepare(const std::string& weights_name);
  size_t advance(const SeenJoints& seen, bool ended);
  /// False: there is no answer yet.
  bool step(const SeenJoints& seen, bool filled, RetargetedFrame* out);
  MotionOutput answer(const SeenJoints& seen, const Mat3& turn);
  void perform(const MotionOutput& answer, const Joints& a, const Mat3& turn, Pose* pose);
  void hold_doubtful(const Joints& a, RetargetedFrame* out);
  void sum_path(const Joints& a, const Vec3& velocity);

  Bundle models_;
  Mesh target_;
  RetargetOptions options_;
  std::optional<JointExtractor> extractor_;
  const MotionModel* motion_ = nullptr;
  Device motion_device_;
  Joints rest_;
  std::optional<Surface> surface_;
  std::optional<SystemRig> rig_;
  Tensor rest_tensor_;  // relative to the rest pelvis
  // How the models were trained:
  enum class Path { velocity, relative, absolute } path_ = Path::velocity;
  bool remove_heading_ = false, steady_heading_ = false;
  Heading heading_{false};
  MotionState state_;
  FootLock feet_;
  Waiting waiting_;
  std::optional<Joints> previous_;      ///< A on the 30 fps grid, one step ago
  std::optional<Mat3> back_before_;     ///< what took A's heading away then
  std::optional<SeenJoints> received_;  ///< A as last pushed
  Joints last_source_;
  Vec3 start_a_ = Vec3::Zero(), start_b_ = Vec3::Zero();  ///< pelvis in the first frame
  Vec3 root_b_ = Vec3::Zero();
  Vec3 centre_a_ = Vec3::Zero(), centre_b_ = Vec3::Zero();  ///< what paths are scaled about
  double legs_a_ = 0;                                       ///< mean leg length of A so far
  /// What was seen on the grid and how it was turned, as many frames as answers come late.
  struct Asked {
    SeenJoints seen;
    Mat3 turn;
    bool filled;
  };
  std::vector<Asked> asked_;
  int64_t frame_ = 0, grid_ = 0;         ///< source frames received or missed, grid frames seen
  int64_t missed_ = 0;                   ///< source frames since the last one that was received
  int64_t answered_ = 0;                 ///< grid frames produced
  std::vector<RetargetedFrame> frames_;  ///< of the last push, and room for more
  FrameTimes times_;
};

}  // namespace restage
