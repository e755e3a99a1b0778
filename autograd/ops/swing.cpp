#include "autograd/ops/swing.h"

namespace restage {

void SwingTwist::check(Inputs x) const {
  if (x[0].rank() != 3 || x[1].rank() != 3 || x[2].rank() != 2 || x[0].size(2) != 3 ||
      !(x[0].shape() == x[1].shape()))
    shape_error(name, letters, x, "axes do not fit");
  if (x[2].size(0) != x[0].size(0)) shape_error(name, letters, x, "n must agree");
  const int64_t j = x[0].size(1);
  if (x[2].size(1) != j || static_cast<int64_t>(joints.size()) != j)
    shape_error(name, letters, x, "j must agree");
  for (int i = 0; i < static_cast<int>(j); ++i) {
    const SwingJoint& s = joints[static_cast<size_t>(i)];
    if (s.parent >= i || s.child >= j || s.left >= j || s.right >= j ||
        (s.left < 0) != (s.right < 0))
      shape_error(name, letters, x, "the skeleton's joints do not fit each other");
  }
  require_floats(name, letters, x);
}

Tensor SwingTwist::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0], {x[0].size(0), x[0].size(1), 3, 3});
  launch(SwingTwistArgs{x[0], x[1], x[2], joints, y});
  saved.keep({x[0], x[1], x[2]});
  return y;
}

Grads SwingTwist::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Grads g;
  for (size_t i = 0; i < 3; ++i) g.push_back(empty_like(gy, saved[i].shape()));
  launch(SwingTwistGradArgs{saved[0], saved[1], saved[2], gy, joints, g[1], g[0], g[2]});
  return g;
}

}  // namespace restage
