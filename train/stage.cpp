#include "train/stage.h"

#include <cmath>

namespace restage {

Differentiated differentiate(const RngKey& key, const std::function<Var(Context&)>& loss) {
  const auto run = [&] {
    Tape tape;
    Context ctx{&tape, true, key};
    const Var value = loss(ctx);
    Differentiated out;
    out.loss = value.value.item();
    out.gradients = tape.backward(value);
    out.norm = out.gradients.norm();
    return out;
  };
  Differentiated out = run();
  if (!std::isfinite(out.loss) || !std::isfinite(out.norm)) {
    const FiniteCheck check;
    run();
    throw NonFiniteError(
        "the loss or the norm of its gradient became infinite or NaN by adding up finite values");
  }
  return out;
}

}  // namespace restage
