// `codes/h4d`, the only model of the role `codes`: H4D (Jiang et al., CVPR 2022). Codes of shape,
// first pose and motion from a window of clouds, and what the codes mean. With `aux` in the sizes
// also its second stage's auxiliary code, which corrects the poses; without clothes.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "nn/config/rules.h"
#include "nn/layers/gru.h"
#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"
#include "nn/models/linear_body.h"

namespace restage {

struct H4dConfig {
  int64_t shape = 10, pose = 72, motion = 90, root = 4, frames = 30;
  int64_t hidden = 128, features = 128, recurrent = 512;
  int64_t aux = 0, vertices = 0, faces = 0;
};

template <class V>
void visit(V& v, H4dConfig& c) {
  v("shape", c.shape, "numbers of the shape", between(1, kMostWidth));
  v("pose", c.pose, "numbers of the first pose: three for each joint", between(1, kMostWidth));
  v("motion", c.motion, "numbers of the motion, those of the root among them",
    between(1, kMostWidth));
  v("root", c.root, "numbers of the root's motion", between(1, kMostWidth));
  v("frames", c.frames, "of a window", between(2, 1024));
  v("hidden", c.hidden, "channels inside the point networks", between(1, kMostWidth));
  v("features", c.features, "numbers of a frame", between(1, kMostWidth));
  v("recurrent", c.recurrent, "units of the GRU", between(1, kMostWidth));
  v("aux", c.aux, "numbers of the second stage's auxiliary code; 0: the first stage only",
    added("0", between(0, kMostWidth)));
  v("vertices", c.vertices, "of the body kept with the weights; a training sets it",
    between(0, 1e6));
  v("faces", c.faces, "of that body; a training sets it", between(0, 4e6));
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

/// What motion codes say: components of the change of pose against frame 0, for t - 1 later frames,
/// frame by frame.
struct MotionBasis {
  Tensor root, root_mean;     ///< [r, 3 (t - 1)], [3 (t - 1)]
  Tensor joints, joint_mean;  ///< [m, (3 j - 3) (t - 1)], [(3 j - 3) (t - 1)]
};
/// Poses of all frames [n, t, 3 j]: frame 0, and frame 0 plus its change (axis-angle numbers are
/// added).
Var h4d_poses(const Var& pose, const Var& motion, const MotionBasis& basis);

/// What the codes of a trained network mean, as buffers, so that a weights file needs nothing
/// beside it. A training computes it from its data; before that all of it is 0. Without `vertices`
/// in the sizes there is none.
struct H4dSpace : Module {
  H4dSpace(const H4dConfig& c, const Init& init);
  bool defined() const { return mean.defined(); }
  /// Takes tensors of the shapes that the sizes say, on any device; ShapeError for others.
  void set(const LinearBody& body, const std::vector<std::array<int32_t, 3>>& faces,
           const MotionBasis& basis);
  /// InputError if the parents are no tree whose root comes first (a damaged file).
  LinearBody body() const;
  MotionBasis basis() const { return {root, root_mean, joints, joint_mean}; }
  /// The body's faces; InputError if one names a vertex that there is not.
  std::vector<std::array<int32_t, 3>> faces() const;
  void visit(Fields& f) override;
  const char* kind() const override { return "H4DSpace"; }

 private:
  Tensor mean, directions, body_joints, joint_directions, weights;
  Tensor parents, corners;  // [j], [f, 3]; whole numbers
  Tensor root, root_mean, joints, joint_mean;
};

/// The networks of the first stage and, with `aux` in the sizes, those of the second one that see
/// to poses. The last layer of the correction starts at zeros.
struct H4d : Module {
  using Config = H4dConfig;
  struct Codes {
    Var shape;   ///< [n, shape]
    Var pose;    ///< [n, pose]: axis-angle of the joints in frame 0, radians
    Var motion;  ///< [n, motion]
    Var aux;     ///< [n, aux]; undefined in a network without the second stage
  };
  H4d(const H4dConfig& c, const Init& init);
  /// Clouds of a window [n, t, v, 3].
  Codes codes(Context& ctx, const Var& window) const;
  /// Sets motion and auxiliary code of frames whose point_encoder gave `features` [n, t, c].
  void read_motion(Context& ctx, const Var& features, Codes* codes) const;
  /// Poses of all frames [n, t, pose], corrected if there is an auxiliary code.
  Var poses(Context& ctx, const Codes& codes, const MotionBasis& basis) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "H4D"; }
  H4dConfig config;
  ResPointNet id_encoder, pose_encoder;
  PlainPointNet point_encoder;
  TemporalEncoder motion_encoder;
  std::optional<TemporalEncoder> aux_encoder, aux_decoder;
  H4dSpace space;
};

}  // namespace restage
