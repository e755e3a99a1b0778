#include "datasets/importers/bodies/makehuman_pack.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/hdf5/file.h"
#include "datasets/importers/bodies/makehuman_lines.h"
#include "datasets/readers/frames/folders.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // bones in the file's order

constexpr uint64_t kMostBytes = uint64_t{64} << 20;

[[noreturn]] void damaged(const std::string& where, const std::string& what) {
  throw InputError(where, what, kFetchAgain);
}

/// Calls line(lines) for each line that has words and is no comment.
template <class Line>
void each_line(const std::string& path, const Line& line) {
  const std::string text = read_file(path, kMostBytes);
  WordLines lines(text, path);
  while (lines.next())
    if (lines.words()[0][0] != '#') line(lines);
}

struct BaseMesh {
  std::vector<float> vertices;  // 3 each
  std::vector<int32_t> quads;   // 4 each, of the skin
  size_t count() const { return vertices.size() / 3; }
};

BaseMesh read_base(const std::string& path) {
  BaseMesh out;
  bool skin = false;
  each_line(path, [&](const WordLines& lines) {
    const auto& words = lines.words();
    if (words[0] == "v" && words.size() >= 4) {
      for (size_t k = 1; k < 4; ++k)
        out.vertices.push_back(static_cast<float>(lines.number(words[k])));
    } else if (words[0] == "g") {
      skin = words.size() == 2 && words[1] == "body";
    } else if (words[0] == "f" && skin) {
      if (words.size() != 5) lines.fail("is no quad", kFetchAgain);
      for (size_t k = 1; k < 5; ++k)
        out.quads.push_back(vertex_named(lines, words[k], 1, out.count()));
    }
  });
  if (out.quads.empty()) damaged(path, "has no faces of a group 'body'");
  return out;
}

struct Targets {
  std::vector<std::string> names;
  std::vector<int64_t> start, count;
  std::vector<int32_t> index;
  std::vector<int16_t> delta;  // 3 each, thousandths of a decimetre
};

void read_target(const std::string& path, size_t vertices, Targets& out) {
  out.start.push_back(static_cast<int64_t>(out.index.size()));
  each_line(path, [&](const WordLines& lines) {
    const auto& words = lines.words();
    if (words.size() != 4) lines.fail("is no line 'vertex x y z'", kFetchAgain);
    out.index.push_back(vertex_named(lines, words[0], 0, vertices));
    for (size_t k = 1; k < 4; ++k) {
      const double milli = std::round(1000 * lines.number(words[k]));
      if (!(std::abs(milli) <= 32767))
        lines.fail("moves a vertex by more than 3 metres", kFetchAgain);
      out.delta.push_back(static_cast<int16_t>(milli));
    }
  });
  out.count.push_back(static_cast<int64_t>(out.index.size()) - out.start.back());
}

Targets read_targets(const std::string& folder, size_t vertices) {
  std::map<std::string, std::string> files;  // by name, so in an order of their own
  for (const std::string& path : files_below(folder)) {
    const fs::path name = fs::path(path).lexically_relative(folder);
    if (name.extension() == ".target")
      files[(name.parent_path() / name.stem()).generic_string()] = path;
  }
  if (files.empty()) damaged(folder, "holds no targets");
  Targets out;
  for (const auto& [name, path] : files) {
    out.names.push_back(name);
    read_target(path, vertices, out);
  }
  return out;
}

struct Rig {
  std::vector<std::string> bones;
  std::vector<int32_t> parents, heads;  // heads: `width` each, -1 where there are fewer
  int64_t width = 0;
  std::vector<int32_t> weight_bone, weight_vertex;
  std::vector<double> weight;

  /// InputError at `path` if there is no such bone.
  int32_t bone(const std::string& name, const std::string& path) const {
    const auto at = std::find(bones.begin(), bones.end(), name);
    if (at == bones.end()) damaged(path, "names a bone that the rig has not");
    return static_cast<int32_t>(at - bones.begin());
  }
};

