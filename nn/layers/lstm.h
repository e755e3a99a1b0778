// Stacked LSTM (Hochreiter and Schmidhuber 1997) in PyTorch's form, batch first.
#pragma once

#include <memory>
#include <vector>

#include "nn/module.h"

namespace restage {

/// Gates i, f, g, o; two biases; zero state at the start. Made of products and element-wise ops:
/// its users (TST) have windows of a few frames.
struct LstmLayer : Module {
  LstmLayer(int64_t in, int64_t hidden, int layers, const Init& init);
  /// x [n, t, in] -> [n, t, hidden]. After it `hidden` and `cell`, where given, hold the states of
  /// all layers behind the last step, [layers, n, hidden].
  Var operator()(Context& ctx, const Var& x, Var* hidden = nullptr, Var* cell = nullptr) const;
  void visit(Fields& f) override;
  const char* kind() const override { return "LSTM"; }

 private:
  struct Weights {
    Parameter w_ih, w_hh, b_ih, b_hh;
  };
  std::vector<std::unique_ptr<Weights>> layers_;
  int64_t hidden_;
};

}  // namespace restage
