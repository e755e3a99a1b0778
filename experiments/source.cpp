#include "experiments/source.h"

#include <algorithm>

#include "datasets/importers/axis.h"
#include "datasets/readers/errors.h"
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
  if (out.frame.number >= 0) numbers_.push_back(out.frame.number);
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
  numbers_.clear();
  broken_.reset();
  frames_->rewind();
}

std::vector<std::string> Source::remarks() const {
  std::vector<std::string> out = frames_->remarks();
  if (std::ssize(numbers_) != frames_->frames() || numbers_.size() < 2) return out;
  int64_t step = INT64_MAX, missing = 0;
  for (size_t i = 1; i < numbers_.size(); ++i) step = std::min(step, numbers_[i] - numbers_[i - 1]);
  if (step < 1) return out;
  for (size_t i = 1; i < numbers_.size(); ++i)
    missing += (numbers_[i] - numbers_[i - 1]) / step - 1;
  if (missing > 0)
    out.push_back(cat(missing, missing == 1 ? " number is" : " numbers are",
                      " missing in the names of the frames, which are played without a pause; "
                      "'restage doctor --fix OUT' puts frames without points there"));
  return out;
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

SourceFrame frame_of(const SourceRecord& how) { return {how.scale, how.up, how.up_known}; }

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
  check_source(first, source.record().path, frame_of(source.record()));
}

}  // namespace restage
