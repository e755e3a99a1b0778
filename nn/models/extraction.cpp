#include "nn/models/extraction.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/log.h"
#include "nn/geometry/strays.h"

namespace restage {
namespace {

constexpr double kLost = 1;  // metres: nobody moves so far from one frame to the next

bool mirrored(size_t view) { return view % 2 == 1; }

/// From the ankles to the head along the bones, whatever the pose.
double tallness(const Joints& joints) {
  double out = leg_length(joints);
  for (int j = kHead; j != 0; j = kParents[static_cast<size_t>(j)])
    out += (joints[static_cast<size_t>(j)] -
            joints[static_cast<size_t>(kParents[static_cast<size_t>(j)])])
               .norm();
  return out;
}

/// 1 for people as tall as those of trainings, 1.37 to 2.1 m. Others are brought inside that range,
/// by a power of 1.1, so that the scale seldom changes from frame to frame.
double scale_for(const Joints& joints) {
  // Tallness, metres: MakeHuman's adults have 1.26 to 1.78, and trainings scale them by up to 5 %.
  constexpr double kSmall = 1.2, kLarge = 1.84, kInside = 1.14, kStep = 1.1;
  const double tall = std::max(tallness(joints), 1e-3);
  if (!std::isfinite(tall) || (tall >= kSmall && tall <= kLarge)) return 1;
  const double wanted = tall < kSmall ? kSmall * kInside : kLarge / kInside;
  const double steps = std::round(std::log(wanted / tall) / std::log(kStep));
  return std::pow(kStep, std::clamp(steps, -16.0, 16.0));
}

}  // namespace

JointExtractor::JointExtractor(SkeletonModel& model, int samples, double around, bool keep_limbs,
                               bool any_size)
    : model_(model),
      device_(device_of(model)),
      around_(around),
      keep_limbs_(keep_limbs),
      any_size_(any_size),
      centres_(static_cast<size_t>(samples)),
      views_(static_cast<size_t>(samples)) {}

double JointExtractor::heading(size_t view) const {
  const size_t pairs = (centres_.size() + 1) / 2, pair = view / 2;
  return around_ * ((static_cast<double>(pair) + 0.5) / static_cast<double>(pairs) - 0.5);
}

void JointExtractor::arrange(const Points& cloud, const std::string& source) {
  for (const Point& p : cloud)
    if (!p.allFinite())
      throw UnusableCloud(source, "holds a coordinate that is not finite", "remove such points");
  const size_t strays = leave_out_strays(cloud, &kept_);
  if (strays > 0 && !told_of_strays_)
    log_warning(source + ": left out " + std::to_string(strays) +
                (strays == 1 ? " point" : " points") +
                " more than 5 m from the middle of the others (this is said once)");
  told_of_strays_ = told_of_strays_ || strays > 0;
  points_.arrange(strays > 0 ? kept_ : cloud);
  if (points_.size() < kLeastDistinctPoints)
    throw UnusableCloud(
        source, "holds " + std::to_string(points_.size()) + " distinct points, too few for a body",
        "give at least " + std::to_string(kLeastDistinctPoints) + ", better a thousand");
}

SeenJoints JointExtractor::operator()(const Points& cloud, const std::string& source,
                                      const RngKey& key, const SeenJoints* before) {
  constexpr int kMostLooks = 5;  // who is very small looks larger than life at first
  arrange(cloud, source);
  scale_ = any_size_ && before != nullptr ? scale_for(before->joints) : 1;
  SeenJoints out = look(source, key, before);
  for (int looks = 1; any_size_ && before == nullptr && looks < kMostLooks; ++looks) {
    const double scale = scale_for(out.joints);
    if (scale == scale_) break;
    scale_ = scale;
    out = look(source, key, before);
  }
  return out;
}

/// The answer to the arranged points in the scale of now.
SeenJoints JointExtractor::look(const std::string& source, const RngKey& key,
                                const SeenJoints* before) {
  const auto n = static_cast<size_t>(model_.points());
  const size_t views = centres_.size();
  Tensor batch = Tensor::empty({static_cast<int64_t>(views), static_cast<int64_t>(n), 3});
  const double start = Rng(key).uniform();
  for (size_t s = 0; s < views; ++s) {
    const double offset = start + static_cast<double>(s) / static_cast<double>(views);
    points_.choose(n, offset - std::floor(offset), &chosen_);
    Vec3& centre = centres_[s];
    centre.setZero();
    for (const Point& p : chosen_) centre += p.cast<double>();
    centre /= static_cast<double>(n);
    const Eigen::Matrix3f turn = turn_about_y(heading(s)).cast<float>();
    const float side = mirrored(s) ? -1.0f : 1.0f;
    float* row = batch.data<float>() + s * n * 3;
    for (size_t i = 0; i < n; ++i) {
      Eigen::Map<Point> to(row + 3 * i);
      to = turn * (scale_ * (chosen_[i].cast<double>() - centre)).cast<float>();
      to.x() *= side;
    }
  }
  Context ctx;
  const Tensor remembered = before != nullptr ? past(*before) : Tensor();
  const SkeletonAnswer answer =
      on_host(model_.forward(ctx, {batch.to(device_), remembered.to(device_)}));
  read(answer);
  std::array<int, 2> limbs{};
  if (before != nullptr) {
    keep_sides(*before, &views_);
    if (keep_limbs_) limbs = restage::keep_limbs(*before, &views_);
  }
  SeenJoints out = combined(views_, answer.turns.value.defined(),
                            answer.uncertainty.value.defined(), source, values_);
  remember_sides(before, &out);
  out.exchanged = limbs;
  return out;
}

/// The joints of the frame before in the frame of each view: turned, mirrored, relative to the
/// view's centre.
Tensor JointExtractor::past(const SeenJoints& before) const {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& joint : before.joints) middle += joint / kJoints;
  if (!((middle - centres_[0]).norm() < kLost)) return {};
  Tensor out = Tensor::empty({std::ssize(centres_), kJoints, 4});
  float* to = out.data<float>();
  for (size_t s = 0; s < centres_.size(); ++s) {
    const Mat3 turn = turn_about_y(heading(s));
    for (size_t j = 0; j < kJoints; ++j, to += 4) {
      const size_t from = mirrored(s) ? static_cast<size_t>(kMirror[j]) : j;
      Eigen::Map<Point>{to} = (scale_ * (turn * (before.joints[from] - centres_[s]))).cast<float>();
      if (mirrored(s)) to[0] = -to[0];
      to[3] = static_cast<float>(before.uncertainty ? trust_of(scale_ * (*before.uncertainty)[from])
                                                    : 1.0);
    }
  }
  return out;
}

