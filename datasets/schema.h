// The project's HDF5 files as values: bodies, motions, scan sequences, predictions. The layout is
// documented in datasets/README.md. Metres, y up, +x the body's left, 30 frames per second.
//
// Reading: InputError "file:/dataset: what; fix" for a data set that is missing, wrongly shaped,
// damaged, holds NaN or infinity or breaks an invariant, and for an unknown schema version. Files
// without any attribute are accepted. Writing: all at once or not at all; WorkError (disk full).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "datasets/hdf5/file.h"
#include "nn/geometry/body.h"

namespace restage {

inline constexpr int64_t kSchemaVersion = 1;

/// The attribute that names the JointDefinition of a body, or of all /joints of a file.
inline constexpr const char* kJointDefinition = "joint_definition";

/// Where data comes from and what may be done with it; goes into the file's attributes.
struct FileInfo {
  std::string license = "unknown";
  std::string provenance = "unknown";
  std::string transform = "";  ///< how it came into our frame (JSON); empty: it was not moved
};

// ---- bodies and motions: one "data set file" holds either or both ------------------------------

/// The three that bodies and motions may be in: "train", "validation", "test".
bool is_split(const std::string& name);

/// Equal face lists are stored once. InputError if two have the same id, an id has a '/', or bodies
/// have two definitions of joints.
void write_dataset(const std::string& path, const std::vector<Body>& bodies,
                   const std::vector<Motion>& motions, const FileInfo& info);
void write_bodies(const std::string& path, const std::vector<Body>& bodies, const FileInfo& info);
void write_motions(const std::string& path, const std::vector<Motion>& motions,
                   const FileInfo& info);
/// In the order they were written; only those of `split`, if one is given. InputError if the file
/// holds none at all.
std::vector<Body> read_bodies(const std::string& path, const std::string& split = "");
std::vector<Motion> read_motions(const std::string& path, const std::string& split = "");

/// Writes a large data set file one by one, so that nobody has to hold it in memory.
class DatasetWriter {
 public:
  DatasetWriter(const std::string& path, const FileInfo& info);
  void add(const Body& body);
  void add(const Motion& motion);
  void commit();

 private:
  void add_blend_shapes(const Body& body, const std::string& group);

  h5::File file_;
  std::vector<std::vector<Triangle>> topologies_;
  std::vector<std::shared_ptr<const PoseBlendShapes>> blend_shapes_;
  NamedDefinition definition_;  ///< of the first body that says it
  int64_t bodies_ = 0, motions_ = 0;
};

// ---- scan sequences: clouds with differing point counts
// -------------------------------------------

struct Scans {
  Points points;                         ///< of all frames, one after the other
  std::vector<int64_t> frame_offset;     ///< F + 1, frame f has points [f], [f + 1)
  std::vector<int64_t> sequence_offset;  ///< S + 1 in frames; {0, F} for one sequence
  double fps = kFps;
  int64_t frames() const { return static_cast<int64_t>(frame_offset.size()) - 1; }
};

void write_scans(const std::string& path, const Scans& scans, const FileInfo& info);
Scans read_scans(const std::string& path);

/// Writes a scan file cloud by cloud in constant memory.
class ScanWriter {
 public:
  ScanWriter(const std::string& path, const FileInfo& info, double fps = kFps);
  void append(const Points& cloud);
  /// The same with the true joints of who was scanned: for all frames of a file, or for none.
  void append(const Points& cloud, const Joints& joints);
  /// Says that units and axes of the points are not the project's.
  void set_foreign_frame();
  void end_sequence();  ///< the next cloud starts another sequence; the last one ends by itself
  /// Which joints append() is given; empty: not said.
  void set_definition(const JointDefinition& definition);
  /// Takes back what was appended since the last end_sequence().
  void drop_sequence();
  h5::File& file() { return file_; }  ///< for data sets beside those of a scan file
  void commit();

 private:
  h5::File file_;
  h5::Dataset points_;
  std::optional<h5::Dataset> joints_;
  std::vector<int64_t> frame_offset_{0}, sequence_offset_{0};
};

// ---- predictions and ground truth: what `restage eval` compares ---------------------------------

struct Prediction {
  int64_t frames = 0;
  int64_t vertex_count = 0;              ///< V, 0 without vertices
  std::vector<double> joints;            ///< F x 22 x 3; empty if absent
  std::vector<double> vertices;          ///< F x V x 3; empty if absent
  std::vector<int64_t> sequence_offset;  ///< S + 1, from 0 to F; {0, F} for one sequence
  std::vector<Triangle> faces;           ///< empty if absent
  std::vector<double> confidence;        ///< F, 0 to 1; empty if absent
  std::vector<double> radius;            ///< F x 22, metres (see PredictionWriter); empty if absent
  std::vector<double> rotations;         ///< F x 22 x 4, as PredictionWriter; empty if absent
  JointDefinition definition;            ///< of the joints; empty: the file does not say
  double fps = kFps;                     ///< written, not read
};

/// /joints [F,22,3] and /vertices [F,V,3] (float32 or float64, either may be absent),
/// /sequence_offset [S+1], /faces [T,3], /confidence [F], /radius [F,22] and /rotations [F,22,4]
/// (all optional).
Prediction read_prediction(const std::string& path);

/// The same some frames at a time, as surfaces are large. Opening it checks shapes and offsets.
class PredictionReader {
 public:
  explicit PredictionReader(const std::string& path);
  int64_t frames() const { return frames_; }
  int64_t vertex_count() const { return vertex_count_; }
  bool has_joints() const { return joints_.has_value(); }
  bool has_vertices() const { return vertices_.has_value(); }
  const std::vector<int64_t>& sequence_offset() const { return sequence_offset_; }
  /// Frames [first, first + count), count x 22 x 3 and count x V x 3.
  void read_joints(int64_t first, int64_t count, std::vector<double>& out) const;
  void read_vertices(int64_t first, int64_t count, std::vector<double>& out) const;
  /// The rest of the file: a kilobyte or two a frame.
  Prediction read_small() const;
  /// Looks at every value; InputError as read_prediction().
  void check() const;

