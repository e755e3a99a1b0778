// Small valid files of every kind, as other programs write them.
#include <cmath>
#include <functional>
#include <map>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/builtin/bodies.h"
#include "datasets/importers/rigs/profiles.h"
#include "datasets/sampling/surface.h"
#include "datasets/schema.h"
#include "experiments/cli/training/benchmark_config.h"
#include "nn/config/config.h"
#include "nn/weights/bundle.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/datasets/pickle_support.h"
#include "tests/datasets/smpl_support.h"
#include "tests/fuzz/old_layout.h"
#include "tests/fuzz/targets.h"
#include "tests/support/files.h"
#include "tests/support/small_models.h"
#include "tests/support/tiny_body.h"
#include "tests/support/toy_asf.h"
#include "train/training/train_config.h"

namespace restage::fuzz {
namespace {

using Seeds = std::vector<Seed>;

// ---- meshes ------------------------------------------------------------------------------------

template <class T>
std::string big(T value) {
  std::string out = test::raw(value);
  return {out.rbegin(), out.rend()};
}

Seeds ply_seeds() {
  const std::string vertices = "element vertex 4\nproperty float x\nproperty float y\nproperty ";
  const std::string header = vertices + "float z\n", corners = "0 0 0\n1 0 0\n0 1.5e0 -1\n0 0 1\n";
  const std::string faces = "element face 2\nproperty list uchar int vertex_indices\n";
  std::string little = "ply\nformat binary_little_endian 1.0\n" + header + faces + "end_header\n",
              large = "ply\r\nformat binary_big_endian 1.0\r\ncomment x\r\n" + vertices +
                      "double z\nproperty uchar red\nelement face 1\nproperty uchar flags\n"
                      "property list ushort uint vertex_index\nelement edge 1\nproperty int a\n"
                      "end_header\n";
  for (int i = 0; i < 4; ++i) {
    for (int c = 0; c < 3; ++c) little += test::raw(0.5f * static_cast<float>(i * c));
    large += big(1.0f) + big(0.25f * static_cast<float>(i)) + big(-2.0) + 'r';
  }
  little += '\3' + test::raw(0) + test::raw(1) + test::raw(2);
  little += '\4' + test::raw(0) + test::raw(1) + test::raw(2) + test::raw(3);
  large += 'f' + big(uint16_t{4});
  for (uint32_t i = 0; i < 4; ++i) large += big(i);
  large += big(7);
  std::string packed = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n";
  for (const char* name : {"min_x", "min_y", "min_z", "max_x", "max_y", "max_z"})
    packed += cat("property float ", name, "\n");
  packed +=
      "element vertex 3\nproperty uint packed_position\nproperty uint packed_color\nend_header\n";
  for (int i = 0; i < 6; ++i) packed += test::raw(static_cast<float>(i));
  for (uint32_t i = 0; i < 6; ++i) packed += test::raw(0x9E3779B9u * (i + 1));
  const std::string strips = "ply\nformat ascii 1.0\n" + vertices +
                             "float z\nproperty float opacity\nproperty float scale_0\nelement "
                             "tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  std::string splats;
  for (int i = 0; i < 4; ++i) splats += cat(i, " 0 1 ", 2 * i - 4, " 1\n");
  return {{"packed", packed},
          {"strips", strips + splats + "6 0 1 2 3 -1 2\n"},
          {"cloud", "ply\nformat ascii 1.0\n" + header + "end_header\n" + corners},
          {"mesh", "ply\nformat ascii 1.0\nobj_info y\n" + header + faces + "end_header\n" +
                       corners + "3 0 1 2\n4 0 1 2 3\n"},
          {"little", little},
          {"big", large}};
}

Seeds obj_seeds() {
  const std::string corners = "v 0 0 0\nv 1 0 0 1 0.5 0.5\nv 0 1.25 0\nv +0 -0 1e0\n";
  return {
      {"cloud", corners, Cut::any},
      {"mesh",
       "# a\nmtllib a.mtl\no a\n" + corners + "g b\nusemtl c\ns off\nf 1 2 3\nf -4 -3 -2 -1 # d\n",
       Cut::any},
      {"normals",
       corners + "vt 0 0\nvn 0 0 1\r\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\nf 1/1 2/1 4/1\n",
       Cut::any}};
}

Seeds pcd_seeds() {
  const auto header = [](const char* data) {
    return std::string(
               "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 "
               "4 8 "
               "4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 "
               "0\nPOINTS 2\nDATA ") +
           data + "\n";
  };
  std::string rows, columns(40, '\0');
  for (int i = 0; i < 2; ++i)
    rows += test::raw(0.5f * static_cast<float>(i)) + test::raw(1.0f) + test::raw(-2.0) +
            test::raw(uint32_t{7});
  // Eight zeros, then copies of them: LZF.
  const std::string packed = std::string("\x07") + std::string(8, '\0') + "\xe0\x17\x07";
  return {{"ascii", header("ascii") + "0 0 0 1\nnan 1.5e0 -2 3\n", Cut::any},
          {"binary", header("binary") + rows},
          {"packed", header("binary_compressed") + test::raw(static_cast<uint32_t>(packed.size())) +
                         test::raw(uint32_t{40}) + packed}};
}

Seeds joints_seeds() {
  const Joints rest = builtin_rest_joints();
  std::string rows = "frame,joint,x,y,z\n", names, places, columns, numbers;
  std::vector<float> flat;
  for (size_t j = 0; j < kJoints; ++j) {
    const Vec3& x = rest[j];
    rows += cat("0,", j, format(",%.3f,%.3f,%.3f\n", x.x(), x.y(), x.z()));
    names += cat(j > 0 ? ", \"" : "\"", kJointNames[j], "\"");
    places += cat(j > 0 ? ", " : "", format("[%.3f, %.3f, %.3f]", x.x(), x.y(), x.z()));
    columns += cat("\t", kJointNames[j], "\t\t");
    numbers += format("\t%.3f\t%.3f\t%.3f", x.x(), x.y(), x.z());
    for (int axis = 0; axis < 3; ++axis) flat.push_back(static_cast<float>(x[axis]));
  }
  return {{"rows", rows, Cut::any},
          {"json",
           cat("{\"joint_names\": [", names,
               "], \"frames\": [{\"bodies\": [{\"joint_positions\": [", places, "]}]}]}"),
           Cut::any},
          {"trc",
           cat("PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\n30\nFrame#\tTime", columns,
               "\n\tX1\n1\t0", numbers, "\n"),
           Cut::any},
          {"array", test::npy<float>({1, kJoints, 3}, flat), Cut::any}};
}

Seeds table_seeds() {
  std::string recording = "time_us,x,y,z\n";
  for (int i = 0; i < 128; ++i) recording += cat(46 * (i / 8), ",", i, ".5,1,2\n");
  return {{"rows", "# x y z\n1 2 3\n-1.#IND nan 6\n", Cut::any},
          {"count", "2\n1 2 3 9\n4 5 6 9\n", Cut::any},
          {"named", "n,z,\"X [m]\",y\n1,2,3,4\n2,,5,6\n", Cut::any},
          {"colmap", "# ID, X, Y, Z, TRACK[]\n1 0.5 1.5 2.5 3 4\n9 0.2 1.2 2.2\n", Cut::any},
          {"times", recording, Cut::any},
          {"commas", "x;y;z\n0,5;1;2\n", Cut::any}};
}

/// Points of a LiDAR.
Seeds raw_seeds() {
  std::string out;
  for (int i = 0; i < 4 * 20; ++i) out += test::raw(0.5f + static_cast<float>(i % 7));
  return {{"kitti", out, Cut::any}};
}

// ---- characters --------------------------------------------------------------------------------

using testing::GlbParts;
using testing::GltfJson;

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

/// The same with its buffer in the text, where no length stands in the way of changes.
std::string as_text(const GlbParts& parts) {
  GltfJson root = parts.root;
  root["buffers"] = {{{"byteLength", parts.binary.size()},
                      {"uri", "data:application/octet-stream;base64," + base64(parts.binary)}}};
  return root.dump();
}

GlbParts scene(const char* interpolation, size_t values) {
  GlbParts out;
  GltfJson primitive;
  primitive["attributes"]["POSITION"] = out.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
  primitive["indices"] = out.add(std::vector<uint16_t>{0, 1, 2}, 5123, "SCALAR", 1);
  out.root["meshes"] = {{{"primitives", {primitive}}}};
  out.root["nodes"] = {{{"mesh", 0}, {"translation", {5, 0, 0}}, {"children", {1}}},
                       {{"mesh", 0}, {"scale", {2, 2, 2}}, {"rotation", {0, 0, 1, 0}}}};
  out.root["scenes"] = {{{"nodes", {0}}}};
  out.root["scene"] = 0;
  const int times = out.floats({0, 0.5f, 1}, "SCALAR", 1);
  const int moved = out.floats(std::vector<float>(values, 0.5f), "VEC3", 3);
  out.root["animations"] = {
      {{"name", "go"},
       {"samplers", {{{"input", times}, {"output", moved}, {"interpolation", interpolation}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}}}}}};
  return out;
}

GlbParts sparse_scene() {
  GlbParts out = scene("STEP", 9);
  const int indices = out.add(std::vector<uint8_t>{1}, 5121, "SCALAR", 1);
  const int values = out.floats({7, 8, 9}, "VEC3", 3);
  const auto view = [&](int accessor) { return out.root["accessors"][accessor]["bufferView"]; };
  out.root["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", view(indices)}, {"componentType", 5121}}},
      {"values", {{"bufferView", view(values)}}}};
  out.root["extensions"]["VRM"]["humanoid"]["humanBones"] = {{{"bone", "hips"}, {"node", 1}}};
  return out;
}

