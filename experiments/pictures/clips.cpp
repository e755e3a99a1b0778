#include "experiments/pictures/clips.h"

#include <utility>

#include "autograd/base/error.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/schema.h"
#include "nn/geometry/skeleton.h"
#include "nn/metrics/metrics.h"

namespace restage {
namespace {

Clip skeletons(const std::string& path, const std::string& label,
               const std::optional<int64_t>& sequence) {
  Clip clip;
  clip.label = label;
  clip.fps = inspect(path).fps;
  for (const Joints& joints : read_joints(path, sequence))
    clip.frames.push_back(stick_figure(joints));
  clip.confidence = read_confidence(path, sequence.value_or(0));
  return clip;
}

bool has_joints_only(const std::string& path) {
  if (!is_hdf5(path)) return false;
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
  Remarks remarks;
  Clip out = read_clip({.path = path, .sequence = sequence}, label, kMaxMemory, remarks);
  if (!remarks.empty()) throw InputError("", remarks[0], "restage doctor --fix mends it");
  return out;
}

Clip read_clip(const SourceRecord& how, const std::string& label, uint64_t max_memory,
               Remarks& remarks) {
  if (has_joints_only(how.path)) return skeletons(how.path, label, how.sequence);
  Source source(how, max_memory);
  Clip clip;
  clip.label = label;
  clip.fps = source.fps();
  bool surface = true;
  std::vector<InputError> faults;
  size_t left_out = 0;
  while (auto cloud = source.next()) {
    if (cloud->fault) {
      faults.push_back(*cloud->fault);
      if (!clip.frames.empty()) clip.frames.push_back(clip.frames.back());
      continue;
    }
    Frame& frame = cloud->frame;
    left_out += frame.left_out;
    if (clip.frames.empty()) {
      clip.faces = frame.faces;
      clip.frames.assign(faults.size(), frame.points);  // of those before it
    }
    surface = surface && frame.faces == clip.faces &&
              (clip.frames.empty() || frame.points.size() == clip.frames[0].size());
    clip.frames.push_back(std::move(frame.points));
  }
  if (clip.frames.empty()) throw faults.at(0);
  if (!faults.empty())
    remarks.push_back(
        std::to_string(faults.size()) + " of the frames of " + how.path +
        " cannot be drawn; the nearest ones are drawn in their place: " + faults[0].what());
  if (left_out > 0)
    remarks.push_back(std::to_string(left_out) + " points of " + how.path +
                      " are NaN or infinite and are left out");
  if (!surface) clip.faces.clear();
  if (is_hdf5(how.path)) clip.confidence = read_confidence(how.path, how.sequence.value_or(0));
  return clip;
}

bool has_joints(const std::string& path) {
  return is_hdf5(path) && inspect(path).counts.contains("joints");
}

std::vector<Joints> read_joints(const std::string& path, const std::optional<int64_t>& chosen) {
  if (!is_hdf5(path))
    throw InputError(path, "does not say where its joints are", "give HDF5 with /joints");
  const PredictionReader data(path);
  check_one_sequence(path, std::ssize(data.sequence_offset()) - 1, chosen);
  const int64_t sequence = chosen.value_or(0);
  const auto s = static_cast<size_t>(sequence);
  if (sequence < 0 || s + 1 >= data.sequence_offset().size())
    throw InputError(path, "has no sequence number " + std::to_string(sequence),
                     "count sequences from 0");
  if (!data.has_joints())
    throw InputError(path + ":/joints", "is missing", "leave the close-up out");
  std::vector<Joints> out;
  std::vector<double> row;
  for (int64_t f = data.sequence_offset()[s]; f < data.sequence_offset()[s + 1]; ++f) {
    data.read_joints(f, 1, row);
    Joints& joints = out.emplace_back();
    for (size_t j = 0; j < kJoints; ++j) joints[j] = Eigen::Map<const Vec3>(&row[3 * j]);
  }
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
