#include "datasets/importers/motions/bvh.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/importers/motions/reroot.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/packed_text.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

struct Rate {
  double fps;
  bool rounded;  ///< the file says another, too short to be exact
};

/// A whole number of frames per second where the frame time is within 0.05 % of it; else the usual
/// rate whose frame time rounds (or is cut) to the digits in the file; else what the file says.
Rate frame_rate(const BvhFile& file) {
  const double time = file.frame_time, digit = file.frame_time_digit, fps = 1.0 / time;
  if (std::abs(fps / std::round(fps) - 1.0) < 5e-4) return {std::round(fps), false};
  double best = 0;
  for (const double usual : {24.0, 25.0, 30.0, 50.0, 60.0, 100.0, 120.0, 240.0}) {
    const double off = 1 / usual - time;
    if (off >= -0.5001 * digit && off < digit &&
        (best == 0 || std::abs(off) < std::abs(1 / best - time)))
      best = usual;
  }
  return best > 0 ? Rate{best, true} : Rate{fps, false};
}

std::string rate_text(const BvhFile& file) {
  if (!(file.frame_time > 0)) return format("the file's frame time is %.6g s", file.frame_time);
  const Rate rate = frame_rate(file);
  return rate.rounded ? format("the file's frame time of %.6g s is %.6g fps, rounded",
                               file.frame_time, rate.fps)
                      : format("the file says %.6g fps", rate.fps);
}

/// What a joint's position channels say: on average, and how far from there at most.
struct Place {
  Vec3 mean = Vec3::Zero();
  double stray = 0;
};

/// `otherwise`: of the axes that have no channel.
Place place_of(const BvhFile& file, size_t joint, const Vec3& otherwise) {
  const auto at = [&](const std::vector<double>& frame) {
    Vec3 out = otherwise;
    for (size_t c = 0; c < file.channels[joint].size(); ++c)
      if (const Channel channel = file.channels[joint][c]; !is_rotation(channel))
        out[axis_of(channel)] = frame[file.first_channel[joint] + c];
    return out;
  };
  Place out;
  for (const auto& frame : file.frames)
    out.mean += at(frame) / static_cast<double>(file.frames.size());
  for (const auto& frame : file.frames)
    out.stray = std::max(out.stray, (at(frame) - out.mean).norm());
  return out;
}

/// The joint and all that it hangs on.
void mark_upwards(const SourceSkeleton& skeleton, int joint, std::vector<uint8_t>& marks) {
  for (; joint >= 0; joint = skeleton.parents[joint]) marks[joint] = 1;
}

bool has_positions(const BvhFile& file, size_t joint) {
  return !std::all_of(file.channels[joint].begin(), file.channels[joint].end(), is_rotation);
}

/// Joints of use that are told where they are in every frame, but for those down to the hips.
struct ToldJoints {
  std::vector<int> beside;    ///< that move with the body, but do not hang on the hips: a spine
  std::vector<size_t> fixed;  ///< others: where they are told to be is the length of a bone
};

ToldJoints told_joints(const BvhFile& file, const JointMap& map) {
  const std::vector<int>& parents = file.skeleton.parents;
  const int hips = map[0].joint;
  std::vector<uint8_t> moves(file.skeleton.size(), 0), used = moves;
  mark_upwards(file.skeleton, hips, moves);
  for (const SourceJoint& joint : map) mark_upwards(file.skeleton, joint.joint, used);
  ToldJoints out;
  for (size_t j = 0; j < moves.size(); ++j) {
    if (!used[j] || moves[j] || !has_positions(file, j)) continue;
    int above = parents[j];
    while (!moves[above] && !has_positions(file, static_cast<size_t>(above)))
      above = parents[above];
    if (moves[above] && above != hips)
      out.beside.push_back(static_cast<int>(j));
    else
      out.fixed.push_back(j);
  }
  return out;
}

/// Bones have one length here, so joints rest where the channels put them on average.
BonePositions use_positions(BvhFile& file, const std::vector<size_t>& told) {
  double said = 0, drawn = 0;
  for (const size_t j : told) {
    said += place_of(file, j, Vec3::Zero()).mean.norm();
    drawn += file.skeleton.offsets[j].norm();
  }
  const bool deltas = said < 0.2 * drawn;  // Blender's: counted from OFFSET, which others replace
  BonePositions found;
  found.joints = told.size();
  for (const size_t j : told) {
    Vec3& offset = file.skeleton.offsets[j];
    const Place place = place_of(file, j, deltas ? Vec3(Vec3::Zero()) : offset);
    const Vec3 rest = deltas ? Vec3(offset + place.mean) : place.mean;
    found.off_offset = std::max(found.off_offset, (rest - offset).norm());
    offset = rest;
    if (place.stray > found.stray) {
      found.stray = place.stray;
      found.stray_joint = file.skeleton.names[j];
    }
  }
  return found;
}

