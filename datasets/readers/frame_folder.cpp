#include "datasets/readers/frame_folder.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "datasets/readers/array_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/folders.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/gltf.h"
#include "datasets/readers/hdf5_frames.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Files of one frame each.
class FileFrames : public FrameSource {
 public:
  FileFrames(FrameList list, const FrameOptions& options)
      : list_(std::move(list)), options_(options) {}
  std::optional<Frame> next() override {
    if (at_ == list_.files.size()) return std::nullopt;
    const std::string& file = list_.files[at_];
    Frame frame;
    if (!list_.numbers.empty()) frame.number = list_.numbers[at_];
    ++at_;
    if (is_array_name(file)) {
      const int64_t number = frame.number;
      frame = read_array_frame(file, options_);
      frame.number = number;
    } else {
      Mesh mesh = read_frame_mesh(file, frame.left_out);
      frame.points = std::move(mesh.vertices);
      frame.faces = std::move(mesh.faces);
      frame.source = file;
    }
    if (frame.points.empty() && frames() == 1)
      throw InputError(
          file,
          frame.left_out > 0 ? "holds no points but NaN and infinite ones" : "holds no points",
          "give a cloud that has some");
    return frame;
  }
  void skip() override { at_ = std::min(at_ + 1, list_.files.size()); }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return std::ssize(list_.files); }
  double fps() const override { return kFps; }
  std::vector<std::string> remarks() const override { return list_.remarks; }

 private:
  FrameList list_;
  FrameOptions options_;
  size_t at_ = 0;
};

/// A character that performs a clip.
class ClipFrames : public FrameSource {
 public:
  ClipFrames(Gltf file, const std::string& clip)
      : file_(std::move(file)),
        clip_(&find_clip(file_, clip)),
        frames_(clip_frames(file_, *clip_)) {
    if (file_.vertices.empty())
      throw InputError(file_.path, "holds no mesh that could be seen",
                       "export the character with its mesh");
  }
  std::optional<Frame> next() override {
    if (at_ == frames_) return std::nullopt;
    const double seconds = clip_->begin + static_cast<double>(at_) / kFps;
    Mesh mesh = gltf_mesh(file_, gltf_pose(file_, *clip_, seconds));
    return Frame{cat(file_.path, ":", at_++), std::move(mesh.vertices), std::move(mesh.faces), 0};
  }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return frames_; }
  double fps() const override { return kFps; }

 private:
  Gltf file_;
  const GltfClip* clip_;  // of file_, which does not move
  int64_t frames_, at_ = 0;
};

// ---- folders -----------------------------------------------------------------------------------

std::string ending_of(const std::string& path) {
  return lower_case(fs::path(path).extension().string());
}

/// Of one frame in several kinds of files the first of these is taken, unless there are more files
/// of another.
constexpr std::string_view kEndings[] = {".ply", ".obj", ".pcd",    ".glb",  ".gltf",
                                         ".vrm", ".xyz", ".xyzrgb", ".xyzn", ".pts",
                                         ".asc", ".npz", ".npy",    ".csv",  ".txt"};

size_t rank_of(const std::string& ending) {
  return static_cast<size_t>(std::find(std::begin(kEndings), std::end(kEndings), ending) -
                             std::begin(kEndings));
}

/// Files of a folder that could be frames, in no order. Texts (.txt, .csv) only where there is
/// nothing else, and if they look like tables of points.
std::vector<std::string> candidates_in(const std::string& folder) {
  std::vector<std::string> out, texts;
  std::error_code error;
  for (fs::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error)) {
    const std::string path = item->path().string();
    std::error_code ignored;
    if (item->path().filename().string()[0] == '.' || item->is_directory(ignored)) continue;
    if (is_mesh_name(path) || is_cloud_name(path) || is_array_name(path)) out.push_back(path);
    if (is_text_name(path)) texts.push_back(path);
  }
  if (error) throw InputError(folder, "cannot be read (" + error.message() + ")", "check the path");
  if (out.empty())
    std::copy_if(texts.begin(), texts.end(), std::back_inserter(out), is_table_of_points);
  return out;
}

