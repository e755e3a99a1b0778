#include "datasets/importers/amass.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/format.h"
#include "datasets/importers/import_detail.h"
#include "datasets/readers/array_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/folders.h"
#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMaxFrames = int64_t{1} << 22;  // 9.7 hours at 120 fps
constexpr double kMaxSeconds = 35000;
constexpr const char* kRates[] = {"mocap_framerate", "mocap_frame_rate"};

/// By the name of the file or its folder: SMPLX_MALE.npz, female/model.npz.
std::string gender_of(const fs::path& file) {
  for (const fs::path& name : {file.filename(), file.parent_path().filename()})
    for (const char* gender : {"female", "male", "neutral"})  // "female" holds "male"
      if (lower_case(name.string()).find(gender) != std::string::npos) return gender;
  return "";
}

/// Text of a scalar; empty where there is none, or where it is no plain text, which is remarked:
/// some files keep it as a Python object.
std::string text_of(const Npz& file, const char* name, ImportReport& report) {
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

SmplFamily family_of(const Npz& file, const NpyHeader& poses, ImportReport& report) {
  const int64_t width = poses.shape.size() == 2 ? poses.shape[1] : 0;
  const std::string type = text_of(file, "surface_model_type", report);
  if (width == 156 && (type.empty() || type == "smplh")) return SmplFamily::smplh;
  if (width == 165 && (type.empty() || type == "smplx")) return SmplFamily::smplx;
  throw InputError(
      file.path() + ":poses",
      "has the shape " + shape_text(poses.shape) + (type.empty() ? "" : " for the model " + type),
      "AMASS has [F, 156] (SMPL-H) and [F, 165] (SMPL-X)");
}

/// 0 where there is no single number; some files keep it as a Python object.
double number_of(const Npz& file, const char* name) {
  try {
    const NpyArray array = file.array(name);
    return array.is_text() || array.size() != 1 ? 0 : array[0];
  } catch (const InputError&) {
    return 0;
  }
}

/// The file's rate; a hair beside a whole number means that number.
double rate_of(const Npz& file, double wanted, std::string& from) {
  from = "--fps";
  if (wanted > 0) return wanted;
  for (const char* name : kRates) {
    if (!file.has(name)) continue;
    from = name;
    const double fps = number_of(file, name);
    if (!(fps >= 1 && fps <= 2000))
      throw InputError(file.path() + ":" + name, "is no frame rate",
                       "give the true one with --fps");
    return std::abs(fps / std::round(fps) - 1) < 5e-4 ? std::round(fps) : fps;
  }
  throw InputError(file.path(), "says no frame rate (mocap_framerate, mocap_frame_rate)",
                   "give it with --fps");
}

Betas betas_of(const Npz& file) {
  const NpyArray array = file.array("betas");
  const auto& shape = array.shape();
  if (array.is_text() || shape.empty() || (shape.size() > 1 && shape.back() != array.size()))
    throw InputError(array.where(), "has the shape " + shape_text(shape),
                     "AMASS has one person a file: [B]");
  return array.finite();
}

Quat rotation(const Vec3& axis_angle) {
  const double angle = axis_angle.norm();
  if (angle < 1e-12) return Quat::Identity();
  return Quat(Eigen::AngleAxisd(angle, axis_angle / angle));
}

/// The 22 joints as a skeleton of their own, and each standing for itself.
SourceSkeleton skeleton_of(const Joints& rest) {
  SourceSkeleton out;
  for (size_t j = 0; j < kJoints; ++j)
    out.add(std::string(kJointNames[j]), kParents[j],
            j == 0 ? rest[0] : Vec3(rest[j] - rest[kParents[j]]));
  return out;
}

JointMap identity_map() {
  JointMap out;
  for (int j = 0; j < kJoints; ++j) out[j].joint = j;
  return out;
}

/// The rest pose is the model's, y up; only the world that its root turns in may be z up.
SourceMotion read_motion(const Npz& file, const Joints& rest, const Mat3& up) {
  const NpyArray poses = file.array("poses"), trans = file.array("trans");
  const int64_t frames = poses.shape()[0], width = poses.shape()[1];
  if (frames == 0 || frames > kMaxFrames)
    throw InputError(poses.where(), cat("has ", frames, " frames"), cat("give 1 to ", kMaxFrames));
  if (!trans.is_shaped({frames, 3}))
    throw InputError(trans.where(), "has the shape " + shape_text(trans.shape()),
                     cat("it needs one position a frame: [", frames, ", 3]"));
  const auto vector = [](const NpyArray& array, int64_t at) {
    const Vec3 out(array[at], array[at + 1], array[at + 2]);
    if (!(out.cwiseAbs().maxCoeff() < 1e5))
      throw InputError(array.where(), "holds a number that is not finite or too large",
                       "give the file as it was published");
    return out;
  };
  SourceMotion out;
  out.skeleton = skeleton_of(rest);
  out.moving = {0};
  for (int64_t f = 0; f < frames; ++f) {
    std::vector<Quat>& local = out.local.emplace_back(kJoints);
    for (size_t j = 0; j < kJoints; ++j)
      local[j] = rotation(vector(poses, f * width + 3 * static_cast<int64_t>(j)));
    local[0] = Quat(up) * local[0];
    out.position.push_back({up * (vector(trans, 3 * f) + rest[0])});
  }
  return out;
}

/// Brings the motion to 30 fps and says how.
std::string resampled(SourceMotion& motion, uint64_t bytes, const std::string& from,
                      const std::string& path) {
  const std::string before = format("%.6g", motion.fps) + " fps (" + from + "), ";
  const size_t frames = motion.local.size();
  if (!(static_cast<double>(frames) / motion.fps < kMaxSeconds))
    throw InputError(path, "lasts more than 9 hours at " + format("%.6g", motion.fps) + " fps",
                     "cut it, or give the true rate with --fps");
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
        "(--up y)");
}

}  // namespace

