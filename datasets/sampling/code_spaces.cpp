#include "datasets/sampling/code_spaces.h"

#include <cmath>

#include "datasets/readers/errors.h"
#include "datasets/sampling/principal.h"

namespace restage {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Tensor floats(const Shape& shape, const Eigen::Ref<const Rows>& values) {
  Tensor out = Tensor::empty(shape);
  Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      out.data<float>(), values.rows(), values.cols()) = values.cast<float>();
  return out;
}

/// Vertices and, after them, joints of all bodies, one body a row.
Eigen::MatrixXd coordinates(const std::vector<Body>& bodies, bool joints) {
  const auto count = static_cast<Eigen::Index>(joints ? kJoints : bodies[0].rest.vertices.size());
  Eigen::MatrixXd out(std::ssize(bodies), 3 * count);
  for (Eigen::Index b = 0; b < out.rows(); ++b) {
    const Body& body = bodies[static_cast<size_t>(b)];
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto at = static_cast<size_t>(i);
      out.block<1, 3>(b, 3 * i) =
          joints ? body.joints[at].transpose()
                 : Eigen::RowVector3d(body.rest.vertices[at].cast<double>().transpose());
    }
  }
  return out;
}

/// Changes against frame 0 of columns [from, from + width) of poses, one window a row.
Eigen::MatrixXd changes(const Tensor& poses, int64_t from, int64_t width) {
  const int64_t n = poses.size(0), t = poses.size(1), all = poses.size(2);
  const float* x = poses.data<float>();
  Eigen::MatrixXd out(n, (t - 1) * width);
  for (int64_t i = 0; i < n; ++i)
    for (int64_t f = 1; f < t; ++f)
      for (int64_t k = 0; k < width; ++k)
        out(i, (f - 1) * width + k) = static_cast<double>(x[(i * t + f) * all + from + k]) -
                                      static_cast<double>(x[i * t * all + from + k]);
  return out;
}

void fit_changes(const Tensor& poses, int64_t from, int64_t width, int64_t most, Tensor* components,
                 Tensor* mean) {
  const Principal found = principal_components(changes(poses, from, width), most);
  const int64_t d = (poses.size(1) - 1) * width, k = found.components.rows();
  if (k == 0)
    throw InputError("", "the motions hold no change of pose to learn", "give other motions");
  *components = floats({k, d}, found.components);
  *mean = floats({d}, found.mean.transpose());
}

}  // namespace

void require_topology(const std::vector<Body>& bodies, const Body& like) {
  for (const Body& body : bodies)
    if (body.rest.faces.empty() || body.rest.faces != like.rest.faces ||
        body.rest.vertices.size() != like.rest.vertices.size())
      throw InputError("",
                       cat("body '", body.id, "' has other faces than '", like.id, "', or none",
                           ", and stage codes needs bodies of one topology"),
                       "set data.one_mesh for built-in bodies, or data.source to data of one "
                       "topology, such as the open benchmark "
                       "(docs/benchmark.md)");
}

LinearBody fit_linear_body(const std::vector<Body>& bodies, int64_t most) {
  if (bodies.size() < 2)
    throw InputError("", "one body shows no directions of shape",
                     "give two bodies or more to train on");
  require_topology(bodies, bodies.front());
  const auto v = std::ssize(bodies.front().rest.vertices);
  const Eigen::MatrixXd rows = coordinates(bodies, false);
  const Principal found = principal_components(rows, most);
  const Eigen::Index b = found.components.rows();
  if (b == 0)
    throw InputError("", "all bodies to train on are the same", "give bodies of different shapes");
  LinearBody out;
  out.mean = floats({v, 3}, found.mean.transpose());
  const Rows directions = found.components.transpose() * found.deviations.asDiagonal();
  out.directions = floats({v, 3, b}, directions);
  // Shapes of all bodies have mean 0, deviation 1 and no correlation, so each direction of the
  // joints is a mean by itself.
  const Eigen::MatrixXd shapes = (rows.rowwise() - found.mean.transpose()) *
                                 found.components.transpose() *
                                 found.deviations.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd joints = coordinates(bodies, true);
  const auto count = static_cast<double>(bodies.size());
  out.joint_mean = floats({kJoints, 3}, joints.colwise().mean());
  out.joint_directions = floats({kJoints, 3, b}, joints.transpose() * shapes / count);
  Rows weights = Rows::Zero(v, kJoints);
  for (const Body& body : bodies) weights += body.weights.cast<double>() / count;
  out.weights = floats({v, kJoints}, weights);
  out.parents.assign(kParents.begin(), kParents.end());
  return out;
}

std::vector<float> nearest_shape(const Tensor& mean, const Tensor& directions,
                                 const Points& vertices) {
  const int64_t v = mean.size(0), b = directions.size(2);
  std::vector<double> along(static_cast<size_t>(b)), squares(static_cast<size_t>(b));
  const float* d = directions.data<float>();
  for (int64_t i = 0; i < 3 * v; ++i) {
    const auto difference = static_cast<double>(vertices[static_cast<size_t>(i / 3)][i % 3]) -
                            static_cast<double>(mean.data<float>()[i]);
    for (size_t k = 0; k < along.size(); ++k, ++d) {
      along[k] += static_cast<double>(*d) * difference;
      squares[k] += static_cast<double>(*d) * static_cast<double>(*d);
    }
  }
  std::vector<float> out;
  for (size_t k = 0; k < along.size(); ++k)
    out.push_back(static_cast<float>(squares[k] > 0 ? along[k] / squares[k] : 0));
  return out;
}

Vec3 without_jump(const Vec3& angle_axis, const Vec3& before) {
  const double angle = angle_axis.norm();
  // Without an angle there is no axis, and whole turns about any are as good.
  const Vec3 axis = angle > 1e-9 ? Vec3(angle_axis / angle) : Vec3(before.stableNormalized());
  const double turns = std::round((axis.dot(before) - angle) / (2 * M_PI));
  return (angle + 2 * M_PI * turns) * axis;
}

MotionBasis fit_motion_basis(const Tensor& poses, int64_t root, int64_t joints) {
  MotionBasis out;
  fit_changes(poses, 0, 3, root, &out.root, &out.root_mean);
  fit_changes(poses, 3, poses.size(2) - 3, joints, &out.joints, &out.joint_mean);
  return out;
}

}  // namespace restage
