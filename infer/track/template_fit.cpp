#include "infer/track/template_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Sparse>
#include <algorithm>
#include <set>

#include "autograd/base/error.h"
#include "infer/track/pose_fit.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

// Widths of the kernel that weights matches, metres, one a round.
constexpr double kShapeWidths[] = {0.08, 0.07, 0.06, 0.05, 0.04, 0.04};
constexpr double kClothWidths[] = {0.05, 0.04, 0.03, 0.03};
constexpr double kShapeCost = 2e-5;  // of a squared step, beside the mean squared distance
constexpr double kBoneCost = 0.02;   // of a squared difference of a bone's length; square metres
// Beside the squared distance of a vertex' points: of the squared difference of two neighbours'
// offsets, and of an offset itself.
constexpr double kSmooth = 0.4, kOffset = 0.01, kHandOffset = 2;

/// The views as the rounds need them.
struct FittedView {
  Scan scan;
  Pose pose;
};

std::vector<Vec3> normals_of(const std::vector<Vec3>& surface, const Mesh& mesh) {
  Points single;
  for (const Vec3& p : surface) single.push_back(p.cast<float>());
  return vertex_normals<Vec3>(single, mesh.faces, Vec3::Zero());
}

class TemplateFit {
 public:
  TemplateFit(const ShapeSpace& space, const std::vector<TemplateView>& views)
      : space_(space), steps_(space.size(), 0.0) {
    for (const TemplateView& view : views)
      views_.push_back({make_scan(view.cloud, view.source), view.pose});
    fit_bones(views);
    body_ = space_.at(steps_);
    for (size_t i = 0; i < views.size(); ++i) put_trunk(views[i].seen, &views_[i].pose);
  }

  void shape_round(double width) {
    fit_poses(width);
    const auto count = static_cast<Eigen::Index>(steps_.size());
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(count);
    for (const FittedView& view : views_) add_shape(view, width, &normal, &gradient);
    for (Eigen::Index k = 0; k < count; ++k) {
      normal(k, k) += kShapeCost;
      gradient[k] += kShapeCost * steps_[static_cast<size_t>(k)];
    }
    const Eigen::VectorXd by = normal.ldlt().solve(-gradient);
    for (Eigen::Index k = 0; k < count; ++k) steps_[static_cast<size_t>(k)] += by[k];
    body_ = space_.at(steps_);
  }

