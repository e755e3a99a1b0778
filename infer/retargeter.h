// Online retargeting by networks (spec 3.6): clouds of the source, who is called A here, go in one
// by one; poses of the target, who is called B, come out. Memory does not grow with the number of
// frames. Work that depends on the target alone is done once, in the constructor.
#pragma once

#include <optional>

#include "infer/contacts.h"
#include "infer/foot_lock.h"
#include "infer/footing.h"
#include "infer/surface.h"
#include "infer/system.h"
#include "infer/waiting.h"
#include "nn/geometry/steady_bones.h"
#include "nn/models/extraction.h"
#include "nn/models/motion.h"
#include "nn/weights/bundle.h"

namespace restage {

struct RetargetOptions {
  double fps = kFps;   ///< frames per second of the source; the result always has kFps
  bool force = false;  ///< accept a target that does not look like a T-pose
  /// A frame in which nobody can be made out, soon after one in which all was clear, is an
  /// UnusableCloud: in so many seconds after the clear one. What lasts longer is taken. 0: all are.
  double lost_seconds = 1.0 / 3;
  uint64_t seed = 0;  ///< of the random choice of points
  int samples = 4;    ///< how many views of a cloud are averaged (nn/models/extraction.h)
  /// B's path is a sum of velocities, whose errors add up. So B's pelvis is drawn to the place that
  /// A's path, scaled by the length of the legs, would give; `anchor` is the time constant in
  /// seconds. 0: B's pelvis is not drawn, as in the papers (docs/method.md, "Drift").
  double anchor = 0.25;
  /// In a frame with less confidence than this, B waits: B keeps the pose that was shown before, or
  /// stands at rest where nothing was shown before. When confidence is back, B comes back to the
  /// network's poses within kReturnFrames frames (infer/waiting.h). 0: B never waits.
  double min_confidence = 0;
  /// Hold feet that stand where they landed (infer/foot_lock.h), if the motion network says which
  /// feet stand.
  bool foot_lock = true;
  /// The soles decide how high B stands, and no foot goes below the floor (infer/footing.h), if the
  /// motion network says which feet stand and the target has a surface.
  bool floor = false;
  /// Hands touch what A's touch and go through nothing (infer/contacts.h), if the target has a
  /// surface: the surfaces of an average person whose legs are 1 m long, who stands in for A. Null:
  /// hands are where the rotations put them.
  std::shared_ptr<const PartSurfaces> contacts = nullptr;
  /// Legs and arms that cross keep their names (keep_limbs(), nn/models/views.h).
  bool keep_limbs = true;
  /// People of any size are seen in an adult's (nn/models/extraction.h), targets too.
  bool any_size = true;
  /// Who lies, leans or stands on the hands is seen upright (nn/models/extraction.h).
  bool any_way_up = true;
  /// Use the motion network that looks ahead, if the weights hold one (kLateMotion): calmer and
  /// nearer, but every frame comes MotionModel::latency() frames later.
  bool late = false;
  /// Hold the source's bones at the mean of their lengths so far (nn/geometry/steady_bones.h).
  bool steady_bones = true;
};

/// What is wrong with a frame, `seconds` after a frame in which all was clear: nobody can be made
/// out, or the trunk has turned as nobody turns. Empty: nothing.
std::string lost(const SeenJoints& now, const SeenJoints& before, double seconds);

/// Our chain of three networks: the extractor finds A's joints in a cloud, the motion network finds
/// B's pose for them, the deformation network gives B's surface. Every network computes on the
/// device on which its parameters lie (move_networks()); the deformation network on the motion
/// network's.
class Retargeter : public System {
 public:
  /// `weights` must hold a model for `skeleton` and one for `motion`. Without `deformation.weights`
  /// frames have no vertices; without `deformation.offsets` vertices are skinned only.
  /// `weights_name` and `where` are the files of `weights` and `target`, for errors. InputError: a
  /// model is missing, a setting is unknown, or the line from a shoulder to a wrist of the target
  /// is more than 30 degrees from +-x.
  Retargeter(const Bundle& weights, const std::string& weights_name, Mesh target,
             const std::string& where, const RetargetOptions& options);
  /// The same with known rest joints of the target: the extractor need not find them. If `weights`
  /// hold no model for `skeleton`, the source is given by push_joints() instead of push().
  Retargeter(const Bundle& weights, const std::string& weights_name, Mesh target,
             const Joints& rest, const RetargetOptions& options);

