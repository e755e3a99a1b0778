#include "infer/track/surface_fit.h"

#include <algorithm>
#include <cstring>

#include "autograd/base/error.h"
#include "infer/track/pose_fit.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

constexpr double kSliding = 0.05;   // how much a distance along the surface counts
constexpr double kShown = 1.0;      // points that show a node from which on it is learnt from
constexpr double kHabitFrames = 5;  // after so many a habit counts half
constexpr double kLongest = 60;     // frames that a habit remembers

using Row = Eigen::Matrix<double, 3, 6>;

}  // namespace

SurfaceFit::SurfaceFit(SurfaceGraph graph, std::vector<Triangle> faces, SurfaceFitOptions options)
    : graph_(std::move(graph)), faces_(std::move(faces)), options_(std::move(options)) {
  const size_t n = graph_.nodes.size();
  nodes_.resize(n);
  own_shift_.assign(n, Vec3::Zero());
  own_turn_ = habit_ = own_shift_;
  times_.assign(n, 0);
  seen_.assign(n, 0);
  slots_.assign(n * n, -1);
  prepare();
}

int32_t SurfaceFit::slot(int32_t i, int32_t j) {
  int32_t& at = slots_[static_cast<size_t>(i) * nodes_.size() + static_cast<size_t>(j)];
  if (at < 0) {
    at = static_cast<int32_t>(pairs_.size());
    pairs_.push_back({i, j});
  }
  return at;
}

/// All pairs of nodes that meet anywhere: the same in every step, so their order is found once.
void SurfaceFit::prepare() {
  for (size_t i = 0; i < nodes_.size(); ++i) slot(static_cast<int32_t>(i), static_cast<int32_t>(i));
  for (const auto& link : graph_.links)
    for (const int32_t a : link.node)
      for (const int32_t b : link.node)
        if (a > b) slot(a, b);
  for (const auto& [low, high] : graph_.edges) slot(high, low);
  blocks_.resize(pairs_.size());
  gradient_.resize(static_cast<Eigen::Index>(6 * nodes_.size()));
}

void SurfaceFit::add(int32_t i, int32_t j, const Block& block) {
  if (i >= j) blocks_[static_cast<size_t>(slot(i, j))] += block;
}

std::vector<Vec3> SurfaceFit::deformed(const std::vector<Vec3>& posed) const {
  std::vector<Vec3> out(posed.size(), Vec3::Zero());
  for (size_t v = 0; v < posed.size(); ++v) {
    const auto& link = graph_.links[v];
    for (size_t k = 0; k < SurfaceGraph::kLinks; ++k) {
      const auto i = static_cast<size_t>(link.node[k]);
      const Vec3& g = posed[static_cast<size_t>(graph_.nodes[i])];
      out[v] += link.weight[k] * (nodes_[i].turn * (posed[v] - g) + g + nodes_[i].shift);
    }
  }
  return out;
}

void SurfaceFit::add_points(const std::vector<Vec3>& posed, const std::vector<Vec3>& now,
                            const Scan& scan, double width) {
  Points single;
  for (const Vec3& p : now) single.push_back(p.cast<float>());
  const auto normals = vertex_normals<Vec3>(single, faces_, Vec3::Zero());
  const double share = static_cast<double>(nodes_.size()) * kScanCell * kScanCell / graph_.area;
  std::fill(seen_.begin(), seen_.end(), 0.0);
  for (const SurfaceMatch& m : match_surface(scan, now, normals, width)) {
    const auto& link = graph_.links[m.vertex];
    const Vec3& n = normals[m.vertex];
    const Vec3 away = now[m.vertex] - m.point;
    const Mat3 pull =
        share * m.weight * (kSliding * Mat3::Identity() + (1 - kSliding) * n * n.transpose());
    std::array<Row, SurfaceGraph::kLinks> rows;
    for (size_t k = 0; k < SurfaceGraph::kLinks; ++k) {
      const auto i = static_cast<size_t>(link.node[k]);
      const Vec3 arm =
          nodes_[i].turn * (posed[m.vertex] - posed[static_cast<size_t>(graph_.nodes[i])]);
      rows[k] << -link.weight[k] * cross_with(arm), link.weight[k] * Mat3::Identity();
      seen_[i] += link.weight[k] * m.weight;
    }
    for (size_t a = 0; a < SurfaceGraph::kLinks; ++a) {
      const Eigen::Matrix<double, 6, 3> left = rows[a].transpose() * pull;
      gradient_.segment<6>(6 * link.node[a]) += left * away;
      for (size_t b = 0; b < SurfaceGraph::kLinks; ++b)
        add(link.node[a], link.node[b], left * rows[b]);
    }
  }
}

