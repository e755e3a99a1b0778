#include "experiments/source.h"

#include <algorithm>

#include "datasets/doctor/examine.h"
#include "datasets/importers/axis.h"
#include "datasets/readers/gltf.h"
#include "nn/geometry/strays.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

Eigen::Matrix3f turn_of(const std::string& up) {
  const Axis axis = parse_axis(up, "--source-up");
  if (axis == Axis::automatic)
    throw InputError("", "--source-up 'auto' is not known here", "give x, -x, y, -y, z or -z");
  return upright(axis).cast<float>();
}

void check(const SourceRecord& how) {
  if (how.fps && !(*how.fps >= 1 && *how.fps <= 1000))
    throw InputError("", "--fps is out of range", "give the source's frames per second, 1 to 1000");
  if (how.fps && *how.fps != kFps && is_gltf_name(how.path))  // it is played at that rate
    throw InputError(how.path, "states its key times, which --fps cannot change",
                     "leave --fps out");
}

}  // namespace

ToOurs::ToOurs(double scale, const std::string& up)
    : scale_(static_cast<float>(scale)), turn_(turn_of(up)) {
  if (!(scale >= kLeastScale && scale <= kMostScale))
    throw InputError("", "--scale is out of range", "give metres per unit, 1e-9 to 1e6");
}

void ToOurs::operator()(Points& points) const {
  const bool upright = turn_.isIdentity();
  for (Point& p : points) {
    if (!upright) p = turn_ * p;
    p *= scale_;
  }
}

Source::Source(const SourceRecord& how, uint64_t max_memory)
    : how_(how), to_ours_(how.scale, how.up) {
  check(how);
  frames_ =
      open_frames(how.path, {.clip = how.clip, .max_memory = max_memory, .sequence = how.sequence});
  if (!how_.fps) how_.fps = frames_->fps();
}

Source::Source(const SourceRecord& how, std::unique_ptr<FrameSource> frames)
    : how_(how), to_ours_(how.scale, how.up), frames_(std::move(frames)) {
  check(how);
  if (!how_.fps) how_.fps = frames_->fps();
}

std::optional<SourceCloud> Source::next() {
  if (at_ == frames_->frames()) return std::nullopt;
  ++at_;
  SourceCloud out;
  out.fault = broken_;
  if (broken_) return out;
  try {
    out.frame = frames_->next().value();
  } catch (const InputError& error) {
    out.fault = error;
    return_to_place();
    return out;
  }
  out.fault = out.frame.fault;
  if (!out.fault && out.frame.points.empty())
    out.fault = InputError(out.frame.source, "holds no points", "leave the frame out");
  to_ours_(out.frame.points);
  if (out.frame.faces.empty()) {
    Points kept;
    const size_t strays = leave_out_strays(out.frame.points, &kept);
    if (strays > 0) out.frame.points = std::move(kept);
    out.frame.left_out += strays;
  }
  return out;
}

void Source::skip(int64_t frames) {
  for (; frames > 0 && at_ < frames_->frames(); --frames, ++at_)
    if (!broken_) frames_->skip();
}

void Source::rewind() {
  at_ = 0;
  broken_.reset();
  frames_->rewind();
}

/// Behind a frame that could not be read, whatever the reader did about it.
void Source::return_to_place() {
  try {
    frames_->rewind();
    for (int64_t i = 0; i < at_; ++i) frames_->skip();
  } catch (const InputError& error) {
    broken_ = error;
  }
}

void check_first_frames(Source& source) {
  std::vector<Mesh> first;
  for (int i = 0; i < kSourceFrames; ++i) {
    auto cloud = source.next();
    if (!cloud) break;
    // What is of no use is told apart later, frame by frame.
    if (cloud->fault || cloud->frame.points.size() < kLeastDistinctPoints) continue;
    first.push_back({std::move(cloud->frame.points), std::move(cloud->frame.faces)});
  }
  source.rewind();
  const SourceRecord& how = source.record();
  check_source(first, how.path, {how.scale, how.up});
}

}  // namespace restage
