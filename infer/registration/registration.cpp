#include "infer/registration/registration.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "autograd/base/error.h"
#include "autograd/base/parallel_each.h"
#include "nn/geometry/closed_form.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

constexpr int kHeadings = 8;
constexpr std::array<double, 3> kArms = {0.0, 0.8, 1.3};  // angles below the T-pose, radians
constexpr double kStartWidth = 0.2, kLastWidth = 0.06;    // of misfit(), before and after the fit

/// The medians of the coordinates, which stray points do not change.
Vec3 middle(const std::vector<Vec3>& points) {
  Vec3 out;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const Vec3& p : points) values.push_back(p[c]);
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    out[c] = *half;
  }
  return out;
}

/// `state`, moved so that the middle of the rig's nodes is the middle of the cloud.
RigState placed(const Rig& rig, RigState state, const std::vector<Vec3>& cloud) {
  state.pose.root += middle(cloud) - middle(pose_rig(rig, state).nodes);
  return state;
}

}  // namespace

std::vector<Vec3> thinned(const Points& cloud, double width, const std::string& source) {
  struct Sum {
    Vec3 sum = Vec3::Zero();
    double count = 0;
  };
  std::map<std::array<int64_t, 3>, Sum> cubes;
  for (const Point& p : cloud) {
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e6f)
      throw UnusableCloud(source, "holds a coordinate that is not finite or beyond 1000 km",
                          "remove such points, and give metres");
    std::array<int64_t, 3> at;
    for (int c = 0; c < 3; ++c)
      at[c] = static_cast<int64_t>(std::floor(static_cast<double>(p[c]) / width));
    Sum& cube = cubes[at];
    cube.sum += p.cast<double>();
    cube.count += 1;
  }
  if (cubes.size() < kLeastDistinctPoints)
    throw UnusableCloud(
        source, "holds points in " + std::to_string(cubes.size()) + " places, too few for a body",
        "give at least " + std::to_string(kLeastDistinctPoints) + " some centimetres apart");
  std::vector<Vec3> out;
  out.reserve(cubes.size());
  for (const auto& [at, cube] : cubes) out.push_back(cube.sum / cube.count);
  return out;
}

Registration::Registration(Mesh target, const Joints& rest, const std::string& where,
                           const RegistrationOptions& options)
    : options_(options) {
  body_.id = where;
  body_.rest = std::move(target);
  body_.joints = rest;
  rig_ = make_rig(body_.rest, rest, where, options.nodes);  // checks its input
  body_.weights = bone_distance_weights(body_.rest.vertices, rest);
  system_rig_.emplace(SystemRig{body_.joints, body_.weights});
}

/// The candidates that are to be fitted: the pose of the frame before, if there is one, then
/// headings and arm poses, the best fitting first.
std::vector<RigState> Registration::starts(const std::vector<Vec3>& cloud) const {
  struct Candidate {
    double cost;
    RigState state;
  };
  std::vector<Candidate> all(kHeadings * kArms.size());
  RigState build;
  if (previous_) {
    build.scale = previous_->scale;
    build.stretch = previous_->stretch;
  }
  parallel_each(static_cast<int64_t>(all.size()), 1, [&](int64_t i) {
    RigState state = build;
    state.pose.local.fill(Mat3::Identity());
    state.pose.local[0] =
        turn_about_y(2 * std::numbers::pi * static_cast<double>(i % kHeadings) / kHeadings);
    const double arms = kArms[i / kHeadings];
    state.pose.local[16] = Eigen::AngleAxisd(-arms, Vec3::UnitZ()).toRotationMatrix();
    state.pose.local[17] = Eigen::AngleAxisd(arms, Vec3::UnitZ()).toRotationMatrix();
    state = placed(rig_, state, cloud);
    all[i] = {misfit(pose_rig(rig_, state), cloud, kStartWidth), state};
  });
  std::stable_sort(all.begin(), all.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  std::vector<RigState> out;
  if (previous_) out.push_back(placed(rig_, *previous_, cloud));
  for (size_t i = 0; i < all.size() && i < static_cast<size_t>(options_.searched); ++i)
    out.push_back(all[i].state);
  return out;
}

void Registration::answer(const Points& cloud, const std::string& source, const Show& show) {
  const std::vector<Vec3> points = thinned(cloud, options_.grid, source);
  std::vector<RigState> fitted = starts(points);
  std::vector<double> costs(fitted.size());
  parallel_each(std::ssize(fitted), 1, [&](int64_t i) {
    const auto k = static_cast<size_t>(i);
    fitted[k] = fit_articulated(rig_, points, fitted[k], options_.articulated);
    costs[k] = misfit(pose_rig(rig_, fitted[k]), points, kLastWidth);
  });
  const auto best =
      static_cast<size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  previous_ = fitted[best];
  const PosedRig posed = pose_rig(rig_, *previous_);
  Pose& pose = frame_.pose;
  pose = previous_->pose;
  if (options_.free_form)
    pose = refit_pose(rig_, posed, fit_free_form(rig_, posed, points, options_.free_form_options));
  source_joints_ = forward_kinematics(built(body_.joints, *previous_), pose).joints;

  pose.root = trajectory_scale(source_joints_, body_.joints) * source_joints_[0];
  show_after_gap(missed(), frame_, show);
}

void Registration::forget() {
  EachCloud::forget();
  previous_.reset();
}

}  // namespace restage
