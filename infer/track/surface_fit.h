// What a pose cannot explain of a cloud: the posed surface is deformed by a graph until it lies on
// the cloud, as rigidly as possible, and little otherwise than in the frame before.
#pragma once

#include <Eigen/Sparse>
#include <string>
#include <vector>

#include "infer/track/scan.h"
#include "infer/track/surface_graph.h"

namespace restage {

/// Costs are per node, beside the mean squared distance of the points that show it (square metres).
struct SurfaceFitOptions {
  std::vector<double> widths = {0.05, 0.04, 0.03, 0.02, 0.02};  ///< of kernels, one a step; metres
  double rigid = 0.03;   ///< of an edge that two nodes would carry to different places
  double pose = 0.02;    ///< of a node's distance from where the pose, and its habit, put it
  double turn = 2e-4;    ///< of a squared radian
  double steady = 0.10;  ///< of a node's distance from where the frame before would put it
};

/// Fits one frame after the other. What was found is kept in the axes of the joints, so that it
/// goes where the body goes. A node that is seen gets a habit, the mean of what was found for it:
/// there it stays where nothing shows it later. What was never seen stays with the pose, but for
/// what its neighbours ask for.
class SurfaceFit {
 public:
  /// `faces`: of the body.
  SurfaceFit(SurfaceGraph graph, std::vector<Triangle> faces, SurfaceFitOptions options = {});

  /// The deformed surface. `posed`: the skinned vertices; `turns`: of every node, how its joints
  /// turn it from rest. `scan`: null where there is none; then the frame before is kept.
  std::vector<Vec3> fit(const std::vector<Vec3>& posed, const std::vector<Mat3>& turns,
                        const Scan* scan);
  /// What later frames depend on, and back; of the same graph.
  std::string save() const;
  void load(const std::string& state);
  const SurfaceGraph& graph() const { return graph_; }
  /// Of every node, the sum of the weights of the points that showed it in the last fit.
  const std::vector<double>& seen() const { return seen_; }

 private:
  using Block = Eigen::Matrix<double, 6, 6>;
  struct Node {
    Mat3 turn = Mat3::Identity();
    Vec3 shift = Vec3::Zero(), goal = Vec3::Zero(), habit = Vec3::Zero();
  };
  int32_t slot(int32_t i, int32_t j);
  void prepare();
  std::vector<Vec3> deformed(const std::vector<Vec3>& posed) const;
  void add_points(const std::vector<Vec3>& posed, const std::vector<Vec3>& now, const Scan& scan,
                  double width);
  void add_shape(const std::vector<Vec3>& posed);
  void add(int32_t i, int32_t j, const Block& block);
  void step();
  void learn(const std::vector<Mat3>& turns);

  SurfaceGraph graph_;
  std::vector<Triangle> faces_;
  SurfaceFitOptions options_;
  std::vector<Node> nodes_;
  std::vector<Vec3> own_shift_, own_turn_;  ///< of the frame before, in the axes of the joints
  std::vector<Vec3> habit_;                 ///< the same, the mean of the frames that showed it
  std::vector<double> times_;               ///< how many did
  std::vector<double> seen_;
  bool begun_ = false;
  // The normal equations: blocks of pairs of nodes, the higher number first.
  std::vector<int32_t> slots_;
  std::vector<std::array<int32_t, 2>> pairs_;
  std::vector<Block> blocks_;
  Eigen::VectorXd gradient_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  bool analysed_ = false;
};

}  // namespace restage
