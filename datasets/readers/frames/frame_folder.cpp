#include "datasets/readers/frames/frame_folder.h"

#include <algorithm>
#include <filesystem>
#include <span>

#include "autograd/base/atomic_file.h"
#include "autograd/base/words.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/clouds/precision.h"
#include "datasets/readers/clouds/table_frames.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/readers/gltf/gltf.h"
#include "datasets/readers/text/text.h"

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
    const size_t at = at_++;
    const std::string& file = list_.files[at];
    Frame frame;
    try {
      frame = read(file);
    } catch (const InputError& error) {
      if (frames() == 1) throw;
      frame.fault = error;
    }
    frame.source = file;
    if (!list_.numbers.empty()) frame.number = list_.numbers[at];
    if (frame.points.empty() && frames() == 1)
      throw InputError(
          file,
          frame.left_out > 0 ? "holds no points but NaN and infinite ones" : "holds no points",
          "give a cloud that has some");
    return frame;
  }
  void skip() override { at_ = std::min(at_ + 1, list_.files.size()); }
  void rewind() override { at_ = faint_ = 0; }
  int64_t frames() const override { return std::ssize(list_.files); }
  double fps() const override { return kFps; }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out = list_.remarks;
    if (faint_ > 0)
      out.push_back(cat("left out ", counted(faint_, "splat"), " of an opacity below a tenth"));
    return out;
  }
  std::vector<int64_t> numbers() const override { return list_.numbers; }

 private:
  Frame read(const std::string& file) {
    Frame frame;
    if (file.ends_with('/')) return frame;  // a folder without a frame
    if (is_array_name(file)) return read_array_frame(file, options_);
    LeftOut left_out;
    Mesh mesh = read_frame_mesh(file, left_out, options_.origin);
    if (!options_.far) check_precision(mesh.vertices, file, kDoctorMoves);
    frame.left_out = left_out.non_finite;
    faint_ += left_out.faint;
    frame.points = std::move(mesh.vertices);
    frame.faces = std::move(mesh.faces);
    return frame;
  }

  FrameList list_;
  FrameOptions options_;
  size_t at_ = 0;
  size_t faint_ = 0;  // splats that were left out
};

/// A table of points that holds a whole recording.
class RecordedTable : public FrameSource {
 public:
  RecordedTable(std::string path, TableFrames table, bool far)
      : path_(std::move(path)), table_(std::move(table)), far_(far) {}
  std::optional<Frame> next() override {
    if (at_ == frames()) return std::nullopt;
    const auto at = table_.points.begin();
    const int64_t begin = table_.offset[static_cast<size_t>(at_)];
    const int64_t end = table_.offset[static_cast<size_t>(at_) + 1];
    Frame frame;
    frame.source = cat(path_, ":", at_++);
    frame.points.assign(at + begin, at + end);
    frame.left_out = leave_out_non_finite(frame.points, frame.faces);
    if (!far_) check_precision(frame.points, frame.source, kDoctorMoves);
    return frame;
  }
  void skip() override { at_ = std::min(at_ + 1, frames()); }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return std::ssize(table_.offset) - 1; }
  double fps() const override { return table_.fps > 0 ? table_.fps : kFps; }
  std::vector<std::string> remarks() const override { return {table_.remark}; }

 private:
  std::string path_;
  TableFrames table_;
  bool far_;
  int64_t at_ = 0;
};

/// Nothing if the file holds one cloud, or what reads that says what is wrong.
std::unique_ptr<FrameSource> open_recorded_table(const std::string& path,
                                                 const FrameOptions& options) {
  const bool text =
      (is_cloud_name(path) || may_be_cloud_name(path)) && !text::ends_in(path, {".pcd", ".bin"});
  if (!text) return nullptr;
  try {
    const std::string content = read_file(path);
    if (!names_frames(content)) return nullptr;
    if (auto table = parse_table_frames(content, path, options.origin))
      return std::make_unique<RecordedTable>(path, std::move(*table), options.far);
  } catch (const InputError&) {
  }
  return nullptr;
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

}  // namespace

