#include "infer/h4d.h"

#include <algorithm>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/ops/layout.h"
#include "infer/cloud_input.h"
#include "infer/registration/nearest_detail.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr size_t kTargetSurface = 16384;  // points of the target's surface to choose from
constexpr int kTargetLooks = 8;           // choices that are averaged

/// A tensor as a matrix of `rows` rows.
Matrix matrix_of(const Tensor& x, int64_t rows) {
  const Tensor here = x.cpu();
  return Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
             here.data<float>(), rows, here.numel() / rows)
      .cast<double>();
}

/// The part of the surface that belongs to each vertex: a third of each of its triangles.
Eigen::VectorXd area_shares(const Matrix& vertices, const std::vector<Triangle>& faces) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(vertices.rows());
  for (const Triangle& f : faces) {
    const Vec3 a = vertices.row(f[0]), b = vertices.row(f[1]), c = vertices.row(f[2]);
    const double area = (b - a).cross(c - a).norm();
    for (const int32_t v : f) out[v] += area;
  }
  const double sum = out.sum();
  if (!(sum > 0))
    return Eigen::VectorXd::Constant(out.size(), 1.0 / static_cast<double>(out.size()));
  return out / sum;
}

double foot_height(const Joints& rest) {
  return 0.5 * (rest[kLeftFoot].y() + rest[kRightFoot].y());
}

/// From the pelvis to the middle of the hips, at rest.
Vec3 to_hips(const Joints& rest) { return 0.5 * (rest[kLeftHip] + rest[kRightHip]) - rest[0]; }

std::shared_ptr<H4d> network_of(const Bundle& weights, const std::string& name) {
  const auto net = std::dynamic_pointer_cast<H4d>(weights.need("codes", name).net);
  if (net == nullptr) weights.need_as<H4d>("codes", name);  // which says so
  if (!net->space.defined() || net->config.pose != 3 * kJoints)
    throw InputError(name, "holds an H4D without a body of 22 joints",
                     "give weights that 'restage train' left");
  return net;
}

}  // namespace

ShapedSkeleton::ShapedSkeleton(const H4dSpace& space) {
  const LinearBody body = space.body();
  const int64_t v = body.mean.size(0), b = body.directions.size(2);
  const Matrix vertices = matrix_of(body.mean, v), skin = matrix_of(body.weights, v);
  const Matrix directions = matrix_of(body.directions, v);
  const Matrix shares = area_shares(vertices, space.faces()).asDiagonal() * skin;  // [v, j]
  joints_.mean = matrix_of(body.joint_mean, 3 * kJoints);
  joints_.directions = matrix_of(body.joint_directions, 3 * kJoints);
  const Matrix means = shares.transpose() * vertices;      // [j, 3]
  const Matrix changes = shares.transpose() * directions;  // [j, 3 b]
  sums_.mean = Eigen::Map<const Eigen::VectorXd>(means.data(), means.size());
  sums_.directions = Eigen::Map<const Matrix>(changes.data(), 3 * kJoints, b);
  for (int j = 0; j < kJoints; ++j) weights_[static_cast<size_t>(j)] = shares.col(j).sum();
  take(Eigen::VectorXd::Zero(b));
}

void ShapedSkeleton::take(const Eigen::VectorXd& shape) {
  const Eigen::VectorXd rest = joints_.mean + joints_.directions * shape;
  const Eigen::VectorXd sums = sums_.mean + sums_.directions * shape;
  for (size_t j = 0; j < kJoints; ++j) {
    rest_[j] = rest.segment<3>(static_cast<Eigen::Index>(3 * j));
    moments_[j] = sums.segment<3>(static_cast<Eigen::Index>(3 * j));
  }
}

Vec3 ShapedSkeleton::middle() const {
  Vec3 out = Vec3::Zero();
  for (const Vec3& moment : moments_) out += moment;
  return out;
}

Vec3 ShapedSkeleton::middle(const PosedSkeleton& posed) const {
  Vec3 out = Vec3::Zero();
  for (size_t j = 0; j < kJoints; ++j)
    out += posed.global[j] * (moments_[j] - weights_[j] * rest_[j]) + weights_[j] * posed.joints[j];
  return out;
}

H4dSystem::H4dSystem(const Bundle& weights, const std::string& weights_name, Mesh target,
                     const std::string& where, const std::optional<Joints>& rest,
                     const RetargetOptions& options)
    : model_(network_of(weights, weights_name)),
      basis_(model_->space.basis()),
      points_(
          static_cast<size_t>(trained_points(weights.need("codes", weights_name), weights_name))),
      frames_of_window_(static_cast<size_t>(model_->config.frames)),
      source_(model_->space) {
  if (target.vertices.empty()) throw InputError(where, "has no vertices", "give a mesh or a cloud");
  if (points_ == 0)
    throw InputError(weights_name, "says that its network sees no points",
                     "give weights as a training left them");
  body_.id = where;
  body_.rest = std::move(target);
  skin(target_shape(options.seed));
  if (rest) body_.joints = *rest;
  system_rig_.emplace(SystemRig{body_.joints, body_.weights});
  restart();
}

/// Points of a cloud about their middle [1, p, 3], on the network's device.
Tensor H4dSystem::centred(const EvenPoints& points, double offset, Vec3* middle) const {
  Points chosen;
  points.choose(points_, offset, &chosen);
  Vec3 sum = Vec3::Zero();
  for (const Point& p : chosen) sum += p.cast<double>();
  *middle = sum / static_cast<double>(chosen.size());
  for (Point& p : chosen) p -= middle->cast<float>();
  return tensor_of_points(chosen, {1, std::ssize(chosen), 3}).to(device_of(*model_));
}

