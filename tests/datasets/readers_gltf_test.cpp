// The glTF reader: types of numbers, interpolation, and files that are wrong in every way.
#include <gtest/gtest.h>

#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/readers/gltf.h"
#include "datasets/readers/mesh_io.h"
#include "tests/datasets/gltf_maker.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using testing::CharacterMaker;
using testing::GlbParts;
using testing::GltfJson;

/// One triangle, and nothing else.
GlbParts triangle() {
  GlbParts out;
  GltfJson primitive;
  primitive["attributes"]["POSITION"] = out.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
  out.root["meshes"] = {{{"primitives", {primitive}}}};
  out.root["nodes"] = {{{"mesh", 0}}};
  return out;
}

GltfJson& primitive_of(GlbParts& parts) { return parts.root["meshes"][0]["primitives"][0]; }

Mesh mesh_of(const GlbParts& parts) {
  const Gltf file = parse_gltf(parts.glb(), "t.glb");
  return gltf_mesh(file, gltf_rest(file));
}

/// The refusal is one line that says `word` and how to mend it.
void expect_refused(const std::string& content, const std::string& word,
                    const std::string& path = "t.glb") {
  try {
    const Gltf file = parse_gltf(content, path);
    gltf_mesh(file, gltf_rest(file));
    ADD_FAILURE() << "not refused: " << word;
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(word), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    EXPECT_LT(text.size(), 390u);
  }
}
void expect_refused(const GlbParts& parts, const std::string& word) {
  expect_refused(parts.glb(), word);
}

TEST(ReadersGltf, MeshesAreMergedWhereTheirNodesPutThem) {
  GlbParts parts = triangle();
  parts.root["nodes"] = {{{"mesh", 0}, {"translation", {5, 0, 0}}, {"children", {1}}},
                         {{"mesh", 0}, {"scale", {2, 2, 2}}, {"rotation", {0, 0, 1, 0}}}};
  const Mesh mesh = mesh_of(parts);
  ASSERT_EQ(mesh.vertices.size(), 6u);
  EXPECT_LT((mesh.vertices[1] - Point(6, 0, 0)).norm(), 1e-6f);
  EXPECT_LT((mesh.vertices[4] - Point(3, 0, 0)).norm(),
            1e-6f);  // half a turn about z, twice as large
  EXPECT_EQ(mesh.faces[1], (Triangle{3, 4, 5}));
  // The same by a matrix, column by column.
  parts.root["nodes"][1] = {{"mesh", 0},
                            {"matrix", {-2, 0, 0, 0, 0, -2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1}}};
  EXPECT_LT((mesh_of(parts).vertices[4] - Point(3, 0, 0)).norm(), 1e-6f);
}

TEST(ReadersGltf, OnlyTheDefaultSceneIsShown) {
  GlbParts parts = triangle();
  parts.root["nodes"].push_back({{"mesh", 0}});
  parts.root["scenes"] = {{{"nodes", {1}}}, {{"nodes", {0, 1}}}};
  EXPECT_EQ(mesh_of(parts).vertices.size(), 3u);
  parts.root["scene"] = 1;
  EXPECT_EQ(mesh_of(parts).vertices.size(), 6u);
}

TEST(ReadersGltf, PrimitivesOfOneListOfVerticesShareIt) {
  GlbParts parts = triangle();
  primitive_of(parts)["indices"] = parts.add(std::vector<uint16_t>{2, 1, 0}, 5123, "SCALAR", 1);
  parts.root["meshes"][0]["primitives"].push_back(primitive_of(parts));
  const Mesh mesh = mesh_of(parts);
  EXPECT_EQ(mesh.vertices.size(), 3u);
  EXPECT_EQ(mesh.faces, (std::vector<Triangle>{{2, 1, 0}, {2, 1, 0}}));
}

TEST(ReadersGltf, StripsFansAndPoints) {
  GlbParts parts;
  GltfJson primitive;
  primitive["attributes"]["POSITION"] =
      parts.floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, "VEC3", 3);
  parts.root["meshes"] = {{{"primitives", {primitive}}}};
  parts.root["nodes"] = {{{"mesh", 0}}};
  primitive_of(parts)["mode"] = 5;
  EXPECT_EQ(mesh_of(parts).faces, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}}));
  primitive_of(parts)["mode"] = 6;
  EXPECT_EQ(mesh_of(parts).faces, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  primitive_of(parts)["mode"] = 0;
  EXPECT_TRUE(mesh_of(parts).faces.empty());
  EXPECT_EQ(mesh_of(parts).vertices.size(), 4u);
  primitive_of(parts)["mode"] = 1;
  expect_refused(parts, "no mesh");
}

