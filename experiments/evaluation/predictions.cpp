#include "experiments/evaluation/predictions.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "experiments/evaluation/mesh_frames.h"
#include "experiments/text.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

using metrics::SequenceView;
using metrics::Surfaces;
using metrics::Track;

void append(const std::vector<Joints>& frames, std::vector<double>* values) {
  for (const Joints& joints : frames)
    for (const Vec3& p : joints) values->insert(values->end(), {p.x(), p.y(), p.z()});
}

/// Frames of the references, as if they had been predicted.
struct Made {
  std::vector<double> rest_pose, closed_form, rotations;  // rotations: the closed form's
};

void make(const std::vector<Joints>& source, const Joints& target, Made* out) {
  append(rest_pose_joints(source, target), &out->rest_pose);
  for (const Pose& pose : closed_form(source, target)) {
    const PosedSkeleton posed = forward_kinematics(target, pose);
    append({posed.joints}, &out->closed_form);
    for (const auto& q : quaternions(posed.global))
      out->rotations.insert(out->rotations.end(), q.begin(), q.end());
  }
}

/// The target's rest surface, carried as its pelvis is, frame by frame.
class CarriedRest {
 public:
  CarriedRest(Surfaces rest, std::vector<int64_t> offset)
      : rest_(rest), offset_(std::move(offset)) {}
  /// Of the next sequence: its row of the rest surfaces, the pelvis there and in every frame.
  void add_sequence(int64_t row, const Vec3& pelvis) { targets_.push_back({row, pelvis}); }
  void set_path(std::span<const double> rest_pose) { rest_pose_ = rest_pose; }

  void read(int64_t first, int64_t count, std::vector<double>& out) {
    out.clear();
    for (int64_t f = first; f < first + count; ++f) {
      const auto next = std::upper_bound(offset_.begin(), offset_.end(), f);
      const auto& [row, pelvis] = targets_[static_cast<size_t>(next - offset_.begin() - 1)];
      if (row != held_) surface_ = rest_.block(row, 1, memory_);
      held_ = row;
      const Vec3 path = Eigen::Map<const Vec3>(&rest_pose_[static_cast<size_t>(3 * f * kJoints)]);
      for (int64_t v = 0; v < surface_.points; ++v) {
        const Vec3 moved = surface_.at(0, v) + path - pelvis;
        out.insert(out.end(), moved.begin(), moved.end());
      }
    }
  }

 private:
  struct Target {
    int64_t row;
    Vec3 pelvis;
  };
  Surfaces rest_;
  std::vector<int64_t> offset_;
  std::vector<Target> targets_;
  std::span<const double> rest_pose_;
  std::vector<double> memory_;
  Track surface_;
  int64_t held_ = -1;
};

}  // namespace

PredictionFile::PredictionFile(const std::string& name) : path(name) {
  if (std::filesystem::is_directory(name)) {
    const auto meshes = std::make_shared<const MeshFrames>(name);
    data.frames = meshes->frames();
    data.vertex_count = meshes->vertex_count();
    data.sequence_offset = meshes->sequence_offset();
    data.faces = meshes->faces();
    remarks = meshes->remarks();
    read_ = [meshes](int64_t first, int64_t count, auto& out) { meshes->read(first, count, out); };
    return;
  }
  const auto reader = std::make_shared<const PredictionReader>(name);
  data = reader->read_small();
  if (reader->has_vertices())
    read_ = [reader](int64_t first, int64_t count, auto& out) {
      reader->read_vertices(first, count, out);
    };
}

Track PredictionFile::joints() const {
  return data.joints.empty() ? Track{} : Track{data.joints.data(), data.frames, kJoints};
}

Surfaces PredictionFile::vertices() const {
  if (!read_)
    return data.vertices.empty() ? Track{}
                                 : Track{data.vertices.data(), data.frames, data.vertex_count};
  const auto rows = std::make_shared<const std::vector<int64_t>>(rows_);
  const auto read = [read_rows = read_, rows, move = move_](int64_t first, int64_t count,
                                                            std::vector<double>& out) {
    if (rows->empty()) {
      read_rows(first, count, out);
    } else {
      out.clear();
      std::vector<double> row;
      for (int64_t f = first; f < first + count; ++f) {
        read_rows((*rows)[static_cast<size_t>(f)], 1, row);
        out.insert(out.end(), row.begin(), row.end());
      }
    }
    if (move) move(out);
  };
  return {data.frames, data.vertex_count, read};
}

void PredictionFile::thin(int64_t step) {
  std::vector<int64_t> kept, offset{0};
  for (int64_t s = 0; s < sequences(); ++s) {
    const auto i = static_cast<size_t>(s);
    for (int64_t f = data.sequence_offset[i]; f < data.sequence_offset[i + 1]; f += step)
      kept.push_back(f);
    offset.push_back(std::ssize(kept));
  }
  for (std::vector<double>* values : {&data.joints, &data.vertices, &data.rotations}) {
    const auto row = static_cast<std::ptrdiff_t>(values->size()) / data.frames;
    for (size_t k = 0; k < kept.size(); ++k)
      std::copy_n(values->begin() + kept[k] * row, row,
                  values->begin() + static_cast<std::ptrdiff_t>(k) * row);
    values->resize(kept.size() * static_cast<size_t>(row));
  }
  data.frames = std::ssize(kept);
  data.sequence_offset = std::move(offset);
  if (rows_.empty()) {
    rows_ = std::move(kept);
    return;
  }
  for (int64_t& f : kept) f = rows_[static_cast<size_t>(f)];
  rows_ = std::move(kept);
}