  void cloth_round(double width) {
    fit_poses(width);
    const size_t count = body_.rest.vertices.size();
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count)), push = pull;
    const double share = 1 / static_cast<double>(views_.size());
    for (const FittedView& view : views_) {
      const std::vector<Vec3> surface = skinned(body_, view.pose);
      const auto normals = normals_of(surface, body_.rest);
      for (const SurfaceMatch& m : match_surface(view.scan, surface, normals, width)) {
        const auto v = static_cast<Eigen::Index>(m.vertex);
        pull[v] += share * m.weight;
        push[v] += share * m.weight * normals[m.vertex].dot(m.point - surface[m.vertex]);
      }
    }
    move_along_normals(pull, push);
  }

  /// On the floor.
  Body take() {
    float low = body_.rest.vertices[0].y();
    for (const Point& p : body_.rest.vertices) low = std::min(low, p.y());
    for (Point& p : body_.rest.vertices) p.y() -= low;
    for (Vec3& joint : body_.joints) joint.y() -= double{low};
    return std::move(body_);
  }

 private:
  /// The build that the networks see: bones of the middle length of all views.
  void fit_bones(const std::vector<TemplateView>& views) {
    const auto count = static_cast<Eigen::Index>(steps_.size());
    Eigen::MatrixXd normal = kShapeCost * Eigen::MatrixXd::Identity(count, count);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (size_t j = 1; j < kJoints; ++j) {
      const auto p = static_cast<size_t>(kParents[j]);
      std::vector<double> lengths;
      for (const TemplateView& view : views)
        lengths.push_back((view.seen[j] - view.seen[p]).norm());
      std::nth_element(lengths.begin(), lengths.begin() + std::ssize(lengths) / 2, lengths.end());
      const Vec3 bone = space_.average.joints[j] - space_.average.joints[p];
      Eigen::VectorXd row(count);
      for (Eigen::Index k = 0; k < count; ++k) {
        const Joints& by = space_.joints[static_cast<size_t>(k)];
        row[k] = bone.normalized().dot(by[j] - by[p]);
      }
      normal += kBoneCost * row * row.transpose();
      right += kBoneCost * row * (lengths[lengths.size() / 2] - bone.norm());
    }
    const Eigen::VectorXd by = normal.ldlt().solve(right);
    for (Eigen::Index k = 0; k < count; ++k) steps_[static_cast<size_t>(k)] = by[k];
  }

  void put_trunk(const Joints& seen, Pose* pose) const {
    const Joints now = forward_kinematics(body_.joints, *pose).joints;
    constexpr std::array<int, 5> kTrunk = {kLeftHip, kRightHip, kSpine2, kLeftShoulder,
                                           kRightShoulder};
    Vec3 away = Vec3::Zero();
    for (const int j : kTrunk) away += (seen[j] - now[j]) / double{kTrunk.size()};
    pose->root += away;
  }

  void fit_poses(double width) {
    PoseFitOptions how;
    how.widths = {width, 0.9 * width, 0.8 * width};
    for (FittedView& view : views_) view.pose = fit_pose(body_, view.scan, view.pose, how);
  }

  void add_shape(const FittedView& view, double width, Eigen::MatrixXd* normal,
                 Eigen::VectorXd* gradient) const {
    const std::vector<Vec3> surface = skinned(body_, view.pose);
    const auto normals = normals_of(surface, body_.rest);
    const auto matches = match_surface(view.scan, surface, normals, width);
    const Rotations turns = forward_kinematics(body_.joints, view.pose).global;
    std::vector<Joints> moved;  // by each direction, while the pelvis stays
    for (const Joints& by : space_.joints) {
      Joints& out = moved.emplace_back();
      out[0].setZero();
      for (size_t j = 1; j < kJoints; ++j) {
        const auto p = static_cast<size_t>(kParents[j]);
        out[j] = out[p] + turns[p] * (by[j] - by[p]);
      }
    }
    const double share = 1 / static_cast<double>(views_.size() * view.scan.points.size());
    Eigen::VectorXd row(std::ssize(steps_));
    for (const SurfaceMatch& m : matches) {
      row.setZero();
      for (size_t j = 0; j < kJoints; ++j) {
        const auto w = static_cast<double>(
            body_.weights(static_cast<Eigen::Index>(m.vertex), static_cast<Eigen::Index>(j)));
        if (w == 0) continue;
        const Vec3 n = turns[j].transpose() * normals[m.vertex];
        for (size_t k = 0; k < steps_.size(); ++k)
          row[static_cast<Eigen::Index>(k)] +=
              w * (n.dot(space_.vertices[k][m.vertex].cast<double>() - space_.joints[k][j]) +
                   normals[m.vertex].dot(moved[k][j]));
      }
      const double away = normals[m.vertex].dot(surface[m.vertex] - m.point);
      *normal += share * m.weight * row * row.transpose();
      *gradient += share * m.weight * away * row;
    }
  }

  void move_along_normals(const Eigen::VectorXd& pull, const Eigen::VectorXd& push) {
    const auto count = pull.size();
    if (offsets_.size() == 0) offsets_ = Eigen::VectorXd::Zero(count);
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = push;
    for (Eigen::Index v = 0; v < count; ++v) {
      const float hands = body_.weights(v, kLeftWrist) + body_.weights(v, kRightWrist);
      const double keep = kOffset + kHandOffset * double{hands};
      entries.emplace_back(v, v, pull[v] + keep);
      right[v] -= keep * offsets_[v];
    }
    std::set<std::array<int32_t, 2>> edges;
    for (const Triangle& f : body_.rest.faces)
      for (size_t k = 0; k < 3; ++k)
        edges.insert({std::min(f[k], f[(k + 1) % 3]), std::max(f[k], f[(k + 1) % 3])});
    for (const auto& [a, b] : edges) {
      entries.emplace_back(a, a, kSmooth);
      entries.emplace_back(b, b, kSmooth);
      entries.emplace_back(a, b, -kSmooth);
      entries.emplace_back(b, a, -kSmooth);
      right[a] -= kSmooth * (offsets_[a] - offsets_[b]);
      right[b] -= kSmooth * (offsets_[b] - offsets_[a]);
    }
    Eigen::SparseMatrix<double> equations(count, count);
    equations.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(equations);
    const Eigen::VectorXd by = solver.solve(right);
    const auto normals = vertex_normals<Vec3>(body_.rest.vertices, body_.rest.faces, Vec3::Zero());
    for (Eigen::Index v = 0; v < count; ++v)
      body_.rest.vertices[static_cast<size_t>(v)] +=
          (by[v] * normals[static_cast<size_t>(v)]).cast<float>();
    offsets_ += by;
  }

  const ShapeSpace& space_;
  std::vector<double> steps_;
  Body body_;
  Eigen::VectorXd offsets_;
  std::vector<FittedView> views_;
};

}  // namespace

Body fit_template(const ShapeSpace& space, const std::vector<TemplateView>& views,
                  const std::string& where, const std::function<void(const std::string&)>& say) {
  if (views.empty())
    throw InputError(where, "shows nobody of whom a template could be made", "give a template");
  TemplateFit fit(space, views);
  const std::string of = " of " + std::to_string(std::size(kShapeWidths) + std::size(kClothWidths));
  int round = 0;
  for (const double width : kShapeWidths) {
    say("template, round " + std::to_string(++round) + of);
    fit.shape_round(width);
  }
  for (const double width : kClothWidths) {
    say("template, round " + std::to_string(++round) + of);
    fit.cloth_round(width);
  }
  return fit.take();
}

}  // namespace restage
