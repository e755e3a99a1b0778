// Garments: a mesh (.obj.gz) whose vertices are bound to three vertices of the body (.mhclo.gz).
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/importers/bodies/makehuman.h"
#include "datasets/importers/bodies/makehuman_lines.h"
#include "datasets/readers/text/packed_text.h"

namespace restage {
namespace {

std::string read_part(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw InputError(path, "is not there", "name a garment of the clothes folder");
  std::optional<std::string> text = read_gz(path);
  if (!text) throw InputError(path, "is damaged or larger than 64 MiB", "fetch it again");
  return std::move(*text);
}

std::vector<std::array<int32_t, 4>> read_quads(const std::string& path, size_t vertices) {
  const std::string text = read_part(path);
  WordLines lines(text, path);
  std::vector<std::array<int32_t, 4>> out;
  while (lines.next()) {
    const auto& words = lines.words();
    if (words[0] != "f") continue;
    if (words.size() != 4 && words.size() != 5)
      lines.fail("is a face that is no triangle or quad", kFetchAgain);
    std::array<int32_t, 4> quad{};
    for (size_t k = 0; k < 4; ++k)
      quad[k] = vertex_named(lines, words[std::min(k + 1, words.size() - 1)], 1, vertices);
    out.push_back(quad);
  }
  return out;
}

/// x = sum of b_k V_k + scale * offset
struct Binding {
  std::array<size_t, 3> vertex;
  std::array<double, 3> weight;
  Vec3 offset;
};

struct Bindings {
  std::vector<Binding> rows;
  Vec3 scale = Vec3::Ones();
  std::vector<uint8_t> hidden;  ///< per vertex of the body: the garment covers it
};

/// A line of delete_verts: "12 - 40 44 50 - 51", ranges with both ends.
void add_hidden(const WordLines& lines, Bindings& out) {
  const auto& words = lines.words();
  const auto vertex = [&](size_t i) {
    return static_cast<size_t>(vertex_named(lines, words[i], 0, out.hidden.size()));
  };
  for (size_t i = 0; i < words.size(); ++i) {
    const size_t first = vertex(i);
    size_t last = first;
    if (i + 2 < words.size() && words[i + 1] == "-") last = vertex(i += 2);
    for (size_t v = first; v <= last; ++v) out.hidden[v] = 1;
  }
}

Binding binding_of(const WordLines& lines, size_t limit) {
  const auto& words = lines.words();
  const auto vertex = [&](size_t i) {
    return static_cast<size_t>(vertex_named(lines, words[i], 0, limit));
  };
  if (words.size() == 1) return {{vertex(0), vertex(0), vertex(0)}, {1, 0, 0}, Vec3::Zero()};
  const auto number = [&](size_t i) { return lines.number(words[i]); };
  return {{vertex(0), vertex(1), vertex(2)},
          {number(3), number(4), number(5)},
          Vec3(number(6), number(7), number(8))};
}

/// A line "x_scale 12 40 1.5": two vertices, and how far apart they are on the base mesh.
void read_scale(const WordLines& lines, const std::vector<Vec3>& body, Vec3& scale) {
  const auto& words = lines.words();
  if (words.size() < 4) lines.fail("lacks numbers", kFetchAgain);
  const int k = words[0][0] - 'x';
  const int32_t a = vertex_named(lines, words[1], 0, body.size());
  const int32_t b = vertex_named(lines, words[2], 0, body.size());
  const double base = lines.number(words[3]);
  if (!(base > 1e-9)) lines.fail("scales by zero", kFetchAgain);
  scale[k] = std::abs(body[a][k] - body[b][k]) / base;
}

Bindings read_bindings(const std::string& path, const std::vector<Vec3>& body) {
  Bindings out;
  out.hidden.assign(body.size(), 0);
  enum { elsewhere, in_verts, in_hidden } part = elsewhere;
  const std::string text = read_part(path);
  WordLines lines(text, path);
  while (lines.next()) {
    const auto& words = lines.words();
    const std::string_view word = words[0];
    const bool numeric = word.find_first_not_of("0123456789") == std::string_view::npos;
    if (word == "x_scale" || word == "y_scale" || word == "z_scale")
      read_scale(lines, body, out.scale);
    else if (word == "verts")
      part = in_verts;
    else if (word == "delete_verts")
      part = in_hidden;
    else if (part == in_verts && numeric && (words.size() == 1 || words.size() == 9))
      out.rows.push_back(binding_of(lines, body.size()));
    else if (part == in_hidden && numeric)
      add_hidden(lines, out);
    else if (!numeric && word[0] != '-')
      part = elsewhere;
  }
  if (out.rows.empty()) throw InputError(path, "binds no vertices", kFetchAgain);
  return out;
}

}  // namespace

SkinnedSurface MakeHuman::fit_garment(const std::vector<Vec3>& body, const std::string& name,
                                      std::vector<uint8_t>* hidden) const {
  if (name.find('/') != std::string::npos || name.find("..") != std::string::npos)
    throw InputError(name.substr(0, 60), "is no garment's name",
                     "name a file of the clothes folder");
  const std::string stem = folder_ + "/clothes/" + name;
  const Bindings bindings = read_bindings(stem + ".mhclo.gz", body);
  if (hidden) *hidden = bindings.hidden;
  SkinnedSurface out;
  for (const Binding& b : bindings.rows) {
    Vec3 x = b.offset.cwiseProduct(bindings.scale);
    JointWeights weights{};
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      x += b.weight[k] * body[b.vertex[k]];
      for (size_t j = 0; j < kJoints; ++j) weights[j] += b.weight[k] * weights_[b.vertex[k]][j];
    }
    for (double& w : weights) sum += w = std::max(0.0, w);
    for (double& w : weights) w = sum > 0 ? w / sum : 0.0;
    if (!(sum > 0)) weights[0] = 1;
    out.vertices.push_back(x);
    out.weights.push_back(weights);
  }
  out.quads = read_quads(stem + ".obj.gz", out.vertices.size());
  return out;
}

}  // namespace restage
