#include "nn/models/pointnet.h"

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {

SpatialTransformer::SpatialTransformer(int64_t k, const std::array<int64_t, 5>& w, const Init& init)
    : conv1(k, w[0], init.sub("conv1"), true, 1),
      conv2(w[0], w[1], init.sub("conv2"), true, 1),
      conv3(w[1], w[2], init.sub("conv3"), true, 1),
      fc1(w[2], w[3], init.sub("fc1")),
      fc2(w[3], w[4], init.sub("fc2")),
      fc3(w[4], k * k, init.sub("fc3")),
      bn1(w[0], init),
      bn2(w[1], init),
      bn3(w[2], init),
      bn4(w[3], init),
      bn5(w[4], init),
      k_(k) {}

Var SpatialTransformer::operator()(Context& ctx, const Var& x) {
  const ModuleScope path(scope);
  Var h = relu(bn1(ctx, conv1(ctx, x)));
  h = relu(bn2(ctx, conv2(ctx, h)));
  h = bn3.pooled(ctx, conv3, h, Activation::relu);
  h = relu(bn4(ctx, fc1(ctx, h)));
  h = relu(bn5(ctx, fc2(ctx, h)));
  std::vector<double> eye(static_cast<size_t>(k_ * k_), 0.0);
  for (int64_t i = 0; i < k_; ++i) eye[i * k_ + i] = 1.0;
  const Tensor identity = Tensor::from<double>({k_ * k_}, eye).cast(x.dtype()).to(x.value.device());
  return reshape(fc3(ctx, h) + Var(identity), {x.size(0), k_, k_});
}

void SpatialTransformer::visit(Fields& f) {
  f("conv1", conv1);
  f("conv2", conv2);
  f("conv3", conv3);
  f("fc1", fc1);
  f("fc2", fc2);
  f("fc3", fc3);
  f("bn1", bn1);
  f("bn2", bn2);
  f("bn3", bn3);
  f("bn4", bn4);
  f("bn5", bn5);
}

PointNet::PointNet(const PointNetConfig& c, const Init& init)
    : config(c),
      stn(3, c.widths, init.sub("stn")),
      fstn(c.feature_transform
               ? std::make_unique<SpatialTransformer>(c.widths[0], c.widths, init.sub("fstn"))
               : nullptr),
      conv1(3, c.widths[0], init.sub("conv1"), true, 1),
      conv2(c.widths[0], c.widths[1], init.sub("conv2"), true, 1),
      conv3(c.widths[1], c.widths[2], init.sub("conv3"), true, 1),
      bn1(c.widths[0], init),
      bn2(c.widths[1], init),
      bn3(c.widths[2], init),
      fc1(c.widths[2], c.widths[3], init.sub("fc1")),
      fc2(c.widths[3], c.widths[4], init.sub("fc2")),
      fc3(c.widths[4], kJoints * 3, init.sub("fc3")),
      bn4(c.widths[3], init),
      bn5(c.widths[4], init) {}

SkeletonOutput PointNet::forward(Context& ctx, const SkeletonInput& in) {
  const ModuleScope path(scope);
  const Var& cloud = in.cloud;
  Var x = matmul(cloud, stn(ctx, cloud));  // points as rows: p A
  x = relu(bn1(ctx, conv1(ctx, x)));
  if (fstn) x = matmul(x, (*fstn)(ctx, x));
  x = relu(bn2(ctx, conv2(ctx, x)));
  x = bn3.pooled(ctx, conv3, x, config.relu3 ? Activation::relu : Activation::none);
  x = relu(bn4(ctx, fc1(ctx, x)));
  x = relu(bn5(ctx, dropout(ctx, fc2(ctx, x), config.dropout)));
  SkeletonOutput out;
  out.joints = reshape(fc3(ctx, x), {cloud.size(0), kJoints, 3});
  return out;
}

void PointNet::visit(Fields& f) {
  f("stn", stn);
  if (fstn) f("fstn", *fstn);
  f("conv1", conv1);
  f("conv2", conv2);
  f("conv3", conv3);
  f("bn1", bn1);
  f("bn2", bn2);
  f("bn3", bn3);
  f("fc1", fc1);
  f("fc2", fc2);
  f("fc3", fc3);
  f("bn4", bn4);
  f("bn5", bn5);
}

}  // namespace restage
