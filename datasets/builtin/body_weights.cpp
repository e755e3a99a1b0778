#include "datasets/builtin/body_weights.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

double step(double x, double lo, double hi) {
  const double t = std::clamp((x - lo) / (hi - lo), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

using Row = Eigen::Matrix<double, 1, kJoints>;

// Hands part `share` of joint `from` over to `to`.
void pass_on(Row& w, int from, int to, double share) {
  w[to] += share * w[from];
  w[from] *= 1 - share;
}

void arm_weights(const BodyShape& s, const Joints& j, const Vec3& p, int side, Row& w) {
  const double x = std::abs(p.x()), top = j[16].y();
  const double sx = shoulder_x(s), elbow = j[18].x(), wrist = j[20].x();
  // Over the armpit, or so far out that it can only be the arm.
  const double arm = std::max(step(p.y(), top - .052, top - .018), step(x, sx + .018, sx + .04));
  const double upper = std::max(step(p.y(), top - .10, top - .02), step(x, sx, sx + .03));
  const double collar =
      upper * step(x, .018, sx - .015) * (1 - step(p.y(), top + .045, top + .065));
  pass_on(w, 9, 13 + side, collar);
  pass_on(w, 12, 13 + side, collar * step(x, .035, .06));
  pass_on(w, 13 + side, 16 + side, arm * step(x, sx - .050, sx + .042));
  pass_on(w, 16 + side, 18 + side, step(x, elbow - .030, elbow + .030));
  pass_on(w, 18 + side, 20 + side, step(x, wrist - .022, wrist + .020));
}

void leg_weights(const Joints& j, const Vec3& p, int side, Row& w) {
  const double x = std::abs(p.x());
  const Vec3 &hip = j[1], &knee = j[4], &ankle = j[7], &ball = j[10];
  // The fold of the groin runs from high outside to low inside, higher in front than behind.
  const double inner = 1 - step(x, 0, hip.x() + .03);
  const double fold = hip.y() - .012 - .030 * inner + .22 * p.z();
  const double leg = 1 - step(p.y(), fold - .042, fold + .042);
  const double own_side =
      std::max(step(x, -.012, .028), 1 - step(p.y(), hip.y() - .065, hip.y() - .05));
  const double share = leg * own_side;
  for (const int trunk : {0, 3}) pass_on(w, trunk, 1 + side, share);
  pass_on(w, 1 + side, 4 + side, 1 - step(p.y(), knee.y() - .042, knee.y() + .042));
  const double below = p.y() - .25 * (p.z() - ankle.z());  // the instep moves with the foot
  pass_on(w, 4 + side, 7 + side, 1 - step(below, ankle.y() - .022, ankle.y() + .032));
  pass_on(w, 7 + side, 10 + side, step(p.z(), ball.z() - .020, ball.z() + .016));
}

Row weights_at(const BodyShape& s, const Joints& j, const Vec3& p) {
  Row w = Row::Zero();
  w[0] = 1;
  const double y = p.y();
  pass_on(w, 0, 3, step(y, j[3].y() - .040, j[3].y() + .032));
  pass_on(w, 3, 6, step(y, j[6].y() - .034, j[6].y() + .034));
  pass_on(w, 6, 9, step(y, j[9].y() - .034, j[9].y() + .034));
  pass_on(w, 9, 12, step(y, j[12].y() - .022, j[12].y() + .022));
  const double tilt = y + .65 * (p.z() - j[15].z());  // the chin belongs to the head
  pass_on(w, 12, 15, step(tilt, j[15].y() - .030, j[15].y() + .012));
  pass_on(
      w, 9, 15,
      step(tilt, j[15].y() - .010, j[15].y() + .012) * step(y, j[15].y() - .05, j[15].y() - .03));
  const int side = p.x() >= 0 ? 0 : 1;
  if (y > j[9].y()) arm_weights(s, j, p, side, w);
  if (y < j[3].y() + .05) leg_weights(j, p, side, w);
  return w;
}

void keep_four(Row& w) {
  Row sorted = w;
  std::sort(sorted.data(), sorted.data() + kJoints, [](double a, double b) { return a > b; });
  const double fifth = sorted[4];
  for (double& x : w) x = std::max(x - fifth, 0.0);  // continuous, unlike dropping small ones
  w /= w.sum();
}

}  // namespace

Weights shape_weights(const BodyShape& shape, const SurfaceMesh& mesh) {
  const Joints joints = shape_joints(shape);
  const size_t n = mesh.vertices.size();
  std::vector<Row> w(n), next(n);
  for (size_t v = 0; v < n; ++v) w[v] = weights_at(shape, joints, mesh.vertices[v]);
  const auto neighbours = vertex_neighbours(n, mesh.faces);
  for (int round = 0; round < 6; ++round) {
    for (size_t v = 0; v < n; ++v) {
      Row sum = Row::Zero();
      for (const int32_t u : neighbours[v]) sum += w[u];
      next[v] = 0.5 * w[v] + 0.5 / static_cast<double>(neighbours[v].size()) * sum;
    }
    w.swap(next);
  }
  Weights out(n, kJoints);
  for (size_t v = 0; v < n; ++v) {
    keep_four(w[v]);
    out.row(v) = w[v].cast<float>();
  }
  return out;
}

}  // namespace restage
