#include "datasets/importers/motions/amass.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <tuple>

#include "autograd/base/format.h"
#include "datasets/importers/motions/body_rotations.h"
#include "datasets/importers/motions/body_units.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr double kMaxSeconds = 35000;
constexpr const char* kRates[] = {"mocap_framerate", "mocap_frame_rate", "mocap_fps", "fps",
                                  "frame_rate",      "framerate"};

/// Text of a scalar; empty where there is none, or where it is no plain text, which is remarked:
/// some files keep it as a Python object.
std::string text_of(const ArraySource& file, const char* name, ImportReport& report) {
  if (!file.has(name)) return "";
  try {
    if (!file.header(name).is_text()) return "";
    return WordLines::quoted(lower_case(file.array(name).text()));
  } catch (const InputError& e) {
    report.remark(cat(name, " counts as not stated: ", e.what()));
    return "";
  }
}

// ---- one file ----------------------------------------------------------------------------------

/// Which model was moved; nothing if the 22 joints are those of any.
std::optional<SmplFamily> family_of(const ArraySource& file, const BodyRotations& rotations,
                                    ImportReport& report) {
  const std::string type = text_of(file, "surface_model_type", report);
  std::optional<SmplFamily> by_joints, by_type;
  if (rotations.joints == 24) by_joints = SmplFamily::smpl;
  if (rotations.joints == 52) by_joints = SmplFamily::smplh;
  if (rotations.joints == 55) by_joints = SmplFamily::smplx;
  if (type == "smpl") by_type = SmplFamily::smpl;
  if (type == "smplh") by_type = SmplFamily::smplh;
  if (type == "smplx") by_type = SmplFamily::smplx;
  if ((!type.empty() && !by_type) || (by_joints && by_type && *by_joints != *by_type))
    throw InputError(file.path(), cat("has ", rotations.layout, " for the model ", type),
                     "AMASS has [F, 156] (SMPL-H) and [F, 165] (SMPL-X)");
  return by_type ? by_type : by_joints;
}

/// 0 where there is no single number; some files keep it as a Python object.
double number_of(const ArraySource& file, const char* name) {
  try {
    const NpyArray array = file.array(name);
    return array.is_text() || array.size() != 1 ? 0 : array[0];
  } catch (const InputError&) {
    return 0;
  }
}

/// The file's rate; a hair beside a whole number means that number.
double rate_of(const ArraySource& file, double wanted, std::string& from, ImportReport& report) {
  from = "{fps}";
  if (wanted > 0) return wanted;
  for (const char* name : kRates) {
    if (!file.has(name)) continue;
    from = name;
    const double fps = number_of(file, name);
    if (!(fps >= 1 && fps <= 2000))
      throw InputError(file.path() + ":" + name, "is no frame rate",
                       "give the true one with {fps}");
    return std::abs(fps / std::round(fps) - 1) < 5e-4 ? std::round(fps) : fps;
  }
  if (is_amass_layout(file))
    throw InputError(file.path(), "says no frame rate (mocap_framerate, mocap_frame_rate)",
                     "give it with {fps}");
  from = "taken for granted: {fps}";
  report.remark("the file says no frame rate: 30 frames a second are taken for granted ({fps})");
  return kFps;
}

/// One person's shape: [B], [1, B], or one a frame, of which the mean is taken.
Betas betas_of(const ArraySource& file, const std::string& name, size_t frames,
               ImportReport& report) {
  if (name.empty()) {
    report.remark("the file says no shape (betas): the mean person is taken");
    return {};
  }
  const NpyArray array = file.array(name);
  const auto& shape = array.shape();
  const auto width = static_cast<size_t>(shape.empty() ? 0 : shape.back());
  const size_t rows = width == 0 ? 0 : static_cast<size_t>(array.size()) / width;
  if (array.is_text() || (rows != 1 && rows != frames))
    throw InputError(array.where(), "has the shape " + shape_text(shape),
                     "give one person's shape a file: [B], or [F, B]");
  const std::vector<double> values = array.finite();
  Betas out(width, 0.0);
  bool differ = false;
  for (size_t i = 0; i < values.size(); ++i) {
    out[i % width] += values[i] / static_cast<double>(rows);
    differ = differ || std::abs(values[i] - values[i % width]) > 1e-6;
  }
  if (differ)
    report.remark(cat("the shape changes from frame to frame: the mean of ", rows, " is taken"));
  return out;
}

