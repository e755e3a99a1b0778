// Muon (Jordan 2024): a matrix moves along its orthogonalised momentum, so that it learns in all
// directions alike and not only in the few directions in which its gradient is large. Steps are as
// large as steps of Adam (Liu et al. 2025, "Muon is scalable for LLM training", eq. 4), so one
// learning rate serves both.
#pragma once

#include "nn/config/config_reader.h"
#include "train/optim/update_rule.h"

namespace restage {

struct MuonConfig {
  double momentum = 0.95, step = 0.2;
};

template <class V>
void visit(V& v, MuonConfig& c) {
  v("momentum", c.momentum, "decay of the average gradient (Nesterov's)", below(0, 1));
  v("step", c.step, "root mean square of a matrix's step, in rates", positive());
}

class Muon final : public UpdateRule {
 public:
  /// Matrices of fewer rows or columns than this are bound by their shape, not by the optimiser.
  static constexpr int64_t kLeastSide = 32;
  /// Whether a parameter is a matrix that Muon is for, perhaps with axes of one number behind it:
  /// weights of 1x1 convolutions are [out, in, 1].
  static bool takes(const Parameter& p);

  Muon(const std::vector<NamedParameter>& matrices, const MuonConfig& config);
  void step(const Gradients& gradients, double rate, double scale) override;

 private:
  /// Matrices of one shape form a group. Threads share the matrices of a group, not the rows of one
  /// matrix.
  std::vector<std::vector<Slot*>> groups_;
  MuonConfig config_;
};

/// Matrices x [n, rows, columns] with their singular values brought to between 0.7 and 1.2 (the
/// singular values over 1e-3 of the norm), singular vectors kept: five steps of a Newton-Schulz
/// iteration. Zero stays zero.
Tensor orthogonalised(const Tensor& x);

}  // namespace restage
