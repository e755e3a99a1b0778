#include "datasets/readers/frame_folder.h"

#include <algorithm>
#include <filesystem>

#include "datasets/readers/array_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/gltf.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/readers/precision.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The run of digits at `at`, without leading zeros; moves `at` behind it.
std::string take_digits(const std::string& text, size_t& at) {
  size_t begin = at;
  while (at < text.size() && is_digit(text[at])) ++at;
  while (begin + 1 < at && text[begin] == '0') ++begin;
  return text.substr(begin, at - begin);
}

/// Mesh or array files, one frame each.
class FileFrames : public FrameSource {
 public:
  FileFrames(std::vector<std::string> files, const FrameOptions& options)
      : files_(std::move(files)), options_(options) {}
  std::optional<Frame> next() override {
    if (at_ == files_.size()) return std::nullopt;
    const std::string& file = files_[at_++];
    if (is_array_name(file)) return read_array_frame(file, options_);
    size_t left_out = 0;
    Mesh mesh = options_.leave_out_non_finite ? read_mesh(file, left_out) : read_mesh(file);
    return Frame{file, std::move(mesh.vertices), std::move(mesh.faces), 0, left_out};
  }
  void skip() override { at_ = std::min(at_ + 1, files_.size()); }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return files_.size(); }
  double fps() const override { return kFps; }

 private:
  std::vector<std::string> files_;
  FrameOptions options_;
  size_t at_ = 0;
};

void check_sequence(const std::string& path, int64_t sequence, int64_t sequences) {
  if (sequence >= 0 && sequence < sequences) return;
  throw InputError(
      path, cat("has no sequence number ", sequence),
      sequences == 1 ? "it holds one, number 0" : cat("give a number from 0 to ", sequences - 1));
}

/// Scans or the vertices of a prediction: a data set of which a frame is some rows.
class Hdf5Frames : public FrameSource {
 public:
  /// Frame f has the rows [offset[f], offset[f + 1]); without offsets it is row f.
  Hdf5Frames(h5::File file, h5::Dataset set, std::vector<int64_t> offset)
      : file_(std::move(file)),
        set_(std::move(set)),
        offset_(std::move(offset)),
        end_(offset_.empty() ? set_.rows() : static_cast<int64_t>(offset_.size()) - 1),
        fps_(read_fps(file_)),
        sequence_{0, end_} {
    if (file_.has("/sequence_offset"))
      sequence_ = read_offsets(file_, "/sequence_offset", end_, true);
    require_frames();
    if (set_.shape().size() == 3 && file_.has("/faces"))
      faces_ = read_faces(file_, "/faces", set_.shape()[1]);
  }
  /// From now on the file is this sequence.
  void choose(int64_t sequence) {
    check_sequence(file_.path(), sequence, sequences());
    begin_ = at_ = sequence_[sequence];
    end_ = sequence_[sequence + 1];
    require_frames();
  }
  std::optional<Frame> next() override {
    if (at_ == end_) return std::nullopt;
    Frame frame;
    frame.source = cat(file_.path(), ":", at_);
    std::vector<float> values;
    set_.read_rows(row(at_), row(at_ + 1) - row(at_), values);
    check_finite(set_.where(), values, std::max<int64_t>(set_.row_size(), 1), row(at_));
    if (values.empty()) throw InputError(frame.source, "holds no points", "leave the frame out");
    frame.points.resize(values.size() / 3);
    std::copy(values.begin(), values.end(), frame.points[0].data());
    check_precision(frame.points, frame.source, kSubtract);
    frame.faces = faces_;
    frame.sequence =
        std::upper_bound(sequence_.begin(), sequence_.end(), at_) - sequence_.begin() - 1;
    ++at_;
    return frame;
  }
  void skip() override { at_ = std::min(at_ + 1, end_); }
  void rewind() override { at_ = begin_; }
  int64_t frames() const override { return end_ - begin_; }
  int64_t sequences() const override { return static_cast<int64_t>(sequence_.size()) - 1; }
  double fps() const override { return fps_; }

 private:
  int64_t row(int64_t frame) const { return offset_.empty() ? frame : offset_[frame]; }
  void require_frames() const {
    if (begin_ == end_)
      throw InputError(set_.where(), "holds no frames", "give a file with at least one frame");
  }
  h5::File file_;
  h5::Dataset set_;
  std::vector<int64_t> offset_;
  int64_t begin_ = 0, end_, at_ = 0;
  double fps_;
  std::vector<int64_t> sequence_;
  std::vector<Triangle> faces_;
};

std::unique_ptr<Hdf5Frames> open_hdf5(const std::string& path) {
  h5::File file = open_schema_file(path);
  const bool scans = file.has("/points");
  if (!scans && !file.has("/vertices"))
    throw InputError(
        path + ":/points", "is missing, and so is /vertices",
        "give a file of scans (/points, /frame_offset) or surfaces (/vertices [F, V, 3])");
  h5::Dataset set =
      scans ? file.dataset("/points", {-1, 3}) : file.dataset("/vertices", {-1, -1, 3});
  std::vector<int64_t> offset;
  if (scans) offset = read_offsets(file, "/frame_offset", set.rows(), false);
  return std::make_unique<Hdf5Frames>(std::move(file), std::move(set), std::move(offset));
}

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

bool is_hdf5_name(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  return extension == ".h5" || extension == ".hdf5" || extension == ".H5";
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string x = take_digits(a, i), y = take_digits(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
    }
  }
  if ((i == a.size()) != (j == b.size())) return i == a.size();
  return a < b;  // equal but for leading zeros: any fixed order
}

std::vector<std::string> frame_files(const std::string& folder) {
  std::vector<std::string> meshes, arrays;
  std::error_code error;
  for (std::filesystem::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error)) {
    const std::string name = item->path().filename().string();
    if (name[0] == '.' || item->is_directory()) continue;
    if (is_mesh_name(name)) meshes.push_back(item->path().string());
    if (is_array_name(name)) arrays.push_back(item->path().string());
  }
  if (error) throw InputError(folder, "cannot be read (" + error.message() + ")", "check the path");
  std::vector<std::string>& files = meshes.empty() ? arrays : meshes;
  std::sort(files.begin(), files.end(), natural_less);
  return files;
}

std::unique_ptr<FrameSource> open_frame_files(std::vector<std::string> files,
                                              const FrameOptions& options) {
  return std::make_unique<FileFrames>(std::move(files), options);
}

std::unique_ptr<FrameSource> open_frames(const std::string& path, const FrameOptions& options) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(path, error);
  if (!folder && is_hdf5_name(path) && options.clip.empty()) {
    auto frames = open_hdf5(path);
    if (options.sequence) frames->choose(*options.sequence);
    return frames;
  }
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
    std::vector<std::string> files = frame_files(path);
    if (files.empty())
      throw InputError(path, "holds no PLY, OBJ or glTF files and no arrays (NPY, NPZ)",
                       "give a folder of numbered frames");
    return open_frame_files(std::move(files), options);
  }
  if (!std::filesystem::exists(path, error))
    throw InputError(path, "does not exist",
                     "give a folder of frames, or a PLY, OBJ, glTF, NPY, NPZ or HDF5 file");
  if (is_array_name(path)) return open_array_frames(path, options);
  return open_frame_files({path}, options);
}

}  // namespace restage
