#include "experiments/clips.h"

#include <utility>

#include "autograd/base/error.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/schema.h"
#include "nn/geometry/skeleton.h"
#include "nn/metrics/metrics.h"

namespace restage {
namespace {

bool ends_with_hdf5(const std::string& path) {
  return path.ends_with(".h5") || path.ends_with(".hdf5");
}

/// Of one sequence.
std::vector<Joints> read_joints(const std::string& path, int64_t sequence) {
  const PredictionReader data(path);
  const auto s = static_cast<size_t>(sequence);
  if (sequence < 0 || s + 1 >= data.sequence_offset().size())
    throw InputError(path, "has no sequence number " + std::to_string(sequence),
                     "count sequences from 0");
  if (!data.has_joints()) throw InputError(path + ":/joints", "is missing", "leave --focus out");
  std::vector<Joints> out;
  std::vector<double> row;
  for (int64_t f = data.sequence_offset()[s]; f < data.sequence_offset()[s + 1]; ++f) {
    data.read_joints(f, 1, row);
    Joints& joints = out.emplace_back();
    for (size_t j = 0; j < kJoints; ++j) joints[j] = Eigen::Map<const Vec3>(&row[3 * j]);
  }
  return out;
}

Clip skeletons(const std::string& path, const std::string& label, int64_t sequence) {
  Clip clip;
  clip.label = label;
  clip.confidence = read_confidence(path, sequence);
  for (const Joints& joints : read_joints(path, sequence))
    clip.frames.push_back(stick_figure(joints));
  return clip;
}

bool has_joints_only(const std::string& path) {
  if (!ends_with_hdf5(path)) return false;
  const Inspection found = inspect(path);
  return found.kind == "prediction" && found.counts.count("vertices") == 0;
}

std::vector<double> coordinates(const Points& frame) {
  std::vector<double> out;
  for (const Point& p : frame) out.insert(out.end(), p.begin(), p.end());
  return out;
}

}  // namespace

Clip read_clip(const std::string& path, const std::string& label, int64_t sequence) {
  if (has_joints_only(path)) return skeletons(path, label, sequence);
  const auto source = open_frames(path, {.clip = "", .sequence = sequence});
  Clip clip;
  clip.label = label;
  bool surface = true;
  while (auto frame = source->next()) {
    if (clip.frames.empty()) clip.faces = frame->faces;
    surface = surface && frame->faces == clip.faces &&
              (clip.frames.empty() || frame->points.size() == clip.frames[0].size());
    clip.frames.push_back(std::move(frame->points));
  }
  if (!surface) clip.faces.clear();
  if (ends_with_hdf5(path)) clip.confidence = read_confidence(path, sequence);
  return clip;
}

std::vector<Point> read_focus(const std::string& path, size_t joint, int64_t sequence) {
  if (!ends_with_hdf5(path))
    throw InputError(path, "does not say where its joints are", "give HDF5 with /joints");
  std::vector<Point> out;
  for (const Joints& joints : read_joints(path, sequence))
    out.push_back(joints[joint].cast<float>());
  return out;
}

bool add_errors(const Clip& truth, Clip* result) {
  const size_t frames = result->frames.size(), vertices = result->frames[0].size();
  if (result->faces.empty() || truth.faces.empty() || truth.frames.size() != frames ||
      truth.frames[0].size() != vertices)
    return false;
  for (size_t f = 0; f < frames; ++f) {
    const std::vector<double> a = coordinates(std::as_const(result->frames)[f]),
                              b = coordinates(truth.frames[f]);
    const auto n = static_cast<int64_t>(vertices);
    const auto off =
        metrics::distances({a.data(), 1, n}, {b.data(), 1, n}, {metrics::Alignment::Mode::frame});
    result->errors.emplace_back(off.begin(), off.end());
  }
  return true;
}

}  // namespace restage
