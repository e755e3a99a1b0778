// Joints of single clouds: the points are put in order, sampled, turned, centred and given to the
// extractor.
#pragma once

#include <array>
#include <optional>

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"
#include "nn/models/skeleton.h"

namespace restage {

inline constexpr size_t kLeastDistinctPoints = 64;

/// Headings over which an extractor's views of a cloud are spread, radians.
inline constexpr double kAllAround = 6.283185307179586;
inline constexpr double kRestPoses = 0.7;  ///< of a target, which faces +z

/// What an extractor answers to a cloud.
struct SeenJoints {
  SeenJoints() = default;
  SeenJoints(const Joints& known) : joints(known) {}
  Joints joints{};  ///< metres
  // Where the model gives them (SkeletonOutput); of several views the mean.
  std::optional<Rotations> turns;                          ///< from the T-pose
  std::optional<std::array<double, kJoints>> uncertainty;  ///< metres
};
SeenJoints turned(const Mat3& turn, const SeenJoints& seen);

/// The 22 joints of clouds. Keeps its working memory between clouds.
class JointExtractor {
 public:
  /// `samples` > 1 takes several views of a cloud, each a random choice of its points, turned about
  /// y by another part of `around`, every second one mirrored; of their answers the mean, from
  /// eight on without a quarter at either end of each coordinate. An extractor errs differently on
  /// each (docs/method.md, "Views").
  explicit JointExtractor(SkeletonModel& model, int samples = 1, double around = kAllAround);
  /// Metres, in the cloud's frame. Points are sorted lexicographically first and exact repeats
  /// left out, so neither their order in a file nor pixels without depth matter to the last bit.
  /// `before`: the answer to the frame before, in the same frame; null where there was none. It is
  /// forgotten where the cloud is more than a metre from it.
  /// InputError naming `source`: fewer than 64 distinct points, values that are not finite.
  SeenJoints operator()(const Points& cloud, const std::string& source, const RngKey& key,
                        const SeenJoints* before = nullptr);

 private:
  void sort(const Points& cloud, const std::string& source);
  void choose(const RngKey& key);
  double heading(size_t view) const;
  Tensor past(const SeenJoints& before) const;
  Rotations mean_turns(const Tensor& turns) const;
  std::array<double, kJoints> mean_uncertainty(const Tensor& logs) const;

  SkeletonModel& model_;
  double around_;
  Points sorted_, chosen_;
  std::vector<Vec3> centres_;
  std::vector<Joints> answers_;
  std::vector<double> values_;  // one coordinate of each
};

/// The joints of one cloud.
Joints extract_joints(SkeletonModel& model, const Points& cloud, const std::string& source,
                      const RngKey& key, int samples = 1, double around = kAllAround);

/// `n` points of a surface, uniform by area; of a mesh without faces, its vertices as they are.
Points surface_points(const Mesh& mesh, size_t n, const RngKey& key);

}  // namespace restage
