#include "datasets/benchmark/realism.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "autograd/base/parallel.h"
#include "datasets/benchmark/floor.h"
#include "datasets/readers/errors.h"
#include "nn/geometry/normals.h"

namespace restage {
namespace {

constexpr double kPart = 0.35;      // of a bone's length: what counts as about a joint
constexpr double kTouching = 0.01;  // metres

Vec3 corner(const Points& x, const Triangle& t, size_t k) { return x[t[k]].cast<double>(); }

/// Faces of the skin of two bones near their joint, found at rest.
std::vector<Triangle> faces_about(const Body& body, int near, int joint, int far) {
  const Vec3 middle = body.joints[joint];
  const Vec3 up = body.joints[near] - middle;
  const Vec3 down = body.joints[far] - middle;
  const auto close = [&](int32_t v) {
    const Vec3 x = body.rest.vertices[v].cast<double>() - middle;
    const double a = x.dot(up) / up.squaredNorm(), b = x.dot(down) / down.squaredNorm();
    return body.weights(v, near) + body.weights(v, joint) > 0.5f && a < kPart && b < kPart;
  };
  std::vector<Triangle> out;
  for (const Triangle& t : body.rest.faces)
    if (std::all_of(t.begin(), t.end(), close)) out.push_back(t);
  return out;
}

/// Volume of the cone from `apex` to the faces.
double cone_volume(const Points& x, const std::vector<Triangle>& faces, const Vec3& apex) {
  double sum = 0;
  for (const Triangle& t : faces)
    sum += (corner(x, t, 0) - apex).dot((corner(x, t, 1) - apex).cross(corner(x, t, 2) - apex));
  return sum / 6;
}

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  const auto k = static_cast<size_t>(std::lround(p * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[k];
}

struct Sums {
  double ours = 0, linear = 0, least_ours = 1e9, least_linear = 1e9;
  void add(const BentVolume& v) {
    ours += v.ours;
    linear += v.linear;
    least_ours = std::min(least_ours, v.ours);
    least_linear = std::min(least_linear, v.linear);
  }
};

using Counts = std::map<std::string, int>;

std::vector<std::string> most_first(const Counts& counts) {
  std::vector<std::pair<int, std::string>> ordered;
  for (const auto& [name, count] : counts) ordered.emplace_back(-count, name);
  std::sort(ordered.begin(), ordered.end());
  std::vector<std::string> out;
  for (const auto& [count, name] : ordered) out.push_back(cat(name, " (", -count, ")"));
  return out;
}

void measure_bodies(const std::vector<Body>& bodies, RealismReport& out, Counts& outside) {
  constexpr double kRight = std::numbers::pi / 2;
  struct Row {
    BentVolume knee[2], elbow[2];
    int inside = 0;
    double buried = 0;
    std::vector<std::string> outside, buried_at;
  };
  std::vector<Row> rows(bodies.size());
  parallel_for(bodies.size(), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Body& body = bodies[i];
      Row& row = rows[i];
      for (int side : {0, 1}) {
        row.knee[side] = bent_volume(body, 1 + side, 4 + side, 7 + side, kRight);
        row.elbow[side] = bent_volume(body, 16 + side, 18 + side, 20 + side, kRight);
      }
      row.inside = joints_inside(body, body.rest.vertices, body.joints, &row.outside);
      row.buried = buried_share(body, 8, &row.buried_at);
    }
  });
  Sums knee, elbow;
  Counts buried_at;
  double inside = 0;
  for (const Row& row : rows) {
    for (int side : {0, 1}) {
      knee.add(row.knee[side]);
      elbow.add(row.elbow[side]);
    }
    inside += row.inside;
    out.buried += row.buried;
    for (const std::string& name : row.buried_at) ++buried_at[name];
    for (const std::string& name : row.outside) ++outside[name];
  }
  const auto n = static_cast<double>(std::max<size_t>(1, bodies.size()));
  out.knee_mean = {knee.ours / (2 * n), knee.linear / (2 * n)};
  out.elbow_mean = {elbow.ours / (2 * n), elbow.linear / (2 * n)};
  out.knee_least = {knee.least_ours, knee.least_linear};
  out.elbow_least = {elbow.least_ours, elbow.least_linear};
  out.joints_inside_rest = inside / (n * kJoints);
  out.buried /= n;
  out.buried_at = most_first(buried_at);
}

void measure_poses(const std::vector<Body>& bodies, const std::vector<Motion>& motions,
                   RealismReport& out, Counts& outside) {
  struct Row {
    int inside = 0;
    std::vector<std::string> outside;
  };
  std::vector<Row> rows(motions.size());
  parallel_for(rows.size(), 1, [&](int64_t begin, int64_t end) {
    for (int64_t m = begin; m < end; ++m) {
      const Body& body = bodies[m % bodies.size()];
      const Pose pose = pose_on(motions[m], body, motions[m].frames() / 2);
      rows[m].inside =
          joints_inside(body, pose_surface(body, pose),
                        forward_kinematics(body.joints, pose).joints, &rows[m].outside);
    }
  });
  double inside = 0;
  for (const Row& row : rows) {
    inside += row.inside;
    for (const std::string& name : row.outside) ++outside[name];
  }
  out.joints_inside_posed = inside / static_cast<double>(kJoints * motions.size());
}

void measure_feet(const std::vector<Body>& bodies, const std::vector<Motion>& motions,
                  RealismReport& out) {
  std::vector<double> lowest, slipping;
  for (const Body& body : bodies) {
    const std::vector<int32_t> vertices = outermost_vertices(body);
    for (const Motion& motion : motions) {
      const FootContact contact = foot_contact(motion, body, vertices);
      lowest.insert(lowest.end(), contact.lowest.begin(), contact.lowest.end());
      slipping.insert(slipping.end(), contact.slipping.begin(), contact.slipping.end());
    }
  }
  for (const double p : {0.0, 0.01, 0.5, 0.99, 1.0}) out.lowest.push_back(percentile(lowest, p));
  const auto near =
      std::count_if(lowest.begin(), lowest.end(), [](double h) { return std::abs(h) <= 0.02; });
  out.on_floor =
      static_cast<double>(near) / static_cast<double>(std::max<size_t>(1, lowest.size()));
  out.slipping = percentile(slipping, 0.5);
  out.frames = lowest.size();
}

}  // namespace

