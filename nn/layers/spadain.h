// Parts of Neural Pose Transfer (Wang et al. 2020) that LART and TST share. Points are rows:
// x [n, v, c], where the papers write [n, c, v].
#pragma once

#include <array>

#include "nn/layers/linear.h"
#include "nn/layers/module_list.h"

namespace restage {

/// Three 1x1 convolutions, each with instance norm and ReLU: points [n, v, 3] -> [n, v, widths[2]].
struct PoseEncoder : Module {
  PoseEncoder(const std::array<int64_t, 3>& widths, const Init& init);
  Var operator()(Context& ctx, const Var& points) const;
  void visit(Fields& f) override { f("convs", convs); }
  const char* kind() const override { return "PoseEncoder"; }
  ModuleList<Linear> convs;
};

/// (A m + a) * instance_norm(x) + (B m + b): x [n, v, c] in the style of the mesh m [n, v, 3].
/// Without the norm where x is one code repeated at every point: over equal values the norm is
/// zero, and the pose would be lost.
struct Spadain : Module {
  Spadain(int64_t channels, bool norm, const Init& init);
  Var operator()(Context& ctx, const Var& x, const Var& mesh) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SPAdaIN"; }
  Linear scale, shift;

 private:
  bool norm_;
};

/// c2 relu(n2(c1 relu(n1(x)))) + c3 relu(n3(x)).
struct SpadainBlock : Module {
  SpadainBlock(int64_t channels, bool norm, const Init& init);
  Var operator()(Context& ctx, const Var& x, const Var& mesh) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SPAdaINBlock"; }
  Spadain n1, n2, n3;
  Linear c1, c2, c3;
};

}  // namespace restage
