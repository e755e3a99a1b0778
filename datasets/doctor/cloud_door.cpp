#include "datasets/doctor/cloud_door.h"

#include "datasets/importers/motions/axis.h"
#include "nn/geometry/strays.h"
#include "nn/models/views.h"

namespace restage {
namespace {

Eigen::Matrix3f turn_of(const std::string& up) {
  const Axis axis = parse_axis(up, "{source-up}");
  if (axis == Axis::automatic)
    throw InputError("", "{source-up} 'auto' is not known here", "give x, -x, y, -y, z or -z");
  return upright(axis).cast<float>();
}

}  // namespace

ToOurs::ToOurs(double scale, const std::string& up)
    : scale_(static_cast<float>(scale)), turn_(turn_of(up)) {
  if (!(scale >= kLeastScale && scale <= kMostScale))
    throw InputError("", "{scale} is out of range", "give metres per unit, 1e-9 to 1e6");
}

void ToOurs::operator()(Points& points) const {
  const bool upright = turn_.isIdentity();
  for (Point& p : points) {
    if (!upright) p = turn_ * p;
    p *= scale_;
  }
}

size_t ToOurs::clean(Points& cloud) const {
  (*this)(cloud);
  Points kept;
  const size_t strays = leave_out_strays(cloud, &kept);
  if (strays > 0) cloud = std::move(kept);
  return strays;
}

CloudDoor::CloudDoor(SourceFrame given, bool force, bool looked_at)
    : given_(std::move(given)), force_(force), clear_(looked_at) {
  if (!looked_at) watch_.emplace(given_);
}

void CloudDoor::pass(const Points& cloud, const std::string& where,
                     const std::function<void()>& push) {
  try {
    if (!force_) {
      check_frame(cloud, where);
      if (watch_) watch_->look(cloud, where);
    }
    push();
  } catch (const UnusableCloud&) {
    if (clear_) watch_.emplace(given_, true);  // somebody may have come
    clear_ = false;
    throw;
  }
  clear_ = true;
}

}  // namespace restage
