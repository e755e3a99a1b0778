#include "datasets/importers/scans.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "autograd/base/format.h"
#include "datasets/doctor/examine.h"
#include "datasets/doctor/orientation_model.h"
#include "datasets/doctor/shape.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/clouds/point_path.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

// ---- finding -----------------------------------------------------------------------------------

/// Without those in folders below it.
std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code ignored;
  for (fs::directory_iterator item(folder, ignored), end; !ignored && item != end;
       item.increment(ignored))
    if (std::error_code failed; item->is_regular_file(failed)) out.push_back(item->path().string());
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

size_t count_pickles(const std::string& folder) {
  const std::vector<std::string> files = files_in(folder);
  return static_cast<size_t>(std::count_if(files.begin(), files.end(), is_pickle_name));
}

/// The sequences of a file.
void add_file(const std::string& file, const FrameOptions& options,
              std::vector<ScanSequence>& out) {
  if (!is_hdf5(file) && !is_array_name(file)) return out.push_back({file, file, {}, {}});
  const int64_t sequences = open_frames(file, options)->sequences();
  if (sequences == 1) return out.push_back({file, file, {}, {}});
  for (int64_t s = 0; s < sequences; ++s) out.push_back({cat(file, ":", s), file, s, {}});
}

/// The arrays of a folder: sequences by themselves, single frames together. Among frames, one that
/// cannot be read is a frame that shows nothing.
void add_arrays(const std::string& folder, const std::vector<std::string>& files,
                uint64_t max_memory, std::vector<ScanSequence>& out,
                std::vector<std::string>& skipped) {
  std::vector<std::string> frames, damaged;
  std::map<std::string, std::string> why;  // of files that are of no use
  for (const std::string& file : files) {
    try {
      refuse_foreign_content(file);
      const std::optional<CloudArray> cloud = find_cloud(file, max_memory);
      if (!cloud)
        why[file] = file + ": holds no points";
      else if (cloud->axes.sequence)
        add_file(file, {"", max_memory}, out);
      else
        frames.push_back(file);
    } catch (const InputError& error) {
      damaged.push_back(file);
      why[file] = error.what();
    }
  }
  if (!frames.empty()) {
    if (damaged.size() < frames.size()) frames.insert(frames.end(), damaged.begin(), damaged.end());
    out.push_back({folder, "", {}, order_frames(frames, folder)});
    for (const std::string& file : out.back().frames.files) why.erase(file);
  }
  for (const std::string& file : files)
    if (why.count(file) > 0) skipped.push_back(why[file]);
}

/// What lies in a folder itself.
void add_folder(const std::string& folder, uint64_t max_memory, std::vector<ScanSequence>& out,
                std::vector<std::string>& skipped) {
  for (const std::string& file : files_in(folder)) {
    if (!is_hdf5(file)) continue;
    try {
      add_file(file, {"", max_memory}, out);
    } catch (const InputError& error) {  // our own data files, mostly
      skipped.emplace_back(error.what());
    }
  }
  const std::vector<std::string> files = frame_files(folder);
  if (!files.empty() && std::all_of(files.begin(), files.end(), is_array_name))
    return add_arrays(folder, files, max_memory, out, skipped);
  if (!files.empty()) out.push_back({folder, "", {}, frame_list(folder)});
}

/// Where its files are one, its folders are no frames; nor where it cannot be told.
bool is_series_of_files(const std::string& folder) {
  try {
    return frame_list(folder).is_series;
  } catch (const InputError&) {
    return true;  // add_folder() says why
  }
}

/// The folders below `path` that are looked into one by one; those whose folders are frames are
/// sequences.
std::vector<std::string> add_folders_of_frames(const std::string& path,
                                               std::vector<ScanSequence>& out,
                                               std::vector<std::string>& skipped) {
  std::vector<std::string> rest;
  std::string taken;  // what lies below the last sequence is in it
  for (const std::string& folder : folders_below(path)) {
    if (!taken.empty() && folder.starts_with(taken)) continue;
    FrameList frames;
    bool refused = false;
    if (!is_series_of_files(folder)) try {
        frames = folder_a_frame(folder);
      } catch (const InputError& error) {
        skipped.emplace_back(error.what());
        refused = true;
      }
    if (frames.files.empty()) rest.push_back(folder);
    if (frames.files.empty() && !refused) continue;
    taken = folder + "/";
    if (!refused) out.push_back({folder, "", {}, std::move(frames)});
  }
  return rest;
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
                       "give metres a unit as {scale}");
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

std::string rate_of(double fps, bool given, bool stated, int64_t frames, const Clock& clock) {
  const char* from = given ? "{fps}" : stated ? "the file's" : "taken for granted: {fps}";
  return rate_fact(fps, from, frames, clock);
}

constexpr size_t kFewest = 64;  // different points that retargeting needs

