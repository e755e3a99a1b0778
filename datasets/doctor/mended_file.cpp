#include "datasets/doctor/mended_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/words.h"
#include "datasets/doctor/carry.h"
#include "datasets/frame_writer.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kWhatCanBeWritten =
    "end it in .ply or .obj (one cloud or surface), .h5 (a sequence), or / (a folder of frames)";

std::string name_of(const std::string& path) {
  const auto slash = path.find_last_of('/', path.find_last_not_of('/'));
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

bool is_prediction(const Subject& subject) {
  return subject.stored && subject.stored->kind == "prediction";
}

double rate(const Diagnosis& d) { return d.fps > 0 ? d.fps / d.keep_every : kFps; }

// ---- where frames go ---------------------------------------------------------------------------

class Sink {
 public:
  virtual ~Sink() = default;
  /// A mended frame, made from number `from` of the source.
  virtual void push(const Mesh& mesh, int64_t from) = 0;
  virtual void end_sequence() {}
  virtual void commit() = 0;
};

/// One cloud or surface.
class MeshSink final : public Sink {
 public:
  MeshSink(std::string out, bool obj) : out_(std::move(out)), obj_(obj) {}
  void push(const Mesh& mesh, int64_t) override { mesh_ = mesh; }
  void commit() override { obj_ ? write_obj(out_, mesh_) : write_ply(out_, mesh_); }

 private:
  std::string out_;
  bool obj_;
  Mesh mesh_;
};

/// A folder has no rate and is read at 30 frames a second: each moment of that grid gets the frame
/// that was the last then.
class FolderSink final : public Sink {
 public:
  FolderSink(const std::string& out, double fps) : folder_(out, {}), fps_(fps) {}
  void push(const Mesh& mesh, int64_t) override {
    for (++received_; std::floor(static_cast<double>(written_) * fps_ / kFps + 1e-9) < received_;
         ++written_)
      folder_.push(mesh.vertices, mesh.faces);
  }
  void commit() override { folder_.commit(); }

 private:
  FrameFolderWriter folder_;
  double fps_, received_ = 0;
  int64_t written_ = 0;
};

/// Scans, with all that the source holds of every frame.
class ScanSink final : public Sink {
 public:
  ScanSink(const std::string& out, const FileInfo& info, const Subject& subject, const Diagnosis& d,
           std::vector<std::string>& remarks)
      : writer_(out, info, rate(d)), subject_(subject), d_(d), remarks_(remarks) {}
  void push(const Mesh& mesh, int64_t from) override {
    writer_.append(mesh.vertices);
    rows_.push_back(from);
  }
  void end_sequence() override { writer_.end_sequence(); }
  void commit() override {
    if (subject_.stored)
      carry_frames(open_schema_file(subject_.path), subject_.frames->frames(), rows_, *d_.transform,
                   writer_.file(), remarks_);
    writer_.commit();
  }

 private:
  ScanWriter writer_;
  const Subject& subject_;
  const Diagnosis& d_;
  std::vector<std::string>& remarks_;
  std::vector<int64_t> rows_;  // of the source, one for each frame
};

// ---- from where they come ----------------------------------------------------------------------

/// Mends frames one by one and counts what is left out.
class Mender {
 public:
  Mender(const std::string& out, const Diagnosis& d) : out_(out), d_(d) {}
  Mesh operator()(const Mesh& mesh) {
    Mesh mended = restage::mended(mesh, d_, &person_);
    if (mended.vertices.empty())
      throw InputError(out_, "a frame would be empty", "leave it out of the input");
    points_ += mesh.vertices.size() - mended.vertices.size();
    faces_ += mesh.faces.size() - mended.faces.size();
    return mended;
  }
  void restart() { person_.reset(); }  ///< the next frame is another sequence's
  void tell(std::vector<std::string>& remarks) const {
    if (points_ + faces_ > 0)
      remarks.push_back("left out: " + std::to_string(points_) + " points" +
                        (faces_ > 0 ? " and " + std::to_string(faces_) + " triangles" : ""));
  }

 private:
  const std::string& out_;
  const Diagnosis& d_;
  size_t points_ = 0, faces_ = 0;
  std::optional<Point> person_;  // where they were in the frame before
};

void mend_frames(const Subject& subject, const Diagnosis& d, Mender& mend, Sink& sink,
                 std::vector<std::string>& remarks) {
  if (subject.mesh) return sink.push(mend(*subject.mesh), 0);
  subject.frames->rewind();
  int64_t empty = 0, leading = 0;  // frames without points: written, left out in front
  int64_t closed = 0;              // gaps
  int64_t odd = 0, odd_now = 0;    // frames that are of another size than people: all, in a row
  std::optional<Mesh> previous;
  int64_t sequence = 0, row = -1, row_before = -1;  // of the source, where empty frames count too
  for (int64_t i = 0; const auto frame = subject.frames->next(); ++i) {
    throw_if_stopped();
    row += 1 + frame->missing;
    if (frame->sequence != sequence) {
      sink.end_sequence();
      sequence = frame->sequence;
      previous.reset();
      mend.restart();
    }
    if (i % d.keep_every != 0 || i < d.odd_front) continue;
    Mesh mesh = mend({frame->points, frame->faces});
    const bool odd_one =
        previous && may_be_a_person(previous->vertices) && !may_be_a_person(mesh.vertices);
    odd_now = odd_one ? odd_now + 1 : 0;
    const bool stood_in = odd_now > 0 && static_cast<double>(odd_now) <= rate(d);  // a second
    if (stood_in) mesh = *previous;
    odd += stood_in;
    const int64_t from = stood_in ? row_before : row;
    // Frames without points keep the time of those behind them; in front they are left out.
    const auto gap = d.gap.find(i);
    const int64_t missing = gap == d.gap.end() ? 0 : gap->second;
    const int64_t kept = d.is_kept(missing) ? missing / d.keep_every : 0;
    for (int64_t k = 0; previous && k < kept; ++k)
      sink.push({}, std::max(row_before, row - missing + k));
    (previous ? empty : leading) += kept;
    closed += !d.is_kept(missing);
    sink.push(mesh, from);
    previous = std::move(mesh);
    row_before = from;
  }
  if (empty > 0)
    remarks.push_back(cat("in gaps ", counted(empty, "frame"),
                          " without points; retarget fills up to a third of a second of them"));
  if (closed > 0) remarks.push_back(cat(counted(closed, "gap"), " of over a minute closed"));
  if (d.odd_front > 0)
    remarks.push_back(cat("left out: the first ", counted(d.odd_front, "frame"),
                          ", of another size than the rest"));
  if (odd > 0)
    remarks.push_back(cat("in ", counted(odd, "frame that is", "frames that are"),
                          " of another size than people the frame before stands in"));
  if (leading > 0)
    remarks.push_back(cat("left out: ", leading, " frames without points before the first"));
}

/// Writes the frames that are kept. All vertices of such a frame are written: `restage eval` finds
/// the true place of a vertex by its number.
void write_mended_prediction(const Subject& subject, const std::string& out, const FileInfo& info,
                             const Diagnosis& d, std::vector<std::string>& remarks) {
  const PredictionReader reader(subject.path);
  const h5::File from = open_schema_file(subject.path);
  h5::File to = create_schema_file(out, "prediction", info);
  to.set_number("/", "fps", rate(d));
  std::vector<int64_t> rows, sequence_offset{0};
  for (size_t s = 0; s + 1 < reader.sequence_offset().size(); ++s) {
    for (int64_t f = reader.sequence_offset()[s]; f < reader.sequence_offset()[s + 1]; ++f)
      if (f % d.keep_every == 0) rows.push_back(f);
    if (std::ssize(rows) > sequence_offset.back()) sequence_offset.push_back(std::ssize(rows));
  }
  to.write<int64_t>("/sequence_offset", {std::ssize(sequence_offset)}, sequence_offset);
  if (from.has("/faces"))
    to.write<int32_t>("/faces", from.dataset("/faces").shape(),
                      from.read<int32_t>("/faces", {-1, 3}));
  if (from.has("/source_to_world")) {  // p' = s R (A x + b - t)
    const std::vector<double> m = from.read<double>("/source_to_world", {3, 4});
    using Rows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
    Rows map = Eigen::Map<const Rows>(m.data());
    map.col(3) -= d.transform->offset;
    map = (d.transform->scale * d.transform->rotation * map).eval();
    to.write<double>("/source_to_world", {3, 4}, std::span<const double>(map.data(), 12));
  }
  carry_frames(from, reader.frames(), rows, *d.transform, to, remarks);
  to.commit();
}

// ---- what is said of it ------------------------------------------------------------------------

/// Refuses what cannot be done, before anything is written.
void check(const Subject& subject, const std::string& out, RepairKind kind, const Diagnosis& d) {
  for (const Finding& f : d.findings)
    if (!d.transform && f.topic == "sizes")
      throw InputError(subject.path, "cannot be repaired: " + f.what, f.fix);
  if (!d.transform)
    throw InputError(subject.path, "cannot be repaired: its up axis or its units cannot be told",
                     "say them with {up} and {scale}");
  const bool single = kind == RepairKind::ply || kind == RepairKind::obj;
  if (single && d.frames > 1)
    throw InputError(out, "would hold one of " + std::to_string(d.frames) + " frames",
                     "give a folder or an .h5 file to {fix}");
  if (kind == RepairKind::hdf5 && d.faces > 0 && !is_prediction(subject))
    throw InputError(out, "cannot hold surfaces",
                     d.frames > 1 ? "give a folder to {fix}" : "end it in .ply or .obj");
  if (kind == RepairKind::folder && d.fps > 0 && d.fps < 1)
    throw InputError(out,
                     "would hold every frame more than 30 times: a folder is played at 30 a second",
                     "give an .h5 file to {fix}");
  if (kind == RepairKind::folder && d.sequences > 1)
    throw InputError(out, "would join " + std::to_string(d.sequences) + " sequences into one",
                     "give an .h5 file to {fix}");
}

/// {"formula", "scale", "rotation" (rows), "offset"}.
Json to_document(const Similarity& t) {
  Json rotation = Json::array();
  for (int i = 0; i < 3; ++i)
    rotation.push_back({t.rotation(i, 0), t.rotation(i, 1), t.rotation(i, 2)});
  return {{"formula", "p' = scale * rotation * (p - offset)"},
          {"scale", t.scale},
          {"rotation", rotation},
          {"offset", {t.offset.x(), t.offset.y(), t.offset.z()}}};
}

/// Names of files may hold any bytes: what is not UTF-8 becomes U+FFFD.
std::string text_of(const Json& note, int indent = -1) {
  return note.dump(indent, ' ', false, Json::error_handler_t::replace);
}

FileInfo info_of(const Subject& subject, const Json& note) {
  FileInfo info;
  info.provenance = "repaired by restage doctor from " + name_of(subject.path);
  info.transform = text_of(note);
  if (!subject.stored) return info;
  info.license = subject.stored->license;
  if (subject.stored->provenance != FileInfo{}.provenance)
    info.provenance = subject.stored->provenance + "; " + info.provenance;
  return info;
}

/// Of the angle beyond quarter turns.
std::string turned_words(const Diagnosis& d) {
  return format(
      "%.1f degrees about the vertical, to the person's %s, so that they face +z as found",
      std::abs(d.turned), d.turned > 0 ? "right" : "left");
}

/// The transform from what the data once were: repairs of a repaired file add up.
Similarity from_first(const Subject& subject, const Similarity& transform) {
  const auto before = subject.stored ? similarity_from(subject.stored->transform) : std::nullopt;
  return before ? transform.after(*before) : from_file(subject, transform);
}

std::unique_ptr<Sink> make_sink(const Subject& subject, const std::string& out, RepairKind kind,
                                const FileInfo& info, const Diagnosis& d,
                                std::vector<std::string>& remarks) {
  if (kind == RepairKind::hdf5) return std::make_unique<ScanSink>(out, info, subject, d, remarks);
  if (kind == RepairKind::folder) return std::make_unique<FolderSink>(out, rate(d));
  return std::make_unique<MeshSink>(out, kind == RepairKind::obj);
}

/// What files of that kind do not hold.
void tell_losses(const Subject& subject, RepairKind kind, const Diagnosis& d,
                 std::vector<std::string>& remarks) {
  if (kind == RepairKind::folder && rate(d) != kFps)
    remarks.push_back("a folder is played at 30 frames a second: its frames were " +
                      std::string(rate(d) < kFps ? "repeated" : "thinned") +
                      " for that; an .h5 file keeps each once, and their rate");
  if (kind == RepairKind::hdf5) return;
  std::vector<std::string> lost;
  if (subject.stored)
    for (const std::string& name : sets_of_frames(open_schema_file(subject.path), d.frames))
      if (name != "/vertices") lost.push_back(name.substr(1));
  if (!lost.empty()) remarks.push_back(joined(lost) + " are not kept; an .h5 file keeps them");
  if (!subject.taken_as.empty())
    remarks.push_back("the rig is not kept; retarget takes the character's own file as its target");
  if (!subject.stored)
    remarks.push_back(
        "only points and triangles are kept: no normals, colours, texture coordinates or groups");
}

}  // namespace

