#include "datasets/readers/frames/array_frames.h"

#include <algorithm>
#include <limits>

#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/clouds/cloud_names.h"
#include "datasets/readers/clouds/precision.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/readers/frames/padding.h"
#include "datasets/readers/frames/ragged_frames.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

std::optional<CloudAxes> axes_of(const NpyHeader& header, int64_t vertices = 0) {
  return header.is_text() ? std::nullopt : cloud_axes(header.shape, vertices);
}

/// The header of an array that may be of a kind that is not read: such a one is no cloud.
std::optional<NpyHeader> header_if_readable(const Npz& file, const std::string& name) {
  try {
    return file.header(name);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// How many vertices the faces or a template beside a flat array [F, 3 V] speak of; 0 where nothing
/// does, and for arrays that are not flat.
int64_t vertices_beside(const Npz& file, const NpyHeader& flat) {
  if (flat.shape.size() != 2) return 0;
  const auto counts = [&](int64_t n) { return flat.shape[0] == 3 * n || flat.shape[1] == 3 * n; };
  for (const std::string& name : file.names()) {
    const std::optional<NpyHeader> header = header_if_readable(file, name);
    if (!header || header->is_text() || header->shape.size() != 2 || header->shape[1] != 3)
      continue;
    const std::string low = lower_case(name);
    if (low == "f" || low == "faces" || low == "triangles" || low == "tris" || low == "face") {
      const NpyArray faces = file.array(name);
      double last = -1;
      for (int64_t i = 0; i < faces.size(); ++i) last = std::max(last, faces[i]);
      if (counts(static_cast<int64_t>(last) + 1)) return static_cast<int64_t>(last) + 1;
    }
    const bool rest = low.find("template") != std::string::npos || low.starts_with("rest") ||
                      low.ends_with("rest") || low.starts_with("reference");
    if (rest && counts(header->shape[0])) return header->shape[0];
  }
  return 0;
}

/// InputError naming `where` for an array whose rows may be flat.
void refuse_flat(const std::string& where, const NpyHeader& header) {
  if (header.is_text()) return;
  if (const auto mend = flat_mend(header.shape))
    throw InputError(where, cat("is a flat array ", shape_text(header.shape), ", and no cloud"),
                     *mend);
}

/// One array, from its file or archive, and what stands before it.
struct OpenArray {
  std::unique_ptr<ByteStream> in;
  NpyHeader header;
  CloudAxes axes;
};

OpenArray open_array(std::unique_ptr<ByteStream> in, int64_t vertices = 0) {
  OpenArray out{std::move(in), {}, {}};
  out.header = read_npy_header(*out.in);
  const std::optional<CloudAxes> axes = axes_of(out.header, vertices);
  if (!axes) refuse_flat(out.in->where(), out.header);
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
std::vector<std::string> series_of(const std::vector<std::string>& clouds,
                                   const std::string& file) {
  std::vector<std::string> out = order_members(clouds, file).files;
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
      const std::optional<CloudAxes> axes = axes_of(*header, vertices_beside(file, *header));
      if (axes && !are_depth_pictures(name, header->shape) && !is_no_cloud(name, !axes->sequence) &&
          (header->kind != 'f') == whole_numbers && header->kind != 'b')
        out.push_back({name, *axes, {}});
    }
    if (!out.empty()) break;
  }
  return out;
}

/// The arrays of numbers beside one; with those of truth values, if `masks`.
std::vector<BesideArray> beside(const Npz& file, const std::string& cloud, bool masks) {
  std::vector<BesideArray> out;
  for (const std::string& name : file.names()) {
    const std::optional<NpyHeader> header = header_if_readable(file, name);
    if (name == cloud || !header || header->is_text() || (header->kind == 'b' && !masks)) continue;
    const auto read = [&file, name] {
      const NpyArray array = file.array(name);
      std::vector<double> numbers;
      for (int64_t i = 0; i < array.size(); ++i) numbers.push_back(array[i]);
      return numbers;
    };
    out.push_back({name, header->shape, header->kind != 'f', read});
  }
  return out;
}

/// The cloud as a sequence, if arrays beside it part it into frames.
CloudArray with_frames(const Npz& file, CloudArray cloud) {
  if (cloud.axes.sequence) return cloud;
  auto frames = ragged_frames(file.path(), cloud.axes.points, beside(file, cloud.name, false));
  if (!frames) return cloud;
  cloud.axes.sequence = true;
  cloud.axes.frames = std::ssize(frames->offset) - 1;
  cloud.axes.remark = cat(text::quote(frames->name), " parts its ", cloud.axes.points,
                          " points into ", cloud.axes.frames, " frames");
  cloud.offset = std::move(frames->offset);
  return cloud;
}

std::vector<std::string> names_of(const std::vector<CloudArray>& clouds) {
  std::vector<std::string> out;
  out.reserve(clouds.size());
  for (const CloudArray& cloud : clouds) out.push_back(cloud.name);
  return out;
}

class ArrayFrames : public FrameSource {
 public:
  /// `parts`: what parts one cloud into frames; empty: nothing does. `beside`: arrays that may say
  /// which points are none.
  ArrayFrames(const std::string& path, OpenArray array, double fps, const FrameOptions& options,
              const CloudArray& parts = {}, const std::vector<BesideArray>& beside = {})
      : path_(path),
        array_(std::move(array)),
        offset_(parts.offset),
        fps_(fps),
        max_memory_(options.max_memory),
        origin_(options.origin),
        far_(options.far) {
    if (!offset_.empty()) parted_ = parts.axes.remark;
    settle_memory();
    const ReadSteps steps = [&](int64_t first, int64_t count) { return read_steps(first, count); };
    if (rows_are_frames(array_.axes, array_.header.shape, steps))
      refuse_flat(array_.in->where(), array_.header);
    array_.axes = axes_by_numbers(array_.axes, array_.header.shape, steps);
    settle_memory();
    const CloudAxes& axes = array_.axes;
    end_ = all_frames();
    if (offset_.empty())
      padding_ = FramePadding(axes.sequences, axes.frames / std::max<int64_t>(axes.sequences, 1),
                              axes.points, beside);
    if (options.sequence) choose(*options.sequence);
    rewind();
  }

  std::optional<Frame> next() override {
    if (at_ == end_) return std::nullopt;
    Frame frame;
    const bool one = !array_.axes.sequence && offset_.empty();
    frame.source = one ? path_ : cat(path_, ":", at_);
    frame.sequence = (at_ - begin_) / std::max<int64_t>(all_frames() / array_.axes.sequences, 1);
    read(frame);
    if (offset_.empty()) padding_.cut(at_, frame.points);
    ++at_;
    frame.left_out = leave_out_non_finite(frame.points, frame.faces);
    const bool single = array_.header.kind == 'f' && array_.header.width <= sizeof(float);
    if (!far_) check_precision(frame.points, frame.source, single ? kSubtract : kDoctorMoves);
    return frame;
  }
  void skip() override {
    if (at_ == end_) return;
    if (!whole_) array_.in->skip(bytes_of_frame(at_));
    ++at_;
  }
  void rewind() override {
    at_ = begin_;
    padding_.restart();
    if (whole_) return;
    to_start();
    for (int64_t f = 0; f < begin_; ++f) array_.in->skip(bytes_of_frame(f));
  }
  int64_t frames() const override { return end_ - begin_; }
  int64_t sequences() const override { return chosen_ ? 1 : array_.axes.sequences; }
  double fps() const override { return fps_; }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out;
    for (const std::string& remark : {array_.axes.remark, parted_})
      if (!remark.empty())
        out.push_back(cat("an array ", shape_text(array_.header.shape), ": ", remark));
    if (const std::string cut = padding_.remark(); !cut.empty()) out.push_back(cut);
    return out;
  }

 private:
  int64_t all_frames() const {
    return offset_.empty() ? array_.axes.frames : std::ssize(offset_) - 1;
  }
  /// From now on the array is this sequence.
  void choose(int64_t sequence) {
    check_sequence(path_, sequence, array_.axes.sequences);
    const int64_t each = all_frames() / array_.axes.sequences;
    begin_ = sequence * each;
    end_ = begin_ + each;
    chosen_ = true;
  }
  void to_start() {
    array_.in->rewind();
    array_.header = read_npy_header(*array_.in);
  }
  int64_t first_point(int64_t frame) const {
    return offset_.empty() ? 0 : offset_[static_cast<size_t>(frame)];
  }
  int64_t points_of(int64_t frame) const {
    return offset_.empty() ? array_.axes.points : first_point(frame + 1) - first_point(frame);
  }
  uint64_t bytes_of_frame(int64_t frame) const {
    if (offset_.empty()) return array_.header.bytes() / static_cast<uint64_t>(all_frames());
    return array_.header.bytes() / static_cast<uint64_t>(array_.axes.points) *
           static_cast<uint64_t>(points_of(frame));
  }
  uint64_t most_bytes() const {
    uint64_t out = 0;
    for (int64_t f = 0; f < (offset_.empty() ? 1 : all_frames()); ++f)
      out = std::max(out, bytes_of_frame(f));
    return out;
  }

  /// The whole array is kept where a frame is spread over it.
  void settle_memory() {
    if (whole_) return;
    const bool parted_columns = !offset_.empty() && array_.axes.axis_step != 1;
    if (array_.header.fortran || !array_.axes.in_order() || parted_columns) {
      array_.in->rewind();
      whole_.emplace(*array_.in, max_memory_);
    } else if (all_frames() > 0 && most_bytes() > max_memory_) {
      throw InputError(path_, cat("has frames of ", most_bytes(), " bytes"),
                       "allow more with {max-memory}");
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
    to_start();
    array_.in->skip(static_cast<uint64_t>(first * bytes));
    const std::vector<char> all = array_.in->take(static_cast<uint64_t>(count * bytes));
    for (int64_t i = 0; i < count * step; ++i)
      out.push_back(header.number(all.data() + i * static_cast<int64_t>(header.width)));
    return out;
  }

  void read(Frame& frame) {
    const std::vector<char> bytes =
        whole_ ? std::vector<char>() : array_.in->take(bytes_of_frame(at_));
    const NpyHeader& header = array_.header;
    const CloudAxes& axes = array_.axes;
    const int64_t first = first_point(at_), step = offset_.empty() ? at_ : 0;
    frame.points.resize(points_of(at_));
    for (int64_t i = 0; i < points_of(at_); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const double value =
            whole_ ? (*whole_)[axes.at(step, first + i, axis)]
                   : header.number(bytes.data() +
                                   axes.at(0, i, axis) * static_cast<int64_t>(header.width));
        frame.points[i][axis] = text::coordinate(
            value - origin_[axis], [&] { return frame.source; }, NonFinite::mark);
      }
  }

  std::string path_;
  OpenArray array_;
  std::vector<int64_t> offset_;
  std::string parted_;  // how; a remark
  double fps_;
  uint64_t max_memory_;
  Vec3 origin_;
  bool far_;  // no matter how far from the origin
  FramePadding padding_;
  std::optional<NpyArray> whole_;
  int64_t at_ = 0, begin_ = 0, end_ = 0;
  bool chosen_ = false;  // one of several sequences
};

/// Arrays of an archive, a frame each.
class SeriesFrames : public FrameSource {
 public:
  SeriesFrames(Npz file, std::vector<std::string> names, double fps, const FrameOptions& options)
      : file_(std::move(file)), names_(std::move(names)), fps_(fps), options_(options) {
    options_.sequence = std::nullopt;
  }

  std::optional<Frame> next() override {
    if (at_ == std::ssize(names_)) return std::nullopt;
    const std::string& name = names_[static_cast<size_t>(at_++)];
    std::optional<Frame> frame =
        ArrayFrames(file_.path(), open_array(file_.open(name)), fps_, options_).next();
    frame->source = cat(file_.path(), ":", name);
    return frame;
  }
  void skip() override { at_ = std::min(at_ + 1, frames()); }
  void rewind() override { at_ = 0; }
  int64_t frames() const override { return std::ssize(names_); }
  double fps() const override { return fps_; }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out =
        ArrayFrames(file_.path(), open_array(file_.open(names_[0])), fps_, options_).remarks();
    out.push_back(cat("its ", names_.size(), " arrays, ", text::quote(names_[0]), " to ",
                      text::quote(names_.back()), ", are the frames of a sequence"));
    return out;
  }

 private:
  Npz file_;
  std::vector<std::string> names_;
  double fps_;
  FrameOptions options_;
  int64_t at_ = 0;
};

