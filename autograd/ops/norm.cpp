#include "autograd/ops/norm.h"

#include "autograd/ops/elementwise.h"

namespace restage {
namespace {

struct Layout {
  int64_t outer, n, inner;
  Affine affine;
};

Tensor normalise(Inputs x, Saved& saved, const Layout& l, double eps, Tensor* mean_out,
                 Tensor* rstd_out) {
  const bool affine = l.affine != Affine::none;
  Tensor y = empty_like(x[0]);
  Tensor mean = Tensor::empty({l.outer, l.inner}, DType::f64, x[0].device());
  Tensor rstd = Tensor::empty({l.outer, l.inner}, DType::f64, x[0].device());
  launch(NormArgs{x[0], affine ? &x[1] : nullptr, affine ? &x[2] : nullptr, y, mean, rstd, l.outer,
                  l.n, l.inner, l.affine, eps});
  if (affine) {
    saved.keep({x[0], mean, rstd, x[1]});
  } else {
    saved.keep({x[0], mean, rstd});
  }
  if (mean_out != nullptr) {
    *mean_out = mean;
    *rstd_out = rstd;
  }
  return y;
}

Grads normalise_grad(const Saved& saved, const Tensor& gy, Needs needs, const Layout& l) {
  const bool affine = l.affine != Affine::none;
  Grads g(needs.size());
  g[0] = empty_like(gy);
  if (affine) {
    g[1] = empty_like(gy, saved[3].shape());
    g[2] = empty_like(gy, saved[3].shape());
  }
  launch(NormGradArgs{saved[0], affine ? &saved[3] : nullptr, saved[1], saved[2], gy, g[0],
                      affine ? &g[1] : nullptr, affine ? &g[2] : nullptr, l.outer, l.n, l.inner,
                      l.affine});
  return g;
}

void check_affine(const char* name, const char* letters, Inputs x) {
  if (x[0].rank() < 2) shape_error(name, letters, x, "needs at least two axes");
  for (size_t i = 1; i < x.size(); ++i)
    if (x[i].rank() != 1 || x[i].size(0) != x[0].size(-1))
      shape_error(name, letters, x, "c must agree");
  require_floats(name, letters, x);
}

Layout batch_layout(const Tensor& x) {
  return {1, x.shape().product(0, x.rank() - 1), x.size(-1), Affine::inner};
}
Layout layer_layout(const Tensor& x) {
  return {x.shape().product(0, x.rank() - 1), x.size(-1), 1, Affine::middle};
}
Layout instance_layout(const Tensor& x) { return {x.size(0), x.size(1), x.size(2), Affine::none}; }

}  // namespace

void BatchNorm::check(Inputs x) const {
  check_affine(name, letters, x);
  if (x[0].shape().product(0, x[0].rank() - 1) < 2)
    shape_error(name, letters, x, "needs more than one value per channel in training");
}

Tensor BatchNorm::forward(Inputs x, Saved& saved) const {
  Tensor mean, rstd;
  const Layout l = batch_layout(x[0]);
  Tensor y = normalise(x, saved, l, eps, &mean, &rstd);
  if (statistics != nullptr) {
    statistics->mean = mean.reshape({l.inner});
    statistics->count = l.n;
    const Var r(rstd.reshape({l.inner}));
    const Var one(Tensor::full({1}, 1, DType::f64, rstd.device()));
    statistics->variance = add_scalar(one / (r * r), -eps).value;
  }
  return y;
}

Grads BatchNorm::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  return normalise_grad(saved, gy, needs, batch_layout(gy));
}

void InstanceNorm::check(Inputs x) const {
  if (x[0].rank() != 3 || x[0].size(1) < 1)
    shape_error(name, letters, x, "needs three axes and v > 0");
  require_floats(name, letters, x);
}

Tensor InstanceNorm::forward(Inputs x, Saved& saved) const {
  return normalise(x, saved, instance_layout(x[0]), eps, nullptr, nullptr);
}

Grads InstanceNorm::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  return normalise_grad(saved, gy, needs, instance_layout(gy));
}

void LayerNorm::check(Inputs x) const { check_affine(name, letters, x); }

Tensor LayerNorm::forward(Inputs x, Saved& saved) const {
  return normalise(x, saved, layer_layout(x[0]), eps, nullptr, nullptr);
}

Grads LayerNorm::backward(const Saved& saved, const Tensor& gy, Needs needs) const {
  return normalise_grad(saved, gy, needs, layer_layout(gy));
}

}  // namespace restage