/// The order of the fingers in SMPL-H.
constexpr int kSmplFingers[] = {1, 2, 4, 3, 0};

/// The joints of both hands among those of skeleton_of().
FingerBones smpl_fingers() {
  FingerBones out;
  for (int side = 0; side < 2; ++side)
    for (int f = 0; f < 5; ++f)
      for (int bone = 0; bone < 3; ++bone)
        out[static_cast<size_t>(finger_bone(side, kSmplFingers[f], bone))] =
            kJoints + 15 * side + 3 * f + bone;
  return out;
}

/// The 22 joints as a skeleton of their own, and each standing for itself. With hands, fingers
/// follow, whose places count for nothing.
SourceSkeleton skeleton_of(const Joints& rest, bool hands) {
  SourceSkeleton out;
  for (size_t j = 0; j < kJoints; ++j)
    out.add(std::string(kJointNames[j]), kParents[j],
            j == 0 ? rest[0] : Vec3(rest[j] - rest[kParents[j]]));
  for (int j = kJoints; hands && j < kJoints + kFingerBones; ++j) {
    const int wrist = j < kJoints + kFingerBones / 2 ? kLeftWrist : kRightWrist;
    out.add("finger", (j - kJoints) % 3 == 0 ? wrist : j - 1, Vec3::Zero());
  }
  return out;
}

JointMap identity_map() {
  JointMap out;
  for (int j = 0; j < kJoints; ++j) out[j].joint = j;
  return out;
}

/// The rest pose is the model's, y up; only the world that its root turns in may be another.
SourceMotion read_motion(const ArraySource& file, const BodyParameters& names,
                         BodyRotations rotations, const Joints& rest, const MotionOptions& options,
                         ImportReport& report) {
  if (names.trans.empty())
    throw InputError(file.path(),
                     cat("says where the joints are (", rotations.layout, "), but not the body"),
                     "add trans [F, 3], the root's place in metres (zeros: it stays in place)");
  const NpyArray trans = file.array(names.trans);
  const auto frames = std::ssize(rotations.local);
  if (trans.is_text() || trans.size() != 3 * frames || trans.shape().back() != 3)
    throw InputError(trans.where(), "has the shape " + shape_text(trans.shape()),
                     cat("it needs one position a frame: [", frames, ", 3]"));
  const std::vector<double> metres =
      metres_of_trans(file, names, rotations.local.size(), options, report);
  SourceMotion out;
  out.skeleton = skeleton_of(rest, !rotations.hands.empty());
  out.moving = {0};
  out.local = std::move(rotations.local);
  for (size_t f = 0; f < rotations.hands.size(); ++f)
    out.local[f].insert(out.local[f].end(), rotations.hands[f].begin(), rotations.hands[f].end());
  for (int64_t f = 0; f < frames; ++f) {
    const Vec3 at(trans[3 * f], trans[3 * f + 1], trans[3 * f + 2]);
    if (!(at.cwiseAbs().maxCoeff() < 1e5))
      throw InputError(trans.where(), "holds a number that is not finite or too large",
                       "give the file as it was published");
    out.position.push_back({metres[static_cast<size_t>(f)] * at + rest[0]});
  }
  return out;
}

/// Where the head is, seen from the pelvis, on average; nothing if the body lies.
std::optional<Axis> up_by_spine(const SourceMotion& motion) {
  const JointMap map = identity_map();
  Vec3 sum = Vec3::Zero();
  double length = 0;
  for (size_t f = 0; f < motion.local.size(); ++f) {
    const PosedSkeleton pose = source_pose(motion, map, f);
    const Vec3 spine = pose.joints[15] - pose.joints[0];
    sum += spine;
    length += spine.norm();
  }
  if (!(sum.norm() > 0.5 * length)) return std::nullopt;
  return axis_near(sum);
}

