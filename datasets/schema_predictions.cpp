// Prediction files: joints and surfaces over time.
#include "autograd/base/error.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

std::vector<double> confidence_in(const h5::File& file, int64_t frames) {
  if (!file.has("/confidence")) return {};
  const h5::Dataset set = file.dataset("/confidence", {frames});
  std::vector<double> out = read_finite<double>(file, "/confidence", {frames});
  for (const double x : out)
    if (!(x >= 0 && x <= 1))
      throw InputError(set.where(), "holds a number that is no confidence", "give 0 to 1");
  return out;
}

std::vector<double> radius_in(const h5::File& file, int64_t frames) {
  if (!file.has("/radius")) return {};
  const h5::Dataset set = file.dataset("/radius", {frames, kJoints});
  std::vector<double> out = read_finite<double>(file, "/radius", {frames, kJoints});
  for (const double x : out)
    if (!(x > 0)) throw InputError(set.where(), "holds a number that is no radius", "give metres");
  return out;
}

/// F x 22 x 4 unit quaternions; none if the file has none.
std::vector<double> rotations_in(const h5::File& file, int64_t frames) {
  if (!file.has("/rotations")) return {};
  const h5::Dataset set = file.dataset("/rotations", {frames, kJoints, 4});
  std::vector<double> all = read_finite<double>(file, "/rotations", {frames, kJoints, 4});
  for (size_t i = 0; i < all.size(); i += 4)
    if (std::abs(Eigen::Map<const Eigen::Vector4d>(&all[i]).norm() - 1) > 1e-3)
      throw InputError(set.where(),
                       "frame " + std::to_string(i / (4 * kJoints)) + " holds no unit quaternion",
                       "normalise the rotations");
  return all;
}

}  // namespace

std::vector<double> read_confidence(const std::string& path, int64_t sequence) {
  const h5::File file = open_schema_file(path);
  if (!file.has("/confidence")) return {};
  const std::vector<double> all = confidence_in(file, file.dataset("/confidence", {-1}).rows());
  const std::vector<int64_t> offset = sequence_offsets(file, std::ssize(all));
  const auto s = static_cast<size_t>(sequence);
  if (sequence < 0 || s + 1 >= offset.size()) return {};
  return {all.begin() + offset[s], all.begin() + offset[s + 1]};
}

PredictionReader::PredictionReader(const std::string& path) : file_(open_schema_file(path)) {
  const bool has_joints = file_.has("/joints"), has_vertices = file_.has("/vertices");
  if (!has_joints && !has_vertices)
    throw InputError(path + ":/joints", "is missing, and so is /vertices",
                     "give a file with /joints [F, 22, 3] or /vertices [F, V, 3]");
  const auto check_frames = [](const h5::Dataset& set) {
    if (set.rows() == 0)
      throw InputError(set.where(), "holds no frames", "give a file with at least one frame");
  };
  if (has_joints) {
    joints_.emplace(file_.dataset("/joints", {-1, kJoints, 3}));
    check_frames(*joints_);
    frames_ = joints_->rows();
  }
  if (has_vertices) {
    vertices_.emplace(file_.dataset("/vertices", {-1, -1, 3}));
    check_frames(*vertices_);
    vertex_count_ = vertices_->shape()[1];
    if (vertex_count_ == 0)
      throw InputError(vertices_->where(), "holds no vertices", "leave it out or fill it");
    if (has_joints && vertices_->rows() != frames_)
      throw InputError(vertices_->where(),
                       "has " + std::to_string(vertices_->rows()) + " frames but /joints has " +
                           std::to_string(frames_),
                       "store the same frames in both");
    frames_ = vertices_->rows();
  }
  sequence_offset_ = sequence_offsets(file_, frames_);
}

void PredictionReader::read_joints(int64_t first, int64_t count, std::vector<double>& out) const {
  joints_->read_rows(first, count, out);
  check_finite(joints_->where(), out, joints_->row_size(), first);
}

void PredictionReader::read_vertices(int64_t first, int64_t count, std::vector<double>& out) const {
  vertices_->read_rows(first, count, out);
  check_finite(vertices_->where(), out, vertices_->row_size(), first);
}

Prediction PredictionReader::read_small() const {
  Prediction out;
  out.frames = frames_;
  out.vertex_count = vertex_count_;
  out.sequence_offset = sequence_offset_;
  if (joints_) read_joints(0, frames_, out.joints);
  if (file_.has("/faces"))
    out.faces = read_faces(file_, "/faces", vertices_ ? vertex_count_ : int64_t{1} << 31);
  out.confidence = confidence_in(file_, frames_);
  out.radius = radius_in(file_, frames_);
  out.rotations = rotations_in(file_, frames_);
  out.definition = read_definition(file_, "/");
  return out;
}

