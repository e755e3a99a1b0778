#include "datasets/importers/motions/cmu.h"

#include <cmath>
#include <map>

#include "autograd/base/parallel.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/motions/source_motion.h"
#include "datasets/readers/errors.h"
#include "datasets/schema.h"

namespace restage {
namespace {

struct CmuSkeleton {
  SourceSkeleton skeleton;
  JointMap map;
  Joints rest;
};

constexpr const char* kAgain = "fetch the file again";

/// InputError for what is no length in metres.
void check_metres(const std::string& where, double x) {
  if (!(std::abs(x) <= 1e6))
    throw InputError(where, "holds a number that is no length in metres", kAgain);
}

std::vector<Vec3> read_points(const h5::File& file, const std::string& name, int64_t rows) {
  const std::vector<double> values = file.read<double>(name, {rows, 3});
  std::vector<Vec3> out(values.size() / 3);
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = Vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    for (const double x : out[i]) check_metres(file.path() + ":" + name, x);
  }
  return out;
}

CmuSkeleton read_skeleton(const h5::File& file, const std::string& name) {
  const std::string group = "/skeletons/" + name;
  CmuSkeleton out;
  SourceSkeleton& s = out.skeleton;
  s.names = file.dataset(group + "/names").read_text();
  const int64_t n = s.names.size();
  s.parents = file.read<int32_t>(group + "/parents", {n});
  for (size_t j = 0; j < s.parents.size(); ++j)
    if (s.parents[j] >= static_cast<int>(j) || s.parents[j] < -1 || (j > 0) != (s.parents[j] >= 0))
      throw InputError(file.path() + ":" + group, "a joint comes before its parent",
                       "fetch it again");
  s.offsets = read_points(file, group + "/offsets", n);
  s.ends = read_points(file, group + "/end_offsets", n);
  s.has_end.assign(s.names.size(), 1);
  out.map = name_joints(s, file.path() + ":" + group).map;
  out.rest = rest_joints(s, out.map);
  return out;
}

std::string need_text(const h5::File& file, const std::string& group, const char* name) {
  const auto value = file.text(group, name);
  if (!value)
    throw InputError(file.path() + ":" + group, cat("has no attribute '", name, "'"),
                     "fetch the file again");
  return *value;
}

struct RawClip {
  std::string name;
  const CmuSkeleton* skeleton = nullptr;
  std::vector<int16_t> rotations;
  std::vector<double> root;
  double floor_y = 0;
  Motion labels;  ///< id, subject, split, action
};

RawClip read_clip(const h5::File& file, const std::string& name,
                  std::map<std::string, CmuSkeleton>& skeletons) {
  const std::string group = "/clips/" + name;
  RawClip out;
  out.name = name;
  const std::string skeleton = need_text(file, group, "skeleton");
  if (skeletons.count(skeleton) == 0) skeletons[skeleton] = read_skeleton(file, skeleton);
  out.skeleton = &skeletons[skeleton];
  const int64_t joints = out.skeleton->skeleton.size();
  const h5::Dataset rotations = file.dataset(group + "/local_rotations", {-1, joints, 4});
  out.rotations = rotations.read<int16_t>();
  out.root = file.read<double>(group + "/root_translation", {rotations.rows(), 3});
  if (out.root.empty()) throw InputError(file.path() + ":" + group, "has no frames", kAgain);
  const auto floor_y = file.number(group, "floor_y");
  if (!floor_y) throw InputError(file.path() + ":" + group, "has no attribute 'floor_y'", kAgain);
  out.floor_y = *floor_y;
  for (const double x : out.root) check_metres(file.path() + ":" + group + "/root_translation", x);
  check_metres(file.path() + ":" + group + "/floor_y", out.floor_y);
  out.labels.id = name;
  out.labels.subject = need_text(file, group, "subject");
  out.labels.split = need_text(file, group, "split");
  if (!is_split(out.labels.split))
    throw InputError(file.path() + ":" + group,
                     "has the split '" + out.labels.split.substr(0, 40) + "'",
                     "write train, validation or test into its attribute 'split'");
  out.labels.action = need_text(file, group, "action");
  return out;
}

Quat unpack(const int16_t* wxyz, const std::string& where) {
  const Quat q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  if (!(q.norm() > 1.0))
    throw InputError(where, "holds a rotation of length zero", "fetch it again");
  return q.normalized();
}

CmuClip convert(const RawClip& raw, bool with_joints, const std::string& where) {
  const SourceSkeleton& skeleton = raw.skeleton->skeleton;
  const size_t n = skeleton.size(), frames = raw.root.size() / 3;
  SourceMotion one;  // a frame at a time: these clips are at 30 fps already
  one.skeleton = skeleton;
  one.moving = {0};
  one.local.assign(1, std::vector<Quat>(n));
  one.position.assign(1, std::vector<Vec3>(1));
  Poses poses(frames);
  CmuClip out;
  for (size_t f = 0; f < frames; ++f) {
    for (size_t j = 0; j < n; ++j) one.local[0][j] = unpack(&raw.rotations[(f * n + j) * 4], where);
    one.position[0][0] = Vec3(raw.root[3 * f], raw.root[3 * f + 1], raw.root[3 * f + 2]);
    poses[f] = source_pose(one, raw.skeleton->map, 0);
    if (with_joints) out.joints.push_back(poses[f].joints);
  }
  out.motion = to_motion(poses, raw.skeleton->rest, raw.floor_y, raw.labels);
  return out;
}

std::vector<std::string> clip_names(const h5::File& file) {
  std::vector<std::string> out = file.children("/clips");
  if (out.empty())
    throw InputError(file.path() + ":/clips", "holds no clips", "give the CMU clips30.h5");
  return out;
}

std::vector<CmuClip> read_clips(const h5::File& file, const std::vector<std::string>& names,
                                bool with_joints) {
  std::map<std::string, CmuSkeleton> skeletons;
  std::vector<RawClip> raw;
  for (const std::string& name : names) raw.push_back(read_clip(file, name, skeletons));
  std::vector<CmuClip> out(raw.size());
  parallel_for(raw.size(), 4, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k)
      out[k] = convert(raw[k], with_joints, file.path() + ":/clips/" + raw[k].name);
  });
  return out;
}