TEST(ReadersGltf, NormalisedSparseAndInterleavedNumbers) {
  GlbParts parts = triangle();
  const int shorts =
      parts.add(std::vector<int16_t>{0, 0, 0, 32767, 0, 0, 0, -32768, 0}, 5122, "VEC3", 3);
  parts.root["accessors"][shorts]["normalized"] = true;
  primitive_of(parts)["attributes"]["POSITION"] = shorts;
  // Elements of shorts are 6 bytes, which the format wants to be 8 apart.
  parts.root["bufferViews"].back()["byteStride"] = 8;
  expect_refused(parts, "beyond");
  parts.root["bufferViews"].back().erase("byteStride");
  parts.root["accessors"][shorts]["count"] = 3;
  EXPECT_EQ(mesh_of(parts).vertices[1], Point(1, 0, 0));
  EXPECT_EQ(mesh_of(parts).vertices[2], Point(0, -1, 0));  // not -1.00003

  GlbParts sparse = triangle();
  sparse.add(std::vector<uint8_t>{1}, 5121, "SCALAR", 1);
  sparse.floats({7, 8, 9}, "VEC3", 3);
  sparse.root["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", 1}, {"componentType", 5121}}},
      {"values", {{"bufferView", 2}}}};
  EXPECT_EQ(mesh_of(sparse).vertices[1], Point(7, 8, 9));
  EXPECT_EQ(mesh_of(sparse).vertices[2], Point(0, 1, 0));
  sparse.root["accessors"][0].erase("bufferView");  // zeros but for what is named
  EXPECT_EQ(mesh_of(sparse).vertices[2], Point(0, 0, 0));
  sparse.root["accessors"][0]["count"] = 1;
  expect_refused(sparse, "sparse part");
  sparse.root["accessors"][0]["count"] = uint64_t{1} << 40;
  expect_refused(sparse, "again and again");
}

TEST(ReadersGltf, KeysAreHeldSteppedAndSplined) {
  GlbParts parts = triangle();
  const int times = parts.floats({1, 2}, "SCALAR", 1);
  const auto animate = [&](const char* how, const std::vector<float>& values) {
    parts.root["animations"] = {
        {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
         {"samplers",
          {{{"input", times},
            {"output", parts.floats(values, "VEC3", 3)},
            {"interpolation", how}}}}}};
    return parse_gltf(parts.glb(), "t.glb");
  };
  const auto x_at = [](const Gltf& file, double t) {
    return gltf_pose(file, file.clips[0], t)[0].translation().x();
  };
  const Gltf linear = animate("LINEAR", {0, 0, 0, 4, 0, 0});
  EXPECT_NEAR(x_at(linear, 0), 0, 1e-9);
  EXPECT_NEAR(x_at(linear, 1.25), 1, 1e-9);
  EXPECT_NEAR(x_at(linear, 9), 4, 1e-9);
  EXPECT_EQ(clip_frames(linear, linear.clips[0]), 31);
  const Gltf step = animate("STEP", {0, 0, 0, 4, 0, 0});
  EXPECT_NEAR(x_at(step, 1.99), 0, 1e-9);
  EXPECT_NEAR(x_at(step, 2), 4, 1e-9);
  // x(t) = t^3 from 0 to 1: tangents 0 and 3.
  const Gltf cubic = animate("CUBICSPLINE", {0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 1, 0, 0, 3, 0, 0});
  for (const double t : {0.0, 0.3, 0.7, 1.0}) EXPECT_NEAR(x_at(cubic, 1 + t), t * t * t, 1e-6);
  EXPECT_THROW(animate("CUBICSPLINE", {0, 0, 0, 4, 0, 0}), InputError);
  EXPECT_THROW(animate("SPIRAL", {0, 0, 0, 4, 0, 0}), InputError);
}

TEST(ReadersGltf, AKeyIsReachedInItsOwnFrame) {
  GlbParts parts = triangle();
  std::vector<float> times, values;
  for (int k = 0; k < 900; ++k) {
    times.push_back(static_cast<float>(k / 30.0));  // as a float, often later than k / 30
    values.insert(values.end(), {static_cast<float>(k), 0, 0});
  }
  parts.root["animations"] = {
      {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
       {"samplers",
        {{{"input", parts.floats(times, "SCALAR", 1)},
          {"output", parts.floats(values, "VEC3", 3)},
          {"interpolation", "STEP"}}}}}};
  const Gltf file = parse_gltf(parts.glb(), "t.glb");
  for (int k = 0; k < 900; ++k)
    ASSERT_EQ(gltf_pose(file, file.clips[0], k / 30.0)[0].translation().x(), k);
  EXPECT_EQ(gltf_pose(file, file.clips[0], 7.9 / 30)[0].translation().x(), 7);
}

