#include "datasets/importers/joints/joint_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/text/text.h"

namespace restage {

using joints_detail::SeenFrame;

namespace joints_detail {

constexpr double kFits = 0.12;  // misfit() of somebody, noise of lifters included

namespace {

std::string names_of(const std::vector<const JointLayout*>& layouts) {
  std::string out;
  for (const JointLayout* layout : layouts) out += cat(out.empty() ? "" : " or ", layout->name);
  return out;
}

}  // namespace

std::optional<JointLayout> choose_layout(const std::vector<FileFrame>& frames,
                                         const std::string& asked, const std::string& where,
                                         bool sure) {
  const size_t count = frames.empty() ? 0 : frames[0].size();
  if (sure) require_known(frames, where);
  if (!asked.empty()) {
    const JointLayout& layout = joint_layout(asked);
    if (layout.count != count)
      throw InputError(
          where, cat("has ", count, " joints a frame, {layout} ", asked, " has ", layout.count),
          "give the layout that the program which wrote it names");
    return layout;
  }
  const std::vector<const JointLayout*> all = layouts_of(count);
  if (all.empty() && !sure) return {};
  if (all.empty())
    throw InputError(where, cat("holds ", count, " joints a frame, an order that is not known"),
                     "save those of a known order (docs/formats.md, {layout}), such as COCO's 17");
  const JointLayout* best = nullptr;
  double least = 0, second = std::numeric_limits<double>::infinity();
  for (const JointLayout* layout : all) {
    const double m = misfit(frames, *layout);
    if (best == nullptr || m < least) {
      if (best != nullptr) second = least;
      best = layout, least = m;
    } else {
      second = std::min(second, m);
    }
  }
  const bool fits = least < kFits;
  if (!fits && !sure) return {};
  if (!fits || second < 1.5 * least)
    throw InputError(where,
                     cat("holds ", count, " joints a frame, and ",
                         fits ? "more than one order fits" : "no known order of so many fits"),
                     cat("say which it is with {layout} ", names_of(all)));
  return *best;
}

std::optional<Vec3> joint_at(double x, double y, double z, double confidence, bool first) {
  const Vec3 out(x, y, z);
  if (!out.allFinite() || confidence <= 0 || (!first && out.isZero(0))) return {};
  return out;
}

size_t person_of(const std::string& asked, size_t people, const std::string& where,
                 const std::string& ids) {
  const std::string called = ids.empty() ? "" : " (ids " + ids + ")";
  if (asked.empty() && people > 1)
    throw InputError(where, cat("holds ", people, " people", called),
                     "choose one with {person} N, from 0");
  if (asked.empty()) return 0;
  int64_t number = 0;
  if (!text::parse(std::string_view(asked), number) || number < 0 ||
      static_cast<size_t>(number) >= people)
    throw InputError(where,
                     cat("holds ", counted(people, "person", "people"), called, ", no number ",
                         text::quote(asked)),
                     ids.empty() ? "count them from 0" : "count them from 0, by their ids");
  return static_cast<size_t>(number);
}

void check_dense(size_t frames, size_t joints, uint64_t bytes, const std::string& where) {
  constexpr size_t kMostFrames = size_t{1} << 20;
  const double places = static_cast<double>(frames) * static_cast<double>(joints);
  if (frames > kMostFrames || joints > kMostJoints ||
      places * sizeof(std::optional<Vec3>) > 3e7 + 32 * static_cast<double>(bytes))
    throw InputError(
        where,
        cat("would make ", frames, " frames of ", joints, " joints, far more than is in the file"),
        "check how its frames and joints are numbered, or cut it");
}

namespace {

/// "'a', 'b' and 3 more"
std::string some_of(const std::vector<std::string>& names) {
  constexpr size_t kSome = 4;
  std::string out;
  for (size_t i = 0; i < std::min(kSome, names.size()); ++i)
    out += (i == 0 ? "" : ", ") + text::quote(names[i]);
  return names.size() > kSome ? cat(out, " and ", names.size() - kSome, " more") : out;
}

}  // namespace

void require_known(const std::vector<FileFrame>& frames, const std::string& where) {
  for (const FileFrame& frame : frames)
    for (const std::optional<Vec3>& x : frame)
      if (x && !x->isZero(0)) return;
  throw InputError(where,
                   cat("knows no joint in any of ", counted(frames.size(), "frame"),
                       ": all are null, NaN, 0 0 0 or of confidence 0"),
                   "give places of joints");
}

void require_trunk(const JointRecording& recording, const std::string& where) {
  for (const FileFrame& frame : recording.frames)
    if (trunk_of(mapped(frame, recording.layout).joints)) return;
  require_known(recording.frames, where);
  const std::vector<std::string>& unknown = recording.layout.unknown;
  throw InputError(
      where,
      cat("holds joints without both hips and both shoulders of anybody in any of ",
          counted(recording.frames.size(), "frame"),
          unknown.empty() ? "" : "; names that are not understood: " + some_of(unknown)),
      unknown.empty()
          ? "give a tracker's joints of the whole trunk"
          : "call joints left_hip, right_shoulder and so on (docs/joints_to_motion.md)");
}

void require_depth(const JointRecording& recording, const std::string& where) {
  constexpr double kFlat = 0.01;  // of the larger extent; nobody is so thin
  double widest = 0, deepest = 0;
  for (const FileFrame& frame : recording.frames) {
    Eigen::AlignedBox3d box;
    for (const auto& x : frame)
      if (x) box.extend(*x);
    if (box.isEmpty()) continue;
    widest = std::max(widest, box.sizes().maxCoeff());
    deepest = std::max(deepest, box.sizes().z());
  }
  if (deepest < kFlat * widest)
    throw InputError(where, "holds places in pictures: its joints all lie in one plane",
                     "lift them to three dimensions first, and give that program's joints");
}

void check_recording(JointRecording& recording, const JointFileOptions& options,
                     const std::string& where) {
  require_trunk(recording, where);
  require_depth(recording, where);
  if (!recording.layout.unknown.empty())
    recording.remarks.push_back("passed over are joints called " +
                                some_of(recording.layout.unknown));
  if (!options.layout.empty() && misfit(recording.frames, recording.layout) > kFits)
    recording.remarks.push_back(
        cat("in the order ", options.layout,
            " bones change their length or differ from left to right as nobody's "
            "do: is that the order?"));
}

}  // namespace joints_detail

namespace {

/// Whether a file may lie beside a recording's frames without being one of them: a note, a picture,
/// a film, a file of settings.
bool is_beside(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  return name.find('.') == name.npos ||
         text::ends_in(name, {".txt", ".md",  ".rst",  ".pdf",  ".html", ".xml", ".yaml",
                              ".yml", ".log", ".jpg",  ".jpeg", ".png",  ".mp4", ".mov",
                              ".avi", ".mkv", ".webm", ".zip",  ".ini",  ".db"});
}

/// The JSON files of a folder of frames, and what else lies there. No frames where there are other
/// files of data, or fewer frames than other files.
struct FrameFolder {
  std::vector<std::string> frames, others;
};
FrameFolder frame_folder(const std::string& path) {
  FrameFolder out;
  for (const std::string& file : files_below(path))
    (text::ends_in(file, {".json"}) ? out.frames : out.others).push_back(file);
  const bool of_data = std::any_of(out.others.begin(), out.others.end(),
                                   [](const std::string& file) { return !is_beside(file); });
  if (of_data || out.others.size() >= out.frames.size()) out.frames.clear();
  return out;
}

std::string passed_over(const std::vector<std::string>& others) {
  const std::string first = std::filesystem::path(others[0]).filename().string();
  return others.size() == 1
             ? first + " is no JSON, and is passed over"
             : cat(others.size(), " files are no JSON, and are passed over: ", first, " ...");
}

}  // namespace

bool may_hold_joints(const std::string& path) {
  return is_pickle_name(path) ||
         text::ends_in(path, {".npy", ".npz", ".csv", ".txt", ".json", ".jsonl", ".trc"});
}

std::optional<JointRecording> find_joint_recording(const std::string& path,
                                                   const JointFileOptions& options) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::optional<JointRecording> out;
  if (fs::is_directory(path, error)) {
    const FrameFolder files = frame_folder(path);
    if (files.frames.empty()) return {};
    out = joints_detail::joints_of_json(files.frames, path, options);
    if (out && !files.others.empty()) out->remarks.push_back(passed_over(files.others));
  } else if (!fs::exists(path, error) || !may_hold_joints(path)) {
    return {};
  } else if (text::ends_in(path, {".json", ".jsonl"})) {
    out = joints_detail::joints_of_json({path}, path, options);
  } else if (text::ends_in(path, {".trc"})) {
    out = joints_detail::joints_of_trc(path, options);
  } else if (is_array_name(path) || is_pickle_name(path)) {
    out = joints_detail::joints_of_arrays(path, options);
  } else {
    out = joints_detail::joints_of_table(path, options);
  }
  if (out) joints_detail::check_recording(*out, options, path);
  return out;
}

void refuse_recordings_in(const std::string& folder, const JointFileOptions& options) {
  const std::vector<std::string> files = files_below(folder, may_hold_joints);
  if (files.empty()) return;
  try {
    JointFileOptions any = options;
    any.person = "0";
    const auto first = find_joint_recording(files[0], any);
    if (!first || first->frames.size() < 2) return;
  } catch (const InputError&) {
    return;  // what reads the folder says what is wrong
  }
  if (files.size() == 1)
    throw InputError(folder, "is a folder with a recording of joints in it",
                     "give the file, " + files[0]);
  throw InputError(
      folder,
      cat("holds ", files.size(), " recordings of joints, a file each: ",
          std::filesystem::path(files[0]).filename().string(), ", ",
          std::filesystem::path(files[1]).filename().string(), files.size() > 2 ? " ..." : ""),
      "give one of the files, or make motions of all: restage data import " + folder +
          " --out M.h5");
}

}  // namespace restage
