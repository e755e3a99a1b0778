#include "datasets/readers/frames/hdf5_frames.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "datasets/readers/arrays/body_parameters.h"
#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/clouds/cloud_axes.h"
#include "datasets/readers/clouds/cloud_names.h"
#include "datasets/readers/clouds/non_finite.h"
#include "datasets/readers/clouds/precision.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/hdf5_clouds.h"
#include "datasets/readers/frames/padding.h"
#include "datasets/readers/frames/ragged_frames.h"
#include "datasets/readers/text/text.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

bool is_our_scans(const h5::File& file) { return file.has("/points") && file.has("/frame_offset"); }

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
    // A surface that lacks a vertex would be another.
    if (offset_.empty())
      check_finite(set_.where(), values, std::max<int64_t>(set_.row_size(), 1), row(at_));
    frame.points.resize(values.size() / 3);
    if (!values.empty()) std::copy(values.begin(), values.end(), frame.points[0].data());
    frame.left_out = leave_out_non_finite(frame.points, frame.faces);
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

std::unique_ptr<FrameSource> open_ours(h5::File file, const FrameOptions& options) {
  const bool scans = is_our_scans(file);
  if (!scans && !file.has("/vertices"))
    throw InputError(
        file.path() + ":/points", "is missing, and so is /vertices",
        "give a file of scans (/points, /frame_offset) or surfaces (/vertices [F, V, 3])");
  h5::Dataset set =
      scans ? file.dataset("/points", {-1, 3}) : file.dataset("/vertices", {-1, -1, 3});
  std::vector<int64_t> offset;
  if (scans) offset = read_offsets(file, "/frame_offset", set.rows(), false);
  auto out = std::make_unique<Hdf5Frames>(std::move(file), std::move(set), std::move(offset));
  if (options.sequence) out->choose(*options.sequence);
  return out;
}

// ---- files of others ---------------------------------------------------------------------------

/// How many vertices the triangles of a file speak of; 0: it has none.
int64_t vertices_by_faces(const h5::File& file) {
  for (const char* name : {"/faces", "/f", "/triangles"}) {
    if (!file.has(name)) continue;
    const h5::Dataset set = file.dataset(name);
    if (set.type() != h5::Type::integer || set.shape().size() != 2) continue;
    const std::vector<int64_t> corners = set.read<int64_t>();
    if (!corners.empty()) return *std::max_element(corners.begin(), corners.end()) + 1;
  }
  return 0;
}

/// The numbers in the group of a data set.
std::vector<BesideArray> beside(const h5::File& file, const std::string& name) {
  const std::string group = name.substr(0, name.rfind('/'));
  std::vector<BesideArray> out;
  for (const std::string& child : file.children(group.empty() ? "/" : group)) {
    const std::string path = group + "/" + child;
    if (path == name || file.is_group(path)) continue;
    try {
      const h5::Dataset set = file.dataset(path);
      if (set.type() != h5::Type::integer && set.type() != h5::Type::floating) continue;
      const auto read = [&file, path] { return file.dataset(path).read<double>(); };
      out.push_back({child, set.shape(), set.type() == h5::Type::integer, read});
    } catch (const InputError&) {
      // Nothing that can be read, so it says nothing.
    }
  }
  return out;
}

/// Offsets of the frames of the only cloud of a file, if a data set in its group parts it into
/// frames; `name` becomes that cloud's.
std::optional<RaggedFrames> parted_cloud(const h5::File& file, std::string& name) {
  const std::vector<Hdf5Sequence> found = find_clouds(file, vertices_by_faces(file));
  if (found.size() != 1 || found[0].sets.size() != 1) return std::nullopt;
  name = found[0].sets[0];
  const h5::Shape shape = file.dataset(name).shape();
  if (shape.size() != 2 || shape[1] != 3) return std::nullopt;
  return ragged_frames(file.path(), shape[0], beside(file, name));
}

/// Surfaces, or joints and no clouds beside them.
bool is_our_prediction(const h5::File& file) {
  if (file.has("/vertices") && !file.is_group("/vertices")) {
    const h5::Shape shape = file.dataset("/vertices").shape();
    if (shape.size() == 3 && shape[2] == 3) return true;
  }
  return file.has("/joints") && !has_clouds(file);
}