TEST(ReadersGltf, AMirrorDoesNotTurnTheSurfaceInsideOut) {
  GlbParts parts = triangle();
  const auto normal = [&] {
    const Gltf file = parse_gltf(parts.glb(), "t.glb");
    const Mesh mesh = gltf_mesh(file, gltf_rest(file));
    const auto at = [&](size_t k) { return mesh.vertices[static_cast<size_t>(mesh.faces[0][k])]; };
    return (at(1) - at(0)).cross(at(2) - at(0)).z();
  };
  const float before = normal();
  parts.root["nodes"][0]["scale"] = {-1, 1, 1};
  EXPECT_EQ(normal(), before);
}

TEST(ReadersGltf, BuffersInTheTextAndBesideTheFile) {
  const std::string folder = ::testing::TempDir() + "readers_gltf";
  fs::remove_all(folder);
  fs::create_directories(folder + "/in/sub");
  GlbParts parts = triangle();
  write_file_atomically(folder + "/in/my mesh.bin", parts.binary);
  write_file_atomically(folder + "/secret.bin", parts.binary);
  fs::create_symlink("../secret.bin", folder + "/in/link.bin");
  const auto with = [&](const std::string& uri) {
    GltfJson root = parts.root;
    root["buffers"] = {{{"byteLength", parts.binary.size()}, {"uri", uri}}};
    write_file_atomically(folder + "/in/t.gltf", root.dump());
    return read_mesh(folder + "/in/t.gltf").vertices[1];
  };
  EXPECT_EQ(with("my%20mesh.bin"), Point(1, 0, 0));
  EXPECT_EQ(with("sub/../my mesh.bin"), Point(1, 0, 0));
  // The 36 bytes of three points.
  EXPECT_EQ(
      with("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"),
      Point(1, 0, 0));
  for (const char* bad :
       {"../secret.bin", "link.bin", "/etc/passwd", "http://a/b.bin", "none.bin", "sub", "",
        "%2e%2e/secret.bin", "data:application/octet-stream;base64,AAAA", "data:text/html,hello",
        "file:///etc/passwd"})
    EXPECT_THROW(with(bad), InputError) << bad;
  fs::remove_all(folder);
}