Eigen::VectorXd H4dSystem::target_shape(uint64_t seed) const {
  EvenPoints points;
  points.arrange(
      surface_points(body_.rest, kTargetSurface, RngKey{seed, 0}.fold("target").fold("surface")));
  Eigen::VectorXd out = Eigen::VectorXd::Zero(model_->config.shape);
  Context ctx;
  for (int k = 0; k < kTargetLooks; ++k) {
    Vec3 middle;
    const Tensor cloud = centred(points, static_cast<double>(k) / kTargetLooks, &middle);
    out += matrix_of(model_->id_encoder(ctx, Var(cloud)).value, out.size()) / kTargetLooks;
  }
  return out;
}

/// Joints and skin weights of the target, by the body of this shape whose middle lies where the
/// target's is.
void H4dSystem::skin(const Eigen::VectorXd& shape) {
  const LinearBody body = model_->space.body();
  const int64_t v = body.mean.size(0);
  const Matrix mean = matrix_of(body.mean, 3 * v), skin = matrix_of(body.weights, v);
  const Eigen::VectorXd made = mean + matrix_of(body.directions, 3 * v) * shape;
  EvenPoints even;
  even.arrange(surface_points(body_.rest, kTargetSurface, RngKey{0, 0}.fold("h4d.middle")));
  Vec3 middle;
  centred(even, 0, &middle);
  ShapedSkeleton skeleton(model_->space);
  skeleton.take(shape);
  const Vec3 shift = middle - skeleton.middle();
  for (size_t j = 0; j < kJoints; ++j) body_.joints[j] = skeleton.rest()[j] + shift;
  std::vector<Vec3> vertices;
  for (int64_t i = 0; i < v; ++i) vertices.push_back(made.segment<3>(3 * i) + shift);
  const NearestPoint nearest(vertices);
  body_.weights.resize(std::ssize(body_.rest.vertices), kJoints);
  for (Eigen::Index i = 0; i < body_.weights.rows(); ++i) {
    const auto found = nearest(body_.rest.vertices[static_cast<size_t>(i)].cast<double>());
    body_.weights.row(i) = skin.row(static_cast<Eigen::Index>(found.index)).cast<float>();
  }
}

void H4dSystem::answer(const Points& cloud, const std::string& source, const Show& show) {
  require_body(cloud, source);
  look(cloud);
  const auto first = static_cast<int64_t>(frames_of_window_);
  if (clouds_ >= first)
    answer_window(clouds_ == first ? 0 : frames_of_window_ - 1, frames_of_window_, show);
}

/// Puts a cloud into the window, as the networks see it.
void H4dSystem::look(const Points& cloud) {
  const Stopwatch watch(&times_.deformation);
  EvenPoints points;
  points.arrange(cloud);
  Seen seen;
  Context ctx;
  const Var shown(centred(points, 0, &seen.middle));
  const Tensor features = model_->point_encoder(ctx, shown).value;
  seen.features = features.reshape({1, 1, features.size(1)});
  seen.pose = model_->pose_encoder(ctx, shown).value;
  shapes_ += matrix_of(model_->id_encoder(ctx, shown).value, shapes_.size());
  seen.missed = missed();
  window_.push_back(std::move(seen));
  if (window_.size() > frames_of_window_) window_.pop_front();
  ++clouds_;
}

/// Shows frames [from, to) of the window, which is full.
void H4dSystem::answer_window(size_t from, size_t to, const Show& show) {
  Tensor poses;
  {
    const Stopwatch watch(&times_.deformation);
    poses = poses_of_window();
  }
  for (size_t k = from; k < to; ++k) {
    frame_.pose = pose_of(poses.data<float>() + k * 3 * kJoints, window_[k].middle);
    show_after_gap(window_[k].missed, frame_, show);
  }
}

/// The rotation vectors of the source in all frames of the window; source_ gets its shape.
Tensor H4dSystem::poses_of_window() {
  Context ctx;
  std::vector<Var> frames;
  for (const Seen& seen : window_) frames.emplace_back(seen.features);
  Var features = frames[0];
  for (size_t i = 1; i < frames.size(); ++i) features = concat({features, frames[i]}, 1);
  H4d::Codes codes{{}, Var(window_.front().pose), {}, {}};
  model_->read_motion(ctx, features, &codes);
  source_.take(shapes_ / static_cast<double>(clouds_));
  return model_->poses(ctx, codes, basis_).value.cpu();
}

/// The target in the pose that these rotation vectors say, where the source stands whose cloud has
/// this middle.
Pose H4dSystem::pose_of(const float* numbers, const Vec3& middle) const {
  Pose out;
  for (size_t j = 0; j < kJoints; ++j) {
    const Vec3 turn = Eigen::Map<const Point>(numbers + 3 * j).cast<double>();
    out.local[j] = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
  }
  const Joints &a = source_.rest(), &b = body_.joints;
  const Vec3 pelvis = middle - source_.middle(forward_kinematics(a, out));
  const double scale = leg_length(b) / std::max(leg_length(a), 1e-6);
  const Vec3 hips = pelvis + out.local[0] * to_hips(a) - Vec3(0, foot_height(a), 0);
  out.root = scale * hips + Vec3(0, foot_height(b), 0) - out.local[0] * to_hips(b);
  return out;
}

void H4dSystem::answer_rest(const Show& show) {
  const size_t clouds = window_.size();
  if (clouds < frames_of_window_) {
    while (window_.size() < frames_of_window_) window_.push_back(window_.back());
    answer_window(0, clouds, show);
  }
  EachCloud::answer_rest(show);
}

void H4dSystem::forget() {
  EachCloud::forget();
  window_.clear();
  clouds_ = 0;
  shapes_ = Eigen::VectorXd::Zero(model_->config.shape);
}

}  // namespace restage
