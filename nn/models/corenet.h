// `transfer/corenet`: 3D-CoreNet (Song et al., NeurIPS 2021).
#pragma once

#include <array>

#include "nn/config/rules.h"
#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"
#include "nn/layers/spectral.h"
#include "nn/models/transfer.h"

namespace restage {

struct CoreNetConfig {
  std::array<int64_t, 3> widths = {64, 128, 256};
  std::array<int64_t, 3> generator = {1024, 512, 256};
  int64_t blocks = 4;
  bool own_start = false;
};

template <class V>
void visit(V& v, CoreNetConfig& c) {
  v("widths", c.widths, "channels of the features that are matched", between(1, kMostWidth));
  v("generator", c.generator, "channels of the generator", between(1, kMostWidth));
  v("blocks", c.blocks, "residual blocks of the features", between(0, 64));
  v("own_start", c.own_start,
    "weights begin as its program's do, with a Xavier gain of 0.02; else as PyTorch's");
}

/// x + norm(c2 act(norm(c1 x))) through act, one PReLU whose slope is used twice.
struct PointResBlock : Module {
  PointResBlock(int64_t channels, const Init& init);
  Var operator()(Context& ctx, const Var& x) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "PointResBlock"; }
  Linear conv1, conv2;
  Parameter slope;
};

/// Finds the pose's point for each vertex of the target, by features and optimal transport.
struct Correspondence : Module {
  struct Found {
    Var features;  ///< of the identity [n, v, c]
    Var rows;      ///< shares of the pose's points [n, v, p], adding up to 1
    Var warped;    ///< the mean of the pose's points [n, v, 3]
  };
  Correspondence(const CoreNetConfig& c, const Init& init);
  Found operator()(Context& ctx, const Var& pose, const Var& identity) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "Correspondence"; }
  ModuleList<Linear> convs;
  ModuleList<PointResBlock> res;
  Linear phi, theta;

 private:
  Var features(Context& ctx, const Var& points) const;
};

/// Features with their mean over the points.
struct WithMean {
  explicit WithMean(const Var& x);
  Var x;     ///< [n, v, c]
  Var mean;  ///< [n, c]
};

/// What all ElaINs of features x [n, v, c], v > 1, need of them.
struct Normalised : WithMean {
  explicit Normalised(const Var& x);
  Var unit;  ///< (x - mean) / s, with the unbiased deviation s
};

/// Elastic instance normalisation and a leaky ReLU: unit (1 + G) + B before it, with scale and
/// shift between what the identity's features ask for, gamma and beta, and x's own deviation s and
/// mean m:
///   G = share gamma + (1 - share) s,   B = share beta + (1 - share) m,   share = mix(same f, m).
/// Since s unit + m is x itself, that is share (unit gamma + beta) + unit + (1 - share) x. gamma
/// and beta are linear in the features f [n, v, i], so one product each makes them of f.
struct Elain : Module {
  Elain(int64_t channels, int64_t identity, const Init& init);
  Var operator()(Context& ctx, const Normalised& x, const WithMean& identity) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "ElaIN"; }
  Linear same, gamma, beta, mix;

 private:
  /// of(same(x)) by one product.
  Var through_same(Context& ctx, const Linear& of, const Var& x) const;
};

struct ElainBlock : Module {
  ElainBlock(int64_t channels, int64_t identity, const Init& init);
  Var operator()(Context& ctx, const Var& x, const WithMean& identity);
  void visit(Fields& f) override;
  const char* kind() const override { return "ElaINBlock"; }
  Elain n0, n1, ns;
  SpectralLinear c0, c1, cs;
};

/// The first layer of the generator sees three neighbours in the order of the vertices, so the
/// answer depends on that order.
struct CoreNet : TransferModel {
  using Config = CoreNetConfig;
  CoreNet(const CoreNetConfig& c, const Init& init);
  Var forward(Context& ctx, const TransferInput& in) override;
  /// The same of poses [n, p, 3]; `found`, where given, says what was matched.
  Var posed(Context& ctx, const Var& pose, const Var& identity,
            Correspondence::Found* found = nullptr);
  void visit(Fields& f) override;
  const char* kind() const override { return "CoreNet"; }
  CoreNetConfig config;
  Correspondence corr;
  Conv1d fc;
  ModuleList<Linear> convs;
  ModuleList<ElainBlock> blocks;
  Linear out;
};

}  // namespace restage