TEST(ReadersGltf, WhatIsWrongIsSaid) {
  const auto wrong = [](const std::string& word, const std::function<void(GltfJson&)>& change) {
    GlbParts parts = triangle();
    change(parts.root);
    expect_refused(parts, word);
  };
  wrong("Draco", [](GltfJson& r) { r["extensionsRequired"] = {"KHR_draco_mesh_compression"}; });
  wrong("meshopt", [](GltfJson& r) { r["extensionsRequired"] = {"EXT_meshopt_compression"}; });
  wrong("'XX_new'", [](GltfJson& r) { r["extensionsRequired"] = {"XX_new"}; });
  wrong("version '1.0'", [](GltfJson& r) { r["asset"]["version"] = "1.0"; });
  wrong("circles", [](GltfJson& r) { r["nodes"] = {{{"children", {1}}}, {{"children", {0}}}}; });
  wrong("several parents", [](GltfJson& r) {
    r["nodes"] = {{{"children", {2}}}, {{"children", {2}}}, GltfJson::object()};
  });
  wrong("node 5", [](GltfJson& r) { r["nodes"][0]["children"] = {5}; });
  wrong("node -1", [](GltfJson& r) { r["nodes"][0]["children"] = {-1}; });
  wrong("mesh 3", [](GltfJson& r) { r["nodes"][0]["mesh"] = 3; });
  wrong("skin 0 of 0", [](GltfJson& r) { r["nodes"][0]["skin"] = 0; });
  wrong("accessor 9",
        [](GltfJson& r) { r["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9; });
  wrong("wrong type", [](GltfJson& r) { r["accessors"][0]["type"] = "VEC4"; });
  wrong("component type", [](GltfJson& r) { r["accessors"][0]["componentType"] = 5130; });
  wrong("beyond", [](GltfJson& r) { r["accessors"][0]["count"] = 4; });
  wrong("beyond", [](GltfJson& r) { r["accessors"][0]["byteOffset"] = ~uint64_t{0} - 3; });
  wrong("none", [](GltfJson& r) { r["accessors"][0]["count"] = 0; });
  wrong("outside of its buffer", [](GltfJson& r) { r["bufferViews"][0]["byteOffset"] = 400; });
  wrong("buffer 2", [](GltfJson& r) { r["bufferViews"][0]["buffer"] = 2; });
  wrong("2 numbers", [](GltfJson& r) { r["nodes"][0]["translation"] = {1, 2}; });
  wrong("rotation", [](GltfJson& r) { r["nodes"][0]["rotation"] = {0, 0, 0, 0}; });
  wrong("out of range", [](GltfJson& r) { r["nodes"][0]["translation"] = {1e300, 0, 0}; });
  wrong("scene 4", [](GltfJson& r) {
    r["scenes"] = {{{"nodes", {0}}}};
    r["scene"] = 4;
  });
  wrong("holds no mesh", [](GltfJson& r) { r["nodes"] = {GltfJson::object()}; });
  GlbParts nan = triangle();
  nan.floats({NAN, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3);
  primitive_of(nan)["attributes"]["POSITION"] = 1;
  expect_refused(nan, "NaN");
  GlbParts index = triangle();
  primitive_of(index)["indices"] = index.add(std::vector<uint8_t>{0, 1, 3}, 5121, "SCALAR", 1);
  expect_refused(index, "vertex 3 of 3");
  expect_refused("glTF", "cut short");
  expect_refused("{}", "usable", "t.gltf");
  expect_refused("[]", "no glTF file", "t.gltf");
  expect_refused("{\"asset\":", "JSON", "t.gltf");
}

TEST(ReadersGltf, SmallFilesThatAskForMuchAreRefused) {
  const auto text = [](const std::string& inner) {
    return "{\"asset\":{\"version\":\"2.0\"}," + inner + "}";
  };
  const auto repeat = [](const std::string& part, size_t times) {
    std::string out;
    for (size_t i = 0; i < times; ++i) out += (i == 0 ? "" : ",") + part;
    return out;
  };
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  expect_refused(text("\"nodes\":" + deep), "deeper", "t.gltf");
  // Where nothing is looked for, anything may stand.
  EXPECT_NO_THROW(
      parse_gltf(text("\"nodes\":[{}],\"extras\":[" + repeat("0", 1000) + "]"), "t.gltf"));
  expect_refused(text("\"nodes\":[" + repeat("{}", 200000) + "]"), "more parts", "t.gltf");
  expect_refused(text("\"nodes\":[{\"weights\":[" + repeat("0", 2000000) + "]}]"), "more parts",
                 "t.gltf");
  GlbParts parts = triangle();
  parts.floats(std::vector<float>(299997, 1.0f), "VEC3", 3);
  GltfJson primitive;
  for (int i = 0; i < 1000; ++i) {
    primitive["attributes"]["POSITION"] = 1;
    parts.root["nodes"].push_back({{"mesh", 0}});
    parts.root["meshes"][0]["primitives"].push_back(primitive);
  }
  expect_refused(parts, "again and again");
}

/// A damaged file is read or refused, never anything else.
size_t refusals(const std::string& content, bool* read) {
  try {
    const Gltf file = parse_gltf(content, "t.glb");
    if (!file.vertices.empty()) gltf_mesh(file, gltf_rest(file));
    for (const GltfClip& clip : file.clips) {
      clip_frames(file, clip);
      gltf_pose(file, clip, 0.5 * (clip.begin + clip.end));
    }
    ImportReport report;
    t_pose_joints(find_rig(file, {}, report));
    *read = true;
    return 0;
  } catch (const InputError& error) {
    EXPECT_LT(std::string(error.what()).size(), 390u) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return 1;
  }
}

TEST(ReadersGltf, CutAndDamagedFiles) {
  const testing::KnownCharacter known = testing::known_character();
  testing::RigStyle style = testing::plain_style();
  style.twist_bones = style.bone_axes = true;
  style.keys = 5;
  const std::string good = CharacterMaker(known, style).parts.glb();
  bool read = false;
  ASSERT_EQ(refusals(good, &read), 0u);
  for (size_t percent = 0; percent < 100; ++percent)
    EXPECT_EQ(refusals(good.substr(0, good.size() * percent / 100), &read), 1u) << percent;
  size_t refused = 0;
  read = false;
  const size_t structure = good.find("BIN");
  for (uint64_t i = 0; i < 3000; ++i) {
    Rng rng(RngKey{1, i});
    std::string bad = good;
    const size_t reach = i % 3 == 0 ? bad.size() : structure;  // most are turned where they matter
    for (uint64_t k = 0; k <= rng.below(4); ++k)
      bad[rng.below(reach)] = static_cast<char>(i % 2 == 0 ? rng.below(256) : '0' + rng.below(10));
    refused += refusals(bad, &read);
  }
  EXPECT_GT(refused, 300u);
  EXPECT_TRUE(read);
}

}  // namespace
}  // namespace restage
