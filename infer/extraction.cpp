#include "infer/extraction.h"

#include <algorithm>
#include <cmath>

namespace restage {
namespace {

bool before(const Point& a, const Point& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

/// Exactly n of the sorted points: a random subset, or all of them and random repetitions.
Points choose(const Points& sorted, size_t n, const RngKey& key) {
  Points out = sorted;
  Rng rng(key);
  if (out.size() > n) {
    for (size_t i = 0; i < n; ++i) std::swap(out[i], out[i + rng.below(out.size() - i)]);
    out.resize(n);
  }
  while (out.size() < n) out.push_back(sorted[rng.below(sorted.size())]);
  std::sort(out.begin(), out.end(), before);
  return out;
}

}  // namespace

Joints extract_joints(SkeletonModel& model, const Points& cloud, const std::string& source,
                      const RngKey& key, int samples) {
  for (const Point& p : cloud)
    if (!p.allFinite())
      throw InputError(source, "holds a coordinate that is not finite", "remove such points");
  Points sorted = cloud;
  std::sort(sorted.begin(), sorted.end(), before);
  Points distinct = sorted;
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  if (distinct.size() < kLeastDistinctPoints)
    throw InputError(
        source, "holds " + std::to_string(distinct.size()) + " distinct points, too few for a body",
        "give at least " + std::to_string(kLeastDistinctPoints) + ", better a thousand");
  const auto n = static_cast<size_t>(model.points());
  Tensor batch = Tensor::empty({samples, static_cast<int64_t>(n), 3});
  std::vector<Vec3> centres;
  for (int s = 0; s < samples; ++s) {
    const Points chosen = choose(sorted, n, key.fold(static_cast<uint64_t>(s)));
    Vec3 centre = Vec3::Zero();
    for (const Point& p : chosen) centre += p.cast<double>();
    centre /= static_cast<double>(n);
    centres.push_back(centre);
    float* row = batch.data<float>() + static_cast<size_t>(s) * n * 3;
    for (size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c)
        row[3 * i + static_cast<size_t>(c)] = static_cast<float>(chosen[i][c] - centre[c]);
  }
  Context ctx;
  const Tensor joints = model.forward(ctx, batch).joints.value;
  Joints out;
  for (size_t j = 0; j < kJoints; ++j) {
    out[j].setZero();
    for (size_t s = 0; s < centres.size(); ++s) {
      const float* x = joints.data<float>() + (s * kJoints + j) * 3;
      out[j] += (Vec3(x[0], x[1], x[2]) + centres[s]) / static_cast<double>(samples);
    }
    if (!out[j].allFinite())
      throw InputError(source, "gives joints that are not finite", "check its units: metres");
  }
  return out;
}

Points surface_points(const Mesh& mesh, size_t n, const RngKey& key) {
  if (mesh.faces.empty()) return mesh.vertices;
  std::vector<double> ends;
  double total = 0;
  for (const Triangle& t : mesh.faces) {
    const auto at = [&](int i) {
      return mesh.vertices[static_cast<size_t>(t[static_cast<size_t>(i)])];
    };
    total += 0.5 * static_cast<double>((at(1) - at(0)).cross(at(2) - at(0)).norm());
    ends.push_back(total);
  }
  if (!(total > 0)) return mesh.vertices;
  Rng rng(key);
  Points out;
  for (size_t i = 0; i < n; ++i) {
    const auto it = std::upper_bound(ends.begin(), ends.end(), rng.uniform() * total);
    const auto face =
        static_cast<size_t>(std::min<std::ptrdiff_t>(it - ends.begin(), std::ssize(ends) - 1));
    double u = rng.uniform(), v = rng.uniform();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Triangle& t = mesh.faces[face];
    const Point &a = mesh.vertices[static_cast<size_t>(t[0])],
                &b = mesh.vertices[static_cast<size_t>(t[1])],
                &c = mesh.vertices[static_cast<size_t>(t[2])];
    out.push_back(a + static_cast<float>(u) * (b - a) + static_cast<float>(v) * (c - a));
  }
  return out;
}

}  // namespace restage
