#include "nn/models/extraction.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/log.h"
#include "autograd/base/words.h"
#include "nn/geometry/strays.h"

namespace restage {
namespace {

constexpr double kLost = 1;  // metres: nobody moves so far from one frame to the next

constexpr double kUnsure = 0.6;     // confidence below which other ways up are looked at
constexpr double kVerySure = 0.95;  // the same of a first frame
constexpr double kSurer = 0.8;      // another way up is believed if its uncertainty is so much less

/// How unsure an answer is, metres. A trunk that points elsewhere than in the frame before, which
/// was sure, counts as an answer that is half as sure.
double doubt(const SeenJoints& now, const SeenJoints* before) {
  constexpr double kMostTurned = 60 * M_PI / 180, kJump = 2;
  const double unsure = mean_uncertainty(*now.uncertainty);
  if (before == nullptr || !before->uncertainty || confidence(*before->uncertainty) < kUnsure)
    return unsure;
  return trunk_turn(now.joints, before->joints) > kMostTurned ? kJump * unsure : unsure;
}

/// As it is, on either side, on the back and on the face, and upside down.
std::array<Mat3, 6> ways_up() {
  const auto about = [](const Vec3& axis, double quarters) {
    return Mat3(Eigen::AngleAxisd(quarters * M_PI / 2, axis));
  };
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ();
  return {Mat3::Identity(), about(x, 1), about(x, -1), about(z, 1), about(z, -1), about(x, 2)};
}

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

JointExtractor::JointExtractor(SkeletonModel& model, const LookOptions& options)
    : model_(model), device_(device_of(model)), options_(options) {
  stand_up(Mat3::Identity());
}

double JointExtractor::heading(size_t view) const {
  const auto samples = static_cast<size_t>(options_.samples);
  const size_t pairs = (samples + 1) / 2, pair = view / 2;
  return options_.around * ((static_cast<double>(pair) + 0.5) / static_cast<double>(pairs) - 0.5);
}

/// From now on the cloud is shown turned so.
void JointExtractor::stand_up(const Mat3& upright) {
  upright_ = upright;
  sights_.clear();
  for (size_t s = 0; s < static_cast<size_t>(options_.samples); ++s)
    sights_.push_back({turn_about_y(heading(s)) * upright,
                       upright.transpose() * turn_about_y(-heading(s)), s % 2 == 1});
}

void JointExtractor::arrange(const Points& cloud, const std::string& source) {
  for (const Point& p : cloud)
    if (!p.allFinite())
      throw UnusableCloud(source, "holds a coordinate that is not finite", "remove such points");
  const size_t strays = leave_out_strays(cloud, &kept_);
  if (strays > 0 && !told_of_strays_)
    log_warning(source + ": left out " + counted(strays, "point") +
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
  scale_ = options_.any_size && before != nullptr ? scale_for(before->joints) : 1;
  stand_up(before == nullptr || before->upright.isIdentity(0) ? Mat3(Mat3::Identity())
                                                              : standing_turn(before->joints));
  const auto look_well = [&] {
    const SeenJoints first = look(source, key, before);
    return options_.any_way_up && first.uncertainty ? surest(first, source, key, before) : first;
  };
  SeenJoints out = look_well();
  for (int looks = 1; options_.any_size && before == nullptr && looks < kMostLooks; ++looks) {
    const double scale = scale_for(out.joints);
    if (scale == scale_) break;
    scale_ = scale;
    out = look_well();
  }
  return out;
}

/// `first`, or the answer to the cloud the other way up that is clearly surer.
SeenJoints JointExtractor::surest(const SeenJoints& first, const std::string& source,
                                  const RngKey& key, const SeenJoints* before) {
  // Who is seen for the first time upside down can look like somebody: more has to be sure.
  const bool anew = confidence(*first.uncertainty) < (before == nullptr ? kVerySure : kUnsure);
  const Mat3 now = upright_,
             other = anew ? surest_way_up(source, key) : standing_turn(first.joints);
  const double apart = Eigen::AngleAxisd(other * now.transpose()).angle();
  stand_up(now);
  if (apart < kTiltedTrunk) return first;
  stand_up(other);
  const SeenJoints second = look(source, key, before);
  if (doubt(second, before) < kSurer * doubt(first, before)) return second;
  stand_up(now);
  return first;
}

/// The turn that lets somebody stand, by the surest of six orientations.
Mat3 JointExtractor::surest_way_up(const std::string& source, const RngKey& key) {
  const std::array<Mat3, 6> ways = ways_up();
  sights_.clear();
  for (const Mat3& way : ways)
    for (const bool mirrored : {false, true}) {
      const double turn = mirrored ? M_PI / 2 : 0;
      sights_.push_back(
          {turn_about_y(turn) * way, way.transpose() * turn_about_y(-turn), mirrored});
    }
  read(ask(key, nullptr));
  size_t best = 0;
  double least = 0;
  for (size_t w = 0; w < ways.size(); ++w) {
    double logs = 0;
    for (size_t v = 2 * w; v < 2 * w + 2; ++v)
      for (const double log : views_[v].log_uncertainty) logs += log / (2 * kJoints);
    if (w == 0 || logs < least) best = w, least = logs;
  }
  std::copy_n(views_.begin() + static_cast<std::ptrdiff_t>(2 * best), 2, views_.begin());
  views_.resize(2);
  return standing_turn(combined(views_, false, true, source, values_).joints);
}

/// The answer to the arranged points in the scale and the way up of now.
SeenJoints JointExtractor::look(const std::string& source, const RngKey& key,
                                const SeenJoints* before) {
  const SkeletonAnswer answer = ask(key, before);
  read(answer);
  std::array<int, 2> limbs{};
  if (before != nullptr) {
    keep_sides(*before, &views_);
    if (options_.keep_limbs) limbs = restage::keep_limbs(*before, &views_);
  }
  SeenJoints out = combined(views_, answer.turns.value.defined(),
                            answer.uncertainty.value.defined(), source, values_);
  remember_sides(before, &out);
  out.exchanged = limbs;
  out.upright = upright_;
  return out;
}

/// The model's answer to the arranged points as sights_ show them.
SkeletonAnswer JointExtractor::ask(const RngKey& key, const SeenJoints* before) {
  const auto n = static_cast<size_t>(model_.points());
  const size_t views = sights_.size();
  Tensor batch = Tensor::empty({static_cast<int64_t>(views), static_cast<int64_t>(n), 3});
  const double start = Rng(key).uniform();
  centres_.resize(views);
  for (size_t s = 0; s < views; ++s) {
    const double offset = start + static_cast<double>(s) / static_cast<double>(views);
    points_.choose(n, offset - std::floor(offset), &chosen_);
    Vec3& centre = centres_[s];
    centre.setZero();
    for (const Point& p : chosen_) centre += p.cast<double>();
    centre /= static_cast<double>(n);
    const Eigen::Matrix3f turn = sights_[s].turn.cast<float>();
    const float side = sights_[s].mirrored ? -1.0f : 1.0f;
    float* row = batch.data<float>() + s * n * 3;
    for (size_t i = 0; i < n; ++i) {
      Eigen::Map<Point> to(row + 3 * i);
      to = turn * (scale_ * (chosen_[i].cast<double>() - centre)).cast<float>();
      to.x() *= side;
    }
  }
  Context ctx;
  const Tensor remembered = before != nullptr ? past(*before) : Tensor();
  return on_host(model_.forward(ctx, {batch.to(device_), remembered.to(device_)}));
}

/// The joints of the frame before in the frame of each view: turned, mirrored, relative to the
/// view's centre.
Tensor JointExtractor::past(const SeenJoints& before) const {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& joint : before.joints) middle += joint / kJoints;
  if (!((middle - centres_[0]).norm() < kLost)) return {};
  Tensor out = Tensor::empty({std::ssize(centres_), kJoints, 4});
  float* to = out.data<float>();
  for (size_t s = 0; s < sights_.size(); ++s) {
    const auto& [turn, back, mirrored] = sights_[s];
    for (size_t j = 0; j < kJoints; ++j, to += 4) {
      const size_t from = mirrored ? static_cast<size_t>(kMirror[j]) : j;
      Eigen::Map<Point>{to} = (scale_ * (turn * (before.joints[from] - centres_[s]))).cast<float>();
      if (mirrored) to[0] = -to[0];
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
  views_.resize(sights_.size());
  for (size_t s = 0; s < views_.size(); ++s) {
    View& view = views_[s];
    const auto& [turn, back, mirrored] = sights_[s];
    for (size_t j = 0; j < kJoints; ++j) {
      const size_t row = s * kJoints + (mirrored ? static_cast<size_t>(kMirror[j]) : j);
      const float* x = joints.data<float>() + row * 3;
      view.joints[j] = back * Vec3(mirrored ? -x[0] : x[0], x[1], x[2]) / scale_ + centres_[s];
      view.turns[j].setZero();
      if (turns.defined()) {
        View::Columns own =
            Eigen::Map<const Eigen::Matrix<float, 3, 2>>(turns.data<float>() + row * 6)
                .cast<double>();
        if (mirrored) {  // M R M with M = diag(-1, 1, 1)
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
                      const RngKey& key, const LookOptions& options) {
  return JointExtractor(model, options)(cloud, source, key).joints;
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
