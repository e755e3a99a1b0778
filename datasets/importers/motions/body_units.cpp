#include "datasets/importers/motions/body_units.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autograd/base/format.h"
#include "datasets/doctor/shape.h"
#include "datasets/importers/motions/source_motion.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr double kMostSpeed = 12;  // of a root, metres a second: nobody runs faster
constexpr double kMostRise = 20;   // metres of the feet above or below 0
constexpr double kMostFar = 100;   // metres from a camera or the middle of a room
constexpr double kCentimetre = 0.01, kMillimetre = 0.001;
constexpr double kUsualSpeed = 1;  // metres a second

/// Where a motion takes the root, in what are taken for metres.
struct Travel {
  double speed = 0;  ///< a second; one step in twenty is faster
  double height = 0, height_over_feet = 0, rise = 0, distance = 0;  ///< medians over frames
};

Travel travel_of(const SourceMotion& motion) {
  JointMap map;
  for (int j = 0; j < kJoints; ++j) map[j].joint = j;
  std::vector<double> speeds, heights, over_feet, rises, distances;
  for (size_t f = 0; f < motion.local.size(); ++f) {
    const PosedSkeleton pose = source_pose(motion, map, f);
    const Vec3 root = pose.joints[0];
    double lowest = root.y();
    for (const Vec3& joint : pose.joints) lowest = std::min(lowest, joint.y());
    heights.push_back(root.y());
    over_feet.push_back(root.y() - lowest);
    rises.push_back(lowest);
    distances.push_back(root.norm());
    if (f > 0)
      speeds.push_back((motion.position[f][0] - motion.position[f - 1][0]).norm() * motion.fps);
  }
  return {quantile(speeds, 0.95), median(heights), median(over_feet), median(rises),
          median(distances)};
}

/// Metres a unit that makes somebody's path of it.
double likely_unit(const Travel& t) {
  const double times = t.height / std::max(t.height_over_feet, 1e-3);
  if (times > 40 && times < 250) return kCentimetre;
  if (times > 400 && times < 2500) return kMillimetre;
  const auto off = [&](double unit) { return std::abs(std::log(t.speed * unit / kUsualSpeed)); };
  return off(kCentimetre) < off(kMillimetre) ? kCentimetre : kMillimetre;
}

/// One number, or one a frame; empty for anything else.
std::vector<double> numbers_of(const ArraySource& file, const std::string& name, size_t frames) {
  const NpyArray array = file.array(name);
  const auto count = static_cast<size_t>(array.size());
  if (array.is_text() || (count != 1 && count != frames)) return {};
  std::vector<double> out(frames);
  for (size_t f = 0; f < frames; ++f) out[f] = array[count == 1 ? 0 : static_cast<int64_t>(f)];
  return out;
}

}  // namespace

std::vector<double> metres_of_trans(const ArraySource& file, const BodyParameters& names,
                                    size_t frames, const MotionOptions& options,
                                    ImportReport& report) {
  std::vector<double> out(frames, 1.0);
  if (options.scale > 0) {
    report.fact("scale of " + names.trans, format("%.6g m a unit ({scale})", options.scale));
    out.assign(frames, options.scale);
  } else if (!names.scaling.empty()) {
    out = numbers_of(file, names.scaling, frames);
    if (out.empty() ||
        !std::all_of(out.begin(), out.end(), [](double s) { return s > 1e-9 && s < 1e9; }))
      throw InputError(file.path() + ":" + names.scaling, "is no number to divide a path by",
                       "give metres a unit of " + names.trans + " with {scale}");
    report.fact("scale of " + names.trans,
                format("divided by %.6g (", out[0]) + names.scaling + ", as AIST++ means it)");
    for (double& unit : out) unit = 1 / unit;
  } else if (!names.scale.empty()) {
    const std::vector<double> found = numbers_of(file, names.scale, frames);
    if (found.empty() || std::any_of(found.begin(), found.end(), [](double s) { return s != 1; }))
      report.remark("the file has an array '" + names.scale + "', which is not applied: if " +
                    names.trans + " is not in metres, give metres a unit with {scale}");
  }
  return out;
}

void check_radians(const ArraySource& file, const BodyRotations& rotations, bool force,
                   ImportReport& report) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (rotations.largest <= kTurn * 1.01) return;
  const std::string what = format("turns a joint by %.4g radians, ", rotations.largest);
  if (rotations.largest > 2 * kTurn && !force)
    throw InputError(
        file.path(),
        what + "more than two whole turns, in " + rotations.layout + ": these seem to be degrees",
        "turn them into radians (numpy.deg2rad), or {force} to take them as they are");
  report.remark(what + "more than a whole turn: if these are degrees, turn them into radians");
}

void check_metres(const std::string& where, const SourceMotion& motion,
                  const MotionOptions& options, ImportReport& report) {
  const Travel t = travel_of(motion);
  const bool fast = t.speed > kMostSpeed, risen = std::abs(t.rise) > kMostRise;
  if ((fast || risen) && !options.force) {
    const std::string what = fast ? format("moves the body at %.3g m a second", t.speed)
                                  : format("holds the feet %.3g m %s 0", std::abs(t.rise),
                                           t.rise > 0 ? "above" : "below");
    const double unit = likely_unit(t);
    throw InputError(
        where, what + ", if its units are metres" + (options.scale > 0 ? " times {scale}" : ""),
        options.scale > 0
            ? "give the true metres a unit as {scale}, or {force} to take it as it is"
            : format("give {scale} %.6g if they are %s, or {force} to take it as it is", unit,
                     unit == kCentimetre ? "centimetres" : "millimetres"));
  }
  if (t.distance > kMostFar)
    report.remark(
        format("the body is %.3g m away from the origin: if the units of its path are no "
               "metres, give metres a unit with {scale}",
               t.distance));
}

}  // namespace restage