/// Of files of one name with several endings only one, with a remark.
std::vector<std::string> one_of_each(const std::vector<std::string>& files,
                                     std::vector<std::string>& remarks) {
  std::map<std::string, size_t> count;  // of an ending
  std::map<std::string, std::vector<std::string>> by_stem;
  for (const std::string& file : files) {
    ++count[ending_of(file)];
    by_stem[fs::path(file).stem().string()].push_back(file);
  }
  const auto better = [&](const std::string& a, const std::string& b) {
    const std::string x = ending_of(a), y = ending_of(b);
    if (is_array_name(a) != is_array_name(b)) return is_array_name(b);
    return count[x] != count[y] ? count[x] > count[y] : rank_of(x) < rank_of(y);
  };
  std::map<std::string, size_t> twice;
  std::vector<std::string> out;
  for (auto& [stem, same] : by_stem) {
    std::sort(same.begin(), same.end(), better);
    out.push_back(same[0]);
    for (size_t i = 1; i < same.size(); ++i) ++twice[ending_of(same[i])];
  }
  for (const auto& [ending, n] : twice)
    remarks.push_back(cat("left out ", n, " ", ending, n == 1 ? " file" : " files",
                          ": the same frames are there as another kind of file"));
  return out;
}

/// The frames among these files: meshes and clouds before arrays, which beside them are mostly
/// something else, unless only the arrays are a series.
FrameList frames_among(const std::string& folder, const std::vector<std::string>& files) {
  std::vector<std::string> remarks, meshes, arrays;
  for (const std::string& file : one_of_each(files, remarks))
    (is_array_name(file) ? arrays : meshes).push_back(file);
  const bool series_of_arrays = meshes.size() == 1 && arrays.size() > 1;
  FrameList out = order_frames(meshes.empty() || series_of_arrays ? arrays : meshes, folder);
  const std::vector<std::string>& others = series_of_arrays ? meshes : arrays;
  if (!meshes.empty() && !others.empty())
    out.remarks.push_back(cat("left out ", others.size(), " ", ending_of(others[0]),
                              others.size() == 1 ? " file" : " files", " beside the ",
                              out.files.size(), " frames"));
  out.remarks.insert(out.remarks.begin(), remarks.begin(), remarks.end());
  return out;
}

/// The one frame that lies in a folder or below it (texts count where there is nothing else); empty
/// if there is none, or are several.
std::string only_frame_below(const std::string& folder) {
  std::vector<std::string> files, texts, ignored;
  for (const std::string& inner : folders_below(folder))
    for (const std::string& file : one_of_each(candidates_in(inner), ignored))
      (is_text_name(file) ? texts : files).push_back(file);
  const std::vector<std::string>& found = files.empty() ? texts : files;
  return found.size() == 1 ? found[0] : "";
}

std::vector<std::string> folders_in(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error)) {
    std::error_code ignored;
    if (item->path().filename().string()[0] != '.' && item->is_directory(ignored))
      out.push_back(item->path().string());
  }
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

[[noreturn]] void throw_no_frames(const std::string& path) {
  std::vector<std::string> with_frames;
  for (const std::string& folder : folders_in(path))
    if (!candidates_in(folder).empty()) with_frames.push_back(folder);
  if (!with_frames.empty())
    throw InputError(path,
                     cat("holds no frames itself, but ", with_frames.size(), " of its folders do"),
                     cat("give one sequence, such as ", with_frames[0]));
  throw InputError(path,
                   "holds no PLY, OBJ or glTF files, no clouds (PCD, XYZ) and no arrays (NPY, NPZ)",
                   "give a folder of numbered frames");
}

}  // namespace

FrameList frame_list(const std::string& folder) {
  return frames_among(folder, candidates_in(folder));
}