/// Heights of the lowest joint along a direction, in order of height; a body that lies or stands
/// on a floor at 0 all the time has it near 0.
std::vector<double> lowest_joints(const SourceMotion& motion, const Vec3& up) {
  const JointMap map = identity_map();
  std::vector<double> out;
  for (size_t f = 0; f < motion.local.size(); ++f) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3& joint : source_pose(motion, map, f).joints)
      lowest = std::min(lowest, up.dot(joint));
    out.push_back(lowest);
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// Whether a body whose own up points along `axis` lies on AMASS's floor, z = 0, rather than stands
/// with that axis up.
bool lies_on_floor(const SourceMotion& motion, Axis axis) {
  constexpr double kBelow = 0, kAbove = 0.3, kSpread = 0.3, kStands = 0.25;  // metres
  const std::vector<double> z = lowest_joints(motion, Vec3::UnitZ());
  const std::vector<double> stands = lowest_joints(motion, vector_of(axis));
  const double middle = z[z.size() / 2];
  return middle > kBelow && middle < kAbove && z.back() - z.front() < kSpread &&
         std::abs(stands[stands.size() / 2]) > kStands;
}

/// The axis that is up in a file laid out as AMASS's, and how it is known. AMASS's is z. Where the
/// root turns the body's own up (+y in the rest pose) to y or -y in the mean of all frames, the
/// file is of another maker, unless it shows somebody who lies on the floor (check_upright()
/// remarks on that).
std::pair<Axis, std::string> up_by_root(const SourceMotion& motion) {
  constexpr double kMost = 45;  // degrees
  Vec3 sum = Vec3::Zero();
  for (const std::vector<Quat>& local : motion.local) sum += local[0] * Vec3::UnitY();
  const Vec3 mean = sum / static_cast<double>(motion.local.size());
  for (const Axis axis : {Axis::y, Axis::minus_y}) {
    const double off = angle_between(mean, vector_of(axis)) * 180 / std::numbers::pi;
    // A body that turns over has a short mean, which points nowhere.
    if (mean.norm() > std::numbers::sqrt2 / 2 && off < kMost && !lies_on_floor(motion, axis))
      return {axis, format("%s, where the root turns the body's up (%.0f degrees off), turned to y",
                           to_string(axis).c_str(), off)};
  }
  return {Axis::z, "z (AMASS), turned to y"};
}

/// Turns the world so that y is up, and says how it is known.
void turn_upright(SourceMotion& motion, const ArraySource& file, Axis given,
                  const ParameterHints& hints, ImportReport& report) {
  Axis up = given;
  std::string how = to_string(given) + " ({up})";
  if (given == Axis::automatic && hints.camera) {
    // Some have turned the camera's axes already. From above, the head is nearer, at -z.
    const std::optional<Axis> found = up_by_spine(motion);
    up = found == Axis::y || found == Axis::z ? *found : Axis::minus_y;
    how = to_string(up) +
          (up == Axis::minus_y ? ", a camera's axes" : ", where the head is on average");
    if (up == Axis::minus_y)
      report.remark("it is what a camera saw, whose y points down: turned about x by 180 degrees");
  } else if (given == Axis::automatic && hints.world && !up_by_spine(motion)) {
    up = Axis::y;
    how = "y, taken for granted of a motion in the world";
    report.remark("the body lies or turns over: y is taken for the way up ({up})");
  } else if (given == Axis::automatic && is_amass_layout(file)) {
    std::tie(up, how) = up_by_root(motion);
  } else if (given == Axis::automatic) {
    const std::optional<Axis> found = up_by_spine(motion);
    if (!found)
      throw InputError(file.path(), "does not show which way is up: the body lies or turns over",
                       "say it with {up} (-y is usual where a camera looks on)");
    up = *found;
    how = to_string(up) + ", where the head is on average, turned to y";
  }
  report.fact("up", how);
  const Mat3 turn = upright(up);
  for (size_t f = 0; f < motion.local.size(); ++f) {
    motion.local[f][0] = Quat(turn) * motion.local[f][0];
    motion.position[f][0] = turn * motion.position[f][0];
  }
}

