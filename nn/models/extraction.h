// Joints of single clouds: the points are put in order, sampled, turned, centred and given to the
// extractor.
#pragma once

#include "autograd/base/rng.h"
#include "nn/geometry/body.h"
#include "nn/models/even_points.h"
#include "nn/models/skeleton.h"
#include "nn/models/views.h"

namespace restage {

inline constexpr size_t kLeastDistinctPoints = 64;
/// Of a person's points in a frame: with fewer, an extractor says that it is surer than it is,
/// where one side is seen (docs/real_scans.md, "Sparse clouds").
inline constexpr size_t kEnoughToTrust = 400;

/// Headings over which an extractor's views of a cloud are spread, radians.
inline constexpr double kAllAround = 6.283185307179586;
inline constexpr double kRestPoses = 0.7;  ///< the same for a target, which faces +z

/// How an extractor looks at clouds.
struct LookOptions {
  /// More than one: several views of a cloud. Each view has other points of the cloud and is turned
  /// about y by another part of `around`; every second view is mirrored. An extractor errs
  /// differently on each view; the answers are combined() (docs/method.md, "Views").
  int samples = 1;
  double around = kAllAround;
  bool keep_limbs = false;  ///< see keep_limbs()
  /// A person who is smaller or larger than the adults of trainings is shown in an adult's size:
  /// the frame before says how tall somebody is, or a first answer.
  bool any_size = false;
  /// Who lies, leans or stands on the hands is shown upright, as trainings show people: the frame
  /// before says where the trunk points; in the first frame, and where the answer is unsure, the
  /// surest of six orientations does (docs/method.md, "Any way up"). Needs a model that says how
  /// sure it is.
  bool any_way_up = false;
};

/// The 22 joints of clouds. Keeps its working memory between clouds.
class JointExtractor {
 public:
  explicit JointExtractor(SkeletonModel& model, const LookOptions& options = {});
  /// Metres, in the cloud's frame. Points are sorted first and exact repeats left out, so neither
  /// their order in a file nor pixels without depth matter to the last bit. `key` says where the
  /// choices of points begin.
  /// `before`: the answer to the frame before, in the same frame; null where there was none. It is
  /// forgotten where the cloud is more than a metre from it.
  /// A few points that lie far from all others are left out (nn/geometry/strays.h); a warning says
  /// so once. UnusableCloud naming `source`: fewer than 64 distinct points, values that are not
  /// finite.
  SeenJoints operator()(const Points& cloud, const std::string& source, const RngKey& key,
                        const SeenJoints* before = nullptr);

 private:
  /// How a view shows the cloud: turned, then mirrored (x to -x) if it is so.
  struct Sight {
    Mat3 turn, back;
    bool mirrored;
  };

  void arrange(const Points& cloud, const std::string& source);
  void stand_up(const Mat3& upright);
  SeenJoints look(const std::string& source, const RngKey& key, const SeenJoints* before);
  SeenJoints surest(const SeenJoints& first, const std::string& source, const RngKey& key,
                    const SeenJoints* before);
  Mat3 surest_way_up(const std::string& source, const RngKey& key);
  SkeletonAnswer ask(const RngKey& key, const SeenJoints* before);
  double heading(size_t view) const;
  Tensor past(const SeenJoints& before) const;
  void read(const SkeletonAnswer& answer);

  SkeletonModel& model_;
  Device device_;  // the model's
  LookOptions options_;
  double scale_ = 1;  // from metres to what the model is shown
  Mat3 upright_ = Mat3::Identity();
  std::vector<Sight> sights_;
  EvenPoints points_;
  Points chosen_, kept_;
  bool told_of_strays_ = false;
  std::vector<Vec3> centres_;
  std::vector<View> views_;
  std::vector<double> values_;  // room for one coordinate of each view
};

/// The joints of one cloud.
Joints extract_joints(SkeletonModel& model, const Points& cloud, const std::string& source,
                      const RngKey& key, const LookOptions& options = {});

/// `n` points of a surface, uniform by area; of a mesh without faces, its vertices as they are.
Points surface_points(const Mesh& mesh, size_t n, const RngKey& key);

}  // namespace restage