class ForeignFrames : public FrameSource {
 public:
  ForeignFrames(h5::File file, const FrameOptions& options)
      : file_(std::move(file)),
        max_memory_(options.max_memory),
        origin_(options.origin),
        far_(options.far),
        vertices_(vertices_by_faces(file_)),
        found_(find_clouds(file_, vertices_)),
        fps_(read_fps(file_)) {
    for (const Hdf5Sequence& sequence : found_)
      axes_of(file_.dataset(sequence.sets[0]));  // or refuses
    part_windows();
    if (options.sequence) {
      check_sequence(file_.path(), *options.sequence, sequences());
      found_ = {found_[static_cast<size_t>(*options.sequence)]};
    }
    for (const Hdf5Sequence& sequence : found_)
      for (const std::string& set : sequence.sets) frames_ += frames_of(file_.dataset(set));
    if (frames_ == 0)
      throw InputError(file_.path(), "holds no frames", "give a file with at least one frame");
  }

  std::optional<Frame> next() override {
    if (!find_place()) return std::nullopt;
    const std::string& name = found_[sequence_].sets[set_];
    if (!open_) open(name);
    Frame frame;
    frame.source =
        axes_.sequence ? cat(file_.path(), ":", name, ":", at_) : cat(file_.path(), ":", name);
    frame.sequence = static_cast<int64_t>(sequence_);
    const int64_t f = read_row();
    frame.points.resize(axes_.points);
    for (int64_t i = 0; i < axes_.points; ++i)
      for (int axis = 0; axis < 3; ++axis)
        frame.points[i][axis] = text::coordinate(
            values_[axes_.at(f, i, axis)] - origin_[axis], [&] { return frame.source; },
            NonFinite::mark);
    if (vertices_ == 0) padding_.cut(at_, frame.points);
    ++at_;
    frame.left_out = leave_out_non_finite(frame.points, frame.faces);
    const bool single = open_->type() == h5::Type::floating && open_->value_size() <= sizeof(float);
    if (!far_) check_precision(frame.points, frame.source, single ? kSubtract : kDoctorMoves);
    return frame;
  }
  void skip() override {
    if (!find_place()) return;
    if (!open_) open(found_[sequence_].sets[set_]);
    ++at_;
  }
  void rewind() override {
    sequence_ = set_ = 0;
    padding_.restart();
    close();
  }
  int64_t frames() const override { return frames_; }
  int64_t sequences() const override { return std::ssize(found_); }
  double fps() const override { return fps_; }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out;
    for (const Hdf5Sequence& sequence : found_) {
      if (sequence.window > 0 && &sequence != found_.data()) continue;  // said of the first
      const h5::Dataset set = file_.dataset(sequence.sets[0]);
      const CloudAxes axes = axes_of(set);
      if (!axes.remark.empty())
        out.push_back(
            cat(text::quote(sequence.sets[0]), " ", shape_text(set.shape()), ": ", axes.remark));
      out.insert(out.end(), sequence.remarks.begin(), sequence.remarks.end());
    }
    if (const std::string cut = padding_.remark(); !cut.empty()) out.push_back(cut);
    return out;
  }

 private:
  CloudAxes axes_of(const h5::Dataset& set) const {
    const auto read = [&](int64_t first, int64_t count) {
      std::vector<double> out;
      set.read_rows(first, count, out);
      return out;
    };
    const CloudAxes axes = *cloud_axes(set.shape(), vertices_);
    if (rows_are_frames(axes, set.shape(), read)) refuse_flat_set(set);
    return axes_by_numbers(axes, set.shape(), read, vertices_);
  }
  /// Of one of its sequences.
  int64_t frames_of(const h5::Dataset& set) const {
    if (!cloud_axes(set.shape(), vertices_)->sequence) return 1;
    const CloudAxes axes = axes_of(set);
    return axes.frames / axes.sequences;
  }

  /// A data set of several sequences becomes several.
  void part_windows() {
    std::vector<Hdf5Sequence> out;
    for (const Hdf5Sequence& sequence : found_) {
      const h5::Dataset set = file_.dataset(sequence.sets[0]);
      const bool several =
          sequence.sets.size() == 1 && cloud_axes(set.shape(), vertices_)->sequences > 1;
      const int64_t windows = several ? axes_of(set).sequences : 1;
      for (int64_t w = 0; w < windows; ++w)
        out.push_back({sequence.sets, w == 0 ? sequence.remarks : std::vector<std::string>(), w});
    }
    found_ = std::move(out);
  }

  /// Makes values_ those of frame at_, or of all; gives the frame's number among them.
  int64_t read_row() {
    if (whole_) return at_;
    const int64_t rows = std::max<int64_t>(open_->rows(), 1);
    const int64_t each = std::max<int64_t>(axes_.frames / rows, 1);
    if (at_ / each != row_) {
      row_ = at_ / each;
      open_->read_rows(row_, 1, values_);
    }
    return at_ % each;
  }

  /// Goes on to a set that has frames left; false at the end.
  bool find_place() {
    while (sequence_ < found_.size()) {
      if (open_ && at_ < end_) return true;
      if (!open_) {
        if (frames_of(file_.dataset(found_[sequence_].sets[set_])) > 0) return true;
      }
      close();
      if (++set_ < found_[sequence_].sets.size()) continue;
      set_ = 0;
      ++sequence_;
    }
    return false;
  }

  void open(const std::string& name) {
    open_.emplace(file_.dataset(name));
    axes_ = axes_of(*open_);
    const int64_t each = axes_.frames / axes_.sequences;
    at_ = found_[sequence_].window * each;
    end_ = at_ + each;
    row_ = -1;
    if (name != padded_)
      padding_ = FramePadding(axes_.sequences, each, axes_.points, beside(file_, name));
    padded_ = name;
    whole_ = !axes_.sequence || !axes_.in_order();
    if (!whole_) return;
    const auto values =
        static_cast<uint64_t>(open_->rows()) * static_cast<uint64_t>(open_->row_size());
    if (values > max_memory_ / sizeof(double))
      throw InputError(open_->where(), cat("takes ", values * sizeof(double), " bytes"),
                       "allow more with {max-memory}");
    values_ = open_->read<double>();
  }

  void close() {
    open_.reset();
    values_.clear();
    whole_ = false;
    at_ = 0;
  }

  h5::File file_;
  uint64_t max_memory_;
  Vec3 origin_;
  bool far_;  // no matter how far from the origin
  int64_t vertices_;
  std::vector<Hdf5Sequence> found_;
  double fps_;
  int64_t frames_ = 0, at_ = 0, end_ = 0;
  size_t sequence_ = 0, set_ = 0;
  std::optional<h5::Dataset> open_;
  CloudAxes axes_;
  FramePadding padding_;
  std::string padded_;  // data set that it is of
  bool whole_ = false;  // values_ are all, where a frame is spread over the data set
  int64_t row_ = -1;    // else those of this row
  std::vector<double> values_;
};

}  // namespace

