// Which points of a body its 22 joints are. Every body model has hips, knees and a spine, but not
// at the same places: SMPL's hips lie 6 cm from MakeHuman's, its spine joints up to 13 cm. So
// numbers of two definitions must not be mixed (docs/joints.md).
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

/// The name of a definition: "makehuman" (the shipped weights, the open benchmark), "smpl" (SMPL,
/// SMPL-H, SMPL-X, AMASS), "builtin" (the built-in people), or a name of the user's own. Empty:
/// nobody has said, as of a character's own rig.
using JointDefinition = std::string;

/// A name as a file gives it. InputError naming `where` if it is none.
JointDefinition checked_definition(const std::string& name, const std::string& where);

/// The joints in the middle and on the left. Those on the right are their mirror images.
inline constexpr std::array<int, 14> kMiddleAndLeft = {
    kPelvis,   kLeftHip, kSpine1,     kLeftKnee, kSpine2,       kLeftAnkle, kSpine3,
    kLeftFoot, kNeck,    kLeftCollar, kHead,     kLeftShoulder, kLeftElbow, kLeftWrist};
/// Each of them as a weighted sum of all joints; the weights of a row sum to 1.
using JointTable = std::array<std::array<double, kJoints>, kMiddleAndLeft.size()>;
extern const JointTable kMakehumanToSmpl, kSmplToMakehuman;

/// Takes joints of one definition to another: each new joint is a fixed weighted sum of the old
/// ones, so turning, moving and resizing a person commute with it. Of makehuman and smpl the sums
/// were fitted on MakeHuman bodies in recorded poses; held-out ones are 7 mm (to smpl) and 8 mm
/// (back) from where they should be, against 38 mm before (docs/joints.md). Metres in, metres out.
class JointConversion {
 public:
  /// InputError naming `where` the joints come from: no conversion is known between the two.
  JointConversion(const JointDefinition& from, const JointDefinition& to, const std::string& where);

  Joints operator()(const Joints& joints) const;
  /// Frames of 22 joints, 66 numbers each, in place.
  void convert(std::span<double> frames) const;

 private:
  Eigen::Matrix<double, kJoints, kJoints> rows_;
};

struct NamedDefinition {
  JointDefinition definition;
  std::string where;
};
/// The one that all of them have. Empty ones are passed over; empty if all are. InputError with the
/// words `mend` if two differ; a warning if one of them is that of the built-in people, who are
/// there for trying things out.
JointDefinition common_definition(
    const std::vector<NamedDefinition>& all,
    const std::string& mend = "use one definition of joints (docs/joints.md)");

}  // namespace restage