  /// As push(), for an A whose joints are known. `seen`: in the world, metres.
  void push_joints(const SeenJoints& seen, const Show& show);

  const Mesh& target() const override { return target_; }
  const Joints* target_joints() const override { return &rest_; }
  const Joints& rest() const { return rest_; }
  /// Whether every push() returns one frame, the frame of the pushed cloud's own moment.
  bool frame_by_frame() const;
  /// Null without a model for `deformation.weights`.
  const Surface* surface() const { return surface_ ? &*surface_ : nullptr; }
  const Joints* source_joints() const override { return &last_source_; }

 protected:
  /// At 30 fps each cloud gives one frame. At another rate a cloud gives the frames of the grid
  /// between the moment of the cloud before and its own moment. A motion network that looks ahead
  /// gives every frame MotionModel::latency() frames later. After a few frames, a call takes no new
  /// memory.
  void answer(const Points& cloud, const std::string& source, const Show& show) override;
  /// Changes the pose of a frame before the frame is placed and shown.
  virtual void adjust(RetargetedFrame&) {}

 private:
  /// To answer the last frames, a network that looks ahead is shown A standing still.
  void answer_rest(const Show& show) override;
  void forget() override;
  void place(RetargetedFrame& frame) const override;
  void prepare(const std::string& weights_name);
  void check_not_lost(const SeenJoints& seen, const std::string& source) const;
  void answer_joints(const SeenJoints& seen, const Show& show);
  void advance(const SeenJoints& seen, int64_t frame, bool ended, const Show& show);
  void step(const SeenJoints& seen, bool filled, const Show& show);
  void begin(const SeenJoints& seen);
  MotionOutput ask(const SeenJoints& seen, const Mat3& turn);
  void perform(const MotionOutput& answer, const Joints& a, const Mat3& turn, Pose* pose);
  void stand(const float* logits, const Joints& a, Pose* pose);
  void hold_doubtful(const Joints& a);
  void keep_contacts(const SeenJoints& a);
  void sum_path(const Joints& a, const Vec3& velocity);

  Bundle models_;
  Mesh target_;
  RetargetOptions options_;
  std::optional<JointExtractor> extractor_;
  const MotionModel* motion_ = nullptr;
  Device motion_device_;
  Joints rest_;
  std::optional<Surface> surface_;
  Tensor rest_tensor_;  // rest_, relative to its pelvis
  // Settings with which the motion network was trained:
  enum class Path { velocity, relative, absolute } path_ = Path::velocity;
  bool remove_heading_ = false, steady_heading_ = false;
  Heading heading_{false};
  MotionState state_;
  FootLock feet_;
  std::optional<Footing> footing_;
  std::optional<Contacts> contacts_;
  std::array<Vec3, 2> hands_moved_ = {Vec3::Zero(), Vec3::Zero()};  ///< in the frame before
  SteadyBones bones_;
  Waiting waiting_;
  std::optional<Joints> previous_;      ///< A one frame of the grid ago
  std::optional<Mat3> back_before_;     ///< the turn that took A's heading away one frame ago
  std::optional<SeenJoints> received_;  ///< A in the frame that was pushed last
  Joints last_source_;
  Vec3 start_a_ = Vec3::Zero(), start_b_ = Vec3::Zero();  ///< pelvises in the first (clear) frame
  bool clear_start_ = true;                               ///< whether that frame was clear
  Vec3 root_b_ = Vec3::Zero();                            ///< B's pelvis, before feet are held
  Vec3 centre_a_ = Vec3::Zero(),
       centre_b_ = Vec3::Zero();  ///< centres about which paths are scaled
  double legs_a_ = 0;             ///< length of A's legs, mean of all frames since begun_, metres
  int64_t begun_ = 0;             ///< the frame of the grid in which B began
  /// A in the last frames of the grid, a ring of latency + 1 of them: a late answer belongs to the
  /// oldest one. `turn`: A's heading.
  struct Asked {
    SeenJoints seen;
    Mat3 turn;
    bool filled;
  };
  std::vector<Asked> asked_;
  int64_t grid_ = 0;       ///< number of grid frames shown to the network
  int64_t answered_ = 0;   ///< number of grid frames answered
  RetargetedFrame frame_;  ///< that was shown last
};

}  // namespace restage