GlbParts character(bool twist) {
  testing::RigStyle style = testing::plain_style();
  style.twist_bones = style.bone_axes = twist;
  style.keys = 4;
  const testing::KnownCharacter known = testing::known_character();
  return testing::CharacterMaker(known, style).parts;
}

Seeds gltf_seeds() {
  return {{"linear.glb", scene("LINEAR", 9).glb()},
          {"cubic.glb", scene("CUBICSPLINE", 27).glb()},
          {"sparse.glb", sparse_scene().glb()},
          {"linear.gltf", as_text(scene("LINEAR", 9))},
          {"sparse.gltf", as_text(sparse_scene())}};
}
Seeds character_seeds() {
  return {{"plain.glb", character(false).glb()},
          {"twisted.glb", character(true).glb()},
          {"twisted.gltf", as_text(character(true))}};
}

// ---- recordings --------------------------------------------------------------------------------

Seeds bvh_seeds() {
  bvh_test::Style plain, odd;
  plain.frames = 3;
  odd.frames = 4;
  odd.fps = 24;
  odd.rotations = "YXZ";
  odd.rotations_first = odd.reversed = odd.all_positions = odd.wrapped = odd.z_up = true;
  return {{"plain", bvh_test::text(plain)}, {"odd", bvh_test::text(odd)}};
}

