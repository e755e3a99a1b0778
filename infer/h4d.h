// H4D as a system (role `codes`): shape from the target's T-pose, pose and motion from windows of
// the source's clouds (spec 9.3).
#pragma once

#include <Eigen/Core>
#include <deque>
#include <memory>
#include <optional>

#include "infer/each_cloud.h"
#include "infer/retargeter.h"
#include "nn/models/even_points.h"
#include "nn/models/h4d.h"
#include "nn/weights/bundle.h"

namespace restage {

/// H4D's body of one shape, as far as its skeleton and the middle of its surface go.
class ShapedSkeleton {
 public:
  explicit ShapedSkeleton(const H4dSpace& space);
  /// Gives the body another shape.
  void take(const Eigen::VectorXd& shape);
  const Joints& rest() const { return rest_; }
  /// The mean of the surface at rest by area, metres.
  Vec3 middle() const;
  /// The same of a posed surface. `posed` must be forward_kinematics(rest(), ...).
  Vec3 middle(const PosedSkeleton& posed) const;

 private:
  // Sums over vertices, each times its part of the area and its skin weight of a joint. With linear
  // blend skinning the middle of a surface needs no vertex.
  struct Linear {
    Eigen::VectorXd mean;        // three numbers a joint
    Eigen::MatrixXd directions;  // [the same, shape]
  };
  Linear joints_, sums_;
  std::array<double, kJoints> weights_{};
  Joints rest_;
  std::array<Vec3, kJoints> moments_;
};

/// The window is the last 30 clouds. The first 30 frames are answered together, by the first
/// window; from then on each cloud gives one frame, the last of its window. A source that ends
/// before is answered as if its last cloud went on. Where frames are missing, the window joins the
/// clouds beside the gap.
///
/// H4D has no path. The reconstructed source's middle is put on the middle of its cloud; where its
/// hips are then, scaled by the ratio of the legs, the target's hips are, as in pose_on(). The
/// source's shape for this is the mean over its clouds so far.
///
/// The target keeps its own vertices. Each takes the skin weights of the nearest vertex of the
/// target's reconstructed body, and is posed from its own rest place.
class H4dSystem final : public EachCloud {
 public:
  /// `weights_name` and `where` name weights and target in errors. `rest`: the target's joints, if
  /// they are known; they take the place of the reconstructed ones. InputError: no network of this
  /// role, or one without its body. Clouds have to come 30 a second, which make_system() checks.
  H4dSystem(const Bundle& weights, const std::string& weights_name, Mesh target,
            const std::string& where, const std::optional<Joints>& rest,
            const RetargetOptions& options);

  const Mesh& target() const override { return body_.rest; }
  const Joints* target_joints() const override { return &body_.joints; }
  /// Poses are answered, joints are not looked for.
  const Joints* source_joints() const override { return nullptr; }

 private:
  void answer(const Points& cloud, const std::string& source, const Show& show) override;
  void answer_rest(const Show& show) override;
  void forget() override;
  void place(RetargetedFrame& frame) const override { place_body(body_, frame); }
  /// A cloud as the networks saw it.
  struct Seen {
    Tensor features;  ///< [1, 1, c], on the network's device
    Tensor pose;      ///< [1, 66]
    Vec3 middle;
    int64_t missed;  ///< frames before it
  };
  Tensor centred(const EvenPoints& points, double offset, Vec3* middle) const;
  Eigen::VectorXd target_shape(uint64_t seed) const;
  void skin(const Eigen::VectorXd& shape);
  void look(const Points& cloud);
  void answer_window(size_t from, size_t to, const Show& show);
  Tensor poses_of_window();
  Pose pose_of(const float* numbers, const Vec3& middle) const;

  std::shared_ptr<H4d> model_;
  MotionBasis basis_;
  size_t points_, frames_of_window_;
  Body body_;  ///< the target
  ShapedSkeleton source_;
  Eigen::VectorXd shapes_;  ///< sum over the source's clouds
  int64_t clouds_ = 0;
  std::deque<Seen> window_;
  RetargetedFrame frame_;  ///< of the last cloud that was answered
};

}  // namespace restage