/// Reads the answer to every view, turned and mirrored back.
void JointExtractor::read(const SkeletonAnswer& answer) {
  const Tensor &joints = answer.joints.value, &turns = answer.turns.value,
               &uncertainty = answer.uncertainty.value;
  for (size_t s = 0; s < views_.size(); ++s) {
    View& view = views_[s];
    const Mat3 back = turn_about_y(-heading(s));
    for (size_t j = 0; j < kJoints; ++j) {
      const size_t row = s * kJoints + (mirrored(s) ? static_cast<size_t>(kMirror[j]) : j);
      const float* x = joints.data<float>() + row * 3;
      view.joints[j] = back * Vec3(mirrored(s) ? -x[0] : x[0], x[1], x[2]) / scale_ + centres_[s];
      view.turns[j].setZero();
      if (turns.defined()) {
        View::Columns own =
            Eigen::Map<const Eigen::Matrix<float, 3, 2>>(turns.data<float>() + row * 6)
                .cast<double>();
        if (mirrored(s)) {  // M R M with M = diag(-1, 1, 1)
          own.row(0) *= -1;
          own.col(0) *= -1;
        }
        view.turns[j] = back * own;
      }
      view.log_uncertainty[j] =
          uncertainty.defined()
              ? static_cast<double>(uncertainty.data<float>()[row]) - std::log(scale_)
              : 0;
    }
  }
}

Joints extract_joints(SkeletonModel& model, const Points& cloud, const std::string& source,
                      const RngKey& key, int samples, double around, bool any_size) {
  return JointExtractor(model, samples, around, false, any_size)(cloud, source, key).joints;
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
