#include "nn/models/patch_transformer.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"
#include "nn/layers/vector_attention.h"

namespace restage {
namespace {

constexpr double kUsualError = -4;  // log of 2 cm: where an untrained uncertainty begins

/// For each centre [n, t, 3]: where each remembered joint lies relative to the centre, times the
/// trust in that joint, and the trust. [n, t, 88], constant; all zero if nothing is remembered.
Tensor seen_from(const Tensor& centres_there, const Tensor& past_there, double scale) {
  const int64_t n = centres_there.size(0), t = centres_there.size(1), w = 4 * kJoints;
  const Device device = centres_there.device();
  if (!past_there.defined()) return Tensor::zeros({n, t, w}, DType::f32, device);
  const Tensor centres = centres_there.cpu(), past = past_there.cpu();
  Tensor out = Tensor::empty({n, t, w});
  for (int64_t row = 0; row < n * t; ++row) {
    const float* centre = centres.data<float>() + 3 * row;
    for (int64_t j = 0; j < kJoints; ++j) {
      const float* joint = past.data<float>() + 4 * (row / t * kJoints + j);
      float* to = out.data<float>() + w * row + 4 * j;
      for (int64_t c = 0; c < 3; ++c)
        to[c] = joint[3] * static_cast<float>(scale) * (joint[c] - centre[c]);
      to[3] = joint[3];
    }
  }
  return out.to(device);
}

}  // namespace

PatchTransformer::PatchTransformer(const PatchTransformerConfig& c, const Init& init)
    : config(c),
      point({3, c.patch, c.width}, init.sub("point")),
      position({3, c.patch, c.width}, init.sub("position")),
      mix(c.width, c.width, init.sub("mix")),
      norm(c.width, init),
      vote(c.width, kJoints * 4, init.sub("vote")),
      segment(c.width, kJoints, init.sub("segment")) {
  for (int64_t i = 0; i < c.layers; ++i)
    layers.emplace(c.width, c.heads, 2 * c.width, init.sub("layers." + std::to_string(i)));
  if (c.orientation) orientation.emplace(c.width, kJoints * 7, init.sub("orientation"));
  if (c.uncertainty) uncertainty.emplace(c.width, kJoints, init.sub("uncertainty"));
  if (c.memory) {
    memory.emplace(std::initializer_list<int64_t>{4 * kJoints, c.width, c.width},
                   init.sub("memory"));
    (*memory)[1].start_small();
  }
  for (int64_t i = 1; i < c.looks; ++i)
    again.emplace(c.patch, c.width, c.heads, init.sub("again." + std::to_string(i - 1)));
}

SkeletonOutput PatchTransformer::forward(Context& ctx, const SkeletonInput& in) {
  const ModuleScope path(scope);
  const Var& cloud = in.cloud;
  const int64_t n = cloud.size(0), t = config.centres;
  SkeletonOutput out;
  out.centres = fps(cloud.value, t);
  const Var centres = gather(cloud, out.centres);
  const Tensor index = knn(centres.value, cloud.value, config.neighbours);
  const Var offsets = neighbour_offsets(cloud, centres, index);
  const Var patch = max(point(ctx, scale(offsets, config.patch_scale)), 2);
  Var x = mix(ctx, relu(patch)) + position(ctx, scale(centres, config.centre_scale));
  if (memory) x = x + (*memory)(ctx, seen_from(centres.value, in.past, config.memory_scale));
  for (size_t i = 0; i < layers.size(); ++i) x = layers[i](ctx, x);
  x = norm(ctx, x);
  const Vars head = split(vote(ctx, x), 2, {kJoints, 3 * kJoints});
  out.votes = reshape(head[1], {n, t, kJoints, 3}) + reshape(centres, {n, t, 1, 3});
  const Var weight = reshape(softmax(head[0], 1), {n, t, kJoints, 1});
  out.joints = sum(weight * out.votes, 1);
  if (orientation) {
    const Vars all = split((*orientation)(ctx, x), 2, {kJoints, 6 * kJoints});
    const Var share = reshape(softmax(all[0], 1), {n, t, kJoints, 1});
    out.turns = sum(share * reshape(all[1], {n, t, kJoints, 6}), 1);
  }
  if (uncertainty) {  // learns from the tokens as they are: where joints are believed is not its to
                      // change
    const Var by_token = (*uncertainty)(ctx, Var(x.value));
    out.uncertainty =
        add_scalar(sum(by_token * Var(weight.value.reshape({n, t, kJoints})), 1), kUsualError);
  }
  if (ctx.training) out.segmentation = segment(ctx, x);
  for (size_t i = 0; i < again.size(); ++i) {
    out.before.push_back(out);
    static_cast<SkeletonAnswer&>(out) = again[i](ctx, cloud, out.before.back());
  }
  return out;
}

void PatchTransformer::visit(Fields& f) {
  f("point", point);
  f("position", position);
  f("mix", mix);
  f("layers", layers);
  f("norm", norm);
  f("vote", vote);
  f("segment", segment);
  if (orientation) f("orientation", *orientation);
  if (uncertainty) f("uncertainty", *uncertainty);
  if (memory) f("memory", *memory);
  if (again.size() > 0) f("again", again);
}

}  // namespace restage
