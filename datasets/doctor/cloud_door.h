// The door through which every cloud comes to a system, whoever brings the cloud: a file, a camera,
// a program in Python.
#pragma once

#include <functional>
#include <optional>

#include "datasets/doctor/examine.h"

namespace restage {

/// From a source's units and axes to metres, y up.
class ToOurs {
 public:
  /// InputError naming --scale or --source-up: out of range, no axis.
  ToOurs(double scale, const std::string& up);
  /// Points of a surface, which keep their order.
  void operator()(Points& points) const;
  /// A cloud: leaves out points that are far from all others (nn/geometry/strays.h), and returns
  /// how many.
  size_t clean(Points& cloud) const;

 private:
  float scale_;
  Eigen::Matrix3f turn_;
};

/// Looks at clouds before a system is given them: at their size and distance (check_frame()), and
/// at the axis that is up, a second person and floors (SourceWatch).
class CloudDoor {
 public:
  /// `force`: takes all clouds as they are. `looked_at`: somebody has looked at the first clouds
  /// (check_source()), so the door begins to look when one cannot be used.
  CloudDoor(SourceFrame given, bool force, bool looked_at = false);

  /// Takes the next cloud (metres, y up), which `where` names, and calls `push()`, which gives the
  /// cloud to the system. UnusableCloud, of `push` too: this cloud cannot be used, and the system
  /// misses it. Other InputErrors are those of SourceWatch::look().
  void pass(const Points& cloud, const std::string& where, const std::function<void()>& push);
  /// SourceWatch::hopeless()
  bool hopeless() const { return watch_ && watch_->hopeless(); }

 private:
  const SourceFrame given_;
  const bool force_;
  std::optional<SourceWatch> watch_;
  bool clear_;  ///< the last cloud could be used
};

}  // namespace restage