/// InputError for a file whose vertices are in flat rows.
void refuse_flat_arrays(const Npz& file) {
  for (const bool named : {true, false})
    for (const std::string& name : file.names()) {
      const std::optional<NpyHeader> header = header_if_readable(file, name);
      const bool may_be = header && header->kind == 'f' && !is_no_cloud(name, true);
      if (may_be && cloud_rank(name).has_value() == named)
        refuse_flat(cat(file.path(), ":", name), *header);
    }
}

/// InputError for an archive of depth pictures, with a camera's matrix beside them.
void refuse_depth_pictures(const Npz& file) {
  for (const std::string& name : file.names())
    if (const auto header = header_if_readable(file, name);
        header && are_depth_pictures(name, header->shape))
      throw InputError(cat(file.path(), ":", name),
                       cat("holds depth pictures ", shape_text(header->shape), ", not clouds"),
                       "restage data import FILE --intrinsics FX,FY,CX,CY makes clouds of them");
}

}  // namespace

bool is_npz_name(const std::string& path) { return text::ends_in(path, {".npz"}); }

bool is_array_name(const std::string& path) { return text::ends_in(path, {".npy", ".npz"}); }

std::optional<CloudArray> named_cloud(const Npz& file) {
  std::optional<CloudArray> out;
  size_t best = std::numeric_limits<size_t>::max();
  for (const std::string& name : file.names()) {
    const std::optional<size_t> rank = cloud_rank(name);
    if (!rank || *rank >= best) continue;
    const NpyHeader header = file.header(name);
    if (const auto axes = axes_of(header, vertices_beside(file, header))) {
      best = *rank;
      out = CloudArray{name, *axes, {}};
    }
  }
  return out;
}

