#include "datasets/characters/mesh_template.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/format.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// Bytes of a PLY type; 0: unknown.
size_t size_of(const std::string& type) {
  for (const auto& [names, bytes] : {std::pair{" char uchar int8 uint8 ", 1},
                                     {" short ushort int16 uint16 ", 2},
                                     {" int uint float int32 uint32 float32 ", 4},
                                     {" double float64 int64 uint64 ", 8}})
    if (std::string(names).find(" " + type + " ") != std::string::npos)
      return static_cast<size_t>(bytes);
  return 0;
}

bool is_real(const std::string& type) {
  return type == "float" || type == "float32" || type == "double" || type == "float64";
}

/// 0, 1, 2 for x, y, z; -1 for others.
int axis_of(const std::string& name) {
  const size_t axis = name.size() == 1 ? std::string("xyz").find(lower_case(name)) : 3;
  return axis < 3 ? static_cast<int>(axis) : -1;
}

bool is_normal(const std::string& name) {
  const std::string plain = lower_case(name);
  return plain == "nx" || plain == "ny" || plain == "nz" || plain.starts_with("normal_");
}

}  // namespace

std::unique_ptr<const MeshTemplate> MeshTemplate::of(const std::string& path, size_t vertices) {
  auto out = std::make_unique<MeshTemplate>();
  out->path_ = path;
  const bool obj = text::ends_in(path, {".obj"});
  if (!obj && !text::ends_in(path, {".ply"})) return nullptr;
  out->format_ = obj ? MeshFormat::obj : MeshFormat::ply;
  const std::string content = read_file(path);
  const std::string_view text = text::without_mark(content, path);
  const bool taken = obj ? out->take_obj(text) : out->take_ply(text);
  return taken && out->places_.size() == 3 * vertices ? std::move(out) : nullptr;
}

// ---- OBJ ---------------------------------------------------------------------------------------

bool MeshTemplate::take_obj(std::string_view content) {
  text::Lines lines(content);
  for (std::string_view line; lines.next(line);) {
    if (line.ends_with('\\') || line.find('\r') != std::string_view::npos) return false;
    take_obj_line(line);
  }
  return true;
}

void MeshTemplate::take_obj_line(std::string_view line) {
  std::string_view rest = line;
  const std::string_view keyword = text::take_word(rest);
  if (keyword == "vn") {
    had_normals_ = true;
    return;
  }
  if (keyword == "mtllib") {
    const size_t first = rest.find_first_not_of(" \t");
    if (first != std::string_view::npos) libraries_.emplace_back(rest.substr(first));
    return;
  }
  if (keyword == "v") {
    kept_ += "v";
    for (uint8_t axis = 0; axis < 3; ++axis) {
      text::take_word(rest);
      kept_ += ' ';
      places_.push_back({kept_.size(), axis, false});
    }
    kept_ += rest;  // colours
  } else if (keyword == "f") {
    kept_ += "f";
    for (std::string_view word = text::take_word(rest); !word.empty();
         word = text::take_word(rest)) {
      const size_t one = word.find('/'), two = word.find('/', one == word.npos ? one : one + 1);
      if (two != word.npos) word = word.substr(0, two == one + 1 ? one : two);
      kept_ += ' ';
      kept_ += word;
    }
  } else {
    kept_ += line;
  }
  kept_ += '\n';
}

// ---- PLY ---------------------------------------------------------------------------------------

bool MeshTemplate::take_ply(std::string_view content) {
  text::Lines lines(content);
  std::string_view line;
  lines.next(line);
  size_t count = 0, elements = 0;
  std::vector<std::string> types, names;
  std::string rest_of_header;
  while (lines.next(line)) {
    std::string_view words = line;
    const std::string_view keyword = text::take_word(words);
    if (keyword == "end_header") break;
    if (keyword == "format") {
      const std::string_view name = text::take_word(words);
      text_ = name == "ascii";
      big_endian_ = name == "binary_big_endian";
      kept_ = "ply\nformat " + std::string(name) + " 1.0\n" + comment_of(MeshFormat::ply);
      continue;
    }
    if (keyword == "element") {
      ++elements;
      const std::string_view name = text::take_word(words);
      int64_t rows = 0;
      if (elements == 1 && (name != "vertex" || !text::parse(text::take_word(words), rows)))
        return false;
      if (elements == 1) count = static_cast<size_t>(rows);
    } else if (keyword == "property" && elements == 1) {
      types.emplace_back(text::take_word(words));
      names.emplace_back(text::take_word(words));
      if (size_of(types.back()) == 0) return false;  // a list, for one
      if (is_normal(names.back())) {
        had_normals_ = true;
        continue;
      }
      if (axis_of(names.back()) >= 0 && !is_real(types.back())) return false;
    }
    rest_of_header += line;
    rest_of_header += '\n';
  }
  kept_ += rest_of_header + "end_header\n";
  return take_rows(lines.rest(), count, types, names);
}

bool MeshTemplate::take_rows(std::string_view rows, size_t count,
                             const std::vector<std::string>& types,
                             const std::vector<std::string>& names) {
  const auto take = [&](size_t k, std::string_view value) {
    if (is_normal(names[k])) return;
    if (const int axis = axis_of(names[k]); axis >= 0)
      places_.push_back({kept_.size(), static_cast<uint8_t>(axis), size_of(types[k]) == 8});
    else
      kept_ += value;
    if (text_) kept_ += ' ';
  };
  text::Lines lines(rows);
  for (size_t v = 0; v < count; ++v) {
    std::string_view line;
    while (text_ && line.find_first_not_of(" \t\r") == line.npos)
      if (!lines.next(line)) return false;
    for (size_t k = 0; k < types.size(); ++k) {
      if (text_) {
        take(k, text::take_word(line));
        continue;
      }
      const size_t bytes = size_of(types[k]);
      if (rows.size() < bytes) return false;
      take(k, rows.substr(0, bytes));
      rows.remove_prefix(bytes);
    }
    if (text_) kept_.back() = '\n';
  }
  kept_ += text_ ? lines.rest() : rows;
  return true;
}

// ---- writing -----------------------------------------------------------------------------------

std::string MeshTemplate::with(const Points& vertices, const std::string& folder) const {
  std::string out;
  out.reserve(kept_.size() + 16 * places_.size());
  if (format_ == MeshFormat::obj) out += comment_of(MeshFormat::obj);
  const fs::path from = fs::absolute(path_).parent_path();
  for (const std::string& library : libraries_) {
    const fs::path near = (from / library).lexically_relative(fs::absolute(folder));
    out += "mtllib " + (near.empty() ? from / library : near).generic_string() + "\n";
  }
  size_t done = 0;
  for (size_t i = 0; i < places_.size(); ++i) {
    const Place& place = places_[i];
    out.append(kept_, done, place.at - done);
    done = place.at;
    const float value = vertices[i / 3][place.axis];
    if (text_) {
      out += restage::format("%.9g", static_cast<double>(value));
      continue;
    }
    char bytes[8];
    const double wide = value;
    const size_t size = place.wide ? 8 : 4;
    std::memcpy(bytes, place.wide ? static_cast<const void*>(&wide) : &value, size);
    if (big_endian_) std::reverse(bytes, bytes + size);
    out.append(bytes, size);
  }
  out.append(kept_, done);
  return out;
}

}  // namespace restage
