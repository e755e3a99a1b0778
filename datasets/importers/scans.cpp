#include "datasets/importers/scans.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>

#include "autograd/base/format.h"
#include "datasets/doctor/orientation_model.h"
#include "datasets/doctor/shape.h"
#include "datasets/readers/array_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/folders.h"
#include "datasets/readers/frame_folder.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

// ---- finding -----------------------------------------------------------------------------------

size_t count_pickles(const std::string& folder) {
  size_t out = 0;
  std::error_code ignored;
  for (fs::directory_iterator item(folder, ignored), end; !ignored && item != end;
       item.increment(ignored))
    out += item->path().extension() == ".pkl";
  return out;
}

/// The arrays of a folder: sequences by themselves, single frames together.
void add_arrays(const std::string& folder, const std::vector<std::string>& files,
                uint64_t max_memory, std::vector<ScanSequence>& out,
                std::vector<std::string>& skipped) {
  ScanSequence frames{folder, {}};
  for (const std::string& file : files) {
    try {
      const std::optional<CloudArray> cloud = find_cloud(file, max_memory);
      if (!cloud)
        skipped.push_back(file + ": holds no points");
      else if (cloud->sequence)
        out.push_back({file, {file}});
      else
        frames.files.push_back(file);
    } catch (const InputError& error) {
      skipped.emplace_back(error.what());
    }
  }
  if (!frames.files.empty()) out.push_back(std::move(frames));
}

// ---- importing ---------------------------------------------------------------------------------

/// The source's frame at each of our frames: the nearest in time, the earlier of two.
class Clock {
 public:
  Clock(int64_t frames, double fps) : frames_(frames), fps_(fps) {}
  int64_t count() const {
    // A hair more than the last frame's time: 1 / 0.0166667 s is not exactly 60.
    return static_cast<int64_t>(static_cast<double>(frames_ - 1) / fps_ * kFps + 1e-3) + 1;
  }
  int64_t source(int64_t k) const {
    const double at = static_cast<double>(k) / kFps * fps_;
    return std::min(frames_ - 1, static_cast<int64_t>(std::ceil(at - 0.5 - 1e-9)));
  }

 private:
  int64_t frames_;
  double fps_;
};

/// Metres, y up.
void convert(Frame& frame, const Eigen::Matrix3f& to_ours) {
  for (Point& p : frame.points) {
    p = to_ours * p;
    if (!p.allFinite())
      throw InputError(frame.source, "is too large for that scale",
                       "give metres a unit as --scale");
  }
}

std::string rate_fact(double fps, const std::string& from, int64_t frames, const Clock& clock) {
  const std::string before = cat(format("%.6g fps (", fps), from, "), ", frames, " frames");
  if (fps == kFps) return before + ", kept";
  const int64_t count = clock.count();
  int64_t used = 1;
  for (int64_t k = 1; k < count; ++k) used += clock.source(k) != clock.source(k - 1);
  return cat(before, " -> 30 fps, ", count, " frames (the nearest in time: ", frames - used,
             " left out, ", count - used, " repeated)");
}

/// InputError unless there are 64 different points, as many as retargeting needs.
void check_count(const Frame& frame) {
  constexpr size_t kFewest = 64;
  std::set<std::array<float, 3>> different;
  for (const Point& p : frame.points)
    if (different.insert({p.x(), p.y(), p.z()}).second && different.size() == kFewest) return;
  throw InputError(frame.source, cat("has only ", different.size(), " different points"),
                   "give scans of 64 points or more");
}

