// Bodies and motions in data set files.
#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

constexpr double kWeightSum = 1e-3;   // how far a row of weights may be from 1
constexpr double kUnitLength = 1e-3;  // and the length of a quaternion

void check_id(const std::string& path, const h5::File& file, const std::string& group,
              const std::string& id) {
  const bool plain = !id.empty() && id != "." && id != ".." && id.find('/') == std::string::npos &&
                     id.find('\0') == std::string::npos;
  if (!plain)
    throw InputError(path, "'" + id + "' cannot be an id", "use letters, digits, '_' and '-'");
  if (file.has(group + id))
    throw InputError(path, "two entries are called '" + id + "'", "give each its own id");
}

Joints read_joints(const h5::File& file, const std::string& name) {
  const std::vector<double> flat = read_finite<double>(file, name, {kJoints, 3});
  Joints joints;
  for (size_t j = 0; j < joints.size(); ++j)
    joints[j] = Vec3(flat[3 * j], flat[3 * j + 1], flat[3 * j + 2]);
  return joints;
}

void write_joints(h5::File& file, const std::string& name, const Joints& joints) {
  std::vector<double> flat;
  for (const Vec3& joint : joints) flat.insert(flat.end(), joint.data(), joint.data() + 3);
  file.write<double>(name, {kJoints, 3}, flat);
}

std::string text_or_nothing(const h5::File& file, const std::string& object,
                            const std::string& name) {
  return file.text(object, name).value_or("");
}

void read_weights(const h5::File& file, const std::string& name, Body& body) {
  const auto rows = static_cast<int64_t>(body.rest.vertices.size());
  const std::vector<float> flat = read_finite<float>(file, name, {rows, kJoints});
  body.weights.resize(rows, kJoints);
  std::copy(flat.begin(), flat.end(), body.weights.data());
  for (int64_t v = 0; v < rows; ++v) {
    const double sum = body.weights.row(v).cast<double>().sum();
    if (std::abs(sum - 1) > kWeightSum || body.weights.row(v).minCoeff() < 0)
      throw InputError(
          file.path() + ":" + name,
          "the weights of vertex " + std::to_string(v) + " are negative or do not sum to 1",
          "normalise the weights");
  }
}

/// [V,3,189] of a group of their own, which several bodies name.
std::shared_ptr<const PoseBlendShapes> read_blend_shapes(const h5::File& file,
                                                         const std::string& name,
                                                         int64_t vertices) {
  const std::vector<float> flat =
      read_finite<float>(file, name, {vertices, 3, PoseBlendShapes::kFeatures});
  const auto out = std::make_shared<PoseBlendShapes>();
  out->directions.resize(3 * vertices, PoseBlendShapes::kFeatures);
  std::copy(flat.begin(), flat.end(), out->directions.data());
  return out;
}

template <class T, class Read>
std::vector<T> read_members(const std::string& path, const std::string& group,
                            const std::string& split, const Read& read) {
  const h5::File file = open_schema_file(path);
  std::vector<T> out;
  const std::vector<std::string> ids = file.children(group);
  if (ids.empty()) throw InputError(path + ":" + group, "is empty", "give a file that holds some");
  for (const std::string& id : ids) {
    const std::string own = text_or_nothing(file, group + "/" + id, "split");
    if (!split.empty() && !own.empty() && !is_split(own))  // else nobody would miss it
      throw InputError(path + ":" + group + "/" + id, "has the split '" + own + "'",
                       "use train, validation or test");
    if (split.empty() || own == split) out.push_back(read(file, id));
  }
  return out;
}

}  // namespace

Body read_body(const h5::File& file, const std::string& id, SharedShapes& shared) {
  const std::string group = "/bodies/" + id;
  Body body;
  body.id = id;
  body.split = text_or_nothing(file, group, "split");
  body.rest.vertices = read_points(file, group + "/vertices");
  if (body.rest.vertices.empty())
    throw InputError(file.path() + ":" + group + "/vertices", "holds no points",
                     "give a body with a surface");
  const auto vertices = static_cast<int64_t>(body.rest.vertices.size());
  if (file.has(group + "/faces")) {
    body.rest.faces = read_faces(file, group + "/faces", vertices);
  } else if (const std::optional<std::string> topology = file.text(group, "topology")) {
    body.rest.faces = read_faces(file, "/topologies/" + *topology, vertices);
  }
  body.joints = read_joints(file, group + "/joints");
  body.definition = read_definition(file, group);
  read_weights(file, group + "/weights", body);
  if (const std::optional<std::string> name = file.text(group, "blend_shapes")) {
    auto& shapes = shared[*name];
    if (!shapes || shapes->directions.rows() != 3 * vertices)
      shapes = read_blend_shapes(file, "/blend_shapes/" + *name, vertices);
    body.blend_shapes = shapes;
  }
  return body;
}

Motion read_motion(const h5::File& file, const std::string& id) {
  const std::string group = "/motions/" + id;
  Motion motion;
  motion.id = id;
  motion.subject = text_or_nothing(file, group, "subject");
  motion.split = text_or_nothing(file, group, "split");
  motion.action = text_or_nothing(file, group, "action");
  motion.rest = read_joints(file, group + "/rest");
  motion.hips = read_points(file, group + "/hips");
  const auto frames = static_cast<int64_t>(motion.hips.size());
  const std::string name = group + "/rotations";
  const std::vector<float> flat = read_finite<float>(file, name, {frames, kJoints, 4});
  motion.global.resize(motion.hips.size());
  for (size_t i = 0; i < flat.size() / 4; ++i) {
    const float* q = &flat[4 * i];
    if (std::abs(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) - 1) > kUnitLength)
      throw InputError(file.path() + ":" + name,
                       "frame " + std::to_string(i / kJoints) + " joint " +
                           std::to_string(i % kJoints) + " is no unit quaternion",
                       "normalise the rotations");
    motion.global[i / kJoints][i % kJoints] = Eigen::Quaternionf(q[0], q[1], q[2], q[3]);
  }
  return motion;
}

