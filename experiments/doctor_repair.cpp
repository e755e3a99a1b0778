#include "experiments/doctor_repair.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/readers/mesh_io.h"
#include "experiments/text.h"
#include "infer/writers/frames.h"

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

/// Scans, with the true joints where the source has them.
class ScanSink final : public Sink {
 public:
  ScanSink(const std::string& out, const FileInfo& info, const Subject& subject, const Diagnosis& d)
      : writer_(out, info, rate(d)), transform_(*d.transform) {
    if (!subject.stored || !subject.stored->counts.contains("joints")) return;
    file_.emplace(open_schema_file(subject.path));
    joints_.emplace(file_->dataset("/joints", {d.frames, kJoints, 3}));
  }
  void push(const Mesh& mesh, int64_t from) override {
    if (!joints_) return writer_.append(mesh.vertices);
    joints_->read_rows(from, 1, row_);
    Joints joints;
    for (size_t j = 0; j < joints.size(); ++j)
      joints[j] = transform_(Vec3(row_[3 * j], row_[3 * j + 1], row_[3 * j + 2]));
    writer_.append(mesh.vertices, joints);
  }
  void end_sequence() override { writer_.end_sequence(); }
  void commit() override { writer_.commit(); }

 private:
  ScanWriter writer_;
  Similarity transform_;
  std::optional<h5::File> file_;  // of the source
  std::optional<h5::Dataset> joints_;
  std::vector<double> row_;
};

// ---- from where they come ----------------------------------------------------------------------

/// Mends frames one by one and counts what is left out.
class Mender {
 public:
  Mender(const std::string& out, const Diagnosis& d) : out_(out), d_(d) {}
  Mesh operator()(const Mesh& mesh) {
    Mesh mended = restage::mended(mesh, d_);
    if (mended.vertices.empty())
      throw InputError(out_, "a frame would be empty", "leave it out of the input");
    points_ += mesh.vertices.size() - mended.vertices.size();
    faces_ += mesh.faces.size() - mended.faces.size();
    return mended;
  }
  void tell(std::vector<std::string>& remarks) const {
    if (points_ + faces_ > 0)
      remarks.push_back("left out: " + std::to_string(points_) + " points" +
                        (faces_ > 0 ? " and " + std::to_string(faces_) + " triangles" : ""));
  }

 private:
  const std::string& out_;
  const Diagnosis& d_;
  size_t points_ = 0, faces_ = 0;
};

void mend_frames(const Subject& subject, const Diagnosis& d, Mender& mend, Sink& sink) {
  if (subject.mesh) return sink.push(mend(*subject.mesh), 0);
  subject.frames->rewind();
  std::optional<Mesh> previous;
  int64_t sequence = 0;
  for (int64_t i = 0; const auto frame = subject.frames->next(); ++i) {
    if (frame->sequence != sequence) {
      sink.end_sequence();
      sequence = frame->sequence;
      previous.reset();
    }
    if (i % d.keep_every != 0) continue;
    Mesh mesh = mend({frame->points, frame->faces});
    // A gap of up to a second: the nearest frame in time stands in.
    const auto gap = d.gap.find(i);
    if (gap != d.gap.end() && previous && d.is_filled(gap->second))
      for (int64_t k = 0; k < gap->second; ++k)
        2 * k < gap->second ? sink.push(*previous, i - 1) : sink.push(mesh, i);
    sink.push(mesh, i);
    previous = std::move(mesh);
  }
}

/// Joints and vertices of every frame that is kept, all of them: their numbers are what the truth
/// of `restage eval` goes by.
void write_mended_prediction(const Subject& subject, const std::string& out, const FileInfo& info,
                             const Diagnosis& d) {
  const Prediction data = read_prediction(subject.path);
  Prediction kept;
  kept.vertex_count = data.vertex_count;
  kept.faces = data.faces;
  kept.fps = rate(d);
  const auto copy = [&](const std::vector<double>& from, int64_t frame, int64_t row,
                        std::vector<double>& to) {
    if (from.empty()) return;
    for (int64_t i = 3 * frame * row; i < 3 * (frame + 1) * row; i += 3) {
      const Vec3 p = (*d.transform)(Vec3(Eigen::Map<const Vec3>(&from[i])));
      to.insert(to.end(), p.begin(), p.end());
    }
  };
  for (int64_t f = 0, sequence = 0; f < data.frames; ++f) {
    if (f == data.sequence_offset[sequence]) {
      kept.sequence_offset.push_back(kept.frames);
      ++sequence;
    }
    if (f % d.keep_every != 0) continue;
    copy(data.joints, f, kJoints, kept.joints);
    copy(data.vertices, f, data.vertex_count, kept.vertices);
    ++kept.frames;
  }
  kept.sequence_offset.push_back(kept.frames);
  const h5::File file = open_schema_file(subject.path);
  if (file.has("/source_to_world")) {  // p' = s R (A x + b - t)
    const std::vector<double> m = file.read<double>("/source_to_world", {3, 4});
    Eigen::Matrix<double, 3, 4> map =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(m.data());
    map.col(3) -= d.transform->offset;
    kept.source_to_world = d.transform->scale * d.transform->rotation * map;
  }
  write_prediction(out, kept, info);
}