// ---- arrays ------------------------------------------------------------------------------------

std::vector<float> numbers(size_t n) {
  std::vector<float> out(n);
  for (size_t i = 0; i < n; ++i) out[i] = static_cast<float>(std::sin(static_cast<double>(i)));
  return out;
}

Seeds npy_seeds() {
  const std::string bytes(2 * 3 * 3 * 8, '\0');
  return {{"cloud", test::npy<float>({5, 3}, numbers(15))},
          {"frames", test::npy<float>({2, 4, 3}, numbers(24))},
          {"fortran", test::npy_of(test::npy_header(">f8", {2, 3, 3}, true), bytes)},
          {"half", test::npy_of(test::npy_header("<f2", {4, 3}), bytes.substr(0, 24))},
          {"bytes", test::npy_of(test::npy_header("|u1", {4, 3}), bytes.substr(0, 12), 2)},
          {"scalar", test::npy<double>({}, {30})},
          {"text", test::npy_text("female")}};
}

Seeds npz_seeds() {
  const std::string cloud = test::npy<float>({2, 4, 3}, numbers(24));
  const std::string rate = test::npy<double>({}, {25});
  test::ZipEntry modern;
  modern.name = "points.npy";
  modern.bytes = cloud;
  modern.deflate = modern.zip64 = modern.descriptor = true;
  const std::string counts = test::npy<int64_t>({2}, {3, 4});
  const std::string windows = test::npy<float>({1, 2, 4, 3}, numbers(24));
  const std::string mask = test::npy<int64_t>({2, 4}, {1, 1, 0, 0, 1, 1, 1, 0});
  return {{"packed", test::npz({{"points", cloud}, {"fps", rate}})},
          {"filled", test::npz({{"points", cloud}, {"lengths", counts}})},
          {"windows", test::npz({{"points", windows}, {"mask", mask}})},
          {"stored", test::npz({{"vertices", cloud}, {"text", test::npy_text("a")}}, false)},
          {"zip64", test::zip_of({modern}, "comment")}};
}