void PredictionReader::check() const {
  read_small();
  if (vertices_) check_all_finite<double>(*vertices_);
}

Prediction read_prediction(const std::string& path) {
  const PredictionReader reader(path);
  Prediction out = reader.read_small();
  if (reader.has_vertices()) reader.read_vertices(0, out.frames, out.vertices);
  return out;
}

void write_prediction(const std::string& path, const Prediction& prediction, const FileInfo& info) {
  h5::File file = create_schema_file(path, "prediction", info);
  if (!prediction.joints.empty())
    file.write<double>("/joints", {prediction.frames, kJoints, 3}, prediction.joints);
  if (!prediction.vertices.empty())
    file.write<double>("/vertices", {prediction.frames, prediction.vertex_count, 3},
                       prediction.vertices);
  if (!prediction.rotations.empty())
    file.write<double>("/rotations", {prediction.frames, kJoints, 4}, prediction.rotations);
  write_sequence_offset(file, prediction.sequence_offset, prediction.frames);
  if (!prediction.faces.empty()) write_faces(file, "/faces", prediction.faces);
  file.set_number("/", "fps", prediction.fps);
  if (!prediction.definition.empty()) file.set_text("/", kJointDefinition, prediction.definition);
  file.commit();
}

PredictionWriter::PredictionWriter(const std::string& path, int64_t vertex_count,
                                   const std::vector<Triangle>& faces, const FileInfo& info,
                                   double fps)
    : file_(create_schema_file(path, "prediction", info)),
      vertex_count_(vertex_count),
      joints_(file_.create_appendable<float>("/joints", {kJoints, 3})) {
  file_.set_number("/", "fps", fps);
  if (vertex_count > 0) vertices_ = file_.create_appendable<float>("/vertices", {vertex_count, 3});
  if (!faces.empty()) write_faces(file_, "/faces", faces);
}

void PredictionWriter::append(const Joints& joints, const Points& vertices,
                              std::optional<double> confidence) {
  if (static_cast<int64_t>(vertices.size()) != vertex_count_)
    throw ShapeError("prediction writer: " + std::to_string(vertices.size()) +
                     " vertices instead of " + std::to_string(vertex_count_));
  joints_.append<float>(flat_joints(joints));
  if (vertices_) vertices_->append<float>(as_floats(vertices));
  if (confidence) confidence_.push_back(static_cast<float>(*confidence));
}

void PredictionWriter::append_rotations(const Rotations& global) {
  if (!rotations_) rotations_ = file_.create_appendable<float>("/rotations", {kJoints, 4});
  std::vector<float> row;
  for (const auto& q : quaternions(global))
    for (const double x : q) row.push_back(static_cast<float>(x));
  rotations_->append<float>(row);
}

void PredictionWriter::append_joints(const Joints& joints,
                                     const std::array<double, kJoints>& radius) {
  append(joints, {});
  radius_.insert(radius_.end(), radius.begin(), radius.end());
}

void PredictionWriter::set_definition(const JointDefinition& definition) {
  if (!definition.empty()) file_.set_text("/", kJointDefinition, definition);
}

void PredictionWriter::set_source_to_world(const Eigen::Matrix<double, 3, 4>& transform) {
  std::vector<double> rows;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) rows.push_back(transform(r, c));
  file_.write<double>("/source_to_world", {3, 4}, rows);
}

void PredictionWriter::end_sequence() {
  if (sequence_offset_.back() != joints_.rows()) sequence_offset_.push_back(joints_.rows());
}

void PredictionWriter::commit() {
  if (!confidence_.empty()) {
    if (std::ssize(confidence_) != joints_.rows())
      throw ShapeError("prediction writer: confidence for some frames only");
    file_.write<float>("/confidence", {joints_.rows()}, confidence_);
  }
  if (!radius_.empty()) {
    if (std::ssize(radius_) != joints_.rows() * static_cast<int64_t>(kJoints))
      throw ShapeError("prediction writer: radius for some frames only");
    file_.write<float>("/radius", {joints_.rows(), kJoints}, radius_);
  }
  if (rotations_ && rotations_->rows() != joints_.rows())
    throw ShapeError("prediction writer: rotations for some frames only");
  write_sequence_offset(file_, sequence_offset_, joints_.rows());
  file_.commit();
}

}  // namespace restage
