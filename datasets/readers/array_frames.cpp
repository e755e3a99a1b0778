#include "datasets/readers/array_frames.h"

#include <algorithm>
#include <limits>

#include "datasets/readers/body_parameters.h"
#include "datasets/readers/cloud_names.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/precision.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

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

OpenArray open_array(std::unique_ptr<ByteStream> in) {
  OpenArray out{std::move(in), {}, {}};
  out.header = read_npy_header(*out.in);
  const std::optional<CloudAxes> axes = axes_of(out.header);
  if (!axes)
    throw InputError(out.in->where(),
                     "is an array " + shape_text(out.header.shape) + ", which is no cloud",
                     "give points as [N, 3] or [F, N, 3]");
  out.axes = *axes;
  if (out.header.count == 0 && out.axes.sequence)
    throw InputError(out.in->where(), "holds no points", "give a cloud that has some");
  return out;
}

CloudArray need_cloud(const Npz& file) {
  std::optional<CloudArray> cloud = find_cloud(file);
  if (!cloud)
    throw InputError(file.path(), "holds no points (its arrays: " + list_of(file.names()) + ")",
                     "save the points as an array [N, 3] or [F, N, 3] named 'points'");
  return *cloud;
}

/// The arrays that are the frames of a sequence, one each, as numpy.savez(*clouds) keeps clouds of
/// unequal size (arr_0, arr_1 ...); none if these are no series.
std::vector<std::string> series_of(const std::vector<std::string>& clouds) {
  std::vector<std::string> out = order_folders(clouds, "").files;
  if (out.size() != clouds.size()) out.clear();
  return out;
}

/// What an archive has that could be its cloud, where none is named so.
std::vector<CloudArray> unnamed_clouds(const Npz& file) {
  std::vector<CloudArray> out;
  for (const bool whole_numbers : {false, true}) {  // of scanners, where nothing else is there
    for (const std::string& name : file.names()) {
      const std::optional<NpyHeader> header = header_if_readable(file, name);
      if (!header) continue;
      const std::optional<CloudAxes> axes = axes_of(*header);
      if (axes && !is_no_cloud(name, !axes->sequence) && (header->kind != 'f') == whole_numbers &&
          header->kind != 'b')
        out.push_back({name, *axes});
    }
    if (!out.empty()) break;
  }
  return out;
}

std::vector<std::string> names_of(const std::vector<CloudArray>& clouds) {
  std::vector<std::string> out;
  out.reserve(clouds.size());
  for (const CloudArray& cloud : clouds) out.push_back(cloud.name);
  return out;
}

class ArrayFrames : public FrameSource {
 public:
  ArrayFrames(const std::string& path, OpenArray array, double fps, uint64_t max_memory)
      : path_(path), array_(std::move(array)), fps_(fps), max_memory_(max_memory) {
    settle_memory();
    const ReadSteps steps = [&](int64_t first, int64_t count) { return read_steps(first, count); };
    array_.axes = axes_by_numbers(array_.axes, array_.header.shape, steps);
    settle_memory();
    rewind();
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
  uint64_t bytes_per_frame() const {
    return array_.header.bytes() / static_cast<uint64_t>(frames());
  }

  /// The whole array is kept where a frame is spread over it.
  void settle_memory() {
    if (whole_) return;
    if (array_.header.fortran || !array_.axes.in_order()) {
      array_.in->rewind();
      whole_.emplace(*array_.in, max_memory_);
    } else if (bytes_per_frame() > max_memory_) {
      throw InputError(path_, cat("has frames of ", bytes_per_frame(), " bytes"),
                       "allow more with --max-memory");
    }
  }

  /// See ReadSteps; the file then stands somewhere else.
  std::vector<double> read_steps(int64_t first, int64_t count) {
    const NpyHeader& header = array_.header;
    const int64_t step = header.count / header.shape[0];
    std::vector<double> out;
    if (whole_) {
      for (int64_t i = first * step; i < (first + count) * step; ++i) out.push_back((*whole_)[i]);
      return out;
    }
    const auto bytes = static_cast<int64_t>(header.width) * step;
    rewind();
    array_.in->skip(static_cast<uint64_t>(first * bytes));
    const std::vector<char> all = array_.in->take(static_cast<uint64_t>(count * bytes));
    for (int64_t i = 0; i < count * step; ++i)
      out.push_back(header.number(all.data() + i * static_cast<int64_t>(header.width)));
    return out;
  }

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
                   : header.number(bytes.data() +
                                   axes.at(0, i, axis) * static_cast<int64_t>(header.width));
        frame.points[i][axis] = text::coordinate(
            value, [&] { return frame.source; }, NonFinite::mark);
      }
  }

  std::string path_;
  OpenArray array_;
  double fps_;
  uint64_t max_memory_;
  std::optional<NpyArray> whole_;
  int64_t at_ = 0;
};