Seeds amass_seeds() {
  test::TinyClip clip, modern;
  clip.frames = modern.frames = 2;
  modern.family = SmplFamily::smplh;
  modern.rate_key = "mocap_frame_rate";
  modern.type = true;
  return {{"clip", framed(clip.arrays()), Cut::never_cut},
          {"modern", framed(modern.arrays()), Cut::never_cut}};
}

Seeds pickle_seeds() {
  namespace p = test::pickle;
  const std::vector<double> turns(2 * 66, 0.1), path(2 * 3, 0.5), camera(2 * 4, 1);
  const std::string wham = p::map({{p::text("pose_world"), p::joblib_array({2, 66}, turns)},
                                   {p::text("trans_world"), p::array({2, 3}, path)},
                                   {p::text("betas"), p::array({4}, {1, 2, 0, 1})}});
  const std::string frame = p::map(
      {{p::text("tid"), p::list({p::number(1)})},
       {p::text("smpl"),
        p::list(
            {p::map({{p::text("poses"), p::array({66}, {turns.begin(), turns.begin() + 66})}})})},
       {p::text("camera"), p::list({p::array({3}, {0, 1, 2})})}});
  const std::string tensors =
      p::map({{p::text("body_pose"), p::tensor("0", 132, 3, {2, 63}, {66, 1})},
              {p::text("global_orient"), p::tensor("0", 132, 0, {2, 3}, {66, 1})},
              {p::text("transl"), p::tensor("1", 6, 0, {2, 3}, {3, 1})}});
  return {
      {"people", p::file(p::map({{p::number(3), wham}, {p::number(7), wham}}))},
      {"frames", p::file(p::map({{p::text("a/1.jpg"), frame}, {p::text("a/2.jpg"), frame}}))},
      {"objects", p::npy_objects({}, {p::map({{p::text("pose"), p::array({2, 66}, turns)},
                                              {p::text("orig_cam"), p::array({2, 4}, camera)}})})},
      {"old", "(dp0\nVposes\np1\n(lp2\nF0.5\naI3\naL7L\nasV\\u00e9\nNsS'x\\x00'\nI01\ns."},
      {"torch", p::torch_file(p::map({{p::text("smpl_params_global"), tensors}}), {turns, path})}};
}

Seeds smpl_seeds() {
  test::TinySmpl model;
  model.family = SmplFamily::smpl;
  return {{"smpl", framed(model.arrays()), Cut::never_cut}};
}

// ---- weights and configurations ----------------------------------------------------------------