// ---- what is said of it ------------------------------------------------------------------------

/// Refuses what cannot be done, before anything is written.
void check(const Subject& subject, const std::string& out, RepairKind kind, const Diagnosis& d) {
  if (!d.transform)
    throw InputError(subject.path, "cannot be repaired: its up axis or its units cannot be told",
                     "say them with --up and --scale");
  const bool single = kind == RepairKind::ply || kind == RepairKind::obj;
  if (single && d.frames > 1)
    throw InputError(out, "would hold one of " + std::to_string(d.frames) + " frames",
                     "give a folder or an .h5 file to --fix");
  if (kind == RepairKind::hdf5 && d.faces > 0 && !is_prediction(subject))
    throw InputError(out, "cannot hold surfaces",
                     d.frames > 1 ? "give a folder to --fix" : "end it in .ply or .obj");
  if (kind == RepairKind::folder && d.fps > 0 && d.fps < 1)
    throw InputError(out,
                     "would hold every frame more than 30 times: a folder is played at 30 a second",
                     "give an .h5 file to --fix");
  if (kind == RepairKind::folder && d.sequences > 1)
    throw InputError(out, "would join " + std::to_string(d.sequences) + " sequences into one",
                     "give an .h5 file to --fix");
}

FileInfo info_of(const Subject& subject, const Json& note) {
  FileInfo info;
  info.provenance = "repaired by restage doctor from " + name_of(subject.path);
  info.transform = note.dump();
  if (!subject.stored) return info;
  info.license = subject.stored->license;
  if (subject.stored->provenance != FileInfo{}.provenance)
    info.provenance = subject.stored->provenance + "; " + info.provenance;
  return info;
}

/// The transform from what the data once were: repairs of a repaired file add up.
Similarity from_first(const Subject& subject, const Similarity& transform) {
  const auto before = subject.stored ? similarity_from(subject.stored->transform) : std::nullopt;
  return before ? transform.after(*before) : from_file(subject, transform);
}

std::unique_ptr<Sink> make_sink(const Subject& subject, const std::string& out, RepairKind kind,
                                const FileInfo& info, const Diagnosis& d) {
  if (kind == RepairKind::hdf5) return std::make_unique<ScanSink>(out, info, subject, d);
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
  if (subject.stored && subject.stored->counts.contains("joints"))
    remarks.push_back("joints are not kept; an .h5 file keeps them");
  if (!subject.stored)
    remarks.push_back(
        "only points and triangles are kept: no normals, colours, texture coordinates or groups");
}

}  // namespace

Json to_json(const Similarity& t) {
  Json rotation = Json::array();
  for (int i = 0; i < 3; ++i)
    rotation.push_back({t.rotation(i, 0), t.rotation(i, 1), t.rotation(i, 2)});
  return {{"formula", "p' = scale * rotation * (p - offset)"},
          {"scale", t.scale},
          {"rotation", rotation},
          {"offset", {t.offset.x(), t.offset.y(), t.offset.z()}}};
}

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
  if (out.empty()) throw InputError("", "--fix names no file", kWhatCanBeWritten);
  std::string ending = std::filesystem::path(out).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".ply") return RepairKind::ply;
  if (ending == ".obj") return RepairKind::obj;
  if (ending == ".h5") return RepairKind::hdf5;
  if (ending.size() < 2) return RepairKind::folder;
  throw InputError(out, "is of no kind that can be written", kWhatCanBeWritten);
}

Repaired write_repaired(const Subject& subject, const std::string& out, const Diagnosis& d) {
  const RepairKind kind = repair_kind(out);
  check(subject, out, kind, d);
  Json note = to_json(from_first(subject, *d.transform));
  note["from"] = valid_utf8(name_of(subject.path));
  if (!subject.taken_as.empty()) note["of"] = valid_utf8(subject.taken_as);
  const FileInfo info = info_of(subject, note);
  Repaired done;
  done.file = out;
  if (kind == RepairKind::hdf5 && is_prediction(subject)) {
    write_mended_prediction(subject, out, info, d);
    return done;
  }
  // It has to be possible to write both before either appears.
  std::optional<AtomicFile> side;
  if (kind != RepairKind::hdf5) {
    done.transform_file = out.substr(0, out.find_last_not_of('/') + 1) + ".transform.json";
    if (std::filesystem::is_directory(done.transform_file))
      throw InputError(done.transform_file, "is a folder", "give another name to --fix");
    note["fps"] = kind == RepairKind::folder ? kFps : rate(d);
    side.emplace(done.transform_file);
    side->write(note.dump(2) + "\n");
  }
  const auto sink = make_sink(subject, out, kind, info, d);
  Mender mend(out, d);
  mend_frames(subject, d, mend, *sink);
  sink->commit();
  if (side) side->commit();
  mend.tell(done.remarks);
  tell_losses(subject, kind, d, done.remarks);
  return done;
}

}  // namespace restage