int32_t vertex_of(const Json& value, size_t vertices, const std::string& path) {
  if (!value.is_number_unsigned() || value.get<uint64_t>() >= vertices)
    damaged(path, "names a vertex that does not exist");
  return value.get<int32_t>();
}

void read_bones(const std::string& path, size_t vertices, Rig& rig) {
  const Json json = Json::parse(read_file(path, kMostBytes));
  const Json &bones = json.at("bones"), &joints = json.at("joints");
  std::vector<std::vector<int32_t>> heads;
  for (const auto& [name, bone] : bones.items()) {
    rig.bones.push_back(name);
    heads.emplace_back();
    for (const Json& v : joints.at(bone.at("head").get<std::string>()))
      heads.back().push_back(vertex_of(v, vertices, path));
    rig.width = std::max(rig.width, static_cast<int64_t>(heads.back().size()));
  }
  for (const auto& [name, bone] : bones.items()) {
    const Json& parent = bone.at("parent");
    rig.parents.push_back(parent.is_null() ? -1 : rig.bone(parent.get<std::string>(), path));
  }
  for (std::vector<int32_t>& row : heads) {
    row.resize(static_cast<size_t>(rig.width), -1);
    rig.heads.insert(rig.heads.end(), row.begin(), row.end());
  }
}

void read_weights(const std::string& path, size_t vertices, Rig& rig) {
  const Json json = Json::parse(read_file(path, kMostBytes));
  for (const auto& [name, rows] : json.at("weights").items()) {
    const int32_t bone = rig.bone(name, path);
    for (const Json& row : rows) {
      const double weight = row.at(1).get<double>();
      if (!(weight >= 0 && weight <= 1)) damaged(path, "holds a weight outside of 0 to 1");
      rig.weight_bone.push_back(bone);
      rig.weight_vertex.push_back(vertex_of(row.at(0), vertices, path));
      rig.weight.push_back(weight);
    }
  }
}

Rig read_rig(const std::string& folder, size_t vertices) {
  Rig out;
  std::string path = folder + "/game_engine.mhskel";
  try {
    read_bones(path, vertices, out);
    path = folder + "/weights.game_engine.json";
    read_weights(path, vertices, out);
  } catch (const Json::exception&) {
    damaged(path, "is not laid out as MakeHuman's rigs are");
  }
  return out;
}

}  // namespace

void pack_makehuman(const std::string& folder, const std::string& out) {
  const BaseMesh base = read_base(folder + "/base.obj");
  const Targets targets = read_targets(folder + "/targets", base.count());
  const Rig rig = read_rig(folder, base.count());
  const auto size = [](const auto& list) { return static_cast<int64_t>(list.size()); };
  h5::File file = h5::File::create(out);
  file.write<float>("/base/vertices", {size(base.vertices) / 3, 3}, base.vertices);
  file.write<int32_t>("/base/body_quads", {size(base.quads) / 4, 4}, base.quads);
  file.write_text("/rig/bone_names", rig.bones);
  file.write<int32_t>("/rig/bone_parent", {size(rig.parents)}, rig.parents);
  file.write<int32_t>("/rig/head_vertices", {size(rig.bones), rig.width}, rig.heads);
  file.write<double>("/rig/weight_value", {size(rig.weight)}, rig.weight);
  file.write<int32_t>("/rig/weight_bone", {size(rig.weight)}, rig.weight_bone);
  file.write<int32_t>("/rig/weight_vertex", {size(rig.weight)}, rig.weight_vertex);
  file.write_text("/targets/names", targets.names);
  file.write<int64_t>("/targets/start", {size(targets.names)}, targets.start);
  file.write<int64_t>("/targets/count", {size(targets.names)}, targets.count);
  file.write<int32_t>("/targets/index", {size(targets.index)}, targets.index);
  file.write<int16_t>("/targets/delta_milli", {size(targets.index), 3}, targets.delta);
  file.commit();
}

}  // namespace restage
