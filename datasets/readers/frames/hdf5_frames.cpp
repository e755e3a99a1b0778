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
#include "datasets/readers/frames/frame_names.h"
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

constexpr int kGroupDepth = 6;        // of groups that are looked into
constexpr size_t kMostSets = 200000;  // a frame each

/// A sequence is one data set, or one a frame.
struct Sequence {
  std::vector<std::string> sets;
  std::vector<std::string> remarks;
};

/// InputError for a data set whose rows may be x y z of one point after the other.
void refuse_flat(const h5::Dataset& set) {
  if (const auto mend = flat_mend(set.shape()))
    throw InputError(set.where(),
                     cat("is a flat data set ", shape_text(set.shape()), ", and no cloud"), *mend);
}

/// All that has the shape of a cloud or a sequence.
class Finder {
 public:
  /// `vertices`: how many there are, if the file says it; else 0.
  explicit Finder(const h5::File& file, int64_t vertices = 0) : file_(file), vertices_(vertices) {
    walk("", 0);
  }

  bool any() const { return !found_.empty(); }

  std::vector<Sequence> find() const {
    if (file_.has("/bodies") || file_.has("/motions"))
      throw InputError(file_.path(), "holds bodies or motions, not scans",
                       "restage data perform makes scans of them");
    std::vector<std::string> sequences, clouds, left_out = others_;
    for (const Candidate& one : found_) {
      if (one.rank > best_)
        left_out.push_back(one.name);
      else
        (one.sequence ? sequences : clouds).push_back(one.name);
    }
    std::vector<Sequence> out;
    out.reserve(sequences.size());
    for (const std::string& name : sequences) out.push_back({{name}, {}});
    if (out.empty() && !clouds.empty()) out.push_back(series(clouds));
    if (out.empty()) throw_no_clouds();
    if (!sequences.empty()) left_out.insert(left_out.end(), clouds.begin(), clouds.end());
    if (!left_out.empty())
      out[0].remarks.push_back(cat("clouds are taken from ", text::quote(out[0].sets[0]),
                                   out.size() > 1 ? " and others" : "",
                                   "; left out: " + list_of(left_out)));
    return out;
  }

 private:
  struct Candidate {
    std::string name;
    bool sequence;
    size_t rank;  ///< cloud_rank(); of other names kUnnamed
  };
  static constexpr size_t kUnnamed = 1000;

  /// Says what the file holds instead.
  [[noreturn]] void throw_no_clouds() const {
    std::vector<std::string> last;
    for (const std::string& name : all_) last.push_back(name.substr(name.rfind('/') + 1));
    const BodyParameters parameters = body_parameters(last);
    if (parameters.moves() || !parameters.body.empty() || !parameters.orient.empty())
      throw InputError(
          file_.path(),
          cat("holds a motion of a body model (its data sets: ", list_of(all_), "), not clouds"),
          "save these data sets as an NPZ (numpy.savez) with the same names; restage "
          "data import FILE.npz --body-model MODEL --out M.h5 reads it");
    for (const std::string& name : all_)
      if (!is_no_cloud(name, true)) refuse_flat(file_.dataset(name));
    throw InputError(
        file_.path() + ":/points", "is missing, and so is /vertices",
        "give a file of scans (/points, /frame_offset) or surfaces (/vertices [F, V, 3])");
  }

  void walk(const std::string& group, int depth) {
    for (const std::string& child : file_.children(group.empty() ? "/" : group)) {
      const std::string name = group + "/" + child;
      if (found_.size() >= kMostSets)
        throw InputError(file_.path(), cat("holds more than ", kMostSets, " data sets of points"),
                         "split it");
      if (!file_.is_group(name))
        consider(name, child);
      else if (depth + 1 < kGroupDepth && !child.starts_with("#"))  // MATLAB's own
        walk(name, depth + 1);
    }
  }

  void consider(const std::string& name, const std::string& child) {
    try {
      const h5::Dataset set = file_.dataset(name);
      if (set.type() == h5::Type::text) return;
      if (all_.size() < kMostListed) all_.push_back(name);
      const auto axes = cloud_axes(set.shape(), vertices_);
      if (!axes) return;
      if (is_no_cloud(child, !axes->sequence)) {
        if (set.type() == h5::Type::floating) others_.push_back(name);
        return;
      }
      const size_t rank = cloud_rank(child).value_or(kUnnamed);
      found_.push_back({name, axes->sequence, rank});
      best_ = std::min(best_, rank);
    } catch (const InputError&) {
      // Nothing that can be read, so no cloud.
    }
  }

  /// Single clouds are the frames of a sequence if their names are a series.
  Sequence series(const std::vector<std::string>& clouds) const {
    if (clouds.size() == 1) return {clouds, {}};
    std::vector<std::string> names;
    for (std::string name : clouds) {
      std::replace(name.begin(), name.end(), '/', ' ');
      names.push_back(name);
    }
    FrameList list = order_members(names, file_.path());
    if (list.files.empty())
      throw InputError(file_.path(), "holds several arrays of points: " + list_of(clouds),
                       "keep one, or name the frames' groups or data sets by numbers");
    Sequence out{{}, list.remarks};
    for (std::string& name : list.files) {
      const auto at = std::find(names.begin(), names.end(), name);
      out.sets.push_back(clouds[static_cast<size_t>(at - names.begin())]);
    }
    return out;
  }

  static constexpr size_t kMostListed = 64;

