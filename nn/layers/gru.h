// Stacked GRU (spec 3.2), batch first, dropout between the layers only.
#pragma once

#include <memory>

#include "nn/module.h"

namespace restage {

struct GruLayer : Module {
  GruLayer(int64_t in, int64_t hidden, int layers, double dropout, const Init& init);
  /// x [n, t, in] -> y [n, t, hidden]; `state` [layers, n, hidden] is read (undefined: zero) and
  /// replaced by the states after the last step.
  Var operator()(Context& ctx, const Var& x, Var* state) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "GRU"; }

 private:
  struct Weights {
    Parameter w_ih, w_hh, b_ih, b_hh;
  };
  std::vector<std::unique_ptr<Weights>> layers_;
  int64_t hidden_;
  double dropout_;
};

}  // namespace restage
