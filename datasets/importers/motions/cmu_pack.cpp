#include "datasets/importers/motions/cmu_pack.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <sstream>
#include <string_view>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/motions/amc.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/sha256.h"
#include "datasets/readers/text/packed_text.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostList = uint64_t{4} << 20;
constexpr double kDazMetres = 0.01;  // a unit of the BVH conversion
constexpr double kInch = 0.0254;

/// What the file holds of one clip, in its types.
struct PackedClip {
  std::vector<std::string> names;
  std::vector<int32_t> parents;
  std::vector<float> offsets, ends;  // metres
  std::vector<int16_t> rotations;    // w, x, y, z in 1/32767, for each frame and joint
  std::vector<float> root;           // metres
};

struct PackedRecording {
  SourceMotion motion;
  double metres = 0;  // a unit of the file
};

PackedRecording read_recording(const std::string& file, const std::string& skeleton) {
  const std::string text = read_packed_text(file);
  if (skeleton.empty()) return {bvh_motion(parse_bvh(text, file), {0}), kDazMetres};
  const AsfFile asf = parse_asf(read_packed_text(skeleton), skeleton);
  if (!(asf.length_unit > 0))
    throw InputError(skeleton, "does not say its unit of length", "fetch it again");
  return {amc_motion(asf, parse_amc(text, file, asf)), kInch / asf.length_unit};
}

void add_scaled(const Vec3& point, double metres, std::vector<float>& out) {
  for (int k = 0; k < 3; ++k) out.push_back(static_cast<float>(point[k] * metres));
}

/// Of the two quaternions of a rotation: at first the one whose largest part is positive, then the
/// one nearer to that of the frame before.
Quat chosen(const Quat& q, const Quat* before) {
  Eigen::Index largest = 0;
  q.coeffs().cwiseAbs().maxCoeff(&largest);
  const double sign = before ? before->dot(q) : q.coeffs()[largest];
  return sign < 0 ? Quat(-q.coeffs()) : q;
}

PackedClip pack_clip(const PackedRecording& recording, const CmuOriginal& entry,
                     const std::string& where) {
  const SourceMotion& motion = recording.motion;
  const size_t joints = motion.skeleton.size();
  if (entry.first + entry.frames > motion.local.size())
    throw InputError(where,
                     cat("has ", motion.local.size(), " frames, clip ", entry.clip,
                         " ends with frame ", entry.first + entry.frames),
                     "fetch it again");
  PackedClip out;
  out.names = motion.skeleton.names;
  for (size_t j = 0; j < joints; ++j) {
    out.parents.push_back(motion.skeleton.parents[j]);
    add_scaled(motion.skeleton.offsets[j], recording.metres, out.offsets);
    add_scaled(motion.skeleton.ends[j], recording.metres, out.ends);
  }
  std::vector<Quat> before;
  for (size_t f = 0; f < entry.frames; ++f) {
    std::vector<Quat> now = motion.local[entry.first + f];
    for (size_t j = 0; j < joints; ++j) now[j] = chosen(now[j], f > 0 ? &before[j] : nullptr);
    if (f % static_cast<size_t>(entry.step) == 0) {
      for (const Quat& q : now)
        for (const double part : {q.w(), q.x(), q.y(), q.z()})
          out.rotations.push_back(static_cast<int16_t>(std::nearbyint(part * 32767)));
      add_scaled(motion.position[entry.first + f][0], recording.metres, out.root);
    }
    before = std::move(now);
  }
  return out;
}

/// The bytes of `width` values that belong to joint j.
template <class T>
std::string_view piece(const std::vector<T>& values, size_t j, size_t width) {
  return {reinterpret_cast<const char*>(values.data() + j * width), width * sizeof(T)};
}

std::vector<size_t> joints_by_name(const PackedClip& clip) {
  std::vector<size_t> out(clip.names.size());
  std::iota(out.begin(), out.end(), size_t{0});
  std::sort(out.begin(), out.end(),
            [&](size_t a, size_t b) { return clip.names[a] < clip.names[b]; });
  return out;
}

