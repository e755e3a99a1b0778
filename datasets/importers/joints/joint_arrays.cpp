// Joints in NPY and NPZ arrays.
#include <algorithm>
#include <cmath>
#include <functional>

#include "datasets/importers/joints/joint_file.h"
#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage::joints_detail {
namespace {

constexpr int64_t kHumanMl = 263;
constexpr int64_t kScan = 64;  // points

/// How the numbers of a shape are frames, joints and coordinates.
struct JointAxes {
  int64_t people = 1, frames = 0, joints = 0, columns = 3;
  int64_t person_step = 0, frame_step = 0, joint_step = 0, axis_step = 1;
};

bool is_count(int64_t joints) {
  return joints > 0 && joints <= static_cast<int64_t>(kMostJoints) &&
         !layouts_of(static_cast<size_t>(joints)).empty();
}

/// All ways in which a shape may be joints, the likeliest first. `joints`: how many there are, 0
/// for any number of a known layout.
std::vector<JointAxes> joint_axes(const std::vector<int64_t>& s, int64_t joints) {
  const auto fits = [&](int64_t n) { return joints > 0 ? n == joints : is_count(n); };
  // Frames of fewer points than a scan has are joints, if of an order that is not known.
  const auto few = [&](int64_t n) {
    return joints == 0 && n >= static_cast<int64_t>(kFewestJoints) && n < kScan;
  };
  std::vector<JointAxes> out;
  if (s.size() == 3 && (s[2] == 3 || s[2] == 4) && (fits(s[1]) || few(s[1])))
    out.push_back({1, s[0], s[1], s[2], 0, s[1] * s[2], s[2], 1});
  if (s.size() == 3 && s[1] == 3 && fits(s[0]))  // [J, 3, F]
    out.push_back({1, s[2], s[0], 3, 0, 1, 3 * s[2], s[2]});
  if (s.size() == 3 && s[1] == 3 && fits(s[2]))  // [F, 3, J]
    out.push_back({1, s[0], s[2], 3, 0, 3 * s[2], 1, s[2]});
  if (s.size() == 4 && (s[3] == 3 || s[3] == 4) && fits(s[2])) {
    // [1, F, J, 3]; [F, 1, J, 3] or [P, F, J, 3] with a few people.
    if (s[0] == 1 || (s[1] != 1 && s[0] < s[1]))
      out.push_back({s[0], s[1], s[2], s[3], s[1] * s[2] * s[3], s[2] * s[3], s[3], 1});
    else
      out.push_back({s[1], s[0], s[2], s[3], s[2] * s[3], s[1] * s[2] * s[3], s[3], 1});
  }
  if (s.size() == 4 && s[2] == 3 && fits(s[1]))  // [P, J, 3, F]
    out.push_back({s[0], s[3], s[1], 3, s[1] * 3 * s[3], 1, 3 * s[3], s[3]});
  if (s.size() == 2 && s[1] % 3 == 0 && fits(s[1] / 3))
    out.push_back({1, s[0], s[1] / 3, 3, 0, s[1], 3, 1});
  if (s.size() == 2 && (s[1] == 3 || s[1] == 4) && fits(s[0]) &&
      (joints > 0 || s[0] < kScan))  // a single pose
    out.push_back({1, 1, s[0], s[1], 0, 0, s[1], 1});
  return out;
}

/// The frames of one person.
std::vector<FileFrame> frames_of(const NpyArray& array, const JointAxes& axes, int64_t person) {
  std::vector<FileFrame> out(static_cast<size_t>(axes.frames));
  for (int64_t f = 0; f < axes.frames; ++f)
    for (int64_t j = 0; j < axes.joints; ++j) {
      const int64_t at = person * axes.person_step + f * axes.frame_step + j * axes.joint_step;
      const auto number = [&](int64_t c) { return array[at + c * axes.axis_step]; };
      out[static_cast<size_t>(f)].push_back(
          joint_at(number(0), number(1), number(2), axes.columns > 3 ? number(3) : 1, j == 0));
    }
  return out;
}

// ---- HumanML3D's numbers -----------------------------------------------------------------------

/// Whether they are as the data set has them; divided by deviations (as a model sees them) they are
/// not: what touches the floor is 0 or 1, and the height of the root is a person's.
bool is_plain_humanml(const NpyArray& array) {
  const int64_t frames = array.shape()[0];
  for (int64_t f = 0; f < frames; ++f) {
    for (int64_t c = kHumanMl - 4; c < kHumanMl; ++c) {
      const double touch = array[f * kHumanMl + c];
      if (std::min(std::abs(touch), std::abs(touch - 1)) > 0.3) return false;
    }
    const double height = array[f * kHumanMl + 3];
    if (!(height > -0.5 && height < 3)) return false;
  }
  return true;
}

/// Guo et al. 2022, recover_from_ric(): the root's turning about y and its velocity in its own
/// heading add up; other joints are given in that heading, about the root's place on the floor.
std::vector<FileFrame> frames_of_humanml(const NpyArray& array) {
  std::vector<FileFrame> out;
  double half = 0;  // of the angle about y: the numbers are those of a quaternion
  Vec3 root = Vec3::Zero();
  for (int64_t f = 0; f < array.shape()[0]; ++f) {
    const auto number = [&](int64_t frame, int64_t c) { return array[frame * kHumanMl + c]; };
    if (f > 0) half += number(f - 1, 0);
    // The inverse of the quaternion (cos half, 0, sin half, 0).
    const Mat3 back = turn_about_y(-2 * half);
    if (f > 0) root += back * Vec3(number(f - 1, 1), 0, number(f - 1, 2));
    root.y() = number(f, 3);
    FileFrame frame = {root};
    for (int64_t j = 0; j < kJoints - 1; ++j) {
      const int64_t at = 4 + 3 * j;
      const Vec3 x(number(f, at), number(f, at + 1), number(f, at + 2));
      const Vec3 there = back * x + Vec3(root.x(), 0, root.z());
      frame.push_back(there.allFinite() ? std::optional(there) : std::nullopt);
    }
    out.push_back(std::move(frame));
  }
  return out;
}

JointRecording humanml(const NpyArray& array, const std::string& where) {
  if (!is_plain_humanml(array))
    throw InputError(where,
                     "looks like HumanML3D's 263 numbers divided by their deviations, as a model "
                     "sees them",
                     "multiply by Std.npy and add Mean.npy of the data set, then save them again");
  JointRecording out;
  out.layout = joint_layout("smpl22");
  out.frames = frames_of_humanml(array);
  out.fps = 20;
  out.form = cat("HumanML3D's numbers ", shape_text(array.shape()), ", 20 frames a second");
  return out;
}

// ---- which array --------------------------------------------------------------------------------

/// InputError for rows that are a model's angles, [F, 72] and the like.
void refuse_angles(const std::string& where, const std::vector<int64_t>& shape) {
  const bool rows = shape.size() == 2 && (shape[1] == 72 || shape[1] == 156 || shape[1] == 165);
  if (rows)
    throw InputError(where,
                     cat("looks like the angles of a body model, ", shape_text(shape),
                         ", and not like positions of joints"),
                     "save them as 'poses' with 'trans' in an NPZ (numpy.savez), as AMASS does");
}

std::optional<JointRecording> of_array(const NpyArray& array, const std::string& where,
                                       const std::string& name, bool sure,
                                       const JointFileOptions& options) {
  const std::vector<int64_t>& shape = array.shape();
  if (shape.size() == 2 && shape[1] == kHumanMl && shape[0] > 0) return humanml(array, where);
  const int64_t asked =
      options.layout.empty() ? 0 : static_cast<int64_t>(joint_layout(options.layout).count);
  const std::vector<JointAxes> ways = joint_axes(shape, asked);
  for (const JointAxes& axes : ways) {
    if (axes.frames < 1) continue;
    // One moment of many points may be a cloud that resembles somebody's joints by chance.
    if (axes.frames == 1 && axes.joints >= kScan && options.layout.empty()) continue;
    const auto person =
        static_cast<int64_t>(person_of(options.person, static_cast<size_t>(axes.people), where));
    JointRecording out;
    out.frames = frames_of(array, axes, person);
    const bool last = &axes == &ways.back();
    const bool flat = shape.size() == 2;
    auto layout = choose_layout(out.frames, options.layout, where, sure && last && !flat);
    if (!layout) continue;
    out.layout = *layout;
    out.form = cat(name.empty() ? "" : text::quote(name) + " ", shape_text(shape));
    return out;
  }
  if (!ways.empty() || sure) refuse_angles(where, shape);
  if (!options.layout.empty())
    throw InputError(where,
                     cat("is an array ", shape_text(shape), ", which has no ", asked,
                         " joints of {layout} ", options.layout),
                     "give positions as [F, J, 3]");
  return {};
}

/// Whether an array of this name holds positions of joints, the surest first; nothing for others.
std::optional<size_t> joint_rank(const std::string& name) {
  static constexpr std::string_view kNames[] = {"joints",
                                                "joints3d",
                                                "joints_3d",
                                                "joint_positions",
                                                "keypoints3d_optim",
                                                "keypoints3d",
                                                "keypoints_3d",
                                                "kp3d",
                                                "j3d",
                                                "j3ds",
                                                "poses3d",
                                                "poses_3d",
                                                "pose3d",
                                                "pose_3d",
                                                "skeleton",
                                                "skeletons",
                                                "skel",
                                                "positions",
                                                "joint",
                                                "keypoints",
                                                "kps",
                                                "landmarks",
                                                "motion",
                                                "pred_joints",
                                                "pred_keypoints_3d",
                                                "x3d",
                                                "jtr",
                                                "markers",
                                                "arr_0"};
  const std::string low = lower_case(name);
  const auto at = std::find(std::begin(kNames), std::end(kNames), low);
  if (at == std::end(kNames)) return {};
  return static_cast<size_t>(at - std::begin(kNames));
}

/// A rate that stands beside, frames a second.
double fps_beside(const ArraySource& file) {
  for (const char* name : {"fps", "mocap_framerate", "mocap_frame_rate", "frame_rate", "framerate"})
    if (file.has(name)) {
      const NpyArray array = file.array(name);
      if (array.size() == 1 && array[0] > 0) return array[0];
    }
  return 0;
}

/// Whether its rows are of fewer points than any scan has.
bool is_of_few(const std::vector<int64_t>& shape) {
  return shape.size() >= 3 && (shape.back() == 3 || shape.back() == 4) &&
         shape[shape.size() - 2] < kScan;
}

void refuse_markers(const std::string& where, const std::vector<int64_t>& shape) {
  throw InputError(where, cat("holds markers, ", shape_text(shape), ", not joints of a skeleton"),
                   "solve a skeleton in the program that recorded them and export BVH");
}

/// The joints among named arrays, if they are no motion of a body model.
std::optional<JointRecording> of_arrays(const ArraySource& file, const JointFileOptions& options) {
  const std::string& path = file.path();
  if (body_parameters(file.names()).moves()) return {};
  std::vector<std::pair<size_t, std::string>> named;
  for (const std::string& name : file.names())
    if (const auto rank = joint_rank(name)) named.emplace_back(*rank, name);
  std::sort(named.begin(), named.end());
  std::vector<std::string> names;
  for (const auto& [rank, name] : named) names.push_back(name);
  if (names.empty() && file.names().size() == 1) names = file.names();
  for (const std::string& name : names) {
    const NpyHeader header = file.header(name);
    if (header.is_text() || header.shape.size() < 2) continue;
    if (joint_axes(header.shape, 0).empty() && header.shape.back() != kHumanMl) {
      if (lower_case(name) == "markers" && header.shape.back() == 3)
        refuse_markers(cat(path, ":", name), header.shape);
      if (options.layout.empty()) continue;
    }
    const bool sure = *joint_rank(name) < joint_rank("motion").value();
    auto out = of_array(file.array(name), cat(path, ":", name), name, sure, options);
    if (!out && lower_case(name) == "markers") refuse_markers(cat(path, ":", name), header.shape);
    if (!out) continue;
    if (const double fps = fps_beside(file); fps > 0) out->fps = fps;
    return out;
  }
  return {};
}

/// The arrays of a dictionary, or the only array there is.
void gather(const ValueTree& tree, GatheredArrays& out) {
  if (tree.size() == 0) return;
  ValueTree::Id root = tree.root;  // an array of one object holds it in a list
  if (tree.is(root, ValueTree::Kind::list) && tree.items(root).size() == 1)
    root = tree.items(root)[0];
  if (tree.is(root, ValueTree::Kind::array)) out.put("joints", tree.array(root));
  if (!tree.is(root, ValueTree::Kind::map)) return;
  const std::vector<ValueTree::Id>& items = tree.items(root);
  for (size_t i = 0; i + 1 < items.size(); i += 2)
    if (const std::string key = tree.key(items[i]);
        !key.empty() && tree.is(items[i + 1], ValueTree::Kind::array))
      out.put(key, tree.array(items[i + 1]));
}

}  // namespace

std::optional<JointRecording> joints_of_arrays(const std::string& path,
                                               const JointFileOptions& options) {
  if (is_pickle_name(path) || (!is_npz_name(path) && holds_objects(path))) {
    const ValueTree tree = read_nested_file(path, options.max_memory);
    GatheredArrays arrays(path);
    gather(tree, arrays);
    return of_arrays(arrays, options);
  }
  if (is_npz_name(path)) {
    const Npz file(path, options.max_memory);
    if (named_cloud(file)) return {};
    return of_arrays(file, options);
  }
  FileStream in(path);
  const NpyHeader header = read_npy_header(in);
  if (header.is_text()) return {};
  const std::vector<int64_t>& shape = header.shape;
  const bool few = std::none_of(shape.begin(), shape.end(), [](int64_t n) { return n < 1; });
  const bool humanml = shape.size() == 2 && shape[1] == kHumanMl;
  if (!few || (options.layout.empty() && !humanml && joint_axes(shape, 0).empty())) return {};
  const bool sure = is_of_few(shape);
  return of_array(read_npy(path, options.max_memory), path, "", sure, options);
}

}  // namespace restage::joints_detail
