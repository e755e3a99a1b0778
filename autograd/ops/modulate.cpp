#include "autograd/ops/modulate.h"

namespace restage {

void Modulate::check(Inputs x) const {
  if (x[0].rank() != 3 || x[1].rank() != 3 || x[1].size(2) != 3)
    shape_error(name, letters, x, "needs three axes, the last of m being 3");
  if (x[0].size(0) != x[1].size(0)) shape_error(name, letters, x, "n must agree");
  if (x[0].size(1) != x[1].size(1) && x[0].size(1) != 1)
    shape_error(name, letters, x, "x needs one row for each point of m, or one in all");
  const int64_t c = x[0].size(2);
  for (size_t k = 2; k < 6; ++k)
    if (x[k].shape() != (k % 2 == 0 ? Shape{c, 3} : Shape{c}))
      shape_error(name, letters, x, "c must agree");
  require_floats(name, letters, x);
}

Tensor Modulate::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0], {x[0].size(0), x[1].size(1), x[0].size(2)});
  launch(ModulateArgs{x[0], x[1], x[2], x[3], x[4], x[5], y, activation});
  saved.keep({x[0], x[1], x[2], x[3], x[4], x[5]});
  return y;
}

Grads Modulate::backward(const Saved& s, const Tensor& gy, Needs needs) const {
  Grads g;
  for (size_t k = 0; k < 6; ++k) g.push_back(k != 1 || needs[1] ? empty_like(s[k]) : Tensor());
  launch(ModulateGradArgs{s[0], s[1], s[2], s[3], s[4], s[5], gy, g[0], needs[1] ? &g[1] : nullptr,
                          g[2], g[3], g[4], g[5], activation});
  return g;
}

void ElainMix::check(Inputs x) const {
  if (x[0].rank() != 3) shape_error(name, letters, x, "needs three axes");
  for (size_t k = 1; k < 4; ++k)
    if (x[k].shape() != x[0].shape()) shape_error(name, letters, x, "shapes must agree");
  if (x[4].shape() != Shape{x[0].size(0), x[0].size(2)})
    shape_error(name, letters, x, "n and c must agree");
  require_floats(name, letters, x);
}

Tensor ElainMix::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0]);
  launch(ElainArgs{x[0], x[1], x[2], x[3], x[4], y, slope});
  saved.keep({x[0], x[1], x[2], x[3], x[4]});
  return y;
}

Grads ElainMix::backward(const Saved& s, const Tensor& gy, Needs) const {
  Grads g;
  for (size_t k = 0; k < 5; ++k) g.push_back(empty_like(s[k]));
  launch(ElainGradArgs{s[0], s[1], s[2], s[3], s[4], gy, g[0], g[1], g[2], g[3], g[4], slope});
  return g;
}

}  // namespace restage