  const h5::File& file_;
  int64_t vertices_;
  std::vector<std::string> all_;  ///< data sets of numbers, the first of them
  std::vector<Candidate> found_;
  std::vector<std::string> others_;  ///< of the shape of clouds, by their names none
  size_t best_ = kUnnamed;
};

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

/// Offsets of the frames of the only cloud of a file, if a data set in its group parts it into
/// frames; `name` becomes that cloud's.
std::optional<RaggedFrames> parted_cloud(const h5::File& file, std::string& name) {
  const std::vector<Sequence> found = Finder(file, vertices_by_faces(file)).find();
  if (found.size() != 1 || found[0].sets.size() != 1) return std::nullopt;
  name = found[0].sets[0];
  const h5::Shape shape = file.dataset(name).shape();
  if (shape.size() != 2 || shape[1] != 3) return std::nullopt;
  const std::string group = name.substr(0, name.rfind('/'));
  std::vector<BesideArray> beside;
  for (const std::string& child : file.children(group.empty() ? "/" : group)) {
    const std::string path = group + "/" + child;
    if (path == name || file.is_group(path)) continue;
    const h5::Dataset set = file.dataset(path);
    if (set.type() != h5::Type::integer && set.type() != h5::Type::floating) continue;
    const auto read = [&file, path] { return file.dataset(path).read<double>(); };
    beside.push_back({child, set.shape(), set.type() == h5::Type::integer, read});
  }
  return ragged_frames(file.path(), shape[0], beside);
}

/// Surfaces, or joints and no clouds beside them.
bool is_our_prediction(const h5::File& file) {
  if (file.has("/vertices") && !file.is_group("/vertices")) {
    const h5::Shape shape = file.dataset("/vertices").shape();
    if (shape.size() == 3 && shape[2] == 3) return true;
  }
  return file.has("/joints") && !Finder(file).any();
}

class ForeignFrames : public FrameSource {
 public:
  ForeignFrames(h5::File file, const FrameOptions& options)
      : file_(std::move(file)),
        max_memory_(options.max_memory),
        vertices_(vertices_by_faces(file_)),
        found_(Finder(file_, vertices_).find()),
        fps_(read_fps(file_)) {
    if (options.sequence) {
      check_sequence(file_.path(), *options.sequence, sequences());
      found_ = {found_[static_cast<size_t>(*options.sequence)]};
    }
    for (const Sequence& sequence : found_) axes_of(file_.dataset(sequence.sets[0]));  // or refuses
    for (const Sequence& sequence : found_)
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
    std::vector<float> row;
    if (whole_.empty() && axes_.sequence) open_->read_rows(at_, 1, row);
    const std::vector<float>& values = row.empty() ? whole_ : row;
    const int64_t f = row.empty() ? at_ : 0;
    frame.points.resize(axes_.points);
    for (int64_t i = 0; i < axes_.points; ++i)
      for (int axis = 0; axis < 3; ++axis) frame.points[i][axis] = values[axes_.at(f, i, axis)];
    ++at_;
    frame.left_out = leave_out_non_finite(frame.points, frame.faces);
    check_precision(frame.points, frame.source, kSubtract);
    return frame;
  }
  void skip() override {
    if (!find_place()) return;
    if (!open_) open(found_[sequence_].sets[set_]);
    ++at_;
  }
  void rewind() override {
    sequence_ = set_ = 0;
    close();
  }
  int64_t frames() const override { return frames_; }
  int64_t sequences() const override { return std::ssize(found_); }
  double fps() const override { return fps_; }
  std::vector<std::string> remarks() const override {
    std::vector<std::string> out;
    for (const Sequence& sequence : found_) {
      const h5::Dataset set = file_.dataset(sequence.sets[0]);
      const CloudAxes axes = axes_of(set);
      if (!axes.remark.empty())
        out.push_back(
            cat(text::quote(sequence.sets[0]), " ", shape_text(set.shape()), ": ", axes.remark));
      out.insert(out.end(), sequence.remarks.begin(), sequence.remarks.end());
    }
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
    if (rows_are_frames(axes, set.shape(), read)) refuse_flat(set);
    return axes_by_numbers(axes, set.shape(), read, vertices_);
  }
  int64_t frames_of(const h5::Dataset& set) const {
    return cloud_axes(set.shape(), vertices_)->sequence ? axes_of(set).frames : 1;
  }

  /// Goes on to a set that has frames left; false at the end.
  bool find_place() {
    while (sequence_ < found_.size()) {
      if (open_ && at_ < axes_.frames) return true;
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
    at_ = 0;
    whole_.clear();
    if (axes_.sequence && axes_.in_order()) return;
    const auto values =
        static_cast<uint64_t>(open_->rows()) * static_cast<uint64_t>(open_->row_size());
    if (values > max_memory_ / sizeof(float))
      throw InputError(open_->where(), cat("takes ", values * sizeof(float), " bytes"),
                       "allow more with {max-memory}");
    whole_ = open_->read<float>();
  }

  void close() {
    open_.reset();
    whole_.clear();
    at_ = 0;
  }

  h5::File file_;
  uint64_t max_memory_;
  int64_t vertices_;
  std::vector<Sequence> found_;
  double fps_;
  int64_t frames_ = 0, at_ = 0;
  size_t sequence_ = 0, set_ = 0;
  std::optional<h5::Dataset> open_;
  CloudAxes axes_;
  std::vector<float> whole_;  // where a frame is spread over the data set
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