DatasetWriter::DatasetWriter(const std::string& path, const FileInfo& info)
    : file_(create_schema_file(path, "dataset", info)) {}

void DatasetWriter::add(const Body& body) {
  check_id(file_.path(), file_, "/bodies/", body.id);
  if (!body.definition.empty()) {
    const std::string where = file_.path() + ": body '" + body.id + "'";
    if (body.definition != definition_.definition)
      common_definition({definition_, {body.definition, where}});
    if (definition_.definition.empty()) definition_ = {body.definition, where};
  }
  const std::string group = "/bodies/" + body.id;
  write_points(file_, group + "/vertices", body.rest.vertices);
  write_joints(file_, group + "/joints", body.joints);
  file_.write<float>(
      group + "/weights", {body.weights.rows(), kJoints},
      std::span<const float>(body.weights.data(), static_cast<size_t>(body.weights.size())));
  file_.set_text(group, "split", body.split);
  if (!body.definition.empty()) file_.set_text(group, kJointDefinition, body.definition);
  ++bodies_;
  add_blend_shapes(body, group);
  if (body.rest.faces.empty()) return;
  auto same = std::find(topologies_.begin(), topologies_.end(), body.rest.faces);
  const std::string topology = std::to_string(same - topologies_.begin());
  if (same == topologies_.end()) {
    topologies_.push_back(body.rest.faces);
    write_faces(file_, "/topologies/" + topology, body.rest.faces);
  }
  file_.set_text(group, "topology", topology);
}

/// What a model's people share is written once.
void DatasetWriter::add_blend_shapes(const Body& body, const std::string& group) {
  if (!body.blend_shapes) return;
  const auto& directions = body.blend_shapes->directions;
  const auto same =
      std::find_if(blend_shapes_.begin(), blend_shapes_.end(), [&](const auto& shapes) {
        return shapes == body.blend_shapes ||
               (shapes->directions.rows() == directions.rows() && shapes->directions == directions);
      });
  const std::string name = std::to_string(same - blend_shapes_.begin());
  file_.set_text(group, "blend_shapes", name);
  if (same != blend_shapes_.end()) return;
  blend_shapes_.push_back(body.blend_shapes);
  file_.write<float>("/blend_shapes/" + name, {directions.rows() / 3, 3, directions.cols()},
                     {directions.data(), static_cast<size_t>(directions.size())});
}

void DatasetWriter::add(const Motion& motion) {
  check_id(file_.path(), file_, "/motions/", motion.id);
  const std::string group = "/motions/" + motion.id;
  write_joints(file_, group + "/rest", motion.rest);
  write_points(file_, group + "/hips", motion.hips);
  std::vector<float> flat;
  flat.reserve(motion.frames() * kJoints * 4);
  for (const auto& frame : motion.global)
    for (const Eigen::Quaternionf& q : frame) flat.insert(flat.end(), {q.w(), q.x(), q.y(), q.z()});
  file_.write<float>(group + "/rotations", {static_cast<int64_t>(motion.frames()), kJoints, 4},
                     flat);
  file_.set_text(group, "subject", motion.subject);
  file_.set_text(group, "split", motion.split);
  file_.set_text(group, "action", motion.action);
  ++motions_;
}

void DatasetWriter::commit() {
  if (motions_ == 0) file_.set_text("/", "kind", "bodies");
  if (bodies_ == 0) file_.set_text("/", "kind", "motions");
  file_.commit();
}

void write_dataset(const std::string& path, const std::vector<Body>& bodies,
                   const std::vector<Motion>& motions, const FileInfo& info) {
  DatasetWriter writer(path, info);
  for (const Body& body : bodies) writer.add(body);
  for (const Motion& motion : motions) writer.add(motion);
  writer.commit();
}

void write_bodies(const std::string& path, const std::vector<Body>& bodies, const FileInfo& info) {
  write_dataset(path, bodies, {}, info);
}

void write_motions(const std::string& path, const std::vector<Motion>& motions,
                   const FileInfo& info) {
  write_dataset(path, {}, motions, info);
}

std::vector<Body> read_bodies(const std::string& path, const std::string& split) {
  SharedShapes shared;
  return read_members<Body>(
      path, "/bodies", split,
      [&](const h5::File& file, const std::string& id) { return read_body(file, id, shared); });
}

std::vector<Motion> read_motions(const std::string& path, const std::string& split) {
  return read_members<Motion>(path, "/motions", split, read_motion);
}

std::string joined_texts(const std::vector<std::string>& texts) {
  std::vector<std::string> parts;
  std::string out;
  for (const std::string& text : texts)
    for (size_t at = 0; at <= text.size();) {
      const size_t end = std::min(text.find("; ", at), text.size());
      const std::string part = text.substr(at, end - at);
      if (!part.empty() && std::find(parts.begin(), parts.end(), part) == parts.end()) {
        parts.push_back(part);
        out += (out.empty() ? "" : "; ") + part;
      }
      at = end + 2;
    }
  return out;
}

}  // namespace restage