/// Brings the motion to 30 fps and says how.
std::string resampled(SourceMotion& motion, uint64_t bytes, const std::string& from,
                      const std::string& path) {
  const std::string before = format("%.6g", motion.fps) + " fps (" + from + "), ";
  const size_t frames = motion.local.size();
  if (!(static_cast<double>(frames) / motion.fps < kMaxSeconds))
    throw InputError(path, "lasts more than 9 hours at " + format("%.6g", motion.fps) + " fps",
                     "cut it, or give the true rate with {fps}");
  check_length(frames, kJoints, motion.fps, bytes, path);
  if (motion.fps == kFps) return cat(before, frames, " frames, kept");
  motion = resample(motion);
  return cat(before, frames, " frames -> 30 fps, ", motion.local.size(), " frames (slerp, linear)");
}

/// Remarks on a body that lies: an option that is wrong, or a motion on the floor.
void check_upright(const Poses& poses, ImportReport& report) {
  Vec3 sum = Vec3::Zero();
  for (const PosedSkeleton& pose : poses) sum += pose.joints[15] - pose.joints[0];
  if (sum.y() < 0.5 * sum.norm())
    report.remark(
        "the body is not upright on average: if it should be, the file's up axis is another "
        "({up} y)");
}

}  // namespace

// ---- clips -------------------------------------------------------------------------------------

namespace {

/// Vertices that an estimator, or SMPL itself, has made of the motion beside them; scans and meshes
/// that were fitted have other names. Of a single pose they may be a scan with its fit.
bool are_of_the_motion(const Npz& file, const BodyParameters& names, const CloudArray& cloud) {
  const std::string name = lower_case(cloud.name);
  const std::string& poses = names.poses.empty() ? names.body : names.poses;
  return (name == "verts" || name == "vertices") && cloud.axes.sequence &&
         file.header(poses).shape.size() > 1 && file.header(poses).shape[0] > 1;
}

}  // namespace

bool is_amass_motion(const Npz& file) {
  if (is_amass_layout(file)) return true;
  const BodyParameters names = body_parameters(file);
  if (!names.moves()) return false;
  const std::optional<CloudArray> cloud = named_cloud(file);
  return !cloud || are_of_the_motion(file, names, *cloud);
}

bool is_amass_shape(const Npz& file) {
  const BodyParameters names = body_parameters(file);
  return !names.betas.empty() && names.poses.empty() && names.orient.empty() &&
         names.body.empty() && !named_cloud(file);
}