 private:
  h5::File file_;
  std::optional<h5::Dataset> joints_, vertices_;
  int64_t frames_ = 0, vertex_count_ = 0;
  std::vector<int64_t> sequence_offset_;
};

/// Of one sequence of a file; empty where there is none.
std::vector<double> read_confidence(const std::string& path, int64_t sequence);
void write_prediction(const std::string& path, const Prediction& prediction, const FileInfo& info);

/// Which file a result's motion was taken from, and how that file was read: the options of `restage
/// retarget`.
struct SourceRecord {
  std::string path = {};                           ///< as from the working directory
  std::string clip = {};                           ///< of a glTF file; empty: the first
  std::optional<int64_t> sequence = std::nullopt;  ///< of an HDF5 file, from 0
  std::optional<double> fps = std::nullopt;        ///< frames per second; nothing: the file's
  double scale = 1;                                ///< metres per unit
  std::string up = "y";                            ///< the axis that points up: x, -x, y, -y, z, -z
  bool up_known = false;                           ///< somebody said which axis it is; not stored
  /// Of several people in clouds this one, from 0 (datasets/doctor/people.h); not stored.
  std::optional<int64_t> person = std::nullopt;
};

/// Nothing where the prediction does not say. A relative path is stored relative to the
/// prediction's folder, so that both may be moved together.
std::optional<SourceRecord> read_source_record(const std::string& path);
/// The frames (from 0, rising) that have no cloud of the source behind them; mostly none.
std::vector<int64_t> read_filled(const std::string& path);

/// Writes a prediction frame by frame in constant memory (float32).
class PredictionWriter {
 public:
  /// `vertex_count` 0: no vertices. `faces` may be empty.
  PredictionWriter(const std::string& path, int64_t vertex_count,
                   const std::vector<Triangle>& faces, const FileInfo& info, double fps = kFps);
  /// `confidence` for all frames or for none.
  void append(const Joints& joints, const Points& vertices,
              std::optional<double> confidence = std::nullopt);
  /// World turns from the T-pose of the frame that append() was called for last; for all frames or
  /// for none. Written as /rotations [F,22,4], unit quaternions w x y z.
  void append_rotations(const Rotations& global);
  /// Joints alone, each with the radius about it that should hold the true one nine times in ten.
  void append_joints(const Joints& joints, const std::array<double, kJoints>& radius);
  /// Which joints append() is given; empty: not said.
  void set_definition(const JointDefinition& definition);
  /// How the source's scans relate to the world: world = A p + b, rows of [A | b]. Written as
  /// /source_to_world [3,4].
  void set_source_to_world(const Eigen::Matrix<double, 3, 4>& transform);
  /// Frames that have no cloud of the source behind them, from 0, rising. Written as /filled.
  void set_filled(const std::vector<int64_t>& frames);
  /// Written as attributes of the group /source.
  void set_source(const SourceRecord& source);
  void end_sequence();  ///< the next frame starts another sequence; the last one ends by itself
  void commit();        ///< before this nothing is under `path`

 private:
  h5::File file_;
  int64_t vertex_count_ = 0;
  h5::Dataset joints_;
  std::optional<h5::Dataset> vertices_, rotations_;
  std::vector<float> confidence_, radius_;
  std::vector<int64_t> sequence_offset_{0};
};

// ---- any of them --------------------------------------------------------------------------------

struct Inspection {
  std::string kind;                       ///< "bodies", "motions", "dataset", "scans", "prediction"
  std::map<std::string, int64_t> counts;  ///< e.g. {"frames": 30, "vertices": 6890}
  std::string units, license, provenance;
  std::string transform;  ///< of repaired files (FileInfo::transform); empty: none
  double fps = kFps, seconds = 0;
  /// Of data sets: {"train": {"bodies": 24, "motions": 60, "frames": 5400}, ...}, motions of each
  /// subject and each action, and the bodies' heights in metres, in order of size.
  std::map<std::string, std::map<std::string, int64_t>> splits;
  std::map<std::string, int64_t> subjects, actions;
  std::vector<double> heights;
  /// The definitions of joints, and how many bodies have each; of other files the file's, 1.
  std::map<std::string, int64_t> definitions;
};

/// What a file holds, without reading more values than the bodies' vertices.
Inspection inspect(const std::string& path);

/// Reads everything and checks it: finite values, weights that sum to 1, unit quaternions, rising
/// offsets, face indices. One line per problem ("file:/dataset: what; fix"); none: all is well.
/// InputError only if the file cannot be opened or is of no known kind.
std::vector<std::string> verify(const std::string& path);

// ---- pieces that readers share ------------------------------------------------------------------

/// A new file with the attributes of every kind; `kind` may be corrected before commit().
h5::File create_schema_file(const std::string& path, const std::string& kind, const FileInfo& info);
/// Opens and checks the schema version.
h5::File open_schema_file(const std::string& path);
/// Reads offsets and checks that they rise (strictly, if asked) from 0 to `end`.
std::vector<int64_t> read_offsets(const h5::File& file, const std::string& name, int64_t end,
                                  bool strictly);

}  // namespace restage
