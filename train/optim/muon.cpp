#include "train/optim/muon.h"

#include <algorithm>
#include <cmath>

#include "autograd/kernels/matmul.h"
#include "autograd/kernels/update.h"

namespace restage {
namespace {

constexpr int kIterations = 5;
// s -> a s + b s^3 + c s^5 for every singular value s: Jordan's coefficients, which let small
// singular values grow fastest and keep all of them near one, not at one.
constexpr double kA = 3.4445, kB = -4.7750, kC = 2.0315;

enum class Transposed { none, first, second };

/// The product of each pair of matrices [b, rows, columns].
Tensor product(const Tensor& a, const Tensor& b, Transposed which = Transposed::none) {
  const bool first = which == Transposed::first, second = which == Transposed::second;
  Tensor out = empty_like(a, {a.size(0), a.size(first ? 2 : 1), b.size(second ? 1 : 2)});
  launch(MatmulArgs{a, b, out, first, second});
  return out;
}

/// The norm of each matrix of x [n, rows, columns].
std::vector<double> norms_of(const Tensor& x) {
  const Tensor squares = Tensor::empty({x.size(0)}, DType::f64, x.device());
  for (int64_t i = 0; i < x.size(0); ++i) {
    Tensor one = squares.rows(i, i + 1);
    launch(SquaredNormArgs{x.rows(i, i + 1), one});
  }
  std::vector<double> out = squares.cpu().to_vector<double>();
  for (double& square : out) square = std::sqrt(square);
  return out;
}

}  // namespace

Tensor orthogonalised(const Tensor& x) {
  Tensor y = Tensor::zeros(x.shape(), x.dtype(), x.device());
  const std::vector<double> norms = norms_of(x);
  for (int64_t i = 0; i < x.size(0); ++i) {
    Tensor scaled = y.rows(i, i + 1);
    if (const double norm = norms[static_cast<size_t>(i)]; norm > 0)
      launch(MixArgs{x.rows(i, i + 1), scaled, 0, 1 / norm});
  }
  const bool wide = x.size(1) <= x.size(2);
  for (int i = 0; i < kIterations; ++i) {
    const Tensor gram = product(y, y, wide ? Transposed::second : Transposed::first);
    Tensor polynomial = product(gram, gram);
    launch(MixArgs{gram, polynomial, kC, kB});
    launch(MixArgs{wide ? product(polynomial, y) : product(y, polynomial), y, kA, 1});
  }
  return y;
}

bool Muon::takes(const Parameter& p) {
  const Tensor& w = p.value;
  return w.rank() >= 2 && w.numel() == w.size(0) * w.size(1) &&
         std::min(w.size(0), w.size(1)) >= kLeastSide;
}

Muon::Muon(const std::vector<NamedParameter>& matrices, const MuonConfig& config)
    : UpdateRule(matrices, {.tensors = 1}), config_(config) {
  for (Slot& slot : slots_) {
    const auto like = std::find_if(groups_.begin(), groups_.end(), [&](const auto& group) {
      const Tensor& m = group[0]->m;
      return m.size(0) == slot.m.size(0) && m.size(1) == slot.m.size(1) &&
             m.dtype() == slot.m.dtype();
    });
    (like != groups_.end() ? *like : groups_.emplace_back()).push_back(&slot);
  }
}

void Muon::step(const Gradients& gradients, double rate, double scale) {
  for (const std::vector<Slot*>& group : groups_) {
    std::vector<Slot*> moving;
    for (Slot* s : group)
      if (gradients.find(s->of.parameter->id) != nullptr) moving.push_back(s);
    if (moving.empty()) continue;
    const int64_t rows = group[0]->m.size(0), columns = group[0]->m.size(1);
    const auto row = [&](const Tensor& stack, size_t i) {
      const auto at = static_cast<int64_t>(i);
      return stack.rows(at, at + 1).reshape({rows, columns});
    };
    const Tensor ahead = Tensor::zeros({std::ssize(moving), rows, columns}, group[0]->m.dtype(),
                                       group[0]->m.device());
    for (size_t i = 0; i < moving.size(); ++i) {
      const Tensor& g = *gradients.find(moving[i]->of.parameter->id);
      Tensor here = row(ahead, i);
      launch(MixArgs{g, moving[i]->m, config_.momentum, scale});
      launch(MixArgs{moving[i]->m, here, 0, 1});
      launch(MixArgs{g, here, config_.momentum, scale});
    }
    const Tensor steps = orthogonalised(ahead);
    // An orthogonal matrix has entries of 1 / sqrt(its longer side), on average.
    const double side = std::sqrt(static_cast<double>(std::max(rows, columns)));
    for (size_t i = 0; i < moving.size(); ++i)
      launch(
          MixArgs{row(steps, i), moving[i]->of.parameter->value, 1, -rate * config_.step * side});
  }
}

}  // namespace restage