/// Over the joints by name, whatever order a program lists them in: a line of the name and its
/// parent's, offset, end. Numbers as they lie in the file, little endian.
Sha256 sum_of_skeleton(const PackedClip& clip) {
  Sha256 sum;
  for (const size_t j : joints_by_name(clip)) {
    const int32_t parent = clip.parents[j];
    sum.add(clip.names[j] + " " + (parent < 0 ? "" : clip.names[parent]) + "\n");
    sum.add(piece(clip.offsets, j, 3));
    sum.add(piece(clip.ends, j, 3));
  }
  return sum;
}

/// Over the skeleton and then, frame by frame, the root and the rotations of the joints by name.
std::string sum_of_clip(const PackedClip& clip) {
  Sha256 sum = sum_of_skeleton(clip);
  const std::vector<size_t> by_name = joints_by_name(clip);
  for (size_t f = 0; f < clip.root.size() / 3; ++f) {
    sum.add(piece(clip.root, f, 3));
    for (const size_t j : by_name) sum.add(piece(clip.rotations, f * by_name.size() + j, 4));
  }
  return sum.hex();
}

std::vector<std::string> named(const std::vector<std::string>& files, const std::string& name,
                               const std::string& folder) {
  std::vector<std::string> out;
  for (const std::string& path : files)
    if (is_path_of(path, name)) out.push_back(path);
  if (out.empty())
    throw InputError(folder, "holds no " + name, "fetch CMU's recordings again, or give them all");
  return out;
}

/// From whichever files of the right names give what is listed.
PackedClip find_clip(const CmuOriginal& entry, const std::vector<std::string>& files,
                     const std::string& folder) {
  std::vector<std::string> skeletons = {""};
  if (!entry.skeleton.empty()) skeletons = named(files, entry.skeleton, folder);
  std::string refusal, last;
  for (const std::string& file : named(files, entry.file, folder))
    for (const std::string& skeleton : skeletons) {
      last = file;
      try {
        PackedClip clip = pack_clip(read_recording(file, skeleton), entry, file);
        if (sum_of_clip(clip) == entry.sha256) return clip;
      } catch (const InputError& error) {  // another file may be meant
        refusal = error.what();
      }
    }
  throw InputError(last,
                   "does not give clip " + entry.clip + " as listed" +
                       (refusal.empty() ? "" : " (" + refusal + ")"),
                   "fetch it again");
}

/// One group for all clips of a skeleton, named after its file and its content. Returns the name.
std::string write_skeleton(h5::File& file, const CmuOriginal& entry, const PackedClip& clip) {
  const std::string kind =
      entry.skeleton.empty() ? "bvh" : "asf_" + fs::path(entry.skeleton).stem().string();
  const std::string name = kind + "_" + sum_of_skeleton(clip).hex().substr(0, 8);
  const std::string group = "/skeletons/" + name;
  if (file.has(group)) return name;
  const int64_t joints = clip.parents.size();
  file.write_text(group + "/names", clip.names);
  file.write<int32_t>(group + "/parents", {joints}, clip.parents);
  file.write<float>(group + "/offsets", {joints, 3}, clip.offsets);
  file.write<float>(group + "/end_offsets", {joints, 3}, clip.ends);
  return name;
}

void write_clip(h5::File& file, const CmuOriginal& entry, const PackedClip& clip) {
  const std::string skeleton = write_skeleton(file, entry, clip);
  const std::string group = "/clips/" + entry.clip;
  const auto joints = static_cast<int64_t>(clip.parents.size()),
             frames = static_cast<int64_t>(clip.root.size()) / 3;
  file.write<int16_t>(group + "/local_rotations", {frames, joints, 4}, clip.rotations);
  file.write<float>(group + "/root_translation", {frames, 3}, clip.root);
  file.set_text(group, "skeleton", skeleton);
  file.set_text(group, "subject", entry.subject);
  file.set_text(group, "split", entry.split);
  file.set_text(group, "action", entry.action);
  file.set_number(group, "floor_y", entry.floor_y);
}

