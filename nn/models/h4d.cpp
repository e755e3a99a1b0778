#include "nn/models/h4d.h"

#include <algorithm>
#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

constexpr size_t kBlocks = 5, kPlainLayers = 3;

/// x [n, v, c] with the maximum over its points joined to each, [n, v, 2 c].
Var with_maximum(const Var& x) {
  const int64_t n = x.size(0), c = x.size(2);
  return concat({x, expand(reshape(max(x, 1), {n, 1, c}), x.shape())}, 2);
}

/// The last step of x [n, t, c], [n, c].
Var last(const Var& x) {
  const int64_t n = x.size(0), t = x.size(1);
  return reshape(slice(x, 1, t - 1, t), {n, x.size(2)});
}

}  // namespace

ResBlockFc::ResBlockFc(int64_t in, int64_t out, const Init& init)
    : fc_0(in, std::min(in, out), init.sub("fc_0")),
      fc_1(std::min(in, out), out, init.sub("fc_1")),
      shortcut(in, out, init.sub("shortcut"), false) {
  fc_1.weight.value = Tensor::zeros(fc_1.weight.value.shape(), init.type);
}

Var ResBlockFc::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  return shortcut(ctx, x) + fc_1(ctx, fc_0(ctx, relu(x), Activation::relu));
}

void ResBlockFc::visit(Fields& f) {
  f("fc_0", fc_0);
  f("fc_1", fc_1);
  f("shortcut", shortcut);
}

ResPointNet::ResPointNet(int64_t out, int64_t hidden, const Init& init)
    : fc_pos(3, 2 * hidden, init.sub("fc_pos")), fc_c(hidden, out, init.sub("fc_c")) {
  for (size_t i = 0; i < kBlocks; ++i)
    blocks.emplace(2 * hidden, hidden, init.sub("blocks." + std::to_string(i)));
}

Var ResPointNet::operator()(Context& ctx, const Var& points) const {
  const ModuleScope path(scope);
  Var x = fc_pos(ctx, points);
  for (size_t i = 0; i < kBlocks; ++i) {
    if (i > 0) x = with_maximum(x);
    x = blocks[i](ctx, x);
  }
  return fc_c(ctx, relu(max(x, 1)));
}

void ResPointNet::visit(Fields& f) {
  f("fc_pos", fc_pos);
  f("fc_c", fc_c);
  f("blocks", blocks);
}

PlainPointNet::PlainPointNet(int64_t out, int64_t hidden, const Init& init)
    : fc_pos(3, 2 * hidden, init.sub("fc_pos")), fc_c(hidden, out, init.sub("fc_c")) {
  for (size_t i = 0; i < kPlainLayers; ++i)
    fc.emplace(2 * hidden, hidden, init.sub("fc." + std::to_string(i)));
}

Var PlainPointNet::operator()(Context& ctx, const Var& points) const {
  const ModuleScope path(scope);
  Var x = fc_pos(ctx, points);
  for (size_t i = 0; i < kPlainLayers; ++i) {
    if (i > 0) x = with_maximum(x);
    x = fc[i](ctx, relu(x));
  }
  return fc_c(ctx, relu(max(x, 1)));
}

void PlainPointNet::visit(Fields& f) {
  f("fc_pos", fc_pos);
  f("fc_c", fc_c);
  f("fc", fc);
}

TemporalEncoder::TemporalEncoder(int64_t in, int64_t hidden, int64_t out, const Init& init)
    : gru(in, hidden, 2, 0, init.sub("gru")), linear(hidden, out, init.sub("linear")) {}

Var TemporalEncoder::operator()(Context& ctx, const Var& x) const {
  const ModuleScope path(scope);
  Var state;
  return linear(ctx, relu(gru(ctx, x, &state)));
}

void TemporalEncoder::visit(Fields& f) {
  f("gru", gru);
  f("linear", linear);
}

H4d::H4d(const H4dConfig& c, const Init& init)
    : config(c),
      id_encoder(c.shape, c.hidden, init.sub("id_encoder")),
      pose_encoder(c.pose, c.hidden, init.sub("pose_encoder")),
      point_encoder(c.features, c.hidden, init.sub("point_encoder")),
      motion_encoder(c.features, c.recurrent, c.motion, init.sub("motion_encoder")),
      space(c, init.sub("space")) {
  if (c.aux == 0) return;
  aux_encoder.emplace(c.features, c.recurrent, c.aux, init.sub("aux_encoder"));
  aux_decoder.emplace(c.motion + c.aux + c.pose, c.recurrent, c.pose, init.sub("aux_decoder"));
  for (Parameter* p : {&aux_decoder->linear.weight, &aux_decoder->linear.bias})
    p->value = Tensor::zeros(p->value.shape(), init.type);
}

H4d::Codes H4d::codes(Context& ctx, const Var& window) const {
  const ModuleScope path(scope);
  const int64_t n = window.size(0), t = window.size(1), v = window.size(2);
  const Var first = reshape(slice(window, 1, 0, 1), {n, v, 3});
  const Var frames = point_encoder(ctx, reshape(window, {n * t, v, 3}));
  Codes out{id_encoder(ctx, first), pose_encoder(ctx, first), {}, {}};
  read_motion(ctx, reshape(frames, {n, t, frames.size(1)}), &out);
  return out;
}

void H4d::read_motion(Context& ctx, const Var& features, Codes* codes) const {
  codes->motion = last(motion_encoder(ctx, features));
  if (aux_encoder) codes->aux = last((*aux_encoder)(ctx, features));
}

Var H4d::poses(Context& ctx, const Codes& codes, const MotionBasis& basis) const {
  const ModuleScope path(scope);
  const Var poses = h4d_poses(codes.pose, codes.motion, basis);
  if (!codes.aux.value.defined()) return poses;
  const int64_t n = poses.size(0), t = poses.size(1);
  const auto each_frame = [&](const Var& code) {
    return expand(reshape(code, {n, 1, code.size(1)}), {n, t, code.size(1)});
  };
  return poses +
         (*aux_decoder)(ctx, concat({each_frame(codes.motion), each_frame(codes.aux), poses}, 2));
}

void H4d::visit(Fields& f) {
  f("id_encoder", id_encoder);
  f("pose_encoder", pose_encoder);
  f("point_encoder", point_encoder);
  f("motion_encoder", motion_encoder);
  if (aux_encoder) {
    f("aux_encoder", *aux_encoder);
    f("aux_decoder", *aux_decoder);
  }
  if (space.defined()) f("space", space);
}

Var h4d_poses(const Var& pose, const Var& motion, const MotionBasis& basis) {
  const int64_t n = pose.size(0), width = pose.size(1), r = basis.root.size(0);
  const auto change = [&](int64_t from, int64_t to, const Tensor& components, const Tensor& mean,
                          int64_t numbers) {
    return reshape(matmul(slice(motion, 1, from, to), components) + Var(mean), {n, -1, numbers});
  };
  const Var changes = concat({change(0, r, basis.root, basis.root_mean, 3),
                              change(r, motion.size(1), basis.joints, basis.joint_mean, width - 3)},
                             2);
  const Var first = reshape(pose, {n, 1, width});
  return concat({first, first + changes}, 1);
}

}  // namespace restage
