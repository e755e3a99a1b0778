// Looks of glTF files: materials, pictures, coordinates, morph targets; the surface is the one of
// read_gltf().
#include <gtest/gtest.h>

#include "datasets/readers/gltf/gltf_look.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using Json = testing::GltfJson;

/// A strip of four vertices on two joints, one of which turns, with looks of all kinds.
struct Strip {
  testing::GlbParts parts;
  Strip() {
    Json& root = parts.root;
    const int position = parts.floats({0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0}, "VEC3", 3);
    const int uv = parts.floats({0, 1, 0, 0, 1, 1, 1, 0}, "VEC2", 2);
    const int second = parts.floats({.5, .5, .5, .5, .5, .5, .5, .5}, "VEC2", 2);
    const int colour = parts.add<uint8_t>(
        {255, 0, 0, 255, 255, 0, 0, 255, 0, 255, 0, 51, 0, 255, 0, 51}, 5121, "VEC4", 4);
    root["accessors"][colour]["normalized"] = true;
    const int joints =
        parts.add<uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}, 5121, "VEC4", 4);
    const int weights = parts.floats({1, 0, 0, 0, 1, 0, 0, 0, .5, .5, 0, 0, 0, 1, 0, 0}, "VEC4", 4);
    const int index = parts.add<uint16_t>({0, 2, 1, 1, 2, 3}, 5123, "SCALAR", 1);
    const int up = parts.floats({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3);
    const int out = parts.floats({0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3);
    root["meshes"] = {{{"weights", {0.5, 0.0}},
                       {"primitives",
                        {{{"attributes",
                           {{"POSITION", position},
                            {"TEXCOORD_0", uv},
                            {"TEXCOORD_1", second},
                            {"COLOR_0", colour},
                            {"JOINTS_0", joints},
                            {"WEIGHTS_0", weights}}},
                          {"indices", index},
                          {"material", 0},
                          {"targets", {{{"POSITION", up}}, {{"POSITION", out}}}}}}}}};
    root["skins"] = {{{"joints", {1, 2}}}};
    root["nodes"] = {{{"mesh", 0}, {"skin", 0}}, {{"children", {2}}}, {{"name", "tip"}}};
    root["scenes"] = {{{"nodes", {0, 1}}}};
    const int times = parts.floats({0, 1}, "SCALAR", 1);
    const float half = std::sqrt(0.5f);
    const int turns = parts.floats({0, 0, 0, 1, 0, 0, half, half}, "VEC4", 4);
    const int faces = parts.floats({0, 0, 1, 0.5}, "SCALAR", 1);
    root["animations"] = {
        {{"name", "turn"},
         {"extras", {{"generator", "restage"}}},
         {"samplers",
          {{{"input", times}, {"output", turns}}, {{"input", times}, {"output", faces}}}},
         {"channels",
          {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}},
           {{"sampler", 1}, {"target", {{"node", 0}, {"path", "weights"}}}}}}},
        {{"name", "smile"},
         {"samplers", {{{"input", times}, {"interpolation", "STEP"}, {"output", faces}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}}};
    root["images"] = {{{"bufferView", 0}, {"name", "cloth"}},
                      {{"uri", "data:image/png;base64,AAAA"}}};
    root["samplers"] = {{{"wrapS", 33648}, {"wrapT", 33071}, {"magFilter", 9728}}};
    root["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 1}}};
    root["materials"] = {
        {{"name", "shirt"},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", {1, 0.5, 0.25, 0.75}},
           {"baseColorTexture",
            {{"index", 0},
             {"texCoord", 1},
             {"extensions",
              {{"KHR_texture_transform", {{"offset", {0.25, 0.5}}, {"scale", {2, 3}}}}}}}}}},
         {"alphaMode", "MASK"},
         {"alphaCutoff", 0.3},
         {"doubleSided", true},
         {"extensions", {{"KHR_materials_unlit", Json::object()}}}}};
  }
  std::string write(const test::TempDir& dir) const {
    return test::write_bytes((dir.path() + "/strip.glb"), parts.glb());
  }
};

TEST(GltfLook, SaysWhatMaterialsSay) {
  const test::TempDir dir;
  Strip strip;
  const GltfLook look = read_gltf_look(strip.write(dir));
  ASSERT_EQ(look.look.materials.size(), 2u);
  const Material& shirt = look.look.materials[0];
  EXPECT_EQ(shirt.name, "shirt");
  EXPECT_EQ(shirt.colour, Rgba(1, 0.5f, 0.25f, 0.75f));
  EXPECT_EQ(shirt.alpha, Material::Alpha::mask);
  EXPECT_FLOAT_EQ(shirt.cutoff, 0.3f);
  EXPECT_TRUE(shirt.two_sided && shirt.unlit && shirt.texture.nearest);
  EXPECT_EQ(shirt.texture.across, Texture::Wrap::mirror);
  EXPECT_EQ(shirt.texture.down, Texture::Wrap::clamp);
  EXPECT_EQ(shirt.texture.transform * Eigen::Vector3f(1, 1, 1), Uv(2.25f, 3.5f));
  ASSERT_EQ(look.look.pictures.size(), 1u) << "only those that are used";
  EXPECT_EQ(look.look.pictures[0].name, "cloth");
  EXPECT_EQ(look.look.pictures[0].bytes.size(), 48u);
  EXPECT_EQ(look.look.material, (std::vector<int32_t>{0, 0}));
  ASSERT_EQ(look.look.uv.size(), 4u);
  EXPECT_EQ(look.look.uv[0], Uv(0.5f, 0.5f)) << "the coordinates that the material names";
  EXPECT_EQ(look.look.colours[0], Rgba(1, 0, 0, 1));
  EXPECT_NEAR(look.look.colours[3][3], 0.2f, 1e-6f);
  EXPECT_EQ(look.ours, (std::vector<bool>{true, false}));
}

