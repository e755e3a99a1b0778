#include "experiments/source.h"

#include <algorithm>

#include "autograd/base/words.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/gltf/gltf.h"
#include "nn/models/extraction.h"

namespace restage {
namespace {

void check(const SourceRecord& how) {
  if (how.fps && !(*how.fps >= 1 && *how.fps <= 1000))
    throw InputError("", "--fps is out of range", "give the source's frames per second, 1 to 1000");
  if (how.fps && *how.fps != kFps && is_gltf_name(how.path))  // it is played at that rate
    throw InputError(how.path, "states its key times, which --fps cannot change",
                     "leave --fps out");
}

}  // namespace

Source::Source(const SourceRecord& how, uint64_t max_memory)
    : how_(how), to_ours_(how.scale, how.up) {
  check(how);
  frames_ =
      open_frames(how.path, {.clip = how.clip, .max_memory = max_memory, .sequence = how.sequence});
  check_one_sequence(how.path, frames_->sequences(), how.sequence);
  if (!how_.fps) how_.fps = frames_->fps();
  end_ = frames_->frames();
  find_person();
}

Source::Source(const SourceRecord& how, std::unique_ptr<FrameSource> frames)
    : how_(how), to_ours_(how.scale, how.up), frames_(std::move(frames)) {
  check(how);
  if (!how_.fps) how_.fps = frames_->fps();
  end_ = frames_->frames();
  find_person();
}

void Source::find_person() {
  if (!how_.person) return;
  int64_t first = -1, last = -1;
  for (int64_t frame = 0; const auto cloud = read(); ++frame)
    if (!cloud->fault) first = first < 0 ? frame : first, last = frame;
  const size_t people = people_.people();
  rewind();
  if (first >= 0) {
    begin_ = first, end_ = last + 1;
    return;
  }
  if (people == 0)
    throw InputError(how_.path, "shows nobody: no piece of its clouds is half a metre large",
                     "give the unit with --scale; if a floor or a wall is in the clouds, take it "
                     "out first with restage doctor --fix");
  throw InputError(
      how_.path, cat("shows ", counted(people, "person", "people"), ", no number ", *how_.person),
      "count them from 0, from -x to +x, then as they come ('restage doctor --people' lists them); "
      "a floor joins people: restage doctor --fix takes it out");
}

std::optional<SourceCloud> Source::next() {
  while (at_ < begin_) read();
  return read();
}

std::optional<SourceCloud> Source::read() {
  if (at_ == end_) return std::nullopt;
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
  if (out.frame.faces.empty())
    out.frame.left_out += to_ours_.clean(out.frame.points);
  else
    to_ours_(out.frame.points);
  if (how_.person && !out.fault) choose_person(out);
  return out;
}

void Source::choose_person(SourceCloud& cloud) {
  const auto who = static_cast<size_t>(*how_.person);
  Frame& frame = cloud.frame;
  std::vector<Points> people = people_.follow(frame.points);
  if (who < people.size()) frame.points = std::move(people[who]);
  frame.faces.clear();
  if (who >= people.size() || frame.points.size() < kLeastDistinctPoints)
    cloud.fault =
        InputError(frame.source, cat("does not show person ", who), "leave the frame out");
}

void Source::skip(int64_t frames) {
  if (how_.person)  // nobody is followed through frames that nobody looks at
    for (; frames > 0 && at_ < end_; --frames) next();
  for (; frames > 0 && at_ < end_; --frames, ++at_)
    if (!broken_) frames_->skip();
}

void Source::rewind() {
  at_ = 0;
  people_.restart();
  broken_.reset();
  frames_->rewind();
}

std::vector<std::string> Source::remarks() const {
  std::vector<std::string> out = frames_->remarks();
  if (frames() < frames_->frames())
    out.push_back(cat("person ", *how_.person, " is in sight in frames ", begin_, " to ", end_ - 1,
                      " of ", frames_->frames(), ": these are taken"));
  const std::vector<int64_t> numbers = frames_->numbers();
  if (numbers.size() < 2) return out;
  int64_t step = INT64_MAX, missing = 0;
  for (size_t i = 1; i < numbers.size(); ++i) step = std::min(step, numbers[i] - numbers[i - 1]);
  if (step < 1) return out;
  for (size_t i = 1; i < numbers.size(); ++i) missing += (numbers[i] - numbers[i - 1]) / step - 1;
  if (missing > 0)
    out.push_back(cat(counted(missing, "number is", "numbers are"),
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

void check_one_sequence(const std::string& path, int64_t sequences,
                        const std::optional<int64_t>& chosen) {
  if (!chosen && sequences > 1)
    throw InputError(path, cat("holds ", sequences, " sequences"),
                     "choose one with --sequence N, from 0");
}

SourceFrame frame_of(const SourceRecord& how) { return {how.scale, how.up, how.up_known}; }

/// Some clouds, evenly from first to last.
static std::vector<Points> clouds_of_take(Source& source) {
  constexpr int64_t kClouds = 40;
  const int64_t step = std::max<int64_t>(1, source.frames() / kClouds);
  std::vector<Points> out;
  for (int64_t at = 0; at < source.frames(); at += step) {
    auto cloud = source.next();
    if (!cloud) break;
    if (!cloud->fault) out.push_back(std::move(cloud->frame.points));
    source.skip(step - 1);
  }
  source.rewind();
  return out;
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
  check_source(first, source.record().path, frame_of(source.record()),
               [&] { return clouds_of_take(source); });
}

}  // namespace restage