PackedClip read_packed(const h5::File& file, const std::string& name) {
  const std::string clip = "/clips/" + name,
                    skeleton = "/skeletons/" + file.text(clip, "skeleton").value_or("");
  PackedClip out;
  out.names = file.dataset(skeleton + "/names").read_text();
  const int64_t joints = out.names.size();
  out.parents = file.read<int32_t>(skeleton + "/parents", {joints});
  for (const int32_t parent : out.parents)
    if (parent >= joints) throw InputError(skeleton, "has a parent that is not there", "mend it");
  out.offsets = file.read<float>(skeleton + "/offsets", {joints, 3});
  out.ends = file.read<float>(skeleton + "/end_offsets", {joints, 3});
  out.rotations = file.read<int16_t>(clip + "/local_rotations", {-1, joints, 4});
  const auto frames = joints > 0 ? static_cast<int64_t>(out.rotations.size()) / joints / 4 : 0;
  out.root = file.read<float>(clip + "/root_translation", {frames, 3});
  return out;
}

CmuOriginal clip_of(std::istringstream& words, const std::string& where) {
  CmuOriginal out;
  std::string rest;
  const bool whole = static_cast<bool>(words >> out.sha256 >> out.clip >> out.file >>
                                       out.skeleton >> out.step >> out.first >> out.frames >>
                                       out.floor_y >> out.subject >> out.split >> out.action);
  const bool sound = whole && !(words >> rest) && out.sha256.size() == 64 &&
                     out.clip.find('/') == std::string::npos && out.step >= 1 && out.step <= 100 &&
                     out.first <= 10'000'000 && out.frames >= 1 && out.frames <= 10'000'000 &&
                     std::isfinite(out.floor_y);
  if (!sound)
    throw InputError(where,
                     "is no line 'SHA256 CLIP FILE SKELETON STEP FIRST FRAMES FLOOR_Y "
                     "SUBJECT SPLIT ACTION'",
                     "mend the list");
  if (out.skeleton == "-") out.skeleton.clear();
  return out;
}

}  // namespace

bool is_path_of(const std::string& path, const std::string& file) {
  for (const std::string& name : {file, file + ".xz"})
    if (path == name || path.ends_with("/" + name)) return true;
  return false;
}

CmuOriginals read_cmu_originals(const std::string& list) {
  CmuOriginals out;
  std::istringstream lines(read_file(list, kMostList));
  std::string line;
  for (size_t number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const std::string where = cat(list, ":", number);
    std::istringstream words(line);
    if (line[0] != '@') {
      out.clips.push_back(clip_of(words, where));
      const CmuOriginal& last = out.clips.back();
      if (out.clips.size() > 1 && !(out.clips[out.clips.size() - 2].clip < last.clip))
        throw InputError(where, "has a clip that is not behind the one above by name",
                         "sort the list, each clip once");
      continue;
    }
    std::string name, rest;
    CmuRepository repository;
    if (!(words >> name >> repository.tree >> repository.files) || words >> rest ||
        name.find('/') != std::string::npos || !out.repositories.emplace(name, repository).second)
      throw InputError(where, "is no line '@NAME TREE FILES' of a new name", "mend the list");
  }
  if (out.clips.empty()) throw InputError(list, "lists no clips", "give a list of clips");
  return out;
}

void pack_cmu(const CmuOriginals& originals, const std::string& folder, const std::string& out) {
  const std::vector<std::string> files = files_below(folder);
  h5::File file = h5::File::create(out);
  for (const CmuOriginal& entry : originals.clips) {
    throw_if_stopped();
    write_clip(file, entry, find_clip(entry, files, folder));
  }
  file.commit();
}

bool is_packed_cmu(const CmuOriginals& originals, const std::string& path) {
  try {
    const h5::File file = h5::File::open(path);
    return std::all_of(originals.clips.begin(), originals.clips.end(), [&](const auto& entry) {
      return sum_of_clip(read_packed(file, entry.clip)) == entry.sha256;
    });
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace restage
