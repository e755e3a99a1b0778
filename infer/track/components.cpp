#include "infer/track/components.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace restage {
namespace {

/// One row a frame, three numbers a vertex.
using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

DistanceSummary length_of_rows(const Rows& rows) {
  Distances all;
  for (Eigen::Index f = 0; f < rows.rows(); ++f)
    for (Eigen::Index v = 0; v < rows.cols(); v += 3)
      all.add(double{rows.row(f).segment<3>(v).norm()});
  return all.summary();
}

/// The direction in which the rows differ most from zero, not scaled.
Eigen::VectorXf strongest(const Rows& rows, const Eigen::MatrixXd& products) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(products);
  const Eigen::VectorXf share = axes.eigenvectors().rightCols<1>().cast<float>();
  return rows.transpose() * share;
}

}  // namespace

SurfaceComponents surface_components(std::vector<Points> offsets, double error, size_t most) {
  SurfaceComponents out;
  if (offsets.empty()) return out;
  const auto frames = static_cast<Eigen::Index>(offsets.size());
  const auto size = static_cast<Eigen::Index>(3 * offsets[0].size());
  Rows rows(frames, size);
  for (Eigen::Index f = 0; f < frames; ++f) {
    rows.row(f) = Eigen::Map<const Eigen::VectorXf>(offsets[f][0].data(), size).transpose();
    Points().swap(offsets[f]);
  }
  const Eigen::VectorXf mean = rows.colwise().mean();
  rows.rowwise() -= mean.transpose();
  for (Eigen::Index v = 0; v < size; v += 3) out.mean.push_back(mean.segment<3>(v));
  out.error = length_of_rows(rows);
  std::vector<Eigen::VectorXf> weights;
  while (out.error.p95 > error && weights.size() < most) {
    const Eigen::MatrixXd products = (rows * rows.transpose()).cast<double>();
    const Eigen::VectorXf direction = strongest(rows, products);
    const float largest = direction.cwiseAbs().maxCoeff();
    if (!(largest > 0)) break;
    std::vector<int8_t>& delta = out.deltas.emplace_back();
    Eigen::VectorXf stored(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      delta.push_back(static_cast<int8_t>(std::lround(127 * direction[i] / largest)));
      stored[i] = static_cast<float>(delta.back()) / 127.0f;
    }
    weights.emplace_back(rows * stored / stored.squaredNorm());
    rows.noalias() -= weights.back() * stored.transpose();
    out.error = length_of_rows(rows);
  }
  for (Eigen::Index f = 0; f < frames; ++f)
    for (const Eigen::VectorXf& weight : weights) out.weights.push_back(weight[f]);
  return out;
}

}  // namespace restage