Seeds safetensors_seeds() {
  TensorFile plain;
  plain.tensors["a.weight"] = Tensor::from<float>({3}, {1.5f, -2, 0});
  plain.tensors["b"] = Tensor::from<double>({2, 2}, {1, 2, 3, 4e300});
  plain.tensors["empty"] = Tensor::zeros({0, 4});
  plain.tensors["index"] = Tensor::from<int64_t>({1}, {int64_t{1} << 40});
  plain.metadata["note"] = "line\n\"quoted\"";
  Bundle models;
  models.put("motion",
             testing::untrained_model("smrm/rot6d", {"hidden=2"}, Init{{7, 1}, DType::f32}));
  const std::string half = R"({"h":{"dtype":"F16","shape":[2],"data_offsets":[0,4]},)"
                           R"("b":{"dtype":"BF16","shape":[2,1],"data_offsets":[4,8]}})";
  return {{"plain", safetensors_bytes(plain)},
          {"models", safetensors_bytes(to_file(models))},
          {"header", half + '\0' + "12345678", Cut::never_cut}};
}

/// What the file says and what it leaves at its default.
template <class Config>
std::string resolved(const std::string& file) {
  Config config;
  if (!file.empty()) load_config(RESTAGE_SOURCE_DIR "/configs/" + file, {}, config);
  return resolved_yaml(config);
}

Seeds config_seeds() {
  return {{"default", resolved<TrainConfig>(""), Cut::any},
          {"lite", resolved<TrainConfig>("lite/all.yaml"), Cut::any},
          {"anchors", "name: &a x\nseed: 3\nskeleton:\n  clouds: {noise: 0.01}\n", Cut::any}};
}

Seeds profile_seeds() {
  Seeds out;
  for (const ProfileText& text : builtin_profile_texts())
    out.push_back({std::string(text.name), std::string(text.yaml), Cut::any});
  return out;
}

// ---- HDF5 --------------------------------------------------------------------------------------

std::string hdf5(const std::function<void(const std::string&)>& write) {
  const test::TempDir dir;
  write(dir / "x.h5");
  return test::bytes_of(dir / "x.h5");
}

Seeds hdf5_seeds() {
  Body body = testing::tiny_body("a", "train");
  const auto shapes = std::make_shared<PoseBlendShapes>();
  shapes->directions.setConstant(3 * static_cast<Eigen::Index>(body.rest.vertices.size()),
                                 PoseBlendShapes::kFeatures, 0.001f);
  body.blend_shapes = shapes;
  const Motion motion = testing::tiny_motion("m", "s", "train", 4);
  return {{"dataset",
           hdf5([&](const std::string& path) { write_dataset(path, {body}, {motion}, {}); })},
          {"scans", hdf5([&](const std::string& path) {
             ScanWriter scans(path, {});
             scans.append(body.rest.vertices);
             scans.append({body.rest.vertices[0]});
             scans.commit();
           })},
          {"prediction", hdf5([&](const std::string& path) {
             PredictionWriter out(path, static_cast<int64_t>(body.rest.vertices.size()),
                                  body.rest.faces, {});
             out.append(body.joints, body.rest.vertices);
             out.commit();
           })},
          {"foreign", hdf5([&](const std::string& path) {
             h5::File file = h5::File::create(path);
             file.write<float>("/50002_walk", {70, 3, 2}, std::vector<float>(420, 0.5f));
             file.write<int32_t>("/faces", {1, 3}, {0, 1, 69});
             file.commit();
           })},
          {"old", hdf5(test::write_old_layout)}};
}

// ---- what comes after reading ------------------------------------------------------------------

std::string obj_of(const Mesh& mesh) {
  std::string out;
  char line[80];
  for (const Point& p : mesh.vertices) {
    std::snprintf(line, sizeof line, "v %.3f %.3f %.3f\n", double{p[0]}, double{p[1]},
                  double{p[2]});
    out += line;
  }
  for (const Triangle& f : mesh.faces) {
    std::snprintf(line, sizeof line, "f %d %d %d\n", f[0] + 1, f[1] + 1, f[2] + 1);
    out += line;
  }
  return out;
}