void check_sequence(const std::string& path, int64_t sequence, int64_t sequences) {
  if (sequence >= 0 && sequence < sequences) return;
  throw InputError(
      path, cat("has no sequence number ", sequence),
      sequences == 1 ? "it holds one, number 0" : cat("give a number from 0 to ", sequences - 1));
}

bool is_hdf5(const std::string& path) {
  if (text::ends_in(path, {".h5", ".hdf5", ".hdf", ".he5"})) return true;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  std::ifstream file(path, std::ios::binary);
  constexpr std::string_view kSignature("\x89HDF\r\n\x1a\n", 8);
  for (const int64_t at : {0, 512, 1024, 2048}) {  // behind what MATLAB and others put before it
    std::array<char, kSignature.size()> bytes{};
    if (!file.seekg(at).read(bytes.data(), bytes.size())) return false;
    if (std::string_view(bytes.data(), bytes.size()) == kSignature) return true;
  }
  return false;
}

bool is_foreign_hdf5(const std::string& path) {
  const h5::File file = open_schema_file(path);
  return !is_our_scans(file) && !is_our_prediction(file) && !file.has("/bodies") &&
         !file.has("/motions");
}

bool holds_clouds(const std::string& path) { return has_clouds(open_schema_file(path)); }

bool states_fps(const std::string& path) {
  return open_schema_file(path).number("/", "fps").has_value();
}

std::unique_ptr<FrameSource> open_hdf5_frames(const std::string& path,
                                              const FrameOptions& options) {
  h5::File file = open_schema_file(path);
  if (!is_our_scans(file) && !is_our_prediction(file)) {
    std::string name;
    std::optional<RaggedFrames> parts = parted_cloud(file, name);
    if (!parts) return std::make_unique<ForeignFrames>(std::move(file), options);
    if (options.sequence) check_sequence(path, *options.sequence, 1);
    h5::Dataset set = file.dataset(name, {-1, 3});
    return std::make_unique<Hdf5Frames>(std::move(file), std::move(set), std::move(parts->offset));
  }
  return open_ours(std::move(file), options);
}

}  // namespace restage
