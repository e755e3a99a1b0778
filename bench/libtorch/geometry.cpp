#include "geometry.h"

#include <array>

namespace bench {
namespace {

constexpr std::array<int64_t, kJoints> kParents = {-1, 0, 0, 0, 1,  2,  3,  4,  5,  6,  7,
                                                   8,  9, 9, 9, 12, 13, 14, 16, 17, 18, 19};

/// The tree by depth: which joints, and where their parents stand among those of the depth before.
struct Level {
  Tensor joints, parents, parent_joints;
};

struct Tree {
  std::vector<Level> levels;
  Tensor order;  ///< where each joint stands among all levels, one after the other
  Tree() {
    std::array<int64_t, kJoints> depth{}, place{}, at{};
    std::vector<std::vector<int64_t>> by_depth;
    for (int64_t j = 0; j < kJoints; ++j) {
      depth[j] = j == 0 ? 0 : depth[kParents[j]] + 1;
      by_depth.resize(std::max<size_t>(by_depth.size(), depth[j] + 1));
      place[j] = static_cast<int64_t>(by_depth[depth[j]].size());
      by_depth[depth[j]].push_back(j);
    }
    int64_t next = 0;
    for (const auto& joints : by_depth) {
      std::vector<int64_t> parents, parent_joints;
      for (const int64_t j : joints) {
        at[j] = next++;
        parents.push_back(j == 0 ? 0 : place[kParents[j]]);
        parent_joints.push_back(j == 0 ? 0 : kParents[j]);
      }
      levels.push_back(
          {torch::tensor(joints), torch::tensor(parents), torch::tensor(parent_joints)});
    }
    order = torch::tensor(std::vector<int64_t>(at.begin(), at.end()));
  }
};

Tensor unit(const Tensor& v) { return v / v.norm(2, -1, true).clamp_min(1e-8); }

}  // namespace

Tensor sixd_to_matrix(const Tensor& v) {
  const Tensor a1 = v.slice(-1, 0, 3), a2 = v.slice(-1, 3, 6), b1 = unit(a1);
  const Tensor b2 = unit(a2 - (b1 * a2).sum(-1, true) * b1);
  return torch::stack({b1, b2, torch::cross(b1, b2, -1)}, -1);
}

Tensor matrix_to_sixd(const Tensor& r) {
  return torch::cat({r.select(-1, 0), r.select(-1, 1)}, -1);
}

Tensor matrix_to_axis_angle(const Tensor& r) {
  // Through the quaternion: of its four forms the one with the largest divisor, w >= 0.
  const auto m = r.flatten(-2).unbind(-1);
  const Tensor t = torch::stack({1 + m[0] + m[4] + m[8], 1 + m[0] - m[4] - m[8],
                                 1 - m[0] + m[4] - m[8], 1 - m[0] - m[4] + m[8]},
                                -1);
  const auto d = t.unbind(-1);
  const Tensor a = m[7] - m[5], b = m[2] - m[6], c = m[3] - m[1], e = m[3] + m[1], f = m[2] + m[6],
               g = m[7] + m[5];
  const Tensor forms =
      torch::stack({d[0], a, b, c, a, d[1], e, f, b, e, d[2], g, c, f, g, d[3]}, -1)
          .unflatten(-1, {4, 4});
  const Tensor best = t.argmax(-1).reshape({-1, 1, 1}).expand({-1, 1, 4});
  Tensor q = unit(forms.gather(-2, best).squeeze(-2));
  q = torch::where(q.slice(-1, 0, 1) < 0, -q, q);
  const Tensor v = q.slice(-1, 1, 4), n = v.norm(2, -1, true);
  const Tensor angle = 2 * torch::atan2(n, q.slice(-1, 0, 1));
  return v * torch::where(n < 1e-8, torch::full_like(n, 2.0), angle / n.clamp_min(1e-12));
}

Posed forward_kinematics(const Tensor& local, const Tensor& rest, const Tensor& root) {
  static const Tree tree;
  std::vector<Tensor> rotations = {local.slice(1, 0, 1)}, joints = {root.unsqueeze(1)};
  for (size_t i = 1; i < tree.levels.size(); ++i) {
    const Level& l = tree.levels[i];
    const Tensor parents = rotations.back().index_select(1, l.parents);
    const Tensor bones = rest.index_select(1, l.joints) - rest.index_select(1, l.parent_joints);
    joints.push_back(joints.back().index_select(1, l.parents) +
                     parents.matmul(bones.unsqueeze(-1)).squeeze(-1));
    rotations.push_back(parents.matmul(local.index_select(1, l.joints)));
  }
  return {torch::cat(rotations, 1).index_select(1, tree.order),
          torch::cat(joints, 1).index_select(1, tree.order)};
}

Tensor skin(const Tensor& points, const Tensor& weights, const Posed& posed, const Tensor& rest) {
  const Tensor shift = posed.joints - posed.rotations.matmul(rest.unsqueeze(-1)).squeeze(-1);
  const Tensor transforms = torch::cat({posed.rotations.flatten(-2), shift}, -1);  // [n, 22, 12]
  const Tensor blended = weights.matmul(transforms);                               // [n, v, 12]
  const Tensor rotation = blended.slice(-1, 0, 9).unflatten(-1, {3, 3});
  return rotation.matmul(points.unsqueeze(-1)).squeeze(-1) + blended.slice(-1, 9, 12);
}

}  // namespace bench
