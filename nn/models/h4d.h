// `codes/h4d`: H4D (Jiang et al., CVPR 2022): codes of shape, first pose and motion from a
// window of clouds, and the body that is made of them.
#pragma once

#include <memory>
#include <vector>

#include "nn/config/rules.h"
#include "nn/layers/gru.h"
#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"

namespace restage {

struct H4dConfig {
  int64_t shape = 10, pose = 72, motion = 90;
  int64_t hidden = 128, features = 128, recurrent = 512;
};

template <class V>
void visit(V& v, H4dConfig& c) {
  v("shape", c.shape, "numbers of the shape", between(1, kMostWidth));
  v("pose", c.pose, "numbers of the first pose: three for each joint", between(1, kMostWidth));
  v("motion", c.motion, "numbers of the motion", between(1, kMostWidth));
  v("hidden", c.hidden, "channels inside the point networks", between(1, kMostWidth));
  v("features", c.features, "numbers of a frame", between(1, kMostWidth));
  v("recurrent", c.recurrent, "units of the GRU", between(1, kMostWidth));
}

/// shortcut(x) + fc_1(relu(fc_0(relu(x)))); fc_1 starts at zero.
struct ResBlockFc : Module {
  ResBlockFc(int64_t in, int64_t out, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "ResBlockFC"; }
  Linear fc_0, fc_1, shortcut;
};

/// Points [n, v, 3] -> code [n, c]. After each block but the last, the maximum over all points is
/// joined to every point.
struct ResPointNet : Module {
  ResPointNet(int64_t out, int64_t hidden, const Init& init);
  Var operator()(Context& ctx, const Var& points) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "ResPointNet"; }
  Linear fc_pos, fc_c;
  ModuleList<ResBlockFc> blocks;
};

/// The same with one ReLU and one layer in the place of a block, three times.
struct PlainPointNet : Module {
  PlainPointNet(int64_t out, int64_t hidden, const Init& init);
  Var operator()(Context& ctx, const Var& points) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "PlainPointNet"; }
  Linear fc_pos, fc_c;
  ModuleList<Linear> fc;
};

/// Two GRU layers from a zero state, ReLU, a linear layer: [n, t, in] -> [n, t, out].
struct TemporalEncoder : Module {
  TemporalEncoder(int64_t in, int64_t hidden, int64_t out, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "TemporalEncoder"; }
  GruLayer gru;
  Linear linear;
};

/// The first stage's networks.
struct H4d : Module {
  using Config = H4dConfig;
  struct Codes {
    Var shape;   ///< [n, shape]
    Var pose;    ///< [n, pose]: axis-angle of the joints in frame 0, radians
    Var motion;  ///< [n, motion]
  };
  H4d(const H4dConfig& c, const Init& init);
  /// Clouds of a window [n, t, v, 3].
  Codes codes(Context& ctx, const Var& window) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "H4D"; }
  H4dConfig config;
  ResPointNet id_encoder, pose_encoder;
  PlainPointNet point_encoder;
  TemporalEncoder motion_encoder;
};

/// What motion codes say: components of the change of pose against frame 0, for t - 1 later frames,
/// frame by frame.
struct MotionBasis {
  Tensor root, root_mean;     ///< [r, 3 (t - 1)], [3 (t - 1)]
  Tensor joints, joint_mean;  ///< [m, (3 j - 3) (t - 1)], [(3 j - 3) (t - 1)]
};
/// Poses of all frames [n, t, 3 j]: frame 0, and frame 0 plus its change (axis-angle numbers are
/// added).
Var h4d_poses(const Var& pose, const Var& motion, const MotionBasis& basis);

/// A body whose shape is a sum of directions, without pose offsets.
struct LinearBody {
  Tensor mean;               ///< [v, 3]
  Tensor directions;         ///< [v, 3, b]
  Tensor regressor;          ///< [j, v]: joints from vertices
  Tensor weights;            ///< [v, j]: skin
  std::vector<int> parents;  ///< of the joints; -1: the root
};
/// Bodies of shapes [n, b] in poses [n, t, 3 j] -> [n, t, v, 3]. The root joint stays where it
/// rests.
Var pose_body(const LinearBody& body, const Var& shape, const Var& poses);

}  // namespace restage
