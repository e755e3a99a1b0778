#include "datasets/importers/joints/clean.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "autograd/base/format.h"
#include "datasets/doctor/shape.h"
#include "datasets/importers/motions/axis.h"
#include "datasets/readers/errors.h"

namespace restage::joints_detail {
namespace {

using Place = std::optional<Vec3>;

/// The places of all frames: one row for each place.
std::vector<std::vector<Place*>> tracks_of(std::vector<MappedFrame>& frames) {
  std::vector<std::vector<Place*>> out;
  for (MappedFrame& frame : frames) {
    size_t i = 0;
    each_place(frame, [&](Place& x) {
      if (out.size() == i) out.emplace_back();
      out[i++].push_back(&x);
    });
  }
  return out;
}

/// Straight lines over gaps of up to `most` frames; a trunk's first and last place also stays.
size_t bridge(std::vector<Place*>& track, size_t most, bool trunk) {
  size_t filled = 0;
  size_t last = track.size();  // none yet
  for (size_t f = 0; f < track.size(); ++f) {
    if (!*track[f]) continue;
    const size_t gap = last < track.size() ? f - last - 1 : f;
    if (last < track.size() && gap > 0 && (trunk || gap <= most))
      for (size_t k = last + 1; k < f; ++k, ++filled)
        *track[k] = **track[last] + static_cast<double>(k - last) / static_cast<double>(f - last) *
                                        (**track[f] - **track[last]);
    if (last == track.size() && trunk)
      for (size_t k = 0; k < f; ++k, ++filled) *track[k] = **track[f];
    last = f;
  }
  if (trunk && last < track.size())
    for (size_t k = last + 1; k < track.size(); ++k, ++filled) *track[k] = **track[last];
  return filled;
}

bool any_of(const MappedFrame& frame) {
  bool out = false;
  each_place(frame, [&](const Place& x) { out = out || x; });
  return out;
}

void bridge_gaps(std::vector<MappedFrame>& frames, double fps, ImportReport& report) {
  constexpr double kMost = 0.5;  // seconds
  const auto most = static_cast<size_t>(std::lround(kMost * fps));
  size_t missing = 0, run = 0, longest = 0;
  for (const MappedFrame& frame : frames) {
    run = any_of(frame) ? 0 : run + 1;
    missing += run > 0;
    longest = std::max(longest, run);
  }
  auto tracks = tracks_of(frames);
  size_t filled = 0, trunk = 0;
  for (size_t i = 0; i < tracks.size(); ++i) {
    const size_t n = bridge(tracks[i], most, is_of_trunk(i));
    filled += n;
    if (is_of_trunk(i)) trunk = std::max(trunk, n - std::min(n, missing));
  }
  if (filled > 0) report.fact("gaps", cat(counted(filled, "place"), " of joints bridged"));
  if (longest > most)
    report.remark(cat("in ", counted(longest, "frame"),
                      " in a row no joint is known: the motion goes straight there"));
  if (trunk > most)
    report.remark(cat("in ", counted(trunk, "frame"),
                      " a hip or a shoulder is not known: the trunk goes straight there"));
}

Axis find_up(const std::vector<MappedFrame>& frames, Axis given, ImportReport& report) {
  if (given != Axis::automatic) {
    report.fact("up", to_string(given) + ", as given");
    return given;
  }
  Vec3 up = Vec3::Zero();
  for (const MappedFrame& frame : frames) {
    const SeenFrame& x = frame.joints;
    const std::optional<Trunk> trunk = trunk_of(x);
    if (!trunk) continue;
    up += trunk->axes.col(1);
    // Who bends forward or sits has the feet below all the same.
    for (const int ankle : {kLeftAnkle, kRightAnkle})
      if (const auto& at = x[static_cast<size_t>(ankle)]) up += (trunk->origin - *at).normalized();
  }
  const Axis out = axis_near(up);
  report.fact("up", cat(to_string(out), ", from ankles over hips to shoulders"));
  const double off = angle_between(up, vector_of(out)) * (180 / M_PI);
  constexpr double kSeen = 20;
  if (off > kSeen)
    report.remark(
        format("the body leans by %.0f degrees on average: if it stands, turn the joints "
               "so that an axis points up, or say which one does ({up})",
               off));
  return out;
}

double median_leg(const std::vector<MappedFrame>& frames) {
  std::vector<double> legs;
  for (const MappedFrame& frame : frames)
    for (const auto& [hip, knee, ankle] : {std::array{kLeftHip, kLeftKnee, kLeftAnkle},
                                           std::array{kRightHip, kRightKnee, kRightAnkle}}) {
      const SeenFrame& x = frame.joints;
      const auto &a = x[static_cast<size_t>(hip)], &b = x[static_cast<size_t>(knee)],
                 &c = x[static_cast<size_t>(ankle)];
      if (a && b && c) legs.push_back((*a - *b).norm() + (*b - *c).norm());
    }
  if (legs.empty()) return 0;
  return median(std::move(legs));
}

double find_scale(const std::vector<MappedFrame>& frames, double given, ImportReport& report) {
  constexpr double kLeastLeg = 0.05, kMostLeg = 20;  // metres, of dwarfs and giants
  double leg = median_leg(frames);
  std::string what = "a leg";
  if (!(leg > 0)) {  // half a body
    constexpr double kLegOfTrunk = 1.6;
    double sum = 0;
    for (const MappedFrame& frame : frames) sum += trunk_length(frame.joints);
    leg = kLegOfTrunk * sum / static_cast<double>(frames.size());
    what = "a leg, by the trunk,";
  }
  const auto says = [&](double metres, const std::string& why) {
    report.fact("units", cat(unit_name(metres), ", ", why, ": ", what, " of ", format("%.4g", leg),
                             " units is ", format("%.2f", leg * metres), " m"));
    return metres;
  };
  if (given != 0) {
    const double metres = leg * given;
    if (!(metres >= kLeastLeg && metres <= kMostLeg))
      throw InputError(report.file,
                       cat("{scale} ", format("%g", given), " makes ", what, " of ",
                           format("%.3g", metres), " m"),
                       format("give the metres of a unit, such as %.3g", 0.8 / leg));
    return says(given, "as given");
  }
  if (const LegUnit* unit = unit_of_leg(leg)) return says(unit->metres, "by the legs");
  constexpr double kFoot = 0.3048, kShortLeg = 0.6, kLongLeg = 1.2;  // metres
  const bool feet = leg * kFoot > kShortLeg && leg * kFoot < kLongLeg;
  if (feet)
    throw InputError(report.file,
                     cat(what, " of ", format("%.4g", leg), " units is no person's in metres"),
                     "if these are feet, give {scale} ft; else the metres of a unit");
  throw InputError(
      report.file,
      cat(what, " of ", format("%.4g", leg), " units is no person's in any known unit"),
      format("give the metres of a unit with {scale}, such as %.3g, which makes the leg "
             "0.8 m",
             0.8 / leg));
}

/// How far knees, toes and nose point forward, of a trunk whose left and right are as they are
/// called: negative of somebody whose sides are exchanged, or whose axes are left-handed.
double forwardness(const std::vector<MappedFrame>& frames) {
  double sum = 0;
  for (const MappedFrame& frame : frames) {
    const SeenFrame& x = frame.joints;
    const std::optional<Trunk> trunk = trunk_of(x);
    if (!trunk) continue;
    const auto add = [&](const Place& from, const Place& to, double weight) {
      if (from && to) sum += weight * trunk->axes.col(2).dot(*to - *from);
    };
    for (const auto& [hip, knee, ankle, foot] :
         {std::array{kLeftHip, kLeftKnee, kLeftAnkle, kLeftFoot},
          std::array{kRightHip, kRightKnee, kRightAnkle, kRightFoot}}) {
      const auto &h = x[static_cast<size_t>(hip)], &a = x[static_cast<size_t>(ankle)];
      if (h && a) add(Vec3(0.5 * (*h + *a)), x[static_cast<size_t>(knee)], 1);
      add(a, x[static_cast<size_t>(foot)], 1);
    }
    if (frame.left_ear && frame.right_ear)
      add(Vec3(0.5 * (*frame.left_ear + *frame.right_ear)), frame.nose, 1);
  }
  return sum / static_cast<double>(std::max<size_t>(1, frames.size()));
}

void check_sides(const std::vector<MappedFrame>& frames, bool force, ImportReport& report) {
  constexpr double kSure = -0.05;  // metres
  if (forwardness(frames) > kSure) return;
  const std::string wrong =
      "knees and toes point backwards: left and right are exchanged, or the axes are left-handed";
  if (!force)
    throw InputError(
        report.file, wrong,
        "negate x of all joints, or exchange left and right; {force} takes it as it is");
  report.remark(wrong);
}

/// Five lengths of the trunk; 0 if it is never known.
double reach_of(const std::vector<MappedFrame>& frames) {
  constexpr double kReach = 5;  // lengths of the trunk
  std::vector<double> trunks;
  for (const MappedFrame& frame : frames)
    if (const double trunk = trunk_length(frame.joints); trunk > 0) trunks.push_back(trunk);
  return trunks.empty() ? 0 : kReach * median(std::move(trunks));
}

/// Joints that are further from the hips than anybody reaches are not known.
void drop_all_strays(std::vector<MappedFrame>& frames, double reach, ImportReport& report) {
  size_t dropped = 0;
  for (MappedFrame& frame : frames) dropped += drop_strays(frame, reach);
  if (dropped > 0)
    report.remark(cat(counted(dropped, "place"),
                      " of joints further away than anybody reaches: taken for not known"));
}

/// InputError for a joint that is further from the hips than anybody reaches.
void check_places(const std::vector<MappedFrame>& frames, const ImportReport& report) {
  constexpr double kReach = 100;  // metres: stray ones are noise, others are no numbers of metres
  for (size_t f = 0; f < frames.size(); ++f) {
    const SeenFrame& x = frames[f].joints;
    for (size_t j = 0; j < kJoints; ++j)
      if (x[j] && !((*x[j] - *x[kLeftHip]).norm() < kReach && x[j]->norm() < 1e9))
        throw InputError(report.file,
                         cat("frame ", f, " has the ", kJointNames[j], " ",
                             format("%.3g", (*x[j] - *x[kLeftHip]).norm()), " m from the hip"),
                         "write NaN where a joint is not known");
  }
}

/// Averages over neighbours, Gaussian of `sigma` frames.
void smooth(std::vector<MappedFrame>& frames, double sigma) {
  const auto reach = static_cast<int64_t>(std::ceil(3 * sigma));
  for (auto& track : tracks_of(frames)) {
    std::vector<Place> out(track.size());
    const auto n = static_cast<int64_t>(track.size());
    for (int64_t f = 0; f < n; ++f) {
      if (!*track[static_cast<size_t>(f)]) continue;
      // As far to one side as to the other, so that what moves evenly stays.
      const int64_t side = std::min({reach, f, n - 1 - f});
      Vec3 sum = Vec3::Zero();
      double weights = 0;
      for (int64_t k = -side; k <= side; ++k) {
        const auto &a = *track[static_cast<size_t>(f + k)], &b = *track[static_cast<size_t>(f - k)];
        if (!a || !b) continue;
        const double w = std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma));
        sum += w * *a, weights += w;
      }
      out[static_cast<size_t>(f)] = sum / weights;
    }
    for (size_t f = 0; f < track.size(); ++f) *track[f] = out[f];
  }
}

