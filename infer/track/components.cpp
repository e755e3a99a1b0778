#include "infer/track/components.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace restage {
namespace {

constexpr Eigen::Index kKeptRows = 96;   // of a sketch: more than there may be components
constexpr Eigen::Index kBlockRows = 48;  // frames that a sketch takes before it is made smaller
constexpr float kWeightSteps = 32767;

/// Three numbers a vertex in each row.
using OffsetRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using OffsetRow = Eigen::RowVectorXf;

OffsetRow row_of(const Points& offsets) {
  return Eigen::Map<const OffsetRow>(offsets[0].data(), 3 * std::ssize(offsets));
}

void add_lengths(const OffsetRow& row, Distances* to) {
  for (Eigen::Index v = 0; v < row.size(); v += 3) to->add(double{row.segment<3>(v).norm()});
}

/// Few rows whose products are nearly those of all that were added: the strongest directions.
class Sketch {
 public:
  explicit Sketch(Eigen::Index size) : rows_(kKeptRows + kBlockRows, size) {}
  void add(const OffsetRow& row) {
    rows_.row(used_++) = row;
    if (used_ == rows_.rows()) shrink();
  }
  /// The strongest first; their lengths fall.
  OffsetRows directions() {
    shrink();
    return rows_.topRows(used_);
  }

 private:
  void shrink() {
    const auto all = rows_.topRows(used_);
    const Eigen::MatrixXd products = (all * all.transpose()).cast<double>();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(products);
    const Eigen::Index kept = std::min(kKeptRows, used_);
    const OffsetRows best =
        axes.eigenvectors().rightCols(kept).rowwise().reverse().transpose().cast<float>() * all;
    rows_.topRows(kept) = best;
    used_ = kept;
  }

  OffsetRows rows_;
  Eigen::Index used_ = 0;
};

/// Targets of bytes, and the same at right angles to each other: what the first k can say is what
/// the first k of `square` can say.
struct Targets {
  std::vector<std::vector<int8_t>> deltas;
  OffsetRows stored, square;
  Eigen::MatrixXf share;  ///< stored = share * square
};

Targets round_to_bytes(const OffsetRows& directions, size_t most) {
  Targets out;
  const auto count = std::min<Eigen::Index>(directions.rows(), static_cast<Eigen::Index>(most));
  out.stored.resize(count, directions.cols());
  out.square.resize(count, directions.cols());
  out.share = Eigen::MatrixXf::Zero(count, count);
  Eigen::Index k = 0;
  for (Eigen::Index i = 0; i < directions.rows() && k < count; ++i) {
    const float largest = directions.row(i).cwiseAbs().maxCoeff();
    if (!(largest > 1e-7f)) break;
    std::vector<int8_t> delta;
    for (Eigen::Index x = 0; x < directions.cols(); ++x)
      delta.push_back(static_cast<int8_t>(std::lround(127 * directions(i, x) / largest)));
    for (Eigen::Index x = 0; x < directions.cols(); ++x)
      out.stored(k, x) = static_cast<float>(delta[static_cast<size_t>(x)]) / 127.0f;
    OffsetRow left = out.stored.row(k);
    for (int again = 0; again < 2; ++again)
      for (Eigen::Index e = 0; e < k; ++e) {
        const float by = left.dot(out.square.row(e));
        out.share(k, e) += by;
        left -= by * out.square.row(e);
      }
    const float length = left.norm();
    if (!(length > 0.01f * out.stored.row(k).norm())) continue;  // nothing new
    out.share(k, k) = length;
    out.square.row(k) = left / length;
    out.deltas.push_back(std::move(delta));
    ++k;
  }
  out.stored.conservativeResize(k, directions.cols());
  out.square.conservativeResize(k, directions.cols());
  out.share.conservativeResize(k, k);
  return out;
}

float in_steps(float weight) {
  return std::abs(weight) <= 1 ? std::round(weight * kWeightSteps) / kWeightSteps : weight;
}

}  // namespace

SurfaceComponents surface_components(const OffsetFrames& frames, double error, size_t most) {
  SurfaceComponents out;
  Eigen::RowVectorXd sum;
  double count = 0;
  frames([&](const Points& offsets) {
    if (count == 0) sum = Eigen::RowVectorXd::Zero(3 * std::ssize(offsets));
    sum += row_of(offsets).cast<double>();
    count += 1;
  });
  if (count == 0) return out;
  const OffsetRow mean = (sum / count).cast<float>();
  for (Eigen::Index v = 0; v < mean.size(); v += 3) out.mean.push_back(mean.segment<3>(v));
  Sketch sketch(mean.size());
  frames([&](const Points& offsets) { sketch.add(row_of(offsets) - mean); });
  Targets targets = round_to_bytes(sketch.directions(), std::min(most, kMostComponents));

  // How much each number of targets leaves over, and what each says of each frame.
  const Eigen::Index all = targets.square.rows();
  std::vector<Distances> left(static_cast<size_t>(all) + 1);
  std::vector<Eigen::VectorXf> said;
  frames([&](const Points& offsets) {
    OffsetRow rest = row_of(offsets) - mean;
    Eigen::VectorXf& by = said.emplace_back(all);
    add_lengths(rest, &left[0]);
    for (Eigen::Index k = 0; k < all; ++k) {
      by[k] = rest.dot(targets.square.row(k));
      rest -= by[k] * targets.square.row(k);
      add_lengths(rest, &left[static_cast<size_t>(k) + 1]);
    }
  });
  Eigen::Index used = 0;
  while (used < all && left[static_cast<size_t>(used)].summary().p95 > error) ++used;
  targets.deltas.resize(static_cast<size_t>(used));
  out.deltas = std::move(targets.deltas);

  const Eigen::MatrixXf back = targets.share.topLeftCorner(used, used)
                                   .transpose()
                                   .triangularView<Eigen::Upper>()
                                   .solve(Eigen::MatrixXf::Identity(used, used));
  Distances lost;
  size_t frame = 0;
  frames([&](const Points& offsets) {
    OffsetRow rest = row_of(offsets) - mean;
    const Eigen::VectorXf weights = back * said[frame++].head(used);
    for (Eigen::Index k = 0; k < used; ++k) {
      out.weights.push_back(in_steps(weights[k]));
      rest -= out.weights.back() * targets.stored.row(k);
    }
    add_lengths(rest, &lost);
  });
  out.error = lost.summary();
  return out;
}

}  // namespace restage