BentVolume bent_volume(const Body& body, int near, int joint, int far, double angle) {
  const std::vector<Triangle> faces = faces_about(body, near, joint, far);
  const Vec3 bone = body.joints[far] - body.joints[joint];
  const bool leg = std::abs(bone.y()) > std::abs(bone.x());
  // A knee takes the shin backwards, an elbow the forearm forwards.
  const Vec3 axis = leg ? Vec3(1, 0, 0) : Vec3(0, bone.x() > 0 ? -1 : 1, 0);
  Pose pose;
  pose.local.fill(Mat3::Identity());
  pose.root = body.joints[0];
  pose.local[joint] = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  const Vec3 apex = body.joints[joint];
  const double rest = cone_volume(body.rest.vertices, faces, apex);
  if (!(std::abs(rest) > 0)) return {};
  return {cone_volume(pose_surface(body, pose), faces, apex) / rest,
          cone_volume(linear_blend_skinning(body, pose), faces, apex) / rest};
}

double winding_number(const Points& x, const std::vector<Triangle>& faces, const Vec3& at) {
  double sum = 0;  // of solid angles (Van Oosterom and Strackee 1983)
  for (const Triangle& t : faces) {
    const Vec3 a = corner(x, t, 0) - at, b = corner(x, t, 1) - at, c = corner(x, t, 2) - at;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

int joints_inside(const Body& body, const Points& surface, const Joints& joints,
                  std::vector<std::string>* outside) {
  int inside = 0;
  for (size_t j = 0; j < joints.size(); ++j) {
    if (winding_number(surface, body.rest.faces, joints[j]) > 0.5)
      ++inside;
    else if (outside)
      outside->emplace_back(kJointNames[j]);
  }
  return inside;
}

double buried_share(const Body& body, size_t step, std::vector<std::string>* where) {
  const Points& x = body.rest.vertices;
  const auto normals = vertex_normals<Vec3>(x, body.rest.faces, Vec3::Zero());
  size_t looked = 0, buried = 0;
  for (size_t v = 0; v < x.size(); v += std::max<size_t>(1, step)) {
    if (normals[v].isZero(0)) continue;
    ++looked;
    const Vec3 at = x[v].cast<double>() + 0.003 * normals[v];
    if (!(winding_number(x, body.rest.faces, at) > 0.5)) continue;
    ++buried;
    Eigen::Index joint = 0;
    body.weights.row(v).maxCoeff(&joint);
    if (where) where->emplace_back(kJointNames[joint]);
  }
  return looked > 0 ? static_cast<double>(buried) / static_cast<double>(looked) : 0.0;
}

FootContact foot_contact(const Motion& motion, const Body& body,
                         const std::vector<int32_t>& vertices) {
  FootContact out;
  Points before;
  for (size_t f = 0; f < motion.frames(); ++f) {
    const Points now = pose_surface(body, pose_on(motion, body, f), &vertices);
    double lowest = 1e9;
    for (size_t i = 0; i < now.size(); ++i) {
      lowest = std::min(lowest, static_cast<double>(now[i].y()));
      if (f == 0 || std::abs(now[i].y()) > kTouching || std::abs(before[i].y()) > kTouching)
        continue;
      const Point step = now[i] - before[i];
      out.slipping.push_back(kFps * std::hypot(step.x(), step.z()));
    }
    out.lowest.push_back(lowest);
    before = now;
  }
  return out;
}

RealismReport measure_realism(const std::vector<Body>& bodies, const std::vector<Motion>& motions) {
  RealismReport out;
  out.bodies = bodies.size();
  out.motions = motions.size();
  Counts outside;
  measure_bodies(bodies, out, outside);
  if (!bodies.empty() && !motions.empty()) {
    measure_poses(bodies, motions, out, outside);
    measure_feet(bodies, motions, out);
  }
  out.outside = most_first(outside);
  return out;
}

}  // namespace restage
