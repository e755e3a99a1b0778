#include "datasets/readers/array_frames.h"

#include <array>

#include "datasets/readers/body_parameters.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/precision.h"
#include "datasets/readers/text.h"
#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

/// What clouds are called, the surest first.
constexpr std::array<std::string_view, 20> kClouds = {
    "points",     "vertices",    "verts", "v_posed", "xyz",    "pointcloud",   "point_cloud",
    "cloud",      "pc",          "pcl",   "pcd",     "pts",    "coords",       "positions",
    "scan_verts", "scan_points", "scan",  "v",       "vertex", "scan_vertices"};
/// What has the shape of a cloud and is none.
constexpr std::array<std::string_view, 30> kOthers = {
    "normals",  "normal",     "n",      "vn",          "colors",      "colours",  "color",    "rgb",
    "faces",    "f",          "face",   "triangles",   "trans",       "transl",   "cam_trans", "translation",
    "joints",   "joints3d",   "j3d",    "keypoints",   "keypoints3d", "kp3d",     "j_posed",  "velocity",
    "v_cano",   "v_template", "uv",     "root_orient", "global_orient", "markers"};

template <class Names>
bool is_one_of(const std::string& name, const Names& names) {
  const std::string lower = lower_case(name);
  return std::find(names.begin(), names.end(), lower) != names.end();
}

std::optional<CloudAxes> axes_of(const NpyHeader& header) {
  return header.is_text() ? std::nullopt : cloud_axes(header.shape);
}