/// Whether `word` is a source, or what stands before or behind its slash.
bool is_part(const std::string& word, const std::string& source) {
  const size_t slash = source.find('/');
  return !word.empty() && (word == source || word == source.substr(0, slash) ||
                           (slash != std::string::npos && word == source.substr(slash + 1)));
}

std::vector<Motion> motions_of(std::vector<CmuClip> clips) {
  std::vector<Motion> out;
  for (CmuClip& clip : clips) out.push_back(std::move(clip.motion));
  return out;
}

}  // namespace

std::vector<CmuClip> read_cmu(const std::string& path, bool with_joints) {
  const h5::File file = h5::File::open(path);
  return read_clips(file, clip_names(file), with_joints);
}

std::vector<Motion> import_cmu(const std::string& path) { return motions_of(read_cmu(path)); }

std::vector<Motion> import_cmu(const std::string& path, const std::vector<std::string>& without,
                               std::vector<size_t>* left_out) {
  const h5::File file = h5::File::open(path);
  const std::vector<std::string> names = clip_names(file);
  std::vector<size_t> counts(without.size());
  std::vector<std::string> kept;
  for (const std::string& name : names) {
    const std::string source = file.text("/clips/" + name, "source").value_or("");
    bool stays = true;
    for (size_t i = 0; i < without.size(); ++i) {
      if (name != without[i] && !is_part(without[i], source)) continue;
      ++counts[i];
      stays = false;
    }
    if (stays) kept.push_back(name);
  }
  for (size_t i = 0; i < without.size(); ++i)
    if (counts[i] == 0)
      throw InputError(path,
                       "no clip has the name or the source '" + without[i].substr(0, 40) + "'",
                       "name a clip, or one part of its attribute 'source', such as the user in "
                       "'user/repository'");
  if (kept.empty()) throw InputError(path, "all clips are left out", "leave out fewer");
  if (left_out != nullptr) *left_out = counts;
  return motions_of(read_clips(file, kept, false));
}

bool is_packed_clips(const std::string& path) {
  const h5::File file = h5::File::open(path);
  return file.has("/clips") && file.has("/skeletons");
}

}  // namespace restage
