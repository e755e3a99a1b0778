#include "datasets/sampling/principal.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace restage {

Principal principal_components(Eigen::MatrixXd rows, Eigen::Index most) {
  const Eigen::Index n = rows.rows(), d = rows.cols();
  Principal out;
  out.mean = rows.colwise().mean().transpose();
  rows.rowwise() -= out.mean.transpose();
  // The smaller of the two matrices that have the same eigenvalues.
  const bool by_row = n < d;
  Eigen::MatrixXd products(by_row ? n : d, by_row ? n : d);
  if (by_row)
    products.noalias() = rows * rows.transpose();
  else
    products.noalias() = rows.transpose() * rows;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(products);
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  const double least = 1e-12 * std::max(values[0], 0.0);
  Eigen::Index count = 0;
  while (count < std::min({most, n - 1, values.size()}) && values[count] > least) ++count;
  out.components.resize(count, d);
  out.deviations.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto vector = solver.eigenvectors().col(products.cols() - 1 - k);
    Eigen::VectorXd component = by_row ? Eigen::VectorXd(rows.transpose() * vector) : vector;
    Eigen::Index largest = 0;
    component.cwiseAbs().maxCoeff(&largest);
    component *= (component[largest] < 0 ? -1 : 1) / component.norm();
    out.components.row(k) = component.transpose();
    out.deviations[k] = std::sqrt(values[k] / static_cast<double>(n));
  }
  return out;
}

}  // namespace restage
