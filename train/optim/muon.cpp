#include "train/optim/muon.h"

#include <algorithm>
#include <cmath>

#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/matmul.h"
#include "autograd/kernels/update.h"

namespace restage {
namespace {

constexpr int kIterations = 5;
constexpr double kLeastNorm = 1e-30;  // float32 has its inverse
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

/// The matrices of x [n, rows, columns], which share its memory.
std::vector<Tensor> matrices_of(const Tensor& x) {
  std::vector<Tensor> out;
  for (int64_t i = 0; i < x.size(0); ++i) out.push_back(x.rows(i, i + 1));
  return out;
}

/// The same, each divided by its norm, where that is not zero.
Tensor normalised(const Tensor& x) {
  const auto number = [&](double value) { return Tensor::full({}, value, DType::f64, x.device()); };
  Tensor squares = Tensor::empty({x.size(0), 1, 1}, DType::f64, x.device()),
         norms = empty_like(squares), some = empty_like(squares), inverse = empty_like(squares),
         out = empty_like(x);
  launch(SquaredNormArgs{matrices_of(x), squares});
  launch(UnaryArgs{Unary::sqrt, squares, norms});
  launch(BinaryArgs{Binary::maximum, norms, number(kLeastNorm), some});
  launch(BinaryArgs{Binary::div, number(1), some, inverse});
  launch(BinaryArgs{Binary::mul, x, inverse.cast(x.dtype()), out});
  return out;
}

}  // namespace

Tensor orthogonalised(const Tensor& x) {
  Tensor y = normalised(x);
  const bool wide = x.size(1) <= x.size(2);
  for (int i = 0; i < kIterations; ++i) {
    const Tensor gram = product(y, y, wide ? Transposed::second : Transposed::first);
    Tensor polynomial = product(gram, gram);
    mix(gram, polynomial, kC, kB);
    mix(wide ? product(polynomial, y) : product(y, polynomial), y, kA, 1);
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
    const Tensor ahead = Tensor::zeros({std::ssize(moving), rows, columns}, group[0]->m.dtype(),
                                       group[0]->m.device());
    std::vector<Tensor> here = matrices_of(ahead);
    std::vector<MixArgs::Of> averages, begun, looks, moves;
    for (size_t i = 0; i < moving.size(); ++i) {
      const Tensor& g = *gradients.find(moving[i]->of.parameter->id);
      averages.push_back({g, moving[i]->m});
      begun.push_back({moving[i]->m, here[i]});
      looks.push_back({g, here[i]});
    }
    launch_all(MixArgs{averages, config_.momentum, scale});
    launch_all(MixArgs{begun, 0, 1});
    launch_all(MixArgs{looks, config_.momentum, scale});
    const std::vector<Tensor> steps = matrices_of(orthogonalised(ahead));
    for (size_t i = 0; i < moving.size(); ++i)
      moves.push_back({steps[i], moving[i]->of.parameter->value});
    // An orthogonal matrix has entries of 1 / sqrt(its longer side), on average.
    const double side = std::sqrt(static_cast<double>(std::max(rows, columns)));
    launch_all(MixArgs{moves, 1, -rate * config_.step * side});
  }
}

}  // namespace restage
