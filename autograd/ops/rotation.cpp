#include "autograd/ops/rotation.h"

#include "autograd/ops/layout.h"

namespace restage {
namespace {

int64_t width_of(RotationForm form) {
  return form == RotationForm::sixd ? 6 : form == RotationForm::quaternion ? 4 : 3;
}

/// Shape with the last `drop` axes replaced.
Shape with_tail(const Shape& s, int drop, std::initializer_list<int64_t> tail) {
  Shape out;
  for (int i = 0; i < s.rank() - drop; ++i) out.push_back(s[i]);
  for (const int64_t t : tail) out.push_back(t);
  return out;
}

Tensor from_matrix(const Tensor& r, RotationForm form) {
  if (r.rank() < 2 || r.size(-1) != 3 || r.size(-2) != 3)
    shape_error("from_matrix", "R[..., 3, 3]", std::array{r}, "needs matrices");
  Tensor out = empty_like(r, with_tail(r.shape(), 2, {width_of(form)}));
  launch(FromMatrixArgs{form, r, out});
  return out;
}

}  // namespace

void ToMatrix::check(Inputs x) const {
  if (x[0].rank() < 1 || x[0].size(-1) != width_of(form))
    shape_error(name, letters, x,
                "the last axis must have " + std::to_string(width_of(form)) + " numbers");
  require_floats(name, letters, x);
}

Tensor ToMatrix::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0], with_tail(x[0].shape(), 1, {3, 3}));
  launch(ToMatrixArgs{form, x[0], y});
  saved.keep({x[0]});
  return y;
}

Grads ToMatrix::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Tensor gx = empty_like(gy, saved[0].shape());
  launch(ToMatrixGradArgs{form, saved[0], gy, gx});
  return {gx};
}

void ForwardKinematics::check(Inputs x) const {
  const bool ranks = x[0].rank() == 4 && x[1].rank() == 3 && x[2].rank() == 2;
  if (!ranks || x[0].size(2) != 3 || x[0].size(3) != 3 || x[1].size(2) != 3 || x[2].size(1) != 3)
    shape_error(name, letters, x, "axes do not fit");
  const int64_t n = x[0].size(0), j = x[0].size(1);
  if (x[1].size(0) != n || x[2].size(0) != n) shape_error(name, letters, x, "n must agree");
  if (x[1].size(1) != j || static_cast<int64_t>(parents.size()) != j)
    shape_error(name, letters, x, "j must agree");
  for (size_t i = 0; i < parents.size(); ++i)
    if (parents[i] >= static_cast<int>(i))
      shape_error(name, letters, x, "parents must come before children");
  require_floats(name, letters, x);
}

Tensor ForwardKinematics::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0], {x[0].size(0), x[0].size(1), 3, 4});
  launch(FkArgs{x[0], x[1], x[2], parents, y});
  saved.keep({x[0], x[1], y});
  return y;
}

Grads ForwardKinematics::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Grads g{empty_like(gy, saved[0].shape()), empty_like(gy, saved[1].shape()),
          empty_like(gy, {gy.size(0), 3})};
  launch(FkGradArgs{saved[0], saved[1], saved[2], gy, parents, g[0], g[1], g[2]});
  return g;
}

void LinearBlendSkinning::check(Inputs x) const {
  const bool ranks = x[0].rank() == 3 && x[1].rank() == 3 && x[2].rank() == 4 && x[3].rank() == 3;
  if (!ranks || x[0].size(2) != 3 || x[2].size(2) != 3 || x[2].size(3) != 4 || x[3].size(2) != 3)
    shape_error(name, letters, x, "axes do not fit");
  const int64_t n = x[0].size(0), v = x[0].size(1), j = x[2].size(1);
  if (x[1].size(0) != n || x[2].size(0) != n || x[3].size(0) != n)
    shape_error(name, letters, x, "n must agree");
  if (x[1].size(1) != v) shape_error(name, letters, x, "v must agree");
  if (x[1].size(2) != j || x[3].size(1) != j) shape_error(name, letters, x, "j must agree");
  require_floats(name, letters, x);
}

Tensor LinearBlendSkinning::forward(Inputs x, Saved& saved) const {
  Tensor y = empty_like(x[0]);
  launch(LbsArgs{x[0], x[1], x[2], x[3], y});
  saved.keep({x[0], x[1], x[2], x[3]});
  return y;
}

Grads LinearBlendSkinning::backward(const Saved& saved, const Tensor& gy, Needs) const {
  Grads g;
  for (size_t i = 0; i < 4; ++i) g.push_back(empty_like(gy, saved[i].shape()));
  launch(LbsGradArgs{saved[0], saved[1], saved[2], saved[3], gy, g[0], g[1], g[2], g[3]});
  return g;
}

Var matrix_to_sixd(const Var& r) {
  if (r.rank() < 2 || r.size(-1) != 3 || r.size(-2) != 3)
    shape_error("matrix_to_sixd", "R[..., 3, 3]", std::array{r.value}, "needs matrices");
  const int64_t n = r.value.numel() / 9;
  const Var columns = permute(slice(reshape(r, {n, 3, 3}), 2, 0, 2), {0, 2, 1});
  return reshape(columns, with_tail(r.shape(), 2, {6}));
}

Tensor matrix_to_quaternion(const Tensor& r) { return from_matrix(r, RotationForm::quaternion); }
Tensor matrix_to_axis_angle(const Tensor& r) { return from_matrix(r, RotationForm::axis_angle); }

Var joints_of(const Var& t) { return reshape(slice(t, 3, 3, 4), {t.size(0), t.size(1), 3}); }
Var rotations_of(const Var& t) { return slice(t, 3, 0, 3); }

}  // namespace restage
