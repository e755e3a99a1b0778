#include "infer/extraction.h"

#include <algorithm>

namespace restage {
namespace {

bool before(const Point& a, const Point& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

JointExtractor::JointExtractor(SkeletonModel& model, int samples)
    : model_(model), centres_(static_cast<size_t>(samples)) {}

void JointExtractor::sort(const Points& cloud, const std::string& source) {
  for (const Point& p : cloud)
    if (!p.allFinite())
      throw InputError(source, "holds a coordinate that is not finite", "remove such points");
  sorted_ = cloud;
  std::sort(sorted_.begin(), sorted_.end(), before);
  sorted_.erase(std::unique(sorted_.begin(), sorted_.end()), sorted_.end());
  if (sorted_.size() < kLeastDistinctPoints)
    throw InputError(
        source, "holds " + std::to_string(sorted_.size()) + " distinct points, too few for a body",
        "give at least " + std::to_string(kLeastDistinctPoints) + ", better a thousand");
}

/// Exactly as many of the sorted points as the model takes: a random subset, or all of them and
/// random repetitions; sorted.
void JointExtractor::choose(const RngKey& key) {
  const auto n = static_cast<size_t>(model_.points());
  chosen_ = sorted_;
  Rng rng(key);
  if (chosen_.size() > n) {
    for (size_t i = 0; i < n; ++i)
      std::swap(chosen_[i], chosen_[i + rng.below(chosen_.size() - i)]);
    chosen_.resize(n);
  }
  while (chosen_.size() < n) chosen_.push_back(sorted_[rng.below(sorted_.size())]);
  std::sort(chosen_.begin(), chosen_.end(), before);
}

Joints JointExtractor::operator()(const Points& cloud, const std::string& source,
                                  const RngKey& key) {
  sort(cloud, source);
  const auto n = static_cast<size_t>(model_.points());
  const size_t samples = centres_.size();
  Tensor batch = Tensor::empty({static_cast<int64_t>(samples), static_cast<int64_t>(n), 3});
  for (size_t s = 0; s < samples; ++s) {
    choose(key.fold(s));
    Vec3& centre = centres_[s];
    centre.setZero();
    for (const Point& p : chosen_) centre += p.cast<double>();
    centre /= static_cast<double>(n);
    float* row = batch.data<float>() + s * n * 3;
    for (size_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c)
        row[3 * i + static_cast<size_t>(c)] = static_cast<float>(chosen_[i][c] - centre[c]);
  }
  Context ctx;
  const Tensor joints = model_.forward(ctx, batch).joints.value;
  Joints out;
  for (size_t j = 0; j < kJoints; ++j) {
    out[j].setZero();
    for (size_t s = 0; s < samples; ++s) {
      const float* x = joints.data<float>() + (s * kJoints + j) * 3;
      out[j] += (Vec3(x[0], x[1], x[2]) + centres_[s]) / static_cast<double>(samples);
    }
    if (!out[j].allFinite())
      throw InputError(source, "gives joints that are not finite", "check its units: metres");
  }
  return out;
}

Joints extract_joints(SkeletonModel& model, const Points& cloud, const std::string& source,
                      const RngKey& key, int samples) {
  return JointExtractor(model, samples)(cloud, source, key);
}

Points surface_points(const Mesh& mesh, size_t n, const RngKey& key) {
  if (mesh.faces.empty()) return mesh.vertices;
  std::vector<double> ends;
  double total = 0;
  for (const Triangle& t : mesh.faces) {
    const auto at = [&](int i) { return mesh.vertices[t[i]]; };
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
    const Point &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    out.push_back(a + static_cast<float>(u) * (b - a) + static_cast<float>(v) * (c - a));
  }
  return out;
}

}  // namespace restage