/// Arrays of an archive, a frame each.
class SeriesFrames : public FrameSource {
 public:
  SeriesFrames(Npz file, std::vector<std::string> names, double fps, uint64_t max_memory)
      : file_(std::move(file)), names_(std::move(names)), fps_(fps), max_memory_(max_memory) {}

  std::optional<Frame> next() override {
    if (at_ == std::ssize(names_)) return std::nullopt;
    const std::string& name = names_[static_cast<size_t>(at_++)];
    std::optional<Frame> frame =
        ArrayFrames(file_.path(), open_array(file_.open(name)), fps_, max_memory_).next();
    frame->source = cat(file_.path(), ":", name);
    return frame;
  }
  void skip() override { at_ = std::min(at_ + 1, frames()); }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return std::ssize(names_); }
  double fps() const override { return fps_; }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out =
        ArrayFrames(file_.path(), open_array(file_.open(names_[0])), fps_, max_memory_).remarks();
    out.push_back(cat("its ", names_.size(), " arrays, ", text::quote(names_[0]), " to ",
                      text::quote(names_.back()), ", are the frames of a sequence"));
    return out;
  }

 private:
  Npz file_;
  std::vector<std::string> names_;
  double fps_;
  uint64_t max_memory_;
  int64_t at_ = 0;
};

}  // namespace

bool is_npz_name(const std::string& path) { return text::ends_in(path, {".npz"}); }

bool is_array_name(const std::string& path) { return text::ends_in(path, {".npy", ".npz"}); }

std::optional<CloudArray> named_cloud(const Npz& file) {
  std::optional<CloudArray> out;
  size_t best = std::numeric_limits<size_t>::max();
  for (const std::string& name : file.names()) {
    const std::optional<size_t> rank = cloud_rank(name);
    if (!rank || *rank >= best) continue;
    if (const auto axes = axes_of(file.header(name))) {
      best = *rank;
      out = CloudArray{name, *axes};
    }
  }
  return out;
}

std::optional<CloudArray> find_cloud(const Npz& file) {
  if (auto cloud = named_cloud(file)) return cloud;
  const BodyParameters parameters = body_parameters(file);
  if (parameters.moves())
    throw InputError(file.path(), "is a motion of a body model (as AMASS has them), not a scan",
                     "restage data import FILE --body-model MODEL --out M.h5, then restage data "
                     "perform --motions M.h5 makes clouds of it");
  const std::vector<CloudArray> found = unnamed_clouds(file);
  if (found.empty()) refuse_incomplete(file, parameters);
  if (found.empty()) return std::nullopt;
  if (found.size() == 1) return found[0];
  const bool single = std::none_of(found.begin(), found.end(),
                                   [](const CloudArray& cloud) { return cloud.axes.sequence; });
  const std::vector<std::string> series =
      single ? series_of(names_of(found)) : std::vector<std::string>();
  if (series.empty())
    throw InputError(file.path(), "holds several arrays of points: " + list_of(names_of(found)),
                     "name the right one 'points'");
  CloudArray out = found[0];
  out.name.clear();
  out.axes.sequence = true;
  out.axes.frames = std::ssize(series);
  return out;
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
  const uint64_t max_memory = options.max_memory;
  const double fps = stated_fps(path, max_memory).value_or(kFps);
  if (!is_npz_name(path))
    return std::make_unique<ArrayFrames>(path, open_array(std::make_unique<FileStream>(path)), fps,
                                         max_memory);
  Npz file(path, max_memory);
  const CloudArray cloud = need_cloud(file);
  std::vector<std::string> series;
  if (cloud.name.empty()) series = series_of(names_of(unnamed_clouds(file)));
  if (!series.empty())
    return std::make_unique<SeriesFrames>(std::move(file), std::move(series), fps, max_memory);
  return std::make_unique<ArrayFrames>(path, open_array(file.open(cloud.name)), fps, max_memory);
}

Frame read_array_frame(const std::string& path, const FrameOptions& options) {
  const std::unique_ptr<FrameSource> frames = open_array_frames(path, options);
  if (frames->frames() != 1)
    throw InputError(path,
                     cat("is a sequence of ", frames->frames(), " frames where one frame belongs"),
                     "give this file by itself");
  return *frames->next();
}

}  // namespace restage