void PredictionFile::carry(const WorldMap& map, bool rigid, double stretched) {
  map.carry(data.joints, rigid, stretched);
  map.carry(data.vertices, rigid, stretched);
  map.turn(data.rotations);
  move_ = [before = move_, map, rigid, stretched](std::span<double> points) {
    if (before) before(points);
    map.carry(points, rigid, stretched);
  };
}

void check_same_frames(const PredictionFile& file, const PredictionFile& truth) {
  if (file.data.frames == truth.data.frames) return;
  throw InputError(file.path,
                   "has " + counted(file.data.frames, "frame") + ", but " + truth.path + " has " +
                       std::to_string(truth.data.frames) +
                       (file.remarks.empty() ? "" : " (" + file.remarks.front() + ")"),
                   "give files of the same frames");
}

std::vector<SequenceView> cut(const std::vector<int64_t>& offset, const Track& joints,
                              const Surfaces& vertices, std::span<const double> rotations,
                              const PredictionFile& truth) {
  std::vector<SequenceView> views;
  const Surfaces true_vertices = truth.vertices();
  for (size_t s = 0; s + 1 < offset.size(); ++s) {
    const int64_t begin = offset[s], end = offset[s + 1];
    const auto turns = [&](std::span<const double> all) {
      const auto row = static_cast<size_t>(4 * kJoints), first = static_cast<size_t>(begin);
      return all.empty() ? all : all.subspan(row * first, row * static_cast<size_t>(end - begin));
    };
    views.push_back({joints.slice(begin, end), truth.joints().slice(begin, end),
                     vertices.slice(begin, end), true_vertices.slice(begin, end), end - begin,
                     turns(rotations), turns(truth.data.rotations)});
  }
  return views;
}

References references(const PredictionFile& source, const PredictionFile& rest,
                      const PredictionFile& truth, const std::vector<int64_t>& offset,
                      std::span<const metrics::Metric> metrics) {
  check_same_frames(source, truth);
  for (const PredictionFile* file : {&source, &rest})
    if (!file->joints().present())
      throw InputError(file->path + ":/joints", "is missing",
                       "store the joints as [frames, 22, 3]");
  const int64_t sequences = std::ssize(offset) - 1, rows = rest.data.frames;
  if (rows != 1 && rows != sequences && rows != truth.data.frames)
    throw InputError(rest.path + ":/joints",
                     "has " + counted(rows, "skeleton") + " for " + counted(sequences, "sequence"),
                     "give the rest joints of one body, or one row for every sequence");
  Made made;
  const auto carried = std::make_shared<CarriedRest>(rest.vertices(), offset);
  for (int64_t s = 0; s < sequences; ++s) {
    const auto i = static_cast<size_t>(s);
    const int64_t row = rows == 1 ? 0 : rows == source.data.frames ? offset[i] : s;
    const Joints target = joints_of(rest.joints().slice(row, row + 1))[0];
    make(joints_of(source.joints().slice(offset[i], offset[i + 1])), target, &made);
    carried->add_sequence(row, target[0]);
  }
  carried->set_path(made.rest_pose);
  const auto score = [&](const Track& joints, const Surfaces& vertices,
                         std::span<const double> rotations = {}) {
    return metrics::evaluate(cut(offset, joints, vertices, rotations, truth), metrics);
  };
  const int64_t frames = source.data.frames;
  Surfaces surfaces;
  if (rest.vertices().present() && truth.vertices().present() &&
      truth.data.vertex_count == rest.data.vertex_count)
    surfaces = {frames, rest.data.vertex_count,
                [carried](int64_t first, int64_t count, std::vector<double>& out) {
                  carried->read(first, count, out);
                }};
  return {{"rest_pose", score({made.rest_pose.data(), frames, kJoints}, surfaces)},
          {"source_unchanged", score(source.joints(), {})},
          {"closed_form", score({made.closed_form.data(), frames, kJoints}, {}, made.rotations)}};
}

std::vector<metrics::Metric> metrics_of_every(int64_t step,
                                              std::span<const metrics::Metric> metrics) {
  std::vector<metrics::Metric> out(metrics.begin(), metrics.end());
  for (metrics::Metric& m : out)
    if (step > 1 && std::string(m.name).find("acc") != std::string::npos) m.of_joints = nullptr;
  return out;
}

std::vector<Joints> joints_of(const Track& track) {
  std::vector<Joints> frames(static_cast<size_t>(track.frames));
  for (size_t f = 0; f < frames.size(); ++f)
    for (int j = 0; j < kJoints; ++j) frames[f][j] = track.at(static_cast<int64_t>(f), j);
  return frames;
}

}  // namespace restage