// ---- body models -------------------------------------------------------------------------------

BodyModels::BodyModels(const std::string& path, uint64_t max_memory)
    : path_(path), max_memory_(max_memory) {
  std::error_code ignored;
  const bool folder = fs::is_directory(path, ignored);
  if (is_pickle_name(path)) refuse_pickle(path);
  std::string first;  // reason why a file is none
  const std::vector<std::string> files =
      folder ? files_below(path, is_npz_name) : std::vector<std::string>{path};
  for (const std::string& file : files) {
    try {
      const Npz archive(file, max_memory);
      if (!is_smpl_model(archive))
        throw InputError(file, "is no body model (it has " + list_of(archive.names()) + ")",
                         "give a SMPL, SMPL-H or SMPL-X model as published (.npz)");
      entries_.push_back({file, gender_of(file), smpl_family(archive)});
    } catch (const InputError& error) {
      if (!folder) throw;  // a folder may hold other things too, such as MANO's hands
      if (first.empty()) first = error.what();
    }
  }
  if (!entries_.empty()) return;
  const std::string none = "holds no SMPL, SMPL-H or SMPL-X model (.npz)";
  if (!first.empty()) refuse_all(path, cat(none, " among ", files.size(), " files"), first);
  if (const auto pickles = files_below(path, is_pickle_name); !pickles.empty())
    refuse_pickle(pickles[0]);
  throw InputError(path, none, "give a model or a folder of them as --body-model");
}

const SmplModel& BodyModels::find(SmplFamily family, const std::string& gender,
                                  const std::string& clip, std::vector<std::string>& remarks) {
  std::vector<const Entry*> usable = of_family(family);
  if (usable.empty() && family == SmplFamily::smplh) {
    usable = of_family(SmplFamily::smpl);
    if (!usable.empty())
      remarks.push_back("a SMPL model stands in for SMPL-H: their shapes are taken for the same");
  }
  if (usable.empty())
    throw InputError(clip,
                     cat("moves a ", to_string(family), " body, ", path_, " is ",
                         to_string(entries_[0].family), ", whose shapes are others"),
                     cat("give a ", to_string(family), " model as --body-model"));
  const std::string wanted = gender.empty() ? "neutral" : gender;
  const Entry* chosen = usable.size() == 1 ? usable[0] : nullptr;
  for (const Entry* entry : usable)
    if (entry->gender == wanted) chosen = entry;
  if (chosen == nullptr)
    throw InputError(clip, "was fitted with a " + wanted + " body, whose model " + path_ + " lacks",
                     "add it, or give one model for all as --body-model");
  if (chosen->gender != wanted && !chosen->gender.empty())
    remarks.push_back("fitted with a " + wanted + " body, but " + chosen->path + " is " +
                      chosen->gender + ": proportions are only roughly this person's");
  std::unique_ptr<SmplModel>& model = loaded_[chosen->path];
  if (!model) model = std::make_unique<SmplModel>(chosen->path, max_memory_);
  return *model;
}

std::vector<const BodyModels::Entry*> BodyModels::of_family(SmplFamily family) const {
  std::vector<const Entry*> out;
  for (const Entry& entry : entries_)
    if (entry.family == family) out.push_back(&entry);
  return out;
}

// ---- clips -------------------------------------------------------------------------------------

bool is_amass_motion(const Npz& file) { return file.has("poses") && file.has("trans"); }

bool is_amass_shape(const Npz& file) { return file.has("betas") && !file.has("poses"); }

Motion import_amass(const Npz& file, BodyModels& models, const MotionOptions& options,
                    ImportReport& report) {
  report.file = file.path();
  const NpyHeader poses = file.header("poses");
  const SmplFamily family = family_of(file, poses, report);
  report.fact("layout", cat(to_string(family), ", poses ", shape_text(poses.shape)));
  const std::string gender = text_of(file, "gender", report);
  report.fact("gender", gender.empty() ? "not stated" : gender);
  const SmplModel& model = models.find(family, gender, file.path(), report.remarks);
  const Betas betas = betas_of(file);
  report.fact("body model", cat(model.path(), ", ", std::min(betas.size(), model.shapes()), " of ",
                                betas.size(), " betas"));

  const Joints rest = model.joints(betas);
  const Axis up = options.rest.up;
  SourceMotion motion = read_motion(file, rest, upright(up == Axis::automatic ? Axis::z : up));
  report.fact("up", up == Axis::automatic ? "z (AMASS), turned to y" : to_string(up) + " (--up)");
  std::string from;
  motion.fps = rate_of(file, options.fps, from);
  report.fact("rate", resampled(motion, poses.bytes(), from, file.path()));

  Poses posed(motion.local.size());
  const JointMap map = identity_map();
  for (size_t f = 0; f < posed.size(); ++f) posed[f] = source_pose(motion, map, f);
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

}  // namespace restage