TEST(GltfLook, IsPosedAsReadGltfPosesIt) {
  const test::TempDir dir;
  Strip strip;
  strip.parts.root["meshes"][0]["weights"] = {0.0, 0.0};
  strip.parts.root["animations"][0]["channels"].erase(1);
  const std::string path = strip.write(dir);
  const GltfLook look = read_gltf_look(path);
  const Gltf plain = read_gltf(path);
  EXPECT_EQ(look.file.faces, plain.faces);
  for (const double t : {0.0, 0.4, 1.0}) {
    const Mesh a =
        gltf_look_mesh(look, gltf_pose(look.file, look.file.clips[0], t), &look.file.clips[0], t);
    const Mesh b = gltf_mesh(plain, gltf_pose(plain, plain.clips[0], t));
    EXPECT_EQ(a.vertices, b.vertices);
  }
}

TEST(GltfLook, MorphTargetsRestAndMove) {
  const test::TempDir dir;
  Strip strip;
  const GltfLook look = read_gltf_look(strip.write(dir));
  ASSERT_EQ(look.file.clips.size(), 2u) << "also the one that only moves a face";
  const Mesh rest = gltf_look_mesh(look, gltf_rest(look.file), nullptr, 0);
  EXPECT_EQ(rest.vertices[0], Point(0, 0.5f, 0)) << "the weights of the mesh";
  const auto at = [&](size_t clip, double t) {
    const GltfClip& c = look.file.clips[clip];
    return gltf_look_mesh(look, gltf_pose(look.file, c, t), &c, t).vertices;
  };
  EXPECT_EQ(at(0, 0)[0], Point(0, 0, 0));
  EXPECT_TRUE(at(0, 0.5)[0].isApprox(Point(0, 0.5f, 0.5f)));
  EXPECT_TRUE(at(0, 1)[0].isApprox(Point(0, 1, 1)));
  EXPECT_EQ(at(1, 0.5)[0], Point(0, 0, 0)) << "STEP";
  EXPECT_TRUE(at(1, 1)[0].isApprox(Point(0, 1, 1)));
  EXPECT_EQ(read_gltf((dir.path() + "/strip.glb")).clips.size(), 1u)
      << "and the plain reader has none";
}

TEST(GltfLook, NonsenseOfLooksIsLeftOutAndSaid) {
  const test::TempDir dir;
  const auto remarks = [&](const std::function<void(Json&)>& change) {
    Strip strip;
    change(strip.parts.root);
    const GltfLook look = read_gltf_look(strip.write(dir));
    EXPECT_EQ(look.look.material.size(), look.file.faces.size());
    EXPECT_TRUE(look.look.uv.empty() || look.look.uv.size() == look.file.vertices.size());
    std::string all;
    for (const std::string& remark : look.file.remarks) all += remark + "\n";
    return all;
  };
  EXPECT_EQ(remarks([](Json&) {}), "");
  auto& attributes = "/meshes/0/primitives/0/attributes/";
  const auto at = [&](const std::string& name) { return Json::json_pointer(attributes + name); };
  EXPECT_HAS(remarks([&](Json& r) { r[at("TEXCOORD_1")] = 99; }), "left out TEXCOORD_1");
  EXPECT_HAS(remarks([&](Json& r) {
               r[at("COLOR_0")] = 0;
               r["accessors"][0]["count"] = 4;
               r["accessors"][3]["type"] = "VEC3";
               r["accessors"][3]["count"] = 5;
               r[at("COLOR_0")] = 3;
             }),
             "left out COLOR_0");
  EXPECT_HAS(remarks([](Json& r) { r["images"][0] = {{"bufferView", 77}}; }), "it has no bytes");
  EXPECT_HAS(remarks([](Json& r) {
               r["images"][0] = {{"uri", "../../etc/passwd"}};
             }),
             "outside of its folder");
  EXPECT_HAS(remarks([](Json& r) {
               r["images"][0] = {{"uri", "lost.png"}};
             }),
             "which is not there");
  EXPECT_HAS(remarks([](Json& r) { r["textures"][0]["source"] = -1; }), "names no picture");
  EXPECT_HAS(remarks([](Json& r) { r["animations"][1]["samplers"][0]["output"] = 0; }),
             "left out weights");
  for (const char* list : {"materials", "textures", "images", "samplers"})
    for (const Json& nonsense :
         {Json(7), Json("x"), Json::array({1, "x", nullptr}), Json::object()})
      remarks([&](Json& r) { r[list] = nonsense; });
  remarks([](Json& r) { r["meshes"][0]["primitives"][0]["material"] = 12; });
  remarks([](Json& r) {
    r["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {"x", 1e300};
  });
}

TEST(GltfLook, CutsForPicturesAreJoined) {
  const test::TempDir dir;
  Strip strip;
  Json& root = strip.parts.root;
  // Two vertices more lie where 2 and 3 lie: a cut, unless their normals are others.
  const int position =
      strip.parts.floats({0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 1, 0, 0, 1, 1, 0}, "VEC3", 3);
  const int normal =
      strip.parts.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 0, 0}, "VEC3", 3);
  root["meshes"] = {
      {{"primitives", {{{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}}}}}};
  root["nodes"][0].erase("skin");
  root.erase("animations");
  const GltfLook look = read_gltf_look(strip.write(dir));
  EXPECT_EQ(look.look.smooth, (std::vector<int32_t>{0, 1, 2, 3, 2, 5}));
}

}  // namespace
}  // namespace restage
