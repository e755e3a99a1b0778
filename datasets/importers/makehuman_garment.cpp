// Garments: a mesh (.obj.gz) whose vertices are bound to three vertices of the body (.mhclo.gz).
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "autograd/base/error.h"
#include "datasets/importers/makehuman.h"

namespace restage {
namespace {

constexpr size_t kMaxText = size_t{64} << 20;

std::string read_gz(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw InputError(path, "is not there", "name a garment of the clothes folder");
  gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) throw InputError(path, "cannot be read", "check its permissions");
  std::string out, piece(1 << 16, '\0');
  int got = 0;
  while ((got = gzread(file, piece.data(), static_cast<unsigned>(piece.size()))) > 0 &&
         out.size() < kMaxText)
    out.append(piece, 0, static_cast<size_t>(got));
  const bool whole = got == 0 && gzeof(file) && gzclose(file) == Z_OK;
  if (!whole) throw InputError(path, "is damaged or larger than 64 MiB", "fetch it again");
  return out;
}

/// Calls line(words, where) for each line that has words.
template <class Line>
void each_line(const std::string& text, const std::string& path, const Line& line) {
  size_t number = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    std::vector<std::string> words;
    for (size_t i = at; i < end;) {
      const size_t from = text.find_first_not_of(" \t\r", i);
      if (from >= end) break;
      i = std::min(text.find_first_of(" \t\r\n", from), end);
      words.push_back(text.substr(from, i - from));
    }
    at = end + 1;
    ++number;
    if (!words.empty()) line(words, path + ":" + std::to_string(number));
  }
}

double number_of(std::string_view word, const std::string& where) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end == word.data() || !std::isfinite(value) || std::abs(value) > 1e9)
    throw InputError(where, "has no number where one belongs", "fetch the garment again");
  return value;
}

/// A vertex index written as a number, `first` being the first one.
int32_t index_of(std::string_view word, int first, size_t limit, const std::string& where) {
  const double value = number_of(word, where) - first;
  if (value < 0 || value >= static_cast<double>(limit) || value != std::floor(value))
    throw InputError(where, "names a vertex that does not exist", "fetch the garment again");
  return static_cast<int32_t>(value);
}

std::vector<std::array<int32_t, 4>> read_quads(const std::string& path, size_t vertices) {
  std::vector<std::array<int32_t, 4>> out;
  each_line(read_gz(path), path,
            [&](const std::vector<std::string>& words, const std::string& where) {
              if (words[0] != "f") return;
              if (words.size() != 4 && words.size() != 5)
                throw InputError(where, "is a face that is no triangle or quad",
                                 "fetch the garment again");
              std::array<int32_t, 4> quad{};
              for (size_t k = 0; k < 4; ++k)
                quad[k] = index_of(words[std::min(k + 1, words.size() - 1)], 1, vertices, where);
              out.push_back(quad);
            });
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
void add_hidden(const std::vector<std::string>& words, const std::string& where, Bindings& out) {
  for (size_t i = 0; i < words.size(); ++i) {
    const auto first = static_cast<size_t>(index_of(words[i], 0, out.hidden.size(), where));
    size_t last = first;
    if (i + 2 < words.size() && words[i + 1] == "-")
      last = static_cast<size_t>(index_of(words[i += 2], 0, out.hidden.size(), where));
    for (size_t v = first; v <= last; ++v) out.hidden[v] = 1;
  }
}

Binding binding_of(const std::vector<std::string>& words, size_t limit, const std::string& where) {
  const auto vertex = [&](size_t i) {
    return static_cast<size_t>(index_of(words[i], 0, limit, where));
  };
  if (words.size() == 1) return {{vertex(0), vertex(0), vertex(0)}, {1, 0, 0}, Vec3::Zero()};
  const auto number = [&](size_t i) { return number_of(words[i], where); };
  return {{vertex(0), vertex(1), vertex(2)},
          {number(3), number(4), number(5)},
          Vec3(number(6), number(7), number(8))};
}

Bindings read_bindings(const std::string& path, const std::vector<Vec3>& body) {
  Bindings out;
  out.hidden.assign(body.size(), 0);
  enum { elsewhere, in_verts, in_hidden } part = elsewhere;
  each_line(read_gz(path), path,
            [&](const std::vector<std::string>& words, const std::string& where) {
              const bool numeric = words[0].find_first_not_of("0123456789") == std::string::npos;
              if (words[0].size() == 7 && words[0].ends_with("_scale") && words[0][0] >= 'x' &&
                  words[0][0] <= 'z') {
                if (words.size() < 4)
                  throw InputError(where, "lacks numbers", "fetch the garment again");
                const int k = words[0][0] - 'x';
                const size_t a = static_cast<size_t>(index_of(words[1], 0, body.size(), where));
                const size_t b = static_cast<size_t>(index_of(words[2], 0, body.size(), where));
                const double base = number_of(words[3], where);
                if (!(base > 1e-9))
                  throw InputError(where, "scales by zero", "fetch the garment again");
                out.scale[k] = std::abs(body[a][k] - body[b][k]) / base;
              } else if (words[0] == "verts") {
                part = in_verts;
              } else if (words[0] == "delete_verts") {
                part = in_hidden;
              } else if (part == in_verts && numeric && (words.size() == 1 || words.size() == 9)) {
                out.rows.push_back(binding_of(words, body.size(), where));
              } else if (part == in_hidden && numeric) {
                add_hidden(words, where, out);
              } else if (!numeric && words[0][0] != '-') {
                part = elsewhere;
              }
            });
  if (out.rows.empty()) throw InputError(path, "binds no vertices", "fetch the garment again");
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