/// A person in T-pose, as a scan of some hundred points and as a surface of boxes.
Seeds people_seeds() {
  const Body body = builtin_body(0, "test", 0);
  const Points scan = SurfaceSampler(body).draw(RngKey{1, 0}, 400).on_rest(body);
  return {{"scan", obj_of({scan, {}}), Cut::never_cut},
          {"boxes", obj_of(testing::tiny_body("a", "train").rest), Cut::never_cut}};
}

/// And nobody.
Seeds doctor_seeds() {
  const Mesh sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.02f}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  Seeds out = people_seeds();
  out.push_back({"sheet", obj_of(sheet), Cut::any});
  return out;
}

Seeds sequence_seeds() {
  const Body body = testing::tiny_body("a", "train");
  std::vector<float> walk;
  for (int f = 0; f < 6; ++f)
    for (const Point& p : body.rest.vertices)
      for (int axis = 0; axis < 3; ++axis)
        walk.push_back(p[axis] + (axis == 2 ? 0.03f * static_cast<float>(f) : 0));
  const auto n = static_cast<int64_t>(body.rest.vertices.size());
  return {{"walk", test::npy<float>({6, n, 3}, walk)},
          {"noise", test::npy<float>({20, 5, 3}, numbers(300))}};
}

Seeds import_seeds() {
  const auto of = [](int kind, const std::string& bytes) {
    return static_cast<char>(kind) + bytes;
  };
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 168\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n";
  for (const Point& p : testing::tiny_body("a", "train").rest.vertices)
    for (const float x : p) ply += test::raw(x);
  return {{"bvh", of(0, bvh_seeds()[0].bytes), Cut::never_cut},
          {"obj", of(3, people_seeds()[0].bytes), Cut::never_cut},
          {"ply", of(4, ply), Cut::never_cut},
          {"npy", of(5, sequence_seeds()[0].bytes), Cut::never_cut}};
}

}  // namespace

std::vector<Seed> seeds(std::string_view target) {
  static const std::map<std::string_view, std::function<Seeds()>> makers = {
      {"ply", ply_seeds},
      {"obj", obj_seeds},
      {"pcd", pcd_seeds},
      {"table", table_seeds},
      {"joints", joints_seeds},
      {"raw", raw_seeds},
      {"gltf", gltf_seeds},
      {"character", character_seeds},
      {"bvh", bvh_seeds},
      {"asf",
       [] {
         return Seeds{{"toy", asf_test::asf_text()}};
       }},
      {"amc",
       [] {
         return Seeds{{"toy", asf_test::amc_text(3), Cut::any}};
       }},
      {"xz",
       [] {
         return Seeds{{"plain", test::xz_of(bvh_seeds()[0].bytes, 8)}};
       }},
      {"npy", npy_seeds},
      {"npz", npz_seeds},
      {"amass", amass_seeds},
      {"pickle", pickle_seeds},
      {"smpl", smpl_seeds},
      {"safetensors", safetensors_seeds},
      {"config", config_seeds},
      {"recipe",
       [] {
         return Seeds{{"open", resolved<BenchmarkRecipe>("data/open_benchmark.yaml"), Cut::any}};
       }},
      {"profile", profile_seeds},
      {"names",
       [] {
         return Seeds{{"map", "a.*: skeleton.*\nb.0.bias: ~\n'x': y\n", Cut::any}};
       }},
      {"hdf5", hdf5_seeds},
      {"stream",
       [] {
         std::string frames;
         for (const uint32_t points : {2u, 0u, 40u})
           frames += test::raw(points) + test::raw(0.1 * points) +
                     std::string(12 * size_t{points}, '\x3f');
         return Seeds{{"frames", frames, Cut::any}};
       }},
      {"doctor", doctor_seeds},
      {"sequence", sequence_seeds},
      {"import", import_seeds},
      {"skeleton", people_seeds},
      {"retarget", people_seeds}};
  return makers.at(target)();
}

}  // namespace restage::fuzz