/// InputError unless its size, the median distance to its median point, can be that of a person
/// (0.26 to 0.63 m in any pose) or of some people in a room: in metres where the scale is given,
/// else in some unit, with a remark if that is surely another than metres.
void check_size(const Frame& frame, double given_scale, ImportReport& report) {
  constexpr double kLeast = 0.1, kMost = 5, kMillimetre = 0.001;
  const Box box = box_of(frame.points);
  const double width = (box.max().cast<double>() - box.min().cast<double>()).norm();
  const double size = width < 1e7 ? doctor_detail::normalised(frame.points).size : width;
  if (given_scale > 0 && !(size * given_scale > kLeast && size * given_scale < kMost))
    throw InputError(frame.source,
                     format("is %.3g m large with --scale %.6g, which no person is",
                            width * given_scale, given_scale),
                     "give the true metres a unit, or leave --scale out to hear what it seems");
  if (!(given_scale > 0) && !(size > kLeast && size < kMost / kMillimetre))
    throw InputError(frame.source,
                     format("is %.3g units large, which no person is in any unit", width),
                     "give scans of one person, or metres a unit as --scale");
  const UnitGuess guess = guess_unit(size);
  if (!(given_scale > 0) && guess.unit.metres != 1 && guess.sure > 0.9)
    report.remark(format("a unit seems to be %.6g m: if so, give --scale %.6g", guess.unit.metres,
                         guess.unit.metres));
}

std::string size_fact(const Points& points) {
  const Point size = box_of(points).sizes();
  return format("%.3g x %.3g x %.3g m in the first frame (x, y, z)", size.x(), size.y(), size.z());
}

}  // namespace

std::vector<ScanSequence> find_scans(const std::string& path, uint64_t max_memory,
                                     std::vector<std::string>& skipped) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return {{path, {path}}};
  std::vector<ScanSequence> out;
  for (const std::string& folder : folders_below(path)) {
    const std::vector<std::string> files = frame_files(folder);
    if (!files.empty() && is_array_name(files[0]))
      add_arrays(folder, files, max_memory, out, skipped);
    else if (!files.empty())
      out.push_back({folder, files});
    if (const size_t n = count_pickles(folder))
      skipped.push_back(cat(folder, ": ", n,
                            " pickles (.pkl), which can run code and are never read; docs/data.md "
                            "shows how to convert them"));
  }
  return out;
}

int64_t import_scans(const ScanSequence& sequence, const MotionOptions& options,
                     uint64_t max_memory, ScanWriter& out, ImportReport& report) {
  const bool one = sequence.files.size() == 1;
  const auto source = one ? open_frames(sequence.files[0], {"", max_memory})
                          : open_frame_files(sequence.files, {"", max_memory});
  const bool stated =
      one && is_array_name(sequence.files[0]) && stated_fps(sequence.files[0], max_memory);
  const double fps = options.fps > 0 ? options.fps : source->fps();
  const double scale = options.scale > 0 ? options.scale : 1;
  const Clock clock(source->frames(), fps);
  report.file = sequence.name;
  report.fact("rate", rate_fact(fps,
                                options.fps > 0 ? "--fps"
                                : stated        ? "the file's"
                                                : "taken for granted: --fps",
                                source->frames(), clock));
  report.fact("scale", options.scale > 0 ? format("%.6g m a unit (--scale)", scale)
                                         : "metres (taken for granted: --scale)");
  const bool given_up = options.rest.up != Axis::automatic;
  const Axis up = given_up ? options.rest.up : Axis::y;
  report.fact("up", to_string(up) + (given_up ? " (--up)" : " (taken for granted: --up)"));
  const Eigen::Matrix3f to_ours = (scale * upright(up)).cast<float>();

  int64_t at = 0;  // of the source, the frame that next() gives
  size_t fewest = 0, most = 0;
  Points points;
  const int64_t count = clock.count();
  for (int64_t k = 0; k < count; ++k) {
    for (; at < clock.source(k); ++at) source->skip();
    if (at == clock.source(k)) {  // else the frame before, once more
      Frame frame = *source->next();
      ++at;
      check_count(frame);
      if (k == 0) check_size(frame, options.scale, report);
      convert(frame, to_ours);
      points = std::move(frame.points);
      if (k == 0) report.fact("size", size_fact(points));
      fewest = k == 0 ? points.size() : std::min(fewest, points.size());
      most = std::max(most, points.size());
    }
    out.append(points);
  }
  out.end_sequence();
  report.fact("points", fewest == most ? std::to_string(most) : cat(fewest, " to ", most));
  return count;
}

}  // namespace restage