size_t different_points(const Points& points) {
  std::set<std::array<float, 3>> different;
  for (const Point& p : points)
    if (different.insert({p.x(), p.y(), p.z()}).second && different.size() == kFewest) break;
  return different.size();
}

/// Writes frames at our rate. Where one shows nobody (too few points), the nearest that do stand in
/// its place, up to a second long.
class HoldingWriter {
 public:
  HoldingWriter(ScanWriter& out, const std::string& name) : out_(out), name_(name) {}

  /// `different`: how many of the points are (different_points()).
  void push(const Frame& frame, size_t different) {
    const Points& points = frame.points;
    if (different < kFewest) {
      if (missing_ == 0) {
        fault_ = frame.fault;
        first_ = fault_ ? fault_->complaint()
                        : cat(frame.source, ": has only ", different, " different points");
      }
      ++missing_;
      return;
    }
    for (int64_t k = 0; k < missing_; ++k)
      out_.append(before_ && 2 * k < missing_ ? *before_ : points);
    settle();
    out_.append(points);
    fewest_ = before_ ? std::min(fewest_, points.size()) : points.size();
    most_ = std::max(most_, points.size());
    before_ = points;
  }

  void finish(ImportReport& report) {
    if (!before_ && fault_) throw *fault_;
    if (!before_)
      throw InputError(name_, "shows nobody: " + first_, "give scans of 64 points or more");
    for (int64_t k = 0; k < missing_; ++k) out_.append(*before_);
    settle();
    out_.end_sequence();
    report.fact("points", fewest_ == most_ ? std::to_string(most_) : cat(fewest_, " to ", most_));
    if (held_ > 0)
      report.remark(cat(counted(held_, "frame shows", "frames show"),
                        " too little (fewer than 64 points): the nearest in time ",
                        held_ == 1 ? "stands" : "stand", " there"));
  }

 private:
  void settle() {
    if (static_cast<double>(missing_) > kFps)
      throw InputError(name_,
                       cat("shows nobody for ", missing_, " frames (30 a second), from ", first_),
                       "cut the sequence there");
    held_ += missing_;
    missing_ = 0;
  }

  ScanWriter& out_;
  std::string name_, first_;
  std::optional<InputError> fault_;  // of the first missing frame, if it could not be read
  std::optional<Points> before_;
  int64_t missing_ = 0, held_ = 0;
  size_t fewest_ = 0, most_ = 0;
};

/// InputError for the path of one point, and for a size (the median distance to the median point,
/// 0.26 to 0.63 m of a person in any pose) that is no person's and not that of some people in a
/// room either. A remark if a size that passes looks more like one in another unit.
void check_person(const Frame& frame, double given_scale, ImportReport& report) {
  // Arrays and tables hold anything; meshes and their kin hold surfaces.
  if (!is_mesh_name(frame.source) && is_path(frame.points))
    throw InputError(frame.source, kPath, cat(kPathFix, ", or {force} to take it as it is"));
  constexpr double kLeast = 0.1, kMost = 5;
  const Box box = box_of(frame.points);
  const double width = (box.max().cast<double>() - box.min().cast<double>()).norm();
  const double size = width < 1e7 ? doctor_detail::normalised(frame.points).size : width;
  const double metres = given_scale > 0 ? given_scale * size : size;
  const UnitGuess guess = guess_unit(size);
  const bool other = guess.unit.metres != 1 && guess.sure > 0.5;
  if (metres > kLeast && metres < kMost) {
    if (!(given_scale > 0) && other && guess.sure > 0.9)
      report.remark(format("a unit seems to be %.6g m: if so, give {scale} %.6g", guess.unit.metres,
                           guess.unit.metres));
    return;
  }
  if (given_scale > 0)
    throw InputError(
        frame.source,
        format("is %.3g m large with {scale} %.6g, which no person is", width * given_scale,
               given_scale),
        "give the true metres a unit, leave {scale} out to hear what it seems, or {force}");
  if (other)
    throw InputError(
        frame.source,
        format("is %.3g units large, which no person is in metres; a unit seems to "
               "be %.6g m",
               width, guess.unit.metres),
        format("give {scale} %.6g, or {force} to take it as it is", guess.unit.metres));
  throw InputError(frame.source,
                   format("is %.3g units large, which no person is in any unit", width),
                   "give scans of one person, metres a unit as {scale}, or {force}");
}

/// By the first file of a sequence that can be read.
bool shows_camera_axes(const ScanSequence& sequence, uint64_t max_memory) {
  const std::string& first = !sequence.file.empty()          ? sequence.file
                             : sequence.frames.files.empty() ? sequence.name
                                                             : sequence.frames.files[0];
  try {
    return is_array_name(first) && is_seen_by_camera(first, max_memory);
  } catch (const InputError&) {
    return false;  // who reads the frames says what is wrong
  }
}