std::unique_ptr<FrameSource> open_frame_list(FrameList list, const FrameOptions& options) {
  if (list.files.size() == 1)
    if (auto table = open_recorded_table(list.files[0], options)) return table;
  return std::make_unique<FileFrames>(std::move(list), options);
}

std::unique_ptr<FrameSource> open_frames(const std::string& path, const FrameOptions& options) {
  std::error_code error;
  const bool folder = fs::is_directory(path, error);
  if (!folder) refuse_foreign_content(path);
  if (!folder && is_hdf5(path) && options.clip.empty()) return open_hdf5_frames(path, options);
  const bool array = !folder && is_array_name(path) && options.clip.empty();
  if (options.sequence && !array) check_sequence(path, *options.sequence, 1);
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
    throw InputError(path, "has no clips to choose from", "leave {clip} out, or give a glTF file");
  if (folder) {
    FrameList list = frames_in(path);
    if (list.files.empty()) throw_no_frames(path);
    return open_frame_list(std::move(list), options);
  }
  if (!fs::exists(path, error))
    throw InputError(path, "does not exist",
                     "give a folder of frames, or a PLY, OBJ, glTF, NPY, NPZ or HDF5 file");
  if (is_array_name(path)) return open_array_frames(path, options);
  refuse_foreign_kind(path);
  FrameList one;
  one.files = {path};
  return open_frame_list(std::move(one), options);
}

Vec3 far_origin(const std::string& path, const FrameOptions& options) {
  FrameOptions anywhere = options;
  anywhere.far = true;
  const std::unique_ptr<FrameSource> frames = open_frames(path, anywhere);
  while (const std::optional<Frame> frame = frames->next())
    if (!frame->points.empty())
      return is_blurred(frame->points) ? Vec3(frame->points[0].cast<double>()) : Vec3(Vec3::Zero());
  return Vec3::Zero();
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
      if (frame->fault) faults_.push_back(*frame->fault);
      if (frame->points.empty()) {
        ++missing;
        continue;
      }
      frame->missing = missing;
      frame->left_out = left_out;
      any_ = true;
      return frame;
    }
    at_end_ = missing;
    if (!any_ && !faults_.empty()) throw faults_[0];
    return std::nullopt;
  }
  void skip() override { next(); }
  void rewind() override {
    all_->rewind();
    faults_.clear();
    any_ = false;
  }
  int64_t frames() const override { return all_->frames(); }
  int64_t sequences() const override { return all_->sequences(); }
  double fps() const override { return all_->fps(); }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out = all_->remarks();
    if (at_end_ > 0)
      out.push_back("its last " + std::to_string(at_end_) +
                    " frames have no points and are left out");
    if (!faults_.empty()) out.push_back(remark_on_faults(faults_));
    return out;
  }

 private:
  std::unique_ptr<FrameSource> all_;
  int64_t at_end_ = 0;  // frames without a point behind the last one; known when that was read
  std::vector<InputError> faults_;
  bool any_ = false;  // of the frames has points
};

}  // namespace

std::string remark_on_faults(const std::vector<InputError>& faults) {
  constexpr size_t kListed = 3;
  std::string out =
      faults.size() == 1
          ? "1 frame could not be read and counts as a frame without points: "
          : cat(faults.size(), " frames could not be read and count as frames without points: ");
  out += joined(std::span(faults).first(std::min(faults.size(), kListed)), &InputError::complaint,
                "; ");
  return faults.size() > kListed ? cat(out, "; and ", faults.size() - kListed, " more") : out;
}

std::unique_ptr<FrameSource> without_empty_frames(std::unique_ptr<FrameSource> all) {
  return std::make_unique<SeenFrames>(std::move(all));
}

}  // namespace restage
