#include "tests/fuzz/targets.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <functional>
#include <span>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/importers/joints/solve.h"
#include "datasets/importers/motions/amass.h"
#include "datasets/importers/motions/amc.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/motions/estimated.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/clouds/table_frames.h"
#include "datasets/readers/frames/array_frames.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/readers/gltf/gltf_look.h"
#include "datasets/readers/skeletons/asf.h"
#include "datasets/schema.h"
#include "experiments/cli/training/benchmark_config.h"
#include "infer/live/frame_parser.h"
#include "infer/render/texture.h"
#include "nn/config/config.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"
#include "tests/datasets/smpl_support.h"
#include "tests/fuzz/after_reading.h"
#include "tests/support/files.h"
#include "tests/support/toy_asf.h"
#include "train/training/train_config.h"

namespace restage::fuzz {
namespace {

const test::TempDir& folder() {
  static const test::TempDir dir;  // where TMPDIR says; run_fuzz.py chooses a place in memory
  return dir;
}

}  // namespace

std::string file_of(const std::string& bytes, const std::string& name) {
  const std::string path = folder() / name;
  std::filesystem::remove(path);  // much faster than cutting the old one to nothing
  test::write_bytes(path, bytes);
  return path;
}

namespace {

/// Does all of them, whatever is refused; then the first refusal counts.
void do_all(const std::vector<std::function<void()>>& actions) {
  std::exception_ptr refusal;
  for (const auto& action : actions) {
    try {
      action();
    } catch (const InputError&) {
      if (!refusal) refusal = std::current_exception();
    }
  }
  if (refusal) std::rethrow_exception(refusal);
}

void play(const std::string& path) {
  const std::unique_ptr<FrameSource> frames = open_frames(path);
  while (frames->next()) {
  }
}

// ---- meshes and characters ---------------------------------------------------------------------

void read_ply(const std::string& bytes) {
  size_t faint = 0;
  parse_mesh(bytes, "x.ply", Vec3::Zero(), NonFinite::refuse, &faint);
}
void read_obj(const std::string& bytes) { parse_mesh(bytes, "x.obj"); }
void read_pcd(const std::string& bytes) {
  parse_mesh(bytes, "x.pcd", Vec3::Zero(), NonFinite::mark);
}
/// Names of files, one a line.
void read_names_of_frames(const std::string& bytes) {
  std::vector<std::string> names;
  std::istringstream lines(bytes);
  for (std::string line; std::getline(lines, line) && names.size() < 200;)
    if (!line.empty() && line.size() < 256 && line.find('\0') == std::string::npos)
      names.push_back(line);
  if (names.empty()) return;
  const FrameList list = order_frames(names, "folder");
  if (list.files.empty() || (!list.numbers.empty() && list.numbers.size() != list.files.size()))
    throw std::logic_error("frames are lost");
}

void read_raw(const std::string& bytes) {
  raw_columns(bytes, bytes.size());
  parse_mesh(bytes, "x.bin", Vec3::Zero(), NonFinite::mark);
}

/// A table of points; and its lines as names of files.
void read_table(const std::string& bytes) {
  starts_as_table(bytes);
  names_frames(bytes);
  do_all({[&] { parse_mesh(bytes, "x.csv", Vec3::Zero(), NonFinite::mark); },
          [&] {
            const auto frames = parse_table_frames(bytes, "x.csv");
            if (frames && frames->offset.back() != std::ssize(frames->points))
              throw std::logic_error("points are lost");
          },
          [&] { read_names_of_frames(bytes); }});
}

/// Joints, in the form that the bytes begin as; a short recording is solved, too.
void read_joints(const std::string& bytes) {
  const bool json = bytes.starts_with("{") || bytes.starts_with("[");
  const char* name = json                                ? "x.json"
                     : bytes.starts_with("PathFileType") ? "x.trc"
                     : bytes.starts_with("\x93NUMPY")    ? "x.npy"
                                                         : "x.csv";
  const std::string path = file_of(bytes, name);
  const auto joints = find_joint_recording(path, {});
  if (!joints || joints->frames.size() > 20) return;
  ImportReport report;
  report.file = path;
  solve_joints(*joints, {}, report);
}

void read_scene(const std::string& bytes) {
  const Gltf file = parse_gltf(bytes, folder() / "x.glb");
  gltf_mesh(file, gltf_rest(file));
  for (const GltfClip& clip : file.clips) {
    clip_frames(file, clip);
    gltf_pose(file, clip, 0.5 * (clip.begin + clip.end));
  }
  const GltfLook look = parse_gltf_look(bytes, folder() / "x.glb");
  std::vector<std::string> remarks;
  decode_pictures(look.look, remarks);
  gltf_look_mesh(look, gltf_rest(look.file), nullptr, 0);
  for (const GltfClip& clip : look.file.clips) {
    const double middle = 0.5 * (clip.begin + clip.end);
    gltf_look_mesh(look, gltf_pose(look.file, clip, middle), &clip, middle);
  }
}

void read_rigged(const std::string& bytes) {
  const std::string path = file_of(bytes, "x.glb");
  do_all({[&] { read_character(path); }, [&] { read_target(path); }});
}

// ---- recordings --------------------------------------------------------------------------------

void finite(const MotionClip& clip) {
  for (const Joints& joints : clip.joints)
    for (const Vec3& x : joints)
      if (!x.allFinite()) throw std::logic_error("a joint is not finite");
}

void read_bvh_text(const std::string& bytes) { finite(convert_bvh(bytes, "x.bvh")); }

void read_asf(const std::string& bytes) {
  const AsfFile asf = parse_asf(bytes, "x.asf");
  asf_skeleton(asf);
  size_t values = 0;
  for (const AsfBone& bone : asf.bones) values += bone.freedoms.size();
  Vec3 position;
  asf_pose(asf, std::vector<double>(values, 1.0), asf.radians, position);
  static const std::string recording = asf_test::amc_text(3);
  finite(convert_amc(recording, "x.amc", bytes, "x.asf"));
}

void read_amc_text(const std::string& bytes) {
  static const std::string skeleton = asf_test::asf_text();
  finite(convert_amc(bytes, "x.amc", skeleton, "x.asf"));
}

void read_packed(const std::string& bytes) { read_bvh(file_of(bytes, "x.bvh.xz")); }

// ---- arrays ------------------------------------------------------------------------------------

void use_array(const NpyArray& array) {
  if (array.is_text())
    for (int64_t i = 0; i < std::min<int64_t>(array.size(), 100); ++i) array.text(i);
  else
    array.finite();
}

void read_npy_file(const std::string& bytes) {
  const std::string path = file_of(bytes, "x.npy");
  use_array(read_npy(path));
  if (find_cloud(path)) play(path);
}

void read_npz_file(const std::string& bytes) {
  const std::string path = file_of(bytes, "x.npz");
  const Npz file(path);
  std::vector<std::function<void()>> actions;
  for (const std::string& name : file.names())
    actions.emplace_back([&file, name] { use_array(file.array(name)); });
  actions.emplace_back([&] {
    if (find_cloud(file)) play(path);
  });
  actions.emplace_back([&] { stated_fps(path); });
  do_all(actions);
}

/// framed(), undone as far as there are bytes.
std::vector<std::pair<std::string, std::string>> arrays_of(std::string_view bytes) {
  std::vector<std::pair<std::string, std::string>> out;
  for (size_t end = 0; (end = bytes.find('\0')) != std::string_view::npos && out.size() < 64;) {
    const std::string name(bytes.substr(0, end));
    bytes.remove_prefix(end + 1);
    uint32_t length = 0;
    std::memcpy(&length, bytes.data(), std::min<size_t>(4, bytes.size()));
    bytes.remove_prefix(std::min<size_t>(4, bytes.size()));
    const std::string_view array = bytes.substr(0, length);
    bytes.remove_prefix(array.size());
    const auto same = [&](const auto& other) { return other.first == name; };
    if (name.size() < 1000 && std::none_of(out.begin(), out.end(), same))
      out.emplace_back(name, array);
  }
  return out;
}

void read_motion(const std::string& bytes) {
  static BodyModels models(file_of(test::TinySmpl().file(), "model.npz"));
  ImportReport report;
  import_amass(Npz(file_of(test::npz(arrays_of(bytes), false), "x.npz")), models, {}, report);
}

/// A pickle in whatever wrapping, and the motions in it.
void read_pickles(const std::string& bytes) {
  constexpr uint64_t kMemory = uint64_t{16} << 20;
  static BodyModels models(file_of(test::TinySmpl().file(), "model.npz"));
  const ValueTree tree = read_nested_file(file_of(bytes, "x.pkl"), kMemory);
  tree.summary();
  std::vector<std::function<void()>> actions;
  const std::vector<EstimatedMotion> motions = estimated_motions(tree, kMemory);
  for (const EstimatedMotion& one : motions)
    actions.emplace_back([&one] {
      ImportReport report;
      import_amass(*one.arrays, models, {}, report, nullptr, one.hints);
    });
  do_all(actions);
}

void read_body_model(const std::string& bytes) {
  const Npz file(file_of(test::npz(arrays_of(bytes), false), "x.npz"));
  SmplModel model(file);
  model.read_blend_shapes(file);
  model.body({1, -2});
}

// ---- weights and configurations ----------------------------------------------------------------

/// A text that begins with a brace is a header whose length is still to be put before it; the data
/// follow a zero.
void read_weights(const std::string& bytes) {
  std::string file = bytes;
  if (bytes.starts_with('{')) {
    const size_t end = std::min(bytes.find('\0'), bytes.size());
    const uint64_t length = end;
    file = std::string(reinterpret_cast<const char*>(&length), 8) + bytes.substr(0, end) +
           bytes.substr(std::min(end + 1, bytes.size()));
  }
  const TensorFile tensors = parse_safetensors(file, "x.safetensors");
  if (tensors.metadata.count("restage") != 0) bundle_of(tensors, "x.safetensors");
}

template <class Config>
Config config_of(const std::string& bytes) {
  Config config;
  load_config(file_of(bytes, "x.yaml"), {}, config);
  const std::string resolved = resolved_yaml(config);
  Config again;
  read_config(parse_yaml(resolved, "resolved"), again);
  if (resolved_yaml(again) != resolved) throw std::logic_error("the resolved YAML says otherwise");
  return config;
}

void read_training(const std::string& bytes) { config_of<TrainConfig>(bytes); }
void read_recipe(const std::string& bytes) {
  check_recipe(config_of<BenchmarkRecipe>(bytes), "x.yaml");
}
void read_profile(const std::string& bytes) { parse_profile(bytes, "x.yaml"); }
void read_names(const std::string& bytes) {
  TensorFile file;
  file.tensors["a.weight"] = Tensor::zeros({1});
  file.tensors["b.0.bias"] = Tensor::zeros({1});
  NameMap::parse(bytes, "x.yaml").apply(file, "x");
}

/// Frames of a stream, cut anywhere on their way.
void read_stream(const std::string& bytes) {
  live::FrameParser parser;
  const size_t step = 1 + checksum(bytes).back() % 61;
  const std::span all(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  for (size_t at = 0; at < all.size(); at += step) {
    const std::string why = parser.take(
        all.subspan(at, std::min(step, all.size() - at)), {},
        [](live::LiveCloud& cloud) {
          for (const Point& p : cloud.points)
            if (!p.allFinite()) throw std::logic_error("a point is not finite");
        },
        [](const std::string&) {});
    if (!why.empty()) throw InputError("stream", why, "send frames");
  }
}

// ---- HDF5 --------------------------------------------------------------------------------------

void read_hdf5(const std::string& bytes) {
  const std::string path = file_of(bytes, "x.h5");
  // Every opening costs a child process: each input is read in one of three ways.
  const char way = checksum(bytes).back();
  if (is_foreign_hdf5(path)) return play(path);
  if (way < '5') return void(verify(path));
  const Inspection holds = inspect(path);
  if (way < 'a') return;
  std::vector<std::function<void()>> actions;
  const bool scans = holds.kind == "scans", prediction = holds.kind == "prediction";
  if (prediction) actions.emplace_back([&] { read_prediction(path); });
  if (scans || (prediction && holds.counts.count("vertices") != 0))
    actions.emplace_back([&] { play(path); });
  if (holds.counts.count("bodies") != 0) actions.emplace_back([&] { read_bodies(path); });
  if (holds.counts.count("motions") != 0) actions.emplace_back([&] { read_motions(path); });
  do_all(actions);
}

}  // namespace

// No allocation may be above 8 times the uncompressed payload plus 64 MB. Of a plain format that is
// 64 + 8 * 64 KiB: 65 MiB (66 of a body model, which has no shorter one). What is packed unpacks to
// at most 1032 times its size (deflate) or to as much as the reader allows, so 16 KiB may mean 16
// MiB, and 8 times as much. In "hdf5" libFuzzer also watches the child that reads first, which may
// take 1 GiB (datasets/hdf5/probe.h); what the file claims is checked against what it stores.
const std::vector<Target>& targets() {
  constexpr size_t kLong = size_t{64} << 10, kModel = 3 * kLong, kShort = size_t{16} << 10;
  static const std::vector<Target> all = {
      {"ply", "ply", kShort, 65, 1000, read_ply},
      {"obj", "obj", kShort, 65, 500, read_obj},
      {"pcd", "cloud", kShort, 65, 500, read_pcd},
      {"table", "cloud", kShort, 65, 500, read_table},
      {"raw", "cloud", kShort, 65, 100, read_raw},
      {"gltf", "gltf", kLong, 65, 3000, read_scene},
      {"character", "gltf", kLong, 65, 3000, read_rigged},
      {"bvh", "bvh", kLong, 65, 900, read_bvh_text},
      {"asf", "asf", kShort, 65, 600, read_asf},
      {"amc", "asf", kShort, 65, 600, read_amc_text},
      {"xz", "", kShort, 320, 200, read_packed},
      {"npy", "npy", kShort, 65, 500, read_npy_file},
      {"npz", "npy", kShort, 192, 800, read_npz_file},
      {"amass", "npy", kLong, 65, 600, read_motion},
      {"pickle", "pickle", kShort, 65, 2000, read_pickles},
      {"joints", "npy", kShort, 96, 300, read_joints},
      {"smpl", "npy", kModel, 66, 300, read_body_model},
      {"safetensors", "safetensors", kLong, 65, 3000, read_weights},
      {"config", "yaml", kShort, 65, 3000, read_training},
      {"recipe", "yaml", kShort, 65, 300, read_recipe},
      {"profile", "yaml", kShort, 65, 300, read_profile},
      {"names", "yaml", kShort, 65, 300, read_names},
      {"hdf5", "", kLong, 1040, 1100, read_hdf5},
      {"stream", "", kShort, 65, 500, read_stream},
      {"doctor", "obj", kShort, 65, 10, doctor_surface},
      {"sequence", "npy", kShort, 65, 20, doctor_sequence},
      {"import", "bvh", kShort, 65, 20, import_file},
      {"skeleton", "obj", kShort, 65, 20, extract},
      {"retarget", "obj", kShort, 65, 20, retarget},
  };
  return all;
}

std::string framed(const std::vector<std::pair<std::string, std::string>>& arrays) {
  std::string out;
  for (const auto& [name, bytes] : arrays)
    out += name + '\0' + test::raw(static_cast<uint32_t>(bytes.size())) + bytes;
  return out;
}

}  // namespace restage::fuzz
