// The glTF reader: types of numbers, interpolation, and files that are wrong in every way.
#include <gtest/gtest.h>

#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/gltf/gltf.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using testing::GlbParts;
using testing::GltfJson;
using ReadersGltf = FileTest;

/// One primitive of these points, and nothing else.
GlbParts shape_of(const std::vector<float>& points) {
  GlbParts out;
  GltfJson primitive;
  primitive["attributes"]["POSITION"] = out.floats(points, "VEC3", 3);
  out.root["meshes"] = {{{"primitives", {primitive}}}};
  out.root["nodes"] = {{{"mesh", 0}}};
  return out;
}
GlbParts triangle() { return shape_of({0, 0, 0, 1, 0, 0, 0, 1, 0}); }

GltfJson& primitive_of(GlbParts& parts) { return parts.root["meshes"][0]["primitives"][0]; }

/// The first node's translation by keys.
Gltf moved(GlbParts parts, const char* how, const std::vector<float>& times,
           const std::vector<float>& values) {
  parts.root["animations"] = {
      {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
       {"samplers",
        {{{"input", parts.floats(times, "SCALAR", 1)},
          {"output", parts.floats(values, "VEC3", 3)},
          {"interpolation", how}}}}}};
  return parse_gltf(parts.glb(), "t.glb");
}

double x_at(const Gltf& file, double t) {
  return gltf_pose(file, file.clips[0], t)[0].translation().x();
}

Mesh mesh_of(const std::string& content, const std::string& path = "t.glb") {
  const Gltf file = parse_gltf(content, path);
  return gltf_mesh(file, gltf_rest(file));
}
Mesh mesh_of(const GlbParts& parts) { return mesh_of(parts.glb()); }

std::string refusal(const GlbParts& parts) {
  return error_of([&] { mesh_of(parts); });
}
std::string refusal_of_text(const std::string& text) {
  return error_of([&] { mesh_of(text, "t.gltf"); });
}

