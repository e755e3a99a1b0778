#include "nn/models/point_transformer.h"

#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {

PointTransformerBackbone::PointTransformerBackbone(const PointTransformerConfig& c,
                                                   const Init& init)
    : fc1({3, c.base, c.base}, init.sub("fc1")),
      transformer1(c.base, c.width, c.neighbours, init.sub("transformer1")) {
  int64_t points = c.points, channels = c.base;
  for (int64_t i = 0; i < c.blocks; ++i) {
    points /= 4;
    const std::string index = std::to_string(i);
    transition_downs.emplace(points, c.neighbours, channels + 3, 2 * channels,
                             init.sub("transition_downs." + index));
    channels *= 2;
    transformers.emplace(channels, c.width, c.neighbours, init.sub("transformers." + index));
  }
}

Var PointTransformerBackbone::operator()(Context& ctx, const Var& cloud) {
  const ModuleScope path(scope);
  Var xyz = cloud;
  Var f = transformer1(ctx, xyz, fc1(ctx, cloud));
  for (size_t i = 0; i < transformers.size(); ++i) {
    f = transition_downs[i].sa(ctx, &xyz, f);
    f = transformers[i](ctx, xyz, f);
  }
  return f;
}

void PointTransformerBackbone::visit(Fields& f) {
  f("fc1", fc1);
  f("transformer1", transformer1);
  f("transition_downs", transition_downs);
  f("transformers", transformers);
}

PointTransformer::PointTransformer(const PointTransformerConfig& c, const Init& init)
    : config(c),
      backbone(c, init.sub("backbone")),
      fc2({c.base << c.blocks, c.head1, c.head2, kJoints * 3}, init.sub("fc2")) {}

SkeletonOutput PointTransformer::forward(Context& ctx, const SkeletonInput& in) {
  const ModuleScope path(scope);
  const Var& cloud = in.cloud;
  SkeletonOutput out;
  out.joints = reshape(fc2(ctx, mean(backbone(ctx, cloud), 1)), {cloud.size(0), kJoints, 3});
  return out;
}

void PointTransformer::visit(Fields& f) {
  f("backbone", backbone);
  f("fc2", fc2);
}

}  // namespace restage