std::string to_json(const Similarity& transform) { return to_document(transform).dump(); }

std::optional<Similarity> similarity_from(const std::string& json) {
  const Json note = Json::parse(json, nullptr, false);
  Similarity out;
  try {
    out.scale = note.at("scale").get<double>();
    for (int r = 0; r < 3; ++r) {
      out.offset[r] = note.at("offset").at(static_cast<size_t>(r)).get<double>();
      for (int c = 0; c < 3; ++c)
        out.rotation(r, c) =
            note.at("rotation").at(static_cast<size_t>(r)).at(static_cast<size_t>(c)).get<double>();
    }
  } catch (const Json::exception&) {
    return std::nullopt;
  }
  const bool good = out.scale > 0 && std::isfinite(out.scale) && out.rotation.allFinite() &&
                    out.offset.allFinite();
  return good ? std::optional(out) : std::nullopt;
}

Mesh frame_of(const Subject& subject, int64_t index) {
  if (subject.mesh) return *subject.mesh;
  subject.frames->rewind();
  for (int64_t i = 0; i < index; ++i) subject.frames->skip();
  auto frame = subject.frames->next();
  if (!frame) throw InputError(subject.path, "has changed while it was read", "run it again");
  return {std::move(frame->points), std::move(frame->faces)};
}

