// Scan files, and what all kinds share. Bodies and motions: schema_bodies.cpp; predictions:
// schema_predictions.cpp.
#include "datasets/schema.h"

#include <cmath>

#include "autograd/base/error.h"
#include "datasets/schema_detail.h"

namespace restage {
bool is_split(const std::string& name) {
  return name == "train" || name == "validation" || name == "test";
}

h5::File create_schema_file(const std::string& path, const std::string& kind,
                            const FileInfo& info) {
  h5::File file = h5::File::create(path);
  file.set_integer("/", "restage_schema", kSchemaVersion);
  file.set_text("/", "kind", kind);
  file.set_text("/", "units", "metres");
  file.set_text("/", "up", "y");
  file.set_number("/", "fps", kFps);
  file.set_text("/", "license", info.license);
  file.set_text("/", "provenance", info.provenance);
  if (!info.transform.empty()) file.set_text("/", "transform", info.transform);
  return file;
}

h5::File open_schema_file(const std::string& path) {
  h5::File file = h5::File::open(path);
  const std::optional<int64_t> version = file.integer("/", "restage_schema");
  if (version && *version != kSchemaVersion)
    throw InputError(path, "has schema version " + std::to_string(*version) + ", which is unknown",
                     "this program reads version " + std::to_string(kSchemaVersion));
  return file;
}

std::vector<int64_t> read_offsets(const h5::File& file, const std::string& name, int64_t end,
                                  bool strictly) {
  const h5::Dataset set = file.dataset(name, {-1});
  const std::vector<int64_t> offset = set.read<int64_t>();
  bool good = offset.size() >= 2 && offset.front() == 0 && offset.back() == end;
  for (size_t i = 1; good && i < offset.size(); ++i)
    good = offset[i] > offset[i - 1] || (!strictly && offset[i] == offset[i - 1]);
  if (!good)
    throw InputError(set.where(), "does not rise from 0 to " + std::to_string(end),
                     "store the start of each part and the end");
  return offset;
}

std::vector<int64_t> sequence_offsets(const h5::File& file, int64_t frames) {
  if (!file.has("/sequence_offset")) return {0, frames};
  return read_offsets(file, "/sequence_offset", frames, true);
}

void write_sequence_offset(h5::File& file, std::vector<int64_t> offset, int64_t frames) {
  if (offset.empty()) offset.push_back(0);
  if (offset.back() != frames) offset.push_back(frames);
  file.write<int64_t>("/sequence_offset", {static_cast<int64_t>(offset.size())}, offset);
}

std::span<const float> as_floats(const Points& points) {
  return {points.empty() ? nullptr : points[0].data(), points.size() * 3};
}

std::array<float, kJoints * 3> flat_joints(const Joints& joints) {
  std::array<float, kJoints * 3> flat;
  for (size_t i = 0; i < flat.size(); ++i)
    flat[i] = static_cast<float>(joints[i / 3][static_cast<int>(i % 3)]);
  return flat;
}

std::vector<Triangle> read_faces(const h5::File& file, const std::string& name, int64_t vertices) {
  const h5::Dataset set = file.dataset(name, {-1, 3});
  const std::vector<int32_t> index = set.read<int32_t>();
  std::vector<Triangle> faces(index.size() / 3);
  for (size_t i = 0; i < index.size(); ++i) {
    if (index[i] < 0 || index[i] >= vertices)
      throw InputError(set.where(),
                       "face " + std::to_string(i / 3) + " has vertex " + std::to_string(index[i]) +
                           " of " + std::to_string(vertices),
                       "correct the face list");
    faces[i / 3][i % 3] = index[i];
  }
  return faces;
}

void write_faces(h5::File& file, const std::string& name, const std::vector<Triangle>& faces) {
  file.write<int32_t>(
      name, {static_cast<int64_t>(faces.size()), 3},
      std::span<const int32_t>(faces.empty() ? nullptr : faces[0].data(), faces.size() * 3));
}

Points read_points(const h5::File& file, const std::string& name) {
  const std::vector<float> flat = read_finite<float>(file, name, {-1, 3});
  Points points(flat.size() / 3);
  for (size_t i = 0; i < points.size(); ++i)
    points[i] = Point(flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]);
  return points;
}

void write_points(h5::File& file, const std::string& name, const Points& points) {
  file.write<float>(name, {static_cast<int64_t>(points.size()), 3}, as_floats(points));
}

// ---- scans -------------------------------------------------------------------------------------

void write_scans(const std::string& path, const Scans& scans, const FileInfo& info) {
  h5::File file = create_schema_file(path, "scans", info);
  file.set_number("/", "fps", scans.fps);
  write_points(file, "/points", scans.points);
  file.write<int64_t>("/frame_offset", {static_cast<int64_t>(scans.frame_offset.size())},
                      scans.frame_offset);
  write_sequence_offset(file, scans.sequence_offset, scans.frames());
  file.commit();
}

Scans read_scans(const std::string& path) {
  const h5::File file = open_schema_file(path);
  Scans scans;
  scans.points = read_points(file, "/points");
  scans.frame_offset =
      read_offsets(file, "/frame_offset", static_cast<int64_t>(scans.points.size()), false);
  scans.sequence_offset = sequence_offsets(file, scans.frames());
  scans.fps = read_fps(file);
  return scans;
}

ScanWriter::ScanWriter(const std::string& path, const FileInfo& info, double fps)
    : file_(create_schema_file(path, "scans", info)),
      points_(file_.create_appendable<float>("/points", {3})) {
  file_.set_number("/", "fps", fps);
}

void ScanWriter::append(const Points& cloud) {
  points_.append<float>(as_floats(cloud));
  frame_offset_.push_back(frame_offset_.back() + static_cast<int64_t>(cloud.size()));
}

void ScanWriter::append(const Points& cloud, const Joints& joints) {
  if (!joints_ && frame_offset_.size() > 1)
    throw ShapeError("scan writer: joints for some frames only");
  if (!joints_) joints_ = file_.create_appendable<float>("/joints", {kJoints, 3});
  joints_->append<float>(flat_joints(joints));
  append(cloud);
}

void ScanWriter::set_definition(const JointDefinition& definition) {
  if (!definition.empty()) file_.set_text("/", kJointDefinition, definition);
}

void ScanWriter::set_foreign_frame() {
  file_.set_text("/", "units", "unknown");
  file_.set_text("/", "up", "unknown");
}

void ScanWriter::end_sequence() {
  const int64_t frames = static_cast<int64_t>(frame_offset_.size()) - 1;
  if (sequence_offset_.back() != frames) sequence_offset_.push_back(frames);
}

void ScanWriter::drop_sequence() {
  frame_offset_.resize(static_cast<size_t>(sequence_offset_.back()) + 1);
  points_.truncate(frame_offset_.back());
  if (joints_) joints_->truncate(sequence_offset_.back());
}

void ScanWriter::commit() {
  if (joints_ && joints_->rows() + 1 != static_cast<int64_t>(frame_offset_.size()))
    throw ShapeError("scan writer: joints for some frames only");
  file_.write<int64_t>("/frame_offset", {static_cast<int64_t>(frame_offset_.size())},
                       frame_offset_);
  write_sequence_offset(file_, sequence_offset_, static_cast<int64_t>(frame_offset_.size()) - 1);
  file_.commit();
}

}  // namespace restage