/// Joints beside the hips rest where they are on average, seen from the hips.
void rest_beside(SourceMotion& motion, int hips, const std::vector<int>& beside) {
  for (const int joint : beside) {
    JointMap map;
    map.fill({hips, Vec3::Zero()});
    map[1].joint = joint;
    Vec3 mean = Vec3::Zero();
    for (size_t f = 0; f < motion.local.size(); ++f) {
      const PosedSkeleton pose = source_pose(motion, map, f);
      mean += pose.global[0].transpose() * (pose.joints[1] - pose.joints[0]);
    }
    mean /= static_cast<double>(std::max<size_t>(motion.local.size(), 1));
    const std::vector<Vec3> zero = zero_positions(motion.skeleton);
    motion.skeleton.offsets[joint] = zero[hips] + mean - zero[motion.skeleton.parents[joint]];
  }
}

}  // namespace

SourceMotion bvh_motion(BvhFile file, const std::vector<int>& moving) {
  SourceMotion out;
  out.fps = frame_rate(file).fps;
  std::vector<uint8_t> moves(file.skeleton.size(), 0);
  for (const int joint : moving) mark_upwards(file.skeleton, joint, moves);
  for (size_t j = 0; j < moves.size(); ++j)
    if (moves[j]) out.moving.push_back(static_cast<int>(j));
  out.local.reserve(file.frames.size());
  out.position.reserve(file.frames.size());
  for (std::vector<double>& frame : file.frames) {
    std::vector<Quat>& local = out.local.emplace_back(file.skeleton.size(), Quat::Identity());
    std::vector<Vec3>& position = out.position.emplace_back();
    for (size_t j = 0; j < file.skeleton.size(); ++j) {
      Vec3 offset = file.skeleton.offsets[j];
      for (size_t c = 0; c < file.channels[j].size(); ++c) {
        const Channel channel = file.channels[j][c];
        const double value = frame[file.first_channel[j] + c];
        if (is_rotation(channel))
          local[j] = local[j] * channel_rotation(channel, value);
        else
          offset[axis_of(channel)] = value;
      }
      if (moves[j]) position.push_back(offset);
    }
    frame = {};
  }
  out.skeleton = std::move(file.skeleton);
  return out;
}

MotionClip convert_bvh(std::string_view text, const std::string& path,
                       const MotionOptions& options) {
  BvhFile file = parse_bvh(text, path, options.fps > 0);
  const std::optional<Profile> profile = asked_profile(options);
  Recording recording;
  if (const int pelvis = hanging_pelvis(file.skeleton, profile ? &*profile : nullptr);
      pelvis >= 0 && has_root_positions_alone(file)) {
    recording.remarks.push_back(cat("its root is ", text::quote(file.skeleton.names[0]),
                                    ", and the hips hang on the spine: its bones are hung on ",
                                    text::quote(file.skeleton.names[static_cast<size_t>(pelvis)]),
                                    ", and each keeps its turn"));
    file = rerooted(file, pelvis);
  }
  recording.names = name_joints(file.skeleton, path, profile ? &*profile : nullptr);
  recording.format = "BVH";
  recording.rate_of_file = rate_text(file);
  recording.rate_known = !frame_rate(file).rounded;
  recording.bytes = text.size();
  const double fps = options.fps > 0 ? options.fps : frame_rate(file).fps;
  check_length(file.frames.size(), file.skeleton.size(), fps, text.size(), path);
  const ToldJoints told = told_joints(file, recording.names.map);
  recording.positions = use_positions(file, told.fixed);
  const int hips = recording.names.map[0].joint;
  std::vector<int> moving = told.beside;
  moving.push_back(hips);
  const size_t frames = file.frames.size(), left_out = file.lines_left_out;
  recording.motion = bvh_motion(std::move(file), moving);
  rest_beside(recording.motion, hips, told.beside);
  if (!told.fixed.empty() || !told.beside.empty())  // joints that the file lacks go between others
    recording.names = name_joints(recording.motion.skeleton, path, profile ? &*profile : nullptr);
  MotionClip clip = make_clip(std::move(recording), path, options);
  if (left_out > 0)
    clip.report.remarks.push_back(
        cat("'Frames:' announces ", frames,
            "; left out what follows them, in as many more lines: ", left_out));
  return clip;
}

MotionClip read_bvh(const std::string& path, const MotionOptions& options) {
  return convert_bvh(read_packed_text(path), path, options);
}

}  // namespace restage