/// The header of an array that may be of a kind that is not read: such a one is no cloud.
std::optional<NpyHeader> header_if_readable(const Npz& file, const std::string& name) {
  try {
    return file.header(name);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// One array, from its file or archive, and what stands before it.
struct OpenArray {
  std::unique_ptr<ByteStream> in;
  NpyHeader header;
  CloudAxes axes;
};

OpenArray open_array(const std::string& path, uint64_t max_memory) {
  OpenArray out;
  if (is_npz_name(path)) {
    const Npz file(path, max_memory);
    const std::optional<CloudArray> cloud = find_cloud(file);
    if (!cloud)
      throw InputError(path, "holds no points (its arrays: " + list_of(file.names()) + ")",
                       "save an array [N, 3] or [F, N, 3] named 'points'");
    out.in = file.open(cloud->name);
  } else {
    out.in = std::make_unique<FileStream>(path);
  }
  out.header = read_npy_header(*out.in);
  const std::optional<CloudAxes> axes = axes_of(out.header);
  if (!axes)
    throw InputError(out.in->where(),
                     "is an array " + shape_text(out.header.shape) + ", which is no cloud",
                     "give points as [N, 3] or [F, N, 3]");
  out.axes = *axes;
  return out;
}

class ArrayFrames : public FrameSource {
 public:
  ArrayFrames(const std::string& path, const FrameOptions& options)
      : path_(path), array_(open_array(path, options.max_memory)) {
    const uint64_t max_memory = options.max_memory;
    fps_ = stated_fps(path, max_memory).value_or(kFps);
    if (array_.header.count == 0 && array_.axes.sequence)
      throw InputError(array_.in->where(), "holds no points", "give a cloud that has some");
    if (array_.header.fortran || !array_.axes.in_order()) {
      array_.in->rewind();
      whole_.emplace(*array_.in, max_memory);
    } else if (bytes_per_frame() > max_memory) {
      throw InputError(path, cat("has frames of ", bytes_per_frame(), " bytes"),
                       "allow more with --max-memory");
    }
  }

  std::optional<Frame> next() override {
    if (at_ == frames()) return std::nullopt;
    Frame frame;
    frame.source = array_.axes.sequence ? cat(path_, ":", at_) : path_;
    read(frame);
    ++at_;
    frame.left_out = leave_out_non_finite(frame.points, frame.faces);
    check_precision(frame.points, frame.source, kSubtract);
    return frame;
  }
  void skip() override {
    if (at_ == frames()) return;
    if (!whole_) array_.in->skip(bytes_per_frame());
    ++at_;
  }
  void rewind() override {
    at_ = 0;
    if (whole_) return;
    array_.in->rewind();
    array_.header = read_npy_header(*array_.in);
  }
  int64_t frames() const override { return array_.axes.frames; }
  double fps() const override { return fps_; }
  std::vector<std::string> remarks() const override {
    if (array_.axes.remark.empty()) return {};
    return {cat("an array ", shape_text(array_.header.shape), ": ", array_.axes.remark)};
  }

 private:
  uint64_t bytes_per_frame() const { return array_.header.bytes() / static_cast<uint64_t>(frames()); }

  void read(Frame& frame) {
    const std::vector<char> bytes =
        whole_ ? std::vector<char>() : array_.in->take(bytes_per_frame());
    const NpyHeader& header = array_.header;
    const CloudAxes& axes = array_.axes;
    frame.points.resize(axes.points);
    for (int64_t i = 0; i < axes.points; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const double value =
            whole_ ? (*whole_)[axes.at(at_, i, axis)]
                   : header.number(bytes.data() + axes.at(0, i, axis) * static_cast<int64_t>(header.width));
        frame.points[i][axis] =
            text::coordinate(value, [&] { return frame.source; }, NonFinite::mark);
      }
  }

  std::string path_;
  OpenArray array_;
  std::optional<NpyArray> whole_;
  int64_t at_ = 0;
  double fps_ = kFps;
};

}  // namespace

bool is_npz_name(const std::string& path) { return text::ends_in(path, {".npz"}); }

bool is_array_name(const std::string& path) { return text::ends_in(path, {".npy", ".npz"}); }

std::optional<CloudArray> named_cloud(const Npz& file) {
  for (const std::string_view wanted : kClouds)
    for (const std::string& name : file.names()) {
      if (lower_case(name) != wanted) continue;
      const NpyHeader header = file.header(name);
      if (const auto axes = axes_of(header)) return CloudArray{name, *axes};
    }
  return std::nullopt;
}

std::optional<CloudArray> find_cloud(const Npz& file) {
  if (auto cloud = named_cloud(file)) return cloud;
  if (body_parameters(file).moves())
    throw InputError(file.path(), "is a motion of a body model (as AMASS has them), not a scan",
                     "restage data import FILE --body-model MODEL --out M.h5, then restage data "
                     "perform --motions M.h5 makes clouds of it");
  std::optional<CloudArray> found;
  std::vector<std::string> several;
  for (const bool whole_numbers : {false, true}) {  // of scanners, where nothing else is there
    if (found) break;
    for (const std::string& name : file.names()) {
      const std::optional<NpyHeader> header = header_if_readable(file, name);
      if (!header || is_one_of(name, kOthers)) continue;
      const std::optional<CloudAxes> axes = axes_of(*header);
      if (!axes || (header->kind != 'f') != whole_numbers || header->kind == 'b') continue;
      found = CloudArray{name, *axes};
      several.push_back(name);
    }
  }
  if (several.size() > 1)
    throw InputError(file.path(), "holds several arrays of points: " + list_of(several),
                     "name the right one 'points'");
  return found;
}

std::optional<CloudArray> find_cloud(const std::string& path, uint64_t max_memory) {
  if (is_npz_name(path)) return find_cloud(Npz(path, max_memory));
  FileStream in(path);
  const std::optional<CloudAxes> axes = axes_of(read_npy_header(in));
  if (!axes) return std::nullopt;
  return CloudArray{"", *axes};
}

std::optional<double> stated_fps(const std::string& path, uint64_t max_memory) {
  if (!is_npz_name(path)) return std::nullopt;
  const Npz file(path, max_memory);
  for (const char* name : {"fps", "frame_rate", "framerate"}) {
    if (!file.has(name)) continue;
    const NpyArray fps = file.array(name);
    if (fps.is_text() || fps.size() != 1 || !(fps[0] >= 1 && fps[0] <= 1000))
      throw InputError(path + ":" + name, "is no frame rate", "store one number from 1 to 1000");
    return fps[0];
  }
  return std::nullopt;
}

std::unique_ptr<FrameSource> open_array_frames(const std::string& path,
                                               const FrameOptions& options) {
  return std::make_unique<ArrayFrames>(path, options);
}

Frame read_array_frame(const std::string& path, const FrameOptions& options) {
  ArrayFrames frames(path, options);
  if (frames.frames() != 1)
    throw InputError(path,
                     cat("is a sequence of ", frames.frames(), " frames where one frame belongs"),
                     "give this file by itself");
  return *frames.next();
}

}  // namespace restage