void SurfaceFit::add_shape(const std::vector<Vec3>& posed) {
  const auto place = [&](int32_t i) { return posed[static_cast<size_t>(graph_.nodes[i])]; };
  const auto edge = [&](int32_t i, int32_t j, double cost) {
    const Vec3 bone = place(j) - place(i), turned = nodes_[i].turn * bone;
    const Vec3 apart = turned - bone + nodes_[i].shift - nodes_[j].shift;
    Row of_i, of_j;
    of_i << -cross_with(turned), Mat3::Identity();
    of_j << Mat3::Zero(), -Mat3::Identity();
    gradient_.segment<6>(6 * i) += cost * of_i.transpose() * apart;
    gradient_.segment<6>(6 * j) += cost * of_j.transpose() * apart;
    add(i, i, cost * of_i.transpose() * of_i);
    add(j, j, cost * of_j.transpose() * of_j);
    add(i, j, cost * of_i.transpose() * of_j);
    add(j, i, cost * of_j.transpose() * of_i);
  };
  for (const auto& [low, high] : graph_.edges) {
    const double cost =
        options_.rigid * 0.5 *
        (graph_.hold[static_cast<size_t>(low)] + graph_.hold[static_cast<size_t>(high)]);
    edge(low, high, cost);
    edge(high, low, cost);
  }
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    const auto at = static_cast<Eigen::Index>(6 * i);
    const double pose = options_.pose * graph_.hold[i], steady = begun_ ? options_.steady : 0;
    Block cost = Block::Zero();
    cost.topLeftCorner<3, 3>() = options_.turn * graph_.hold[i] * Mat3::Identity();
    cost.bottomRightCorner<3, 3>() = (pose + steady) * Mat3::Identity();
    blocks_[i] += cost;  // the first pairs are those of each node with itself
    gradient_.segment<3>(at) += options_.turn * graph_.hold[i] * turn_vector(node.turn);
    gradient_.segment<3>(at + 3) +=
        pose * (node.shift - node.habit) + steady * (node.shift - node.goal);
  }
}

void SurfaceFit::step() {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * pairs_.size());
  for (size_t p = 0; p < pairs_.size(); ++p)
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c)
        entries.emplace_back(6 * pairs_[p][0] + r, 6 * pairs_[p][1] + c, blocks_[p](r, c));
  Eigen::SparseMatrix<double> equations(gradient_.size(), gradient_.size());
  equations.setFromTriplets(entries.begin(), entries.end());
  if (!analysed_) solver_.analyzePattern(equations);
  analysed_ = true;
  solver_.factorize(equations);
  if (solver_.info() != Eigen::Success)
    throw WorkError("the surface's equations have no solution; check the template and the scans");
  const Eigen::VectorXd by = solver_.solve(-gradient_);
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(6 * i);
    nodes_[i].turn = turn_of(by.segment<3>(at)) * nodes_[i].turn;
    nodes_[i].shift += by.segment<3>(at + 3);
  }
}

std::vector<Vec3> SurfaceFit::fit(const std::vector<Vec3>& posed, const std::vector<Mat3>& turns,
                                  const Scan* scan) {
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const double sure = times_[i] / (times_[i] + kHabitFrames);
    nodes_[i].turn = turn_of(turns[i] * own_turn_[i]);
    nodes_[i].shift = nodes_[i].goal = turns[i] * own_shift_[i];
    nodes_[i].habit = sure * (turns[i] * habit_[i]);
  }
  if (scan == nullptr) return deformed(posed);
  for (const double width : options_.widths) {
    for (Block& block : blocks_) block.setZero();
    gradient_.setZero();
    add_points(posed, deformed(posed), *scan, width);
    add_shape(posed);
    step();
  }
  learn(turns);
  return deformed(posed);
}

void SurfaceFit::learn(const std::vector<Mat3>& turns) {
  begun_ = true;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const Mat3 back = turns[i].transpose();
    own_turn_[i] = back * turn_vector(nodes_[i].turn);
    own_shift_[i] = back * nodes_[i].shift;
    if (seen_[i] < kShown) continue;
    times_[i] = std::min(times_[i] + 1, kLongest);
    habit_[i] += (own_shift_[i] - habit_[i]) / times_[i];
  }
}

std::string SurfaceFit::save() const {
  std::string out(1, begun_ ? '1' : '0');
  const auto put = [&](const double* x, size_t count) {
    out.append(reinterpret_cast<const char*>(x), count * sizeof(double));
  };
  for (const auto* all : {&own_shift_, &own_turn_, &habit_})
    for (const Vec3& x : *all) put(x.data(), 3);
  put(times_.data(), times_.size());
  return out;
}

void SurfaceFit::load(const std::string& state) {
  begun_ = state.at(0) == '1';
  size_t at = 1;
  const auto take = [&](double* x, size_t count) {
    std::memcpy(x, state.data() + at, count * sizeof(double));
    at += count * sizeof(double);
  };
  for (auto* all : {&own_shift_, &own_turn_, &habit_})
    for (Vec3& x : *all) take(x.data(), 3);
  take(times_.data(), times_.size());
}

}  // namespace restage
