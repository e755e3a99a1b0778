#include "experiments/pictures/rows.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/readers/gltf/gltf.h"
#include "experiments/pictures/view.h"

namespace restage {
namespace {

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return std::filesystem::equivalent(a, b, error) && !error;
}

/// What the file says of its source, if that is still there.
std::optional<SourceRecord> remembered_source(const std::string& file, Remarks& remarks) {
  std::optional<SourceRecord> out;
  if (is_hdf5(file)) out = read_source_record(file);
  std::error_code error;
  if (!out || std::filesystem::exists(out->path, error)) return out;
  remarks.push_back("the source of " + file + ", " + out->path +
                    ", is not there any more: it is left out");
  return std::nullopt;
}

/// Which source is drawn, and how it is read; nothing if none is.
std::optional<SourceRecord> source_of(const SourceRecord& file, const Comparison& how,
                                      Remarks& remarks) {
  if (!how.remembered && how.source.empty()) return std::nullopt;
  std::optional<SourceRecord> out = remembered_source(file.path, remarks);
  if (!out && how.needed && remarks.empty())
    throw InputError(file.path, "does not say what it was made from", "name the file");
  if (!how.source.empty()) {
    // Of another source than its own a file knows nothing.
    if (!out || !is_same_file(out->path, how.source)) out = SourceRecord{.sequence = file.sequence};
    out->path = how.source;
  }
  if (!out) return out;
  if (how.clip) out->clip = *how.clip;
  if (how.up) out->up = *how.up;
  if (how.fps) out->fps = how.fps;
  if (how.scale) out->scale = *how.scale;
  if (how.sequence) out->sequence = how.sequence;
  return out;
}

/// What is said of a source is of no use without one.
void check_needs_source(const Comparison& how) {
  for (const auto& [given, name] :
       {std::pair(how.clip.has_value(), "clip"), std::pair(how.up.has_value(), "up"),
        std::pair(how.scale.has_value(), "scale"), std::pair(how.sequence.has_value(), "sequence")})
    if (given)
      throw InputError("", cat("--source-", name, " belongs to a source, and there is none"),
                       "say which file it is, or leave it out");
}

/// Median distance of the first frame's points from its middle, metres.
double size_of(const Clip& clip) {
  const Point centre = clip_centre(clip.frames[0]);
  std::vector<float> away;
  for (const Point& p : clip.frames[0])
    if (p.allFinite()) away.push_back((p - centre).norm());
  if (away.empty()) return 0;
  const auto half = away.begin() + std::ssize(away) / 2;
  std::nth_element(away.begin(), half, away.end());
  return static_cast<double>(*half);
}

/// Somebody a thousand times as large as the file's is an empty row.
void compare_sizes(const Clip& source, const Clip& result, const std::string& path,
                   Remarks& remarks) {
  constexpr double kMostTimes = 4;
  const double times = size_of(source) / std::max(size_of(result), 1e-9);
  if (times > kMostTimes || times < 1 / kMostTimes)
    remarks.push_back(path + ": somebody " + format("%.3g", times) +
                      " times the size of the result; --source-scale says how many metres a unit "
                      "has");
}

/// Another rate may cut off or add a frame.
void check_same_motion(const Clip& truth, const std::string& truth_path, const Clip& result,
                       const std::string& path) {
  const double seconds = static_cast<double>(truth.frames.size()) / truth.fps;
  const double other = static_cast<double>(result.frames.size()) / result.fps;
  if (std::abs(seconds - other) > 1.5 / std::min(truth.fps, result.fps))
    throw InputError(truth_path,
                     "has " + counted(truth.frames.size(), "frame") +
                         format(" (%.3g s), and ", seconds) + path + " has " +
                         counted(result.frames.size(), "frame") + format(" (%.3g s)", other),
                     "give the truth of the same motion");
}

/// The same fault where the options of the source have names of their own.
InputError of_source(const InputError& fault) {
  std::string mend = fault.mend();
  for (const char* option : {"clip", "fps", "scale", "sequence"})
    for (size_t at = 0; (at = mend.find(cat("--", option), at)) != std::string::npos;)
      mend.insert(at + 2, "source-"), at += 9;
  return {fault.where(), fault.cause(), mend};
}

/// A recording of a skeleton, which has no clouds, as a stick figure.
Clip read_recording(const SourceRecord& how, const Look& look, uint64_t max_memory, Rows& rows) {
  ShowRequest request;
  request.path = how.path;
  request.clip = how.clip;
  request.look = look;
  request.fps = how.fps;
  request.sequence = how.sequence;
  request.max_memory = max_memory;
  if (how.up_known || how.up != SourceRecord{}.up) request.up = how.up;
  if (how.scale != SourceRecord{}.scale) request.scale = how.scale;
  Showing shown = read_showing(request);
  rows.remarks.insert(rows.remarks.end(), shown.remarks.begin(), shown.remarks.end());
  rows.close_up = std::max(rows.close_up, shown.close_up);
  return std::move(shown.clip);
}

}  // namespace

Rows read_rows(const SourceRecord& file, const Comparison& how, const Look& look,
               uint64_t max_memory) {
  Rows rows;
  const auto read = [&](const SourceRecord& one, const std::string& label) {
    if (!is_gltf_name(one.path) && holds_take(one.path)) {
      Clip out = read_recording(one, look, max_memory, rows);
      out.label = label;
      return out;
    }
    Clip out = read_clip(one, label, max_memory, rows.remarks);
    if (look.part.empty()) return out;
    Aim aim = aim_at(read_joints(one.path, one.sequence), look, out);
    out.focus = std::move(aim.focus);
    rows.close_up = std::max(rows.close_up, aim.close_up);
    return out;
  };
  std::optional<SourceRecord> source = source_of(file, how, rows.remarks);
  if (!source) check_needs_source(how);
  const std::optional<double> fps = source ? std::nullopt : how.fps;
  // A close-up needs joints. A source that nobody asked for is then left out.
  const bool drawn =
      source && (look.part.empty() || !how.source.empty() || has_joints(source->path));
  if (source && !drawn)
    rows.remarks.push_back(source->path + " does not say where its joints are: it is left out");
  Clip result = read(file, "result");
  if (fps) result.fps = *fps;
  const auto timed = [&](Clip clip) {
    return at_rate(std::move(clip), result.fps, result.frames.size());
  };
  if (drawn) {
    try {
      rows.clips.push_back(timed(read(*source, "source")));
    } catch (const InputError& fault) {
      throw of_source(fault);
    }
    compare_sizes(rows.clips[0], result, source->path, rows.remarks);
    rows.source = source->path;
  }
  std::optional<Clip> truth;
  if (!how.truth.empty()) {
    Clip whole = read({.path = how.truth, .sequence = file.sequence}, "truth");
    if (fps) whole.fps = *fps;
    check_same_motion(whole, how.truth, result, file.path);
    truth = timed(std::move(whole));
    add_errors(*truth, &result);
  }
  rows.result = rows.clips.size();
  rows.clips.push_back(std::move(result));
  if (truth) rows.clips.push_back(std::move(*truth));
  return rows;
}

}  // namespace restage