std::string size_fact(const Points& points) {
  const Point size = box_of(points).sizes();
  return format("%.3g x %.3g x %.3g m in the first frame (x, y, z)", size.x(), size.y(), size.z());
}

/// Writes the frames at our rate.
int64_t copy_frames(FrameSource& source, const Clock& clock, const Eigen::Matrix3f& to_ours,
                    const std::string& name, const MotionOptions& options, ScanWriter& out,
                    ImportReport& report) {
  HoldingWriter writer(out, name);
  Frame frame;
  bool first = true;
  size_t left_out = 0, different = 0;
  std::vector<InputError> faults;
  int64_t at = 0;  // of the source, the frame that next() gives
  const int64_t count = clock.count();
  for (int64_t k = 0; k < count; ++k) {
    for (; at < clock.source(k); ++at) source.skip();
    if (at == clock.source(k)) {  // else the frame before, once more
      frame = *source.next();
      ++at;
      left_out += frame.left_out;
      if (frame.fault) faults.push_back(*frame.fault);
      different = different_points(frame.points);
      const bool look = first && different >= kFewest;
      if (look && !options.force) check_person(frame, options.scale, report);
      convert(frame, to_ours);
      if (look) report.fact("size", size_fact(frame.points));
      first = first && !look;
    }
    writer.push(frame, different);
  }
  if (left_out > 0)
    report.remark(
        cat("left out ", counted(left_out, "point"), " whose coordinates are NaN or infinite"));
  for (const std::string& remark : source.remarks()) report.remark(remark);
  if (!faults.empty()) report.remark(remark_on_faults(faults));
  writer.finish(report);
  return count;
}

}  // namespace

std::vector<ScanSequence> find_scans(const std::string& path, uint64_t max_memory,
                                     std::vector<std::string>& skipped) {
  std::error_code ignored;
  std::vector<ScanSequence> out;
  if (!fs::is_directory(path, ignored)) {
    add_file(path, {"", max_memory}, out);
    return out;
  }
  for (const std::string& folder : add_folders_of_frames(path, out, skipped)) {
    try {
      add_folder(folder, max_memory, out, skipped);
    } catch (const InputError& error) {
      skipped.emplace_back(error.what());
    }
    if (const size_t n = count_pickles(folder))
      skipped.push_back(
          cat(folder, ": ", n,
              " pickles (.pkl), of which only motions of a body model are read; docs/formats.md "
              "shows how to convert others"));
  }
  const auto by_name = [](const ScanSequence& a, const ScanSequence& b) {
    return natural_less(a.name, b.name);
  };
  std::stable_sort(out.begin(), out.end(), by_name);
  return out;
}

int64_t import_scans(const ScanSequence& sequence, const MotionOptions& options,
                     uint64_t max_memory, ScanWriter& out, ImportReport& report) {
  const bool one = !sequence.file.empty();
  const FrameOptions how{"", max_memory, sequence.part};
  const auto source = one ? open_frames(sequence.file, how) : open_frame_list(sequence.frames, how);
  const bool stated =
      source->fps() != kFps ||
      (one && ((is_array_name(sequence.file) && stated_fps(sequence.file, max_memory)) ||
               (is_hdf5(sequence.file) && states_fps(sequence.file))));
  const double fps = options.fps > 0 ? options.fps : source->fps();
  const double scale = options.scale > 0 ? options.scale : 1;
  const Clock clock(source->frames(), fps);
  report.file = sequence.name;
  report.fact("rate", rate_of(fps, options.fps > 0, stated, source->frames(), clock));
  report.fact("scale", options.scale > 0 ? format("%.6g m a unit ({scale})", scale)
                                         : "metres (taken for granted: {scale})");
  const bool given_up = options.rest.up != Axis::automatic;
  const bool camera = !given_up && shows_camera_axes(sequence, max_memory);
  const Axis up = given_up ? options.rest.up : camera ? Axis::minus_y : Axis::y;
  report.fact("up", to_string(up) + (given_up ? " ({up})"
                                     : camera ? " (a camera's axes: {up})"
                                              : " (taken for granted: {up})"));
  if (camera)
    report.remark(
        "these are vertices as a camera saw them, whose y points down: turned about x by 180 "
        "degrees ({up} y if they were turned before); the body stays where its vertices are, "
        "pred_cam_t is not added");
  const Eigen::Matrix3f to_ours = (scale * upright(up)).cast<float>();

  return copy_frames(*source, clock, to_ours, sequence.name, options, out, report);
}

int64_t import_frames(FrameSource& source, const std::string& name, const MotionOptions& options,
                      bool stated, ScanWriter& out, ImportReport& report) {
  const double fps = options.fps > 0 ? options.fps : source.fps();
  const Clock clock(source.frames(), fps);
  report.fact("rate", rate_of(fps, options.fps > 0, stated, source.frames(), clock));
  return copy_frames(source, clock, Eigen::Matrix3f::Identity(), name, options, out, report);
}

}  // namespace restage
