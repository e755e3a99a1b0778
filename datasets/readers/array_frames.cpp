#include "datasets/readers/array_frames.h"

#include "datasets/readers/errors.h"
#include "datasets/readers/precision.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

constexpr const char* kNames[] = {"points", "vertices", "verts", "v_posed"};

bool is_cloud(const NpyHeader& header) {
  const size_t axes = header.shape.size();
  return !header.is_text() && (axes == 2 || axes == 3) && header.shape.back() == 3;
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
  if (!is_cloud(out.header))
    throw InputError(out.in->where(),
                     "is an array " + shape_text(out.header.shape) + ", which is no cloud",
                     "give points as [N, 3] or [F, N, 3]");
  return out;
}

class ArrayFrames : public FrameSource {
 public:
  ArrayFrames(const std::string& path, const FrameOptions& options)
      : path_(path),
        array_(open_array(path, options.max_memory)),
        how_(options.leave_out_non_finite ? NonFinite::mark : NonFinite::refuse) {
    const uint64_t max_memory = options.max_memory;
    const NpyHeader& header = array_.header;
    const size_t axes = header.shape.size();
    frames_ = axes == 3 ? header.shape[0] : 1;
    points_ = header.shape[axes - 2];
    fps_ = stated_fps(path, max_memory).value_or(kFps);
    if (header.count == 0)
      throw InputError(array_.in->where(), "holds no points", "give a cloud that has some");
    if (header.fortran && axes == 3) {
      array_.in->rewind();
      whole_.emplace(*array_.in, max_memory);
    } else if (bytes_per_frame() > max_memory) {
      throw InputError(path, cat("has frames of ", bytes_per_frame(), " bytes"),
                       "allow more with --max-memory");
    }
  }

  std::optional<Frame> next() override {
    if (at_ == frames_) return std::nullopt;
    Frame frame;
    frame.source = array_.header.shape.size() == 3 ? cat(path_, ":", at_) : path_;
    read(frame);
    ++at_;
    if (how_ == NonFinite::mark) {
      frame.left_out = leave_out_non_finite(frame.points, frame.faces);
      if (frame.points.empty())
        throw InputError(frame.source, "holds no points but NaN and infinite ones",
                         "leave the frame out");
    }
    check_precision(frame.points, frame.source, kSubtract);
    return frame;
  }
  void skip() override {
    if (at_ == frames_) return;
    if (!whole_) array_.in->skip(bytes_per_frame());
    ++at_;
  }
  void rewind() override {
    at_ = 0;
    if (whole_) return;
    array_.in->rewind();
    array_.header = read_npy_header(*array_.in);
  }
  int64_t frames() const override { return frames_; }
  double fps() const override { return fps_; }

 private:
  uint64_t bytes_per_frame() const {
    return static_cast<uint64_t>(points_) * 3 * array_.header.width;
  }

  /// The next frame: of the stream, where a cloud [N, 3] in Fortran order lies axis by axis.
  void read(Frame& frame) {
    const std::vector<char> bytes =
        whole_ ? std::vector<char>() : array_.in->take(bytes_per_frame());
    const NpyHeader& header = array_.header;
    frame.points.resize(points_);
    for (int64_t i = 0; i < points_; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const int64_t element = header.fortran ? axis * points_ + i : 3 * i + axis;
        const double value = whole_ ? (*whole_)[3 * (at_ * points_ + i) + axis]
                                    : header.number(bytes.data() + element * header.width);
        frame.points[i][axis] = text::coordinate(
            value, [&] { return cat(frame.source, ": point ", i); }, how_);
      }
  }

  std::string path_;
  OpenArray array_;
  NonFinite how_;
  std::optional<NpyArray> whole_;
  int64_t frames_ = 0, points_ = 0, at_ = 0;
  double fps_ = kFps;
};

}  // namespace

bool is_npz_name(const std::string& path) { return text::ends_in(path, {".npz"}); }

bool is_array_name(const std::string& path) { return text::ends_in(path, {".npy", ".npz"}); }

std::optional<CloudArray> find_cloud(const Npz& file) {
  const auto cloud = [](const std::string& name, const NpyHeader& header) {
    return CloudArray{name, header.shape.size() == 3};
  };
  for (const char* name : kNames)
    if (file.has(name)) {
      const NpyHeader header = file.header(name);
      if (is_cloud(header)) return cloud(name, header);
    }
  if (file.has("poses") && file.has("trans"))
    throw InputError(file.path(), "is a motion in AMASS's format, not a scan",
                     "import it with restage data import");
  std::optional<CloudArray> found;
  std::vector<std::string> several;
  for (const std::string& name : file.names()) {
    const std::optional<NpyHeader> header = header_if_readable(file, name);
    if (!header || header->kind != 'f' || !is_cloud(*header)) continue;
    found = cloud(name, *header);
    several.push_back(name);
  }
  if (several.size() > 1)
    throw InputError(file.path(), "holds several arrays of points: " + list_of(several),
                     "name the right one 'points'");
  return found;
}

std::optional<CloudArray> find_cloud(const std::string& path, uint64_t max_memory) {
  if (is_npz_name(path)) return find_cloud(Npz(path, max_memory));
  FileStream in(path);
  const NpyHeader header = read_npy_header(in);
  if (!is_cloud(header)) return std::nullopt;
  return CloudArray{"", header.shape.size() == 3};
}

std::optional<double> stated_fps(const std::string& path, uint64_t max_memory) {
  if (!is_npz_name(path)) return std::nullopt;
  const Npz file(path, max_memory);
  if (!file.has("fps")) return std::nullopt;
  const NpyArray fps = file.array("fps");
  if (fps.is_text() || fps.size() != 1 || !(fps[0] >= 1 && fps[0] <= 1000))
    throw InputError(path + ":fps", "is no frame rate", "store one number from 1 to 1000");
  return fps[0];
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