void calm(CleanJoints& joints, ImportReport& report) {
  constexpr double kSteady = 0.003, kFull = 0.012;  // metres
  constexpr double kMost = 1.6;                     // frames at 30 fps: more blurs quick limbs
  const double noise = unsteadiness(joints.frames);
  if (noise < kSteady) return;
  const double sigma = std::clamp(noise / kFull, 0.5, kMost) * joints.fps / kFps;
  smooth(joints.frames, sigma);
  joints.sigma = sigma;
  report.fact("noise",
              format("bones change by %.0f mm: their lengths are held, and places averaged "
                     "over about %.1f s",
                     1e3 * noise, 2 * sigma / joints.fps));
}

double find_fps(double of_file, double given, ImportReport& report) {
  const auto possible = [](double fps) { return fps >= 1 && fps <= 2000; };
  if (given != 0 && !possible(given))
    throw InputError("", "{fps} is out of range", "give frames per second, 1 to 2000");
  if (of_file != 0 && given == 0 && !possible(of_file))
    throw InputError(report.file, format("says %g frames a second", of_file),
                     "give the true rate with {fps}");
  if (given > 0) {
    report.fact("frame rate", format("%g fps, as given", given));
    return given;
  }
  if (of_file > 0) {
    report.fact("frame rate", format("%g fps, as the file says", of_file));
    return of_file;
  }
  report.remark(
      format("the file says no frame rate: taken for %g fps ({fps} N if it is another)", kFps));
  return kFps;
}