std::optional<CloudArray> find_cloud(const Npz& file) {
  if (auto cloud = named_cloud(file)) return with_frames(file, *cloud);
  const BodyParameters parameters = body_parameters(file);
  if (parameters.moves())
    throw InputError(file.path(), "is a motion of a body model (as AMASS has them), not a scan",
                     "restage data import FILE --body-model MODEL --out M.h5, then restage data "
                     "perform --motions M.h5 makes clouds of it");
  const std::vector<CloudArray> found = unnamed_clouds(file);
  if (found.empty()) refuse_incomplete(file, parameters);
  if (found.empty()) refuse_depth_pictures(file);
  if (found.empty()) refuse_flat_arrays(file);
  if (found.empty()) return std::nullopt;
  if (found.size() == 1) return with_frames(file, found[0]);
  const bool single = std::none_of(found.begin(), found.end(),
                                   [](const CloudArray& cloud) { return cloud.axes.sequence; });
  const std::vector<std::string> series =
      single ? series_of(names_of(found), file.path()) : std::vector<std::string>();
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
  const NpyHeader header = read_npy_header(in);
  const std::optional<CloudAxes> axes = axes_of(header);
  if (!axes) refuse_flat(path, header);
  if (!axes) return std::nullopt;
  return CloudArray{"", *axes, {}};
}

bool is_seen_by_camera(const std::string& path, uint64_t max_memory) {
  if (!is_npz_name(path)) return false;
  const Npz file(path, max_memory);
  const std::optional<CloudArray> cloud = find_cloud(file);
  const std::string name = cloud ? lower_case(cloud->name) : "";
  if (name != "pred_vertices" && name != "pred_verts" && name != "verts" && name != "vertices")
    return false;
  for (const char* camera : {"pred_cam_t", "pred_cam", "orig_cam", "cam_t", "cam_trans"})
    if (file.has(camera)) return true;
  return false;
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
                                         options);
  Npz file(path, max_memory);
  const CloudArray cloud = need_cloud(file);
  std::vector<std::string> series;
  if (cloud.name.empty()) series = series_of(names_of(unnamed_clouds(file)), path);
  if (!series.empty() && options.sequence) check_sequence(path, *options.sequence, 1);
  if (!series.empty())
    return std::make_unique<SeriesFrames>(std::move(file), std::move(series), fps, options);
  const int64_t vertices = vertices_beside(file, file.header(cloud.name));
  return std::make_unique<ArrayFrames>(path, open_array(file.open(cloud.name), vertices), fps,
                                       options, cloud, beside(file, cloud.name, true));
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
