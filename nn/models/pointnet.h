// `skeleton/pointnet`: the extractor of the paper's first version (spec 2.4).
#pragma once

#include <array>
#include <memory>

#include "nn/config/rules.h"
#include "nn/layers/linear.h"
#include "nn/layers/norm.h"
#include "nn/models/skeleton.h"

namespace restage {

struct PointNetConfig {
  std::array<int64_t, 5> widths = {64, 128, 1024, 512, 256};
  int64_t points = 1024;
  bool feature_transform = false;  ///< the 64x64 T-net of v1's table, which its count excludes
  bool relu3 = true;               ///< ReLU before the maximum (v1's table)
  double dropout = 0.3;
};

template <class V>
void visit(V& v, PointNetConfig& c) {
  v("points", c.points, "points per cloud", between(1, kMostPoints));
  v("dropout", c.dropout, "dropout rate", below(0, 1));
  v("feature_transform", c.feature_transform, "the 64x64 T-net of the first version's table");
  v("relu3", c.relu3, "ReLU before the maximum");
  v("widths", c.widths, "channels of the three convolutions and the head's two layers",
    added("[64, 128, 1024, 512, 256]", between(1, kMostWidth)));
}

/// T-net: a k x k matrix per cloud, identity added.
struct SpatialTransformer : Module {
  SpatialTransformer(int64_t k, const std::array<int64_t, 5>& w, const Init& init);
  Var operator()(Context& ctx, const Var& x);  ///< x [n, v, k] -> [n, k, k]
  void visit(Fields& f) override;
  const char* kind() const override { return "SpatialTransformer"; }
  Linear conv1, conv2, conv3, fc1, fc2, fc3;
  BatchNormLayer bn1, bn2, bn3, bn4, bn5;

 private:
  int64_t k_;
};

struct PointNet : SkeletonModel {
  using Config = PointNetConfig;
  PointNet(const PointNetConfig& c, const Init& init);
  SkeletonOutput forward(Context& ctx, const SkeletonInput& in) override;
  int64_t points() const override { return config.points; }
  void visit(Fields& f) override;
  const char* kind() const override { return "PointNet"; }
  PointNetConfig config;
  SpatialTransformer stn;
  std::unique_ptr<SpatialTransformer> fstn;
  Linear conv1, conv2, conv3;
  BatchNormLayer bn1, bn2, bn3;
  Linear fc1, fc2, fc3;
  BatchNormLayer bn4, bn5;
};

}  // namespace restage