/// Whether the middle of the hips never goes anywhere though the body moves: joints relative to the
/// root.
bool stays_in_place(const std::vector<MappedFrame>& frames) {
  constexpr double kStill = 0.01, kMoving = 0.05;  // metres
  double root = 0, others = 0;
  const SeenFrame& first = frames[0].joints;
  const auto middle = [](const SeenFrame& x) { return Vec3(0.5 * (*x[kLeftHip] + *x[kRightHip])); };
  for (const MappedFrame& frame : frames) {
    root = std::max(root, (middle(frame.joints) - middle(first)).norm());
    for (size_t j = 0; j < kJoints; ++j)
      if (frame.joints[j] && first[j])
        others = std::max(others, (*frame.joints[j] - *first[j]).norm());
  }
  return root < kStill && others > kMoving;
}

}  // namespace

bool is_of_trunk(size_t track) {
  return track == kLeftHip || track == kRightHip || track == kLeftShoulder ||
         track == kRightShoulder;
}

size_t drop_strays(MappedFrame& frame, double reach) {
  // Of two hips that are far from each other, the one that is far from the shoulders strays.
  const Place middle =
      frame.joints[kLeftShoulder] ? frame.joints[kLeftShoulder] : frame.joints[kRightShoulder];
  if (!middle || !(reach > 0)) return 0;
  size_t far = 0, all = 0;
  each_place(frame, [&](const Place& x) {
    if (x) far += (*x - *middle).norm() > reach ? 1 : 0, ++all;
  });
  if (far == 0 || 2 * far > all) return 0;  // the shoulder itself strays: bones will tell
  each_place(frame, [&](Place& x) {
    if (x && (*x - *middle).norm() > reach) x.reset();
  });
  return far;
}

