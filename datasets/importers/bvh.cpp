#include "datasets/importers/bvh.h"

#include <cmath>
#include <cstdio>

#include "datasets/readers/packed_text.h"

namespace restage {
namespace {

/// A whole number of frames per second where the frame time is within 0.05 % of it.
double frame_rate(double frame_time) {
  const double fps = 1.0 / frame_time;
  return std::abs(fps / std::round(fps) - 1.0) < 5e-4 ? std::round(fps) : fps;
}

}  // namespace

SourceMotion bvh_motion(BvhFile file, int hips) {
  SourceMotion out;
  out.fps = frame_rate(file.frame_time);
  std::vector<uint8_t> moves(file.skeleton.size(), 0);
  for (int j = hips; j >= 0; j = file.skeleton.parents[static_cast<size_t>(j)])
    moves[static_cast<size_t>(j)] = 1;
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
        if (channel >= Channel::x_rotation)
          local[j] = local[j] * channel_rotation(channel, value);
        else
          offset[static_cast<int>(channel)] = value;
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
  BvhFile file = parse_bvh(text, path);
  const std::optional<Profile> profile = asked_profile(options);
  Recording recording;
  recording.names = name_joints(file.skeleton, path, profile ? &*profile : nullptr);
  recording.format = "BVH";
  char rate[60];
  std::snprintf(rate, sizeof rate, "the file says %.6g fps", frame_rate(file.frame_time));
  recording.rate_of_file = rate;
  recording.bytes = text.size();
  check_length(file.frames.size(), file.skeleton.size(), frame_rate(file.frame_time), text.size(),
               path);
  const int hips = recording.names.map[0].joint;
  recording.motion = bvh_motion(std::move(file), hips);
  return make_clip(std::move(recording), path, options);
}

MotionClip read_bvh(const std::string& path, const MotionOptions& options) {
  return convert_bvh(read_packed_text(path), path, options);
}

}  // namespace restage
