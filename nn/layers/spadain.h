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

/// (A m + a) * x + (B m + b): x, normalised by its block, in the style of the mesh m [n, v, 3].
/// x [n, v, c], or [n, 1, c] for one code at all points.
struct Spadain : Module {
  Spadain(int64_t channels, const Init& init);
  Var operator()(Context& ctx, const Var& x, const Var& mesh,
                 Activation activation = Activation::none) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SPAdaIN"; }
  Linear scale, shift;
};

/// c2 relu(n2(norm(c1 relu(n1(norm(x)))))) + c3 relu(n3(norm(x))), with instance norm. Without it
/// where x is one code for all points: over equal values the norm is zero, and the pose would be
/// lost.
struct SpadainBlock : Module {
  SpadainBlock(int64_t channels, bool norm, const Init& init);
  Var operator()(Context& ctx, const Var& x, const Var& mesh) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "SPAdaINBlock"; }
  Spadain n1, n2, n3;
  Linear c1, c2, c3;

 private:
  bool norm_;
};

}  // namespace restage
