#include "infer/track/tracker.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "autograd/base/error.h"
#include "infer/writers/glb.h"

namespace restage {
namespace {

constexpr double kKeptCorrection = 0.9;  // of a joint's, from frame to frame
constexpr double kThinBlend = 0.3;       // a blend of turns with a smaller determinant is torn

Body with_four_weights(Body body) {
  const Influences strongest = strongest_four(body.weights);
  body.weights.setZero();
  for (size_t v = 0; v < strongest.joints.size(); ++v)
    for (size_t k = 0; k < 4; ++k)
      body.weights(static_cast<Eigen::Index>(v), strongest.joints[v][k]) += strongest.weights[v][k];
  return body;
}

Mat3 blended(const Body& body, const PosedSkeleton& posed, size_t vertex) {
  Mat3 out = Mat3::Zero();
  for (int j = 0; j < kJoints; ++j)
    if (const double w = body.weights(static_cast<Eigen::Index>(vertex), j); w != 0)
      out += w * posed.global[j];
  return out;
}

Mat3 nearest_turn(const Mat3& m) {
  const Eigen::JacobiSVD<Mat3> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 sign = Mat3::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign(2, 2) = -1;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

}  // namespace

Tracker::Tracker(Body body, const std::string& where, TrackOptions options)
    : body_(with_four_weights(std::move(body))),
      options_(std::move(options)),
      surface_(make_surface_graph(body_, options_.nodes, where), body_.rest.faces,
               options_.surface),
      distance_(body_.rest) {
  options_.pose.whole = surface_.graph().area / (kScanCell * kScanCell);
  correction_.fill(Mat3::Identity());
  if (!options_.skin) return;
  Pose rest;
  rest.local.fill(Mat3::Identity());
  rest.root = body_.joints[kPelvis];
  std::vector<double> sizes;
  for (const Mat3& blend : options_.skin(rest).blends)
    sizes.push_back(std::cbrt(std::abs(blend.determinant())));
  std::nth_element(sizes.begin(), sizes.begin() + std::ssize(sizes) / 2, sizes.end());
  if (const double metres = sizes[sizes.size() / 2]; metres > 0) stored_metre_ = 1 / metres;
}

FileSkin Tracker::skin(const Pose& pose) const {
  if (options_.skin) return options_.skin(pose);
  FileSkin out{skinned(body_, pose), {}};
  const PosedSkeleton posed = forward_kinematics(body_.joints, pose);
  out.blends.reserve(out.vertices.size());
  for (size_t v = 0; v < out.vertices.size(); ++v) out.blends.push_back(blended(body_, posed, v));
  return out;
}

std::vector<Vec3> Tracker::surface(const Pose& pose, const Points& offsets) const {
  FileSkin out = skin(pose);
  for (size_t v = 0; v < offsets.size(); ++v)
    out.vertices[v] += stored_metre_ * (out.blends[v] * offsets[v].cast<double>());
  return std::move(out.vertices);
}

/// Puts the trunk where it was seen: the chain keeps its own path, and scales it.
Pose Tracker::start(const Pose& chain, const Joints* seen) const {
  Pose out = chain;
  for (size_t j = 1; j < kJoints; ++j) out.local[j] = correction_[j] * chain.local[j];
  out.local[kPelvis] = chain.local[kPelvis] * correction_[kPelvis];
  if (seen == nullptr) {
    out.root += moved_;
    return out;
  }
  const Joints now = forward_kinematics(body_.joints, chain).joints;
  constexpr std::array<int, 7> kTrunk = {kPelvis, kLeftHip,      kRightHip,     kSpine2,
                                         kSpine3, kLeftShoulder, kRightShoulder};
  Vec3 away = Vec3::Zero();
  for (const int j : kTrunk) away += ((*seen)[j] - now[j]) / double{kTrunk.size()};
  out.root += away;
  return out;
}

std::vector<Mat3> Tracker::node_turns(const PosedSkeleton& posed) const {
  std::vector<Mat3> out;
  for (const int32_t v : surface_.graph().nodes)
    out.push_back(nearest_turn(blended(body_, posed, static_cast<size_t>(v))));
  return out;
}

void Tracker::unskin(const FileSkin& skin, TrackedFrame* frame) const {
  frame->offsets.reserve(skin.vertices.size());
  for (size_t v = 0; v < skin.vertices.size(); ++v) {
    const Mat3 turn = stored_metre_ * skin.blends[v];
    const Vec3 moved = frame->vertices[v].cast<double>() - skin.vertices[v];
    const Mat3 back = std::abs(turn.determinant()) > kThinBlend ? Mat3(turn.inverse())
                                                                : nearest_turn(turn).transpose();
    frame->offsets.push_back((back * moved).cast<float>());
  }
}

TrackedFrame Tracker::operator()(const Pose& chain, const Joints* seen, const Points* cloud,
                                 const std::string& source) {
  std::optional<Scan> scan;
  if (cloud != nullptr) scan = make_scan(*cloud, source);
  TrackedFrame out;
  out.pose = start(chain, seen);
  if (scan) {
    out.pose = fit_pose(body_, *scan, out.pose, options_.pose);
    moved_ = out.pose.root - chain.root;
    correction_[kPelvis] = turn_of(
        kKeptCorrection * turn_vector(chain.local[kPelvis].transpose() * out.pose.local[kPelvis]));
    for (size_t j = 1; j < kJoints; ++j)
      correction_[j] =
          turn_of(kKeptCorrection * turn_vector(out.pose.local[j] * chain.local[j].transpose()));
  }
  const PosedSkeleton posed = forward_kinematics(body_.joints, out.pose);
  const FileSkin skinned_now = skin(out.pose);
  const std::vector<Vec3> surface =
      options_.deform
          ? surface_.fit(skinned_now.vertices, node_turns(posed), scan ? &*scan : nullptr)
          : skinned_now.vertices;
  for (const Vec3& p : surface) out.vertices.push_back(p.cast<float>());
  unskin(skinned_now, &out);
  if (scan) out.distance = middle_and_most(distance_(scan->points, surface));
  return out;
}

namespace {

template <class Visit>
void each_number(Rotations& turns, Vec3& moved, const Visit& visit) {
  for (Mat3& turn : turns) visit(turn.data(), 9);
  visit(moved.data(), 3);
}

}  // namespace

std::string Tracker::save() const {
  std::string out;
  Rotations turns = correction_;
  Vec3 moved = moved_;
  each_number(turns, moved, [&](const double* x, size_t count) {
    out.append(reinterpret_cast<const char*>(x), count * sizeof(double));
  });
  return out + surface_.save();
}

void Tracker::load(const std::string& state, const std::string& where) {
  constexpr size_t kOwn = (9 * kJoints + 3) * sizeof(double);
  if (state.size() != save().size())
    throw InputError(where, "is of another take", "remove it, and begin anew");
  size_t at = 0;
  each_number(correction_, moved_, [&](double* x, size_t count) {
    std::memcpy(x, state.data() + at, count * sizeof(double));
    at += count * sizeof(double);
  });
  surface_.load(state.substr(kOwn));
}

}  // namespace restage