TEST_F(ReadersGltf, MeshesAreMergedWhereTheirNodesPutThem) {
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

TEST_F(ReadersGltf, OnlyTheDefaultSceneIsShown) {
  GlbParts parts = triangle();
  parts.root["nodes"].push_back({{"mesh", 0}});
  parts.root["scenes"] = {{{"nodes", {1}}}, {{"nodes", {0, 1}}}};
  EXPECT_EQ(mesh_of(parts).vertices.size(), 3u);
  parts.root["scene"] = 1;
  EXPECT_EQ(mesh_of(parts).vertices.size(), 6u);
}

TEST_F(ReadersGltf, PrimitivesOfOneListOfVerticesShareIt) {
  GlbParts parts = triangle();
  primitive_of(parts)["indices"] = parts.add(std::vector<uint16_t>{2, 1, 0}, 5123, "SCALAR", 1);
  parts.root["meshes"][0]["primitives"].push_back(primitive_of(parts));
  const Mesh mesh = mesh_of(parts);
  EXPECT_EQ(mesh.vertices.size(), 3u);
  EXPECT_EQ(mesh.faces, (std::vector<Triangle>{{2, 1, 0}, {2, 1, 0}}));
}

TEST_F(ReadersGltf, StripsFansAndPoints) {
  GlbParts parts = shape_of({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  primitive_of(parts)["mode"] = 5;
  EXPECT_EQ(mesh_of(parts).faces, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}}));
  primitive_of(parts)["mode"] = 6;
  EXPECT_EQ(mesh_of(parts).faces, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  primitive_of(parts)["mode"] = 0;
  EXPECT_TRUE(mesh_of(parts).faces.empty());
  EXPECT_EQ(mesh_of(parts).vertices.size(), 4u);
  primitive_of(parts)["mode"] = 1;
  EXPECT_HAS(refusal(parts), "no mesh");
}

TEST_F(ReadersGltf, NormalisedSparseAndInterleavedNumbers) {
  GlbParts parts = triangle();
  const int shorts =
      parts.add(std::vector<int16_t>{0, 0, 0, 32767, 0, 0, 0, -32768, 0}, 5122, "VEC3", 3);
  parts.root["accessors"][shorts]["normalized"] = true;
  primitive_of(parts)["attributes"]["POSITION"] = shorts;
  // Elements of shorts are 6 bytes, which the format wants to be 8 apart.
  parts.root["bufferViews"].back()["byteStride"] = 8;
  EXPECT_HAS(refusal(parts), "beyond");
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
  EXPECT_HAS(refusal(sparse), "sparse part");
  sparse.root["accessors"][0]["count"] = uint64_t{1} << 40;
  EXPECT_HAS(refusal(sparse), "again and again");
}

TEST_F(ReadersGltf, KeysAreHeldSteppedAndSplined) {
  const auto animate = [](const char* how, const std::vector<float>& values) {
    return moved(triangle(), how, {1, 2}, values);
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

TEST_F(ReadersGltf, AKeyIsReachedInItsOwnFrame) {
  std::vector<float> times, values;
  for (int k = 0; k < 900; ++k) {
    times.push_back(static_cast<float>(k / 30.0));  // as a float, often later than k / 30
    values.insert(values.end(), {static_cast<float>(k), 0, 0});
  }
  const Gltf file = moved(triangle(), "STEP", times, values);
  for (int k = 0; k < 900; ++k) ASSERT_EQ(x_at(file, k / 30.0), k);
  EXPECT_EQ(x_at(file, 7.9 / 30), 7);
}

TEST_F(ReadersGltf, AMirrorDoesNotTurnTheSurfaceInsideOut) {
  GlbParts parts = triangle();
  const auto normal = [&] {
    const Mesh mesh = mesh_of(parts);
    const auto at = [&](size_t k) { return mesh.vertices[static_cast<size_t>(mesh.faces[0][k])]; };
    return (at(1) - at(0)).cross(at(2) - at(0)).z();
  };
  const float before = normal();
  parts.root["nodes"][0]["scale"] = {-1, 1, 1};
  EXPECT_EQ(normal(), before);
}

TEST_F(ReadersGltf, BuffersInTheTextAndBesideTheFile) {
  const GlbParts parts = triangle();
  dir.write("in/my mesh.bin", parts.binary);
  dir.write("in/sub/other.bin", "");
  dir.write("secret.bin", parts.binary);
  std::filesystem::create_symlink("../secret.bin", dir / "in/link.bin");
  const auto with = [&](const std::string& uri) {
    GltfJson root = parts.root;
    root["buffers"] = {{{"byteLength", parts.binary.size()}, {"uri", uri}}};
    return read_mesh(dir.write("in/t.gltf", root.dump())).vertices[1];
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
}

TEST_F(ReadersGltf, CompressedDataThatIsThereInPlainIsRead) {
  GlbParts both = triangle();
  both.root["extensionsUsed"] = {"KHR_draco_mesh_compression", "EXT_meshopt_compression"};
  primitive_of(both)["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
  EXPECT_EQ(mesh_of(both).vertices.size(), 3u);
  // Data that only the compressed copy has: of an accessor, and of a buffer.
  GlbParts accessor = triangle();
  accessor.root["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  accessor.root["accessors"][0].erase("bufferView");
  EXPECT_HAS(refusal(accessor), "compressed with Draco");
  for (const char* list : {"extensionsUsed", "extensionsRequired"})
    EXPECT_HAS(refusal_of_text(std::string(R"({"asset":{"version":"2.0"},")") + list +
                               R"(":["EXT_meshopt_compression"],"buffers":[{"byteLength":36,)"
                               R"("extensions":{"EXT_meshopt_compression":{"fallback":true}}}]})"),
               "compressed with meshopt");
}

TEST_F(ReadersGltf, WhatIsWrongIsSaid) {
  /// What is said where the triangle's structure has another value at a place.
  struct Case {
    const char *says, *place, *value;
  };
  for (const auto& [says, place, value] :
       {Case{"is compressed with Draco (KHR_draco_mesh_compression); unpack it: npx "
             "@gltf-transform/cli copy \"t.glb\" unpacked.glb",
             "/extensionsRequired", R"(["KHR_draco_mesh_compression"])"},
        {"is compressed with meshopt (EXT_meshopt_compression); unpack it: npx "
         "@gltf-transform/cli copy \"t.glb\" unpacked.glb",
         "/extensionsRequired", R"(["EXT_meshopt_compression"])"},
        {"'XX_new'", "/extensionsRequired", R"(["XX_new"])"},
        {"version '1.0'", "/asset/version", R"("1.0")"},
        {"circles", "/nodes", R"([{"children": [1]}, {"children": [0]}])"},
        {"several parents", "/nodes", R"([{"children": [2]}, {"children": [2]}, {}])"},
        {"node 5", "/nodes/0/children", "[5]"},
        {"node -1", "/nodes/0/children", "[-1]"},
        {"mesh 3", "/nodes/0/mesh", "3"},
        {"skin 0 of 0", "/nodes/0/skin", "0"},
        {"accessor 9", "/meshes/0/primitives/0/attributes/POSITION", "9"},
        {"wrong type", "/accessors/0/type", R"("VEC4")"},
        {"component type", "/accessors/0/componentType", "5130"},
        {"beyond", "/accessors/0/count", "4"},
        {"beyond", "/accessors/0/byteOffset", "18446744073709551612"},
        {"none", "/accessors/0/count", "0"},
        {"outside of its buffer", "/bufferViews/0/byteOffset", "400"},
        {"buffer 2", "/bufferViews/0/buffer", "2"},
        {"2 numbers", "/nodes/0/translation", "[1, 2]"},
        {"rotation", "/nodes/0/rotation", "[0, 0, 0, 0]"},
        {"out of range", "/nodes/0/translation", "[1e300, 0, 0]"},
        {"holds no mesh", "/nodes", "[{}]"}}) {
    GlbParts parts = triangle();
    parts.root[GltfJson::json_pointer(place)] = GltfJson::parse(value);
    EXPECT_HAS(refusal(parts), says) << place;
  }
  GlbParts scene = triangle();
  scene.root["scenes"] = {{{"nodes", {0}}}};
  scene.root["scene"] = 4;
  EXPECT_HAS(refusal(scene), "scene 4");
  EXPECT_HAS(refusal(shape_of({NAN, 0, 0, 0, 0, 0, 0, 0, 0})), "NaN");
  GlbParts index = triangle();
  primitive_of(index)["indices"] = index.add(std::vector<uint8_t>{0, 1, 3}, 5121, "SCALAR", 1);
  EXPECT_HAS(refusal(index), "vertex 3 of 3");
  EXPECT_HAS(error_of([] { mesh_of("glTF"); }), "cut short");
  EXPECT_HAS(refusal_of_text("{}"), "usable");
  EXPECT_HAS(refusal_of_text("[]"), "no glTF file");
  EXPECT_HAS(refusal_of_text("{\"asset\":"), "JSON");
}

TEST_F(ReadersGltf, SmallFilesThatAskForMuchAreRefused) {
  const auto text = [](const std::string& inner) {
    return R"({"asset":{"version":"2.0"},)" + inner + "}";
  };
  const auto repeat = [](const std::string& part, size_t times) {
    std::string out = part;
    for (size_t i = 1; i < times; ++i) out += "," + part;
    return out;
  };
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  EXPECT_HAS(refusal_of_text(text(R"("nodes":)" + deep)), "deeper");
  // Where nothing is looked for, anything may stand.
  EXPECT_NO_THROW(
      parse_gltf(text(R"("nodes":[{}],"extras":[)" + repeat("0", 1000) + "]"), "t.gltf"));
  EXPECT_HAS(refusal_of_text(text(R"("nodes":[)" + repeat("{}", 200000) + "]")), "more parts");
  EXPECT_HAS(refusal_of_text(text(R"("nodes":[{"weights":[)" + repeat("0", 2000000) + "]}]")),
             "more parts");
  GlbParts parts = triangle();
  parts.floats(std::vector<float>(299997, 1.0f), "VEC3", 3);
  GltfJson primitive;
  primitive["attributes"]["POSITION"] = 1;
  for (int i = 0; i < 1000; ++i) {
    parts.root["nodes"].push_back({{"mesh", 0}});
    parts.root["meshes"][0]["primitives"].push_back(primitive);
  }
  EXPECT_HAS(refusal(parts), "again and again");
}

}  // namespace
}  // namespace restage
