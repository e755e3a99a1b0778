#include "experiments/predictions.h"

#include <algorithm>

#include "autograd/base/error.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

using metrics::SequenceView;
using metrics::Track;

std::string counted(int64_t n, const std::string& what) { return std::to_string(n) + " " + what; }

void append(const std::vector<Joints>& frames, std::vector<double>* values) {
  for (const Joints& joints : frames)
    for (const Vec3& p : joints) values->insert(values->end(), {p.x(), p.y(), p.z()});
}

/// Frames of the references, as if they had been predicted.
struct Made {
  std::vector<double> rest_pose, closed_form, rest_vertices;
};

void make(const std::vector<Joints>& source, const PredictionFile& rest, int64_t row, Made* out) {
  const Joints target = joints_of(rest.joints().slice(row, row + 1))[0];
  const std::vector<Joints> carried = rest_pose_joints(source, target);
  append(carried, &out->rest_pose);
  append(closed_form_joints(source, target), &out->closed_form);
  if (!rest.vertices().present()) return;
  for (const Joints& joints : carried)
    for (int64_t v = 0; v < rest.data.vertex_count; ++v) {
      const Vec3 moved = rest.vertices().at(row, v) + joints[0] - target[0];
      out->rest_vertices.insert(out->rest_vertices.end(), {moved.x(), moved.y(), moved.z()});
    }
}

}  // namespace

Track PredictionFile::joints() const {
  return data.joints.empty() ? Track{} : Track{data.joints.data(), data.frames, kJoints};
}

Track PredictionFile::vertices() const {
  return data.vertices.empty() ? Track{}
                               : Track{data.vertices.data(), data.frames, data.vertex_count};
}

void PredictionFile::thin(int64_t step) {
  std::vector<int64_t> kept, offset{0};
  for (int64_t s = 0; s < sequences(); ++s) {
    const auto i = static_cast<size_t>(s);
    for (int64_t f = data.sequence_offset[i]; f < data.sequence_offset[i + 1]; f += step)
      kept.push_back(f);
    offset.push_back(std::ssize(kept));
  }
  for (std::vector<double>* values : {&data.joints, &data.vertices}) {
    const auto row = static_cast<std::ptrdiff_t>(values->size()) / data.frames;
    for (size_t k = 0; k < kept.size(); ++k)
      std::copy_n(values->begin() + kept[k] * row, row,
                  values->begin() + static_cast<std::ptrdiff_t>(k) * row);
    values->resize(kept.size() * static_cast<size_t>(row));
  }
  data.frames = std::ssize(kept);
  data.sequence_offset = std::move(offset);
}

void check_same_frames(const PredictionFile& file, const PredictionFile& truth) {
  if (file.data.frames == truth.data.frames) return;
  throw InputError(file.path,
                   "has " + counted(file.data.frames, "frames, but ") + truth.path + " has " +
                       std::to_string(truth.data.frames),
                   "give files of the same frames");
}

std::vector<SequenceView> cut(const std::vector<int64_t>& offset, const Track& joints,
                              const Track& vertices, const PredictionFile& truth) {
  std::vector<SequenceView> views;
  for (size_t s = 0; s + 1 < offset.size(); ++s) {
    const int64_t begin = offset[s], end = offset[s + 1];
    views.push_back({joints.slice(begin, end), truth.joints().slice(begin, end),
                     vertices.slice(begin, end), truth.vertices().slice(begin, end), end - begin});
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
                     "has " + counted(rows, "skeletons for ") + counted(sequences, "sequences"),
                     "give the rest joints of one body, or one row for every sequence");
  Made made;
  for (int64_t s = 0; s < sequences; ++s) {
    const auto i = static_cast<size_t>(s);
    const int64_t row = rows == 1 ? 0 : rows == source.data.frames ? offset[i] : s;
    make(joints_of(source.joints().slice(offset[i], offset[i + 1])), rest, row, &made);
  }
  const auto score = [&](const Track& joints, const Track& vertices) {
    return metrics::evaluate(cut(offset, joints, vertices, truth), metrics);
  };
  const int64_t frames = source.data.frames;
  const bool surfaces = !made.rest_vertices.empty() && truth.vertices().present() &&
                        truth.data.vertex_count == rest.data.vertex_count;
  const Track carried =
      surfaces ? Track{made.rest_vertices.data(), frames, rest.data.vertex_count} : Track{};
  return {{"rest_pose", score({made.rest_pose.data(), frames, kJoints}, carried)},
          {"source_unchanged", score(source.joints(), {})},
          {"closed_form", score({made.closed_form.data(), frames, kJoints}, {})}};
}

std::vector<metrics::Metric> metrics_of_every(int64_t step,
                                              std::span<const metrics::Metric> metrics) {
  std::vector<metrics::Metric> out(metrics.begin(), metrics.end());
  for (metrics::Metric& m : out)
    if (step > 1 && std::string(m.name).find("acc") != std::string::npos)
      m.compute = [](const SequenceView&) { return metrics::Value(); };
  return out;
}

std::vector<Joints> joints_of(const Track& track) {
  std::vector<Joints> frames(static_cast<size_t>(track.frames));
  for (size_t f = 0; f < frames.size(); ++f)
    for (int j = 0; j < kJoints; ++j) frames[f][j] = track.at(static_cast<int64_t>(f), j);
  return frames;
}

}  // namespace restage