FrameList folder_a_frame(const std::string& folder) {
  const std::vector<std::string> folders = folders_in(folder);
  if (folders.size() < 2) return {};
  FrameList out = order_folders(folders, folder);
  if (out.files.empty()) return out;
  const std::string first = only_frame_below(out.files[0]);
  const std::string name = first.empty() ? "" : fs::path(first).extension().string();
  for (std::string& file : out.files) {
    file = file == out.files[0] ? first : only_frame_below(file);
    if (file.empty() || fs::path(file).extension().string() != name) return {};
  }
  out.remarks.insert(out.remarks.begin(),
                     cat("a folder a frame: ", out.files.size(), " folders are one sequence"));
  return out;
}

std::vector<std::string> frame_files(const std::string& folder) {
  std::vector<std::string> out = candidates_in(folder);
  std::sort(out.begin(), out.end(), natural_less);
  return out;
}

std::unique_ptr<FrameSource> open_frame_list(FrameList list, const FrameOptions& options) {
  return std::make_unique<FileFrames>(std::move(list), options);
}

std::unique_ptr<FrameSource> open_frames(const std::string& path, const FrameOptions& options) {
  std::error_code error;
  const bool folder = fs::is_directory(path, error);
  if (!folder && is_hdf5(path) && options.clip.empty()) return open_hdf5_frames(path, options);
  if (options.sequence) check_sequence(path, *options.sequence, 1);
  if (!folder && is_gltf_name(path)) {
    Gltf file = read_gltf(path);
    if (file.vertices.empty() && !file.clips.empty())
      throw InputError(path, "holds a motion without a surface",
                       "import it (restage data import) and let a body perform it (restage data "
                       "perform)");
    if (!options.clip.empty() || !file.clips.empty())
      return std::make_unique<ClipFrames>(std::move(file), options.clip);
  }
  if (!options.clip.empty())
    throw InputError(path, "has no clips to choose from", "leave --clip out, or give a glTF file");
  if (folder) {
    FrameList list = frame_list(path);
    if (list.files.empty()) list = folder_a_frame(path);
    if (list.files.empty()) throw_no_frames(path);
    return open_frame_list(std::move(list), options);
  }
  if (!fs::exists(path, error))
    throw InputError(path, "does not exist",
                     "give a folder of frames, or a PLY, OBJ, glTF, NPY, NPZ or HDF5 file");
  if (is_array_name(path)) return open_array_frames(path, options);
  refuse_foreign_kind(path);
  return open_frame_list({{path}, {}, {}}, options);
}

namespace {

/// Without frames that show nothing.
class SeenFrames : public FrameSource {
 public:
  explicit SeenFrames(std::unique_ptr<FrameSource> all) : all_(std::move(all)) {}
  std::optional<Frame> next() override {
    int64_t missing = 0;
    size_t left_out = 0;
    while (std::optional<Frame> frame = all_->next()) {
      left_out += frame->left_out;
      if (frame->points.empty()) {
        ++missing;
        continue;
      }
      frame->missing = missing;
      frame->left_out = left_out;
      return frame;
    }
    at_end_ = missing;
    return std::nullopt;
  }
  void skip() override { next(); }
  void rewind() override { all_->rewind(); }
  int64_t frames() const override { return all_->frames(); }
  int64_t sequences() const override { return all_->sequences(); }
  double fps() const override { return all_->fps(); }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out = all_->remarks();
    if (at_end_ > 0)
      out.push_back("its last " + std::to_string(at_end_) +
                    " frames have no points and are left out");
    return out;
  }

 private:
  std::unique_ptr<FrameSource> all_;
  int64_t at_end_ = 0;  // frames without a point behind the last one; known when that was read
};

}  // namespace

std::unique_ptr<FrameSource> without_empty_frames(std::unique_ptr<FrameSource> all) {
  return std::make_unique<SeenFrames>(std::move(all));
}

}  // namespace restage