namespace {

/// Frames between others, by slerp and linearly.
void fill_missing(SourceMotion& motion, const std::vector<size_t>& missing) {
  for (size_t k = 0; k < missing.size();) {
    size_t end = k;  // of frames that follow each other
    while (end < missing.size() && missing[end] == missing[k] + (end - k)) ++end;
    const size_t before = missing[k] - 1, after = missing[k] + (end - k);
    if (missing[k] == 0 || after >= motion.local.size()) return;  // there is nothing on one side
    for (; k < end; ++k) {
      const double share =
          static_cast<double>(missing[k] - before) / static_cast<double>(after - before);
      for (size_t j = 0; j < motion.local[before].size(); ++j)
        motion.local[missing[k]][j] = motion.local[before][j].slerp(share, motion.local[after][j]);
      motion.position[missing[k]][0] =
          (1 - share) * motion.position[before][0] + share * motion.position[after][0];
    }
  }
}

/// The body that the file's turns are done by.
using SkeletonOf = std::function<Joints(const BodyParameters& names, const BodyRotations&)>;

Motion import_parameters(const ArraySource& file, const MotionOptions& options,
                         const SkeletonOf& skeleton, ImportReport& report,
                         std::vector<FingerTurns>* fingers, const ParameterHints& hints) {
  report.file = file.path();
  for (const std::string& remark : hints.remarks) report.remark(remark);
  const BodyParameters names = body_parameters(file);
  BodyRotations rotations = read_body_rotations(file, names, fingers != nullptr);
  check_radians(file, rotations, options.force, report);
  const Joints rest = skeleton(names, rotations);
  SourceMotion motion = read_motion(file, names, std::move(rotations), rest, options, report);
  fill_missing(motion, hints.missing);
  turn_upright(motion, file, options.rest.up, hints, report);
  const bool hands = motion.skeleton.size() > kJoints;
  if (lower_case(names.trans).find("cam_t") != std::string::npos)
    report.remark("the path is what a camera saw (" + names.trans + "): its depth is an estimate");
  std::string from;
  motion.fps = rate_of(file, options.fps, from, report);
  check_metres(file.path() + ":" + names.trans, motion, options, report);
  uint64_t bytes = 0;
  for (const std::string& name : {names.poses, names.orient, names.body})
    if (!name.empty()) bytes += file.header(name).bytes();
  report.fact("rate", resampled(motion, bytes, from, file.path()));

  Poses posed(motion.local.size());
  const JointMap map = identity_map();
  for (size_t f = 0; f < posed.size(); ++f) posed[f] = source_pose(motion, map, f);
  for (size_t f = 0; hands && f < posed.size(); ++f)
    fingers->push_back(source_fingers(motion, smpl_fingers(), f));
  check_upright(posed, report);
  const double floor = floor_height(posed);
  report.fact("floor", format("%.6g", std::round(1e3 * floor) / 1e3) + " m, taken to 0");
  Joints centred = rest;
  for (Vec3& x : centred) x -= rest[0];
  Motion out = to_motion(posed, centred, floor);
  out.id = options.id;
  out.subject = options.subject;
  out.split = options.split;
  out.action = options.action;
  return out;
}

void report_layout(const std::optional<SmplFamily>& family, const BodyRotations& rotations,
                   ImportReport& report) {
  report.fact("layout", cat(family ? to_string(*family) : "22 joints", ", ", rotations.layout));
}

}  // namespace

Motion import_amass(const ArraySource& file, BodyModels& models, const MotionOptions& options,
                    ImportReport& report, std::vector<FingerTurns>* fingers,
                    const ParameterHints& hints) {
  const auto skeleton = [&](const BodyParameters& names, const BodyRotations& rotations) {
    const std::optional<SmplFamily> family = family_of(file, rotations, report);
    report_layout(family, rotations, report);
    const std::string gender = text_of(file, "gender", report);
    report.fact("gender", gender.empty() ? "not stated" : gender);
    const SmplModel& model = models.find(family, gender, file.path(), report.remarks);
    const Betas betas = betas_of(file, names.betas, rotations.local.size(), report);
    report.fact("body model", cat(model.path(), ", ", std::min(betas.size(), model.shapes()),
                                  " of ", betas.size(), " betas"));
    return model.joints(betas);
  };
  return import_parameters(file, options, skeleton, report, fingers, hints);
}

Motion import_amass(const ArraySource& file, const Joints& like, const MotionOptions& options,
                    ImportReport& report, std::vector<FingerTurns>* fingers,
                    const ParameterHints& hints) {
  constexpr double kLegs = 0.8;  // metres, hip to ankle, of the mean body of such models
  Joints stand_in = like;
  // `trans` is where the pelvis is, but for some 25 cm that each model has its own way.
  for (Vec3& x : stand_in) x = kLegs / std::max(leg_length(like), 1e-9) * (x - like[kPelvis]);
  const auto skeleton = [&](const BodyParameters&, const BodyRotations& rotations) {
    report_layout(family_of(file, rotations, report), rotations, report);
    return stand_in;
  };
  Motion out = import_parameters(file, options, skeleton, report, fingers, hints);
  report.remark(
      format("no body model: turns go over as they are, and the path as that of a person with legs "
             "of %.1f m ({body-model} FILE gives this person's)",
             kLegs));
  return out;
}

}  // namespace restage