RepairKind repair_kind(const std::string& out) {
  if (out.empty()) throw InputError("", "{fix} names no file", kWhatCanBeWritten);
  const std::string ending = lower_case(std::filesystem::path(out).extension().string());
  if (ending == ".ply") return RepairKind::ply;
  if (ending == ".obj") return RepairKind::obj;
  if (ending == ".h5") return RepairKind::hdf5;
  if (ending.size() < 2) return RepairKind::folder;
  throw InputError(out, "is of no kind that can be written", kWhatCanBeWritten);
}

Repaired write_repaired(const Subject& subject, const std::string& out, const Diagnosis& d) {
  const RepairKind kind = repair_kind(out);
  check(subject, out, kind, d);
  Json note = to_document(from_first(subject, *d.transform));
  note["from"] = name_of(subject.path);
  if (!subject.taken_as.empty()) note["of"] = subject.taken_as;
  if (d.turned != 0) note["turned"] = turned_words(d);
  const FileInfo info = info_of(subject, note);
  Repaired done;
  done.file = out;
  if (d.turned != 0) done.remarks.push_back("turned by " + turned_words(d));
  if (kind == RepairKind::hdf5 && is_prediction(subject)) {
    write_mended_prediction(subject, out, info, d, done.remarks);
    return done;
  }
  // It has to be possible to write both before either appears.
  std::optional<AtomicFile> side;
  if (kind != RepairKind::hdf5) {
    done.transform_file = out.substr(0, out.find_last_not_of('/') + 1) + ".transform.json";
    if (std::filesystem::is_directory(done.transform_file))
      throw InputError(done.transform_file, "is a folder", "give another name to {fix}");
    note["fps"] = kind == RepairKind::folder ? kFps : rate(d);
    side.emplace(done.transform_file);
    side->write(text_of(note, 2) + "\n");
  }
  const auto sink = make_sink(subject, out, kind, info, d, done.remarks);
  Mender mend(out, d);
  mend_frames(subject, d, mend, *sink, done.remarks);
  sink->commit();
  if (side) side->commit();
  mend.tell(done.remarks);
  tell_losses(subject, kind, d, done.remarks);
  return done;
}

}  // namespace restage