void to_ours(MappedFrame& frame, const JointFrame& from) {
  each_place(frame, [&](Place& x) {
    if (x) *x = from.scale * (from.turn * *x);
  });
}

double unsteadiness(const std::vector<MappedFrame>& frames) {
  std::vector<double> deviations;
  for (size_t j = 1; j < kJoints; ++j) {
    const auto p = static_cast<size_t>(kParents[j]);
    double sum = 0, squares = 0, n = 0;
    for (const MappedFrame& frame : frames)
      if (frame.joints[j] && frame.joints[p]) {
        const double d = (*frame.joints[j] - *frame.joints[p]).norm();
        sum += d, squares += d * d, n += 1;
      }
    if (n > 1) deviations.push_back(std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))));
  }
  if (deviations.empty()) return 0;
  return median(std::move(deviations));
}

CleanJoints clean_joints(const JointRecording& recording, const MotionOptions& options,
                         ImportReport& report) {
  CleanJoints out;
  if (!recording.gap.empty() && !options.force)
    throw InputError(report.file, recording.gap,
                     "cut it there, or {force}, which goes straight from one side to the other");
  if (!recording.gap.empty()) report.remark(recording.gap);
  for (const FileFrame& frame : recording.frames)
    out.frames.push_back(mapped(frame, recording.layout));
  out.fps = find_fps(recording.fps, options.fps, report);
  out.from.reach = reach_of(out.frames);
  drop_all_strays(out.frames, out.from.reach, report);
  bridge_gaps(out.frames, out.fps, report);
  out.from.turn = upright(find_up(out.frames, options.rest.up, report));
  out.from.scale = find_scale(out.frames, options.scale, report);
  for (MappedFrame& frame : out.frames) to_ours(frame, out.from);
  check_places(out.frames, report);
  check_sides(out.frames, options.force, report);
  out.in_place = stays_in_place(out.frames);
  calm(out, report);
  return out;
}

}  // namespace restage::joints_detail
