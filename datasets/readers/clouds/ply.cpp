#include <algorithm>
#include <array>
#include <cmath>

#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/numbers.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

const char* const kExportAgain = "export the file again";

enum class Format { ascii, little, big };
struct Property {
  std::string name;
  const Number* type = nullptr;
  const Number* count = nullptr;  // of a list: the kind of its length
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

struct PlyHeader {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

/// The kind of number of this name; null for an unknown one.
const Number* number_named(std::string_view name) {
  struct Named {
    std::string_view old_name, name;
    const Number* type;
  };
  static constexpr Named kNames[] = {
      {"char", "int8", &kNumber<int8_t>},    {"uchar", "uint8", &kNumber<uint8_t>},
      {"short", "int16", &kNumber<int16_t>}, {"ushort", "uint16", &kNumber<uint16_t>},
      {"int", "int32", &kNumber<int32_t>},   {"uint", "uint32", &kNumber<uint32_t>},
      {"float", "float32", &kNumber<float>}, {"double", "float64", &kNumber<double>},
      {"int64", "int64", &kNumber<int64_t>}, {"uint64", "uint64", &kNumber<uint64_t>}};
  for (const Named& known : kNames)
    if (name == known.old_name || name == known.name) return known.type;
  return nullptr;
}

// ---- header ------------------------------------------------------------------------------------

Property parse_property(std::string_view line, const std::string& where) {
  Property property;
  std::string_view word = text::take_word(line);
  if (word == "list") {
    const std::string_view count = text::take_word(line);
    property.count = number_named(count);
    if (property.count == nullptr || !property.count->integer)
      throw InputError(where, "unknown type " + text::quote(count) + " of a list's length",
                       kExportAgain);
    word = text::take_word(line);
  }
  property.type = number_named(word);
  if (property.type == nullptr)
    throw InputError(where, "unknown property type " + text::quote(word), kExportAgain);
  property.name = text::take_word(line);
  return property;
}

Element parse_element(std::string_view line, const std::string& where) {
  Element element;
  element.name = text::take_word(line);
  const std::string_view word = text::take_word(line);
  int64_t count = 0;
  if (!text::parse(word, count) || count < 0)
    throw InputError(
        where, "impossible count " + text::quote(word) + " of element " + text::quote(element.name),
        kExportAgain);
  element.count = static_cast<uint64_t>(count);
  return element;
}

Format parse_format(std::string_view line, const std::string& where) {
  const std::string_view name = text::take_word(line);
  if (name == "ascii") return Format::ascii;
  if (name == "binary_little_endian") return Format::little;
  if (name == "binary_big_endian") return Format::big;
  throw InputError(where, "unknown PLY format " + text::quote(name),
                   "use ascii or a binary format");
}

PlyHeader parse_header(text::Lines& lines, const std::string& path) {
  PlyHeader header;
  bool has_format = false;
  std::string_view line;
  lines.next(line);  // the magic word, checked by the caller
  while (lines.next(line)) {
    const std::string where = cat(path, ":", lines.number());
    const std::string_view word = text::take_word(line);
    if (word == "end_header") {
      if (!has_format) throw InputError(where, "the PLY header names no format", kExportAgain);
      return header;
    }
    if (word.empty() || word == "comment" || word == "obj_info") continue;
    if (word == "format") {
      header.format = parse_format(line, where);
      has_format = true;
    } else if (word == "element") {
      header.elements.push_back(parse_element(line, where));
    } else if (word == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(parse_property(line, where));
    } else {
      throw InputError(where, "unknown PLY header line " + text::quote(word), kExportAgain);
    }
  }
  throw InputError(path, "is cut short inside the PLY header", kExportAgain);
}

// ---- rows --------------------------------------------------------------------------------------

/// Gives the values of one element's rows, whatever the encoding.
class Rows {
 public:
  Rows(text::Lines& lines, const PlyHeader& header, const std::string& path)
      : lines_(lines), bytes_(lines.rest()), format_(header.format), path_(path) {}

  /// InputError if what is left of the file cannot hold the rows of the element.
  void begin(const Element& element) {
    element_ = &element;
    row_ = 0;
    uint64_t smallest = 0;
    for (const Property& p : element.properties)
      smallest += format_ == Format::ascii ? 2 : (p.count ? p.count : p.type)->bytes;
    const size_t left = format_ == Format::ascii ? lines_.rest().size() + 1 : bytes_.size();
    if (element.count > 0 && smallest == 0)
      throw InputError(path_, "element " + text::quote(element.name) + " has no properties",
                       kExportAgain);
    if (element.count > 0 && element.count > left / smallest) throw_short();
  }

  void begin_row() {
    ++row_;
    if (format_ != Format::ascii) return;
    do {
      if (!lines_.next(line_)) throw_short();
    } while (line_.find_first_not_of(" \t\r") == std::string_view::npos);
  }

  void end_row() {
    if (format_ == Format::ascii && !text::take_word(line_).empty())
      throw InputError(where(), "has more values than the header says", kExportAgain);
  }

  double next(const Number& type) {
    return format_ == Format::ascii ? next_word() : next_bytes(type);
  }

  /// Length of a list, checked against what is left.
  size_t next_length(const Property& property) {
    const double n = next(*property.count);
    const size_t left =
        format_ == Format::ascii ? line_.size() : bytes_.size() / property.type->bytes;
    if (!(n >= 0) || n != std::floor(n))
      throw InputError(where(), "a list has an impossible length", kExportAgain);
    if (n > static_cast<double>(left)) throw_short();
    return static_cast<size_t>(n);
  }

  std::string where() const {
    return format_ == Format::ascii ? cat(path_, ":", lines_.number())
                                    : cat(path_, ":", element_->name.substr(0, 40), " ", row_ - 1);
  }

 private:
  double next_word() {
    const std::string_view word = text::take_word(line_);
    double value = 0;
    if (word.empty())
      throw InputError(where(), "has fewer values than the header says", kExportAgain);
    if (!text::parse(word, value)) text::throw_no_number(word, where());
    return value;
  }

  double next_bytes(const Number& type) {
    if (bytes_.size() < type.bytes) throw_short();
    const double value = type.at(bytes_.data(), format_ == Format::big);
    bytes_.remove_prefix(type.bytes);
    return value;
  }

  [[noreturn]] void throw_short() const {
    throw InputError(path_,
                     cat("is cut short: element ", text::quote(element_->name), " should have ",
                         element_->count, " rows"),
                     kExportAgain);
  }

  text::Lines& lines_;
  std::string_view bytes_, line_;
  Format format_;
  const std::string& path_;
  const Element* element_ = nullptr;
  uint64_t row_ = 0;
};

void skip_property(Rows& rows, const Property& property) {
  const size_t n = property.count ? rows.next_length(property) : 1;
  for (size_t i = 0; i < n; ++i) rows.next(*property.type);
}

using Colours = std::vector<std::array<float, 4>>;

/// Where the property belongs in a colour, or -1.
int colour_channel(const Property& p) {
  static constexpr std::array<std::string_view, 4> kNames = {"red", "green", "blue", "alpha"};
  const auto at = std::find(kNames.begin(), kNames.end(), lower_case(p.name));
  return p.count || at == kNames.end() ? -1 : static_cast<int>(at - kNames.begin());
}

// ---- splats ------------------------------------------------------------------------------------

size_t property_named(const Element& element, std::string_view name) {
  for (size_t k = 0; k < element.properties.size(); ++k)
    if (element.properties[k].name == name && !element.properties[k].count) return k;
  return std::string::npos;
}

constexpr double kFaint = 0.1;  // an opacity below it nobody sees

/// Which of the splats nobody sees, one by one.
struct Faint {
  std::vector<bool> is;

  /// Leaves them out, unless they are nearly all; gives how many.
  size_t leave_out(Points& points) const {
    constexpr size_t kFewestSeen = 64;
    if (is.size() != points.size()) return 0;
    const auto faint = static_cast<size_t>(std::count(is.begin(), is.end(), true));
    if (points.size() - faint < kFewestSeen) return 0;
    size_t kept = 0;
    for (size_t i = 0; i < points.size(); ++i)
      if (!is[i]) points[kept++] = points[i];
    points.resize(kept);
    return faint;
  }
};

/// SuperSplat's: the box of the positions of so many splats.
struct Chunk {
  static constexpr uint64_t kSplats = 256;
  Vec3 low, high;
};

bool is_packed(const Element& element) {
  return property_named(element, "packed_position") != std::string::npos;
}

std::vector<Chunk> read_chunks(Rows& rows, const Element& element, const std::string& path) {
  std::array<size_t, 6> at{};
  const std::array<std::string_view, 6> names = {"min_x", "min_y", "min_z",
                                                 "max_x", "max_y", "max_z"};
  for (size_t k = 0; k < 6; ++k) {
    at[k] = property_named(element, names[k]);
    if (at[k] == std::string::npos)
      throw InputError(path, cat("its chunks do not have the property ", names[k]), kExportAgain);
  }
  std::vector<Chunk> out;
  std::vector<double> row(element.properties.size());
  for (uint64_t i = 0; i < element.count; ++i) {
    rows.begin_row();
    for (size_t k = 0; k < row.size(); ++k) {
      if (element.properties[k].count)
        skip_property(rows, element.properties[k]);
      else
        row[k] = rows.next(*element.properties[k].type);
    }
    rows.end_row();
    out.push_back({{row[at[0]], row[at[1]], row[at[2]]}, {row[at[3]], row[at[4]], row[at[5]]}});
  }
  return out;
}

/// Positions of 11, 10 and 11 bits in the box of their chunk; the lowest byte of the colour is the
/// opacity.
void read_packed(Rows& rows, const Element& element, const std::vector<Chunk>& chunks,
                 const std::string& path, const Vec3& origin, NonFinite how, Points& points,
                 Faint& faint) {
  const size_t position = property_named(element, "packed_position");
  const size_t colour = property_named(element, "packed_color");
  if (element.count > Chunk::kSplats * chunks.size())
    throw InputError(path, "has fewer chunks than its packed splats need", kExportAgain);
  for (uint64_t i = 0; i < element.count; ++i) {
    rows.begin_row();
    uint32_t place = 0, rgba = 0xFF;
    for (size_t k = 0; k < element.properties.size(); ++k) {
      const Property& property = element.properties[k];
      if (k != position && k != colour) {
        skip_property(rows, property);
        continue;
      }
      const double value = rows.next(*property.type);
      if (!(value >= 0 && value < 4294967296.0) || value != std::floor(value))
        throw InputError(rows.where(), "a packed number is out of range", kExportAgain);
      (k == position ? place : rgba) = static_cast<uint32_t>(value);
    }
    rows.end_row();
    const Vec3 share((place >> 21) / 2047.0, ((place >> 11) & 1023) / 1023.0,
                     (place & 2047) / 2047.0);
    const Chunk& chunk = chunks[i / Chunk::kSplats];
    const Vec3 at = chunk.low + share.cwiseProduct(chunk.high - chunk.low) - origin;
    Point point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = text::coordinate(
          at[axis], [&] { return rows.where(); }, how);
    points.push_back(point);
    faint.is.push_back((rgba & 255) / 255.0 < kFaint);
  }
}

/// Where the opacity of splats stands, a number before the sigmoid; npos: these are none.
size_t opacity_of(const Element& element) {
  for (const std::string_view mark : {"f_dc_0", "scale_0", "rot_0"})
    if (property_named(element, mark) != std::string::npos)
      return property_named(element, "opacity");
  return std::string::npos;
}

void read_vertices(Rows& rows, const Element& element, const std::string& path, const Vec3& origin,
                   NonFinite how, Points& points, Colours* colours, Faint& faint) {
  std::array<int, 3> axis_seen = {0, 0, 0};
  std::vector<int> axis_of;  // for each property: 0, 1, 2 or -1
  for (const Property& p : element.properties) {
    const size_t axis = p.count ? std::string::npos : std::string("xyz").find(lower_case(p.name));
    axis_of.push_back(p.name.size() == 1 && axis < 3 ? static_cast<int>(axis) : -1);
    if (axis_of.back() >= 0) ++axis_seen[axis_of.back()];
  }
  if (axis_seen != std::array<int, 3>{1, 1, 1})
    throw InputError(path, "the vertices do not have the properties x, y and z", kExportAgain);
  std::vector<int> channel_of;
  int coloured = 0;
  for (const Property& p : element.properties) {
    channel_of.push_back(colours == nullptr ? -1 : colour_channel(p));
    if (channel_of.back() >= 0 && channel_of.back() < 3) coloured |= 1 << channel_of.back();
  }
  const size_t opacity = opacity_of(element);
  points.reserve(points.size() + element.count);
  for (uint64_t i = 0; i < element.count; ++i) {
    rows.begin_row();
    Point point = Point::Zero();
    std::array<float, 4> colour = {1, 1, 1, 1};
    for (size_t k = 0; k < axis_of.size(); ++k) {
      const Property& property = element.properties[k];
      if (coloured == 7 && channel_of[k] >= 0) {
        const double whole = !property.type->integer ? 1 : property.type->bytes == 1 ? 255 : 65535;
        colour[static_cast<size_t>(channel_of[k])] =
            static_cast<float>(std::clamp(rows.next(*property.type) / whole, 0.0, 1.0));
      } else if (k == opacity)
        faint.is.push_back(1 / (1 + std::exp(-rows.next(*property.type))) < kFaint);
      else if (axis_of[k] < 0)
        skip_property(rows, property);
      else
        point[axis_of[k]] = text::coordinate(
            rows.next(*element.properties[k].type) - origin[axis_of[k]],
            [&] { return rows.where(); }, how);
    }
    rows.end_row();
    points.push_back(point);
    if (coloured == 7) colours->push_back(colour);
  }
}

/// Indices are kept as they stand (checked to fit); the range is checked when all vertices are
/// known.
void read_faces(Rows& rows, const Element& element, std::vector<Triangle>& faces) {
  std::vector<int32_t> corners;
  for (uint64_t i = 0; i < element.count; ++i) {
    rows.begin_row();
    for (const Property& p : element.properties) {
      if (!p.count || (p.name != "vertex_indices" && p.name != "vertex_index")) {
        skip_property(rows, p);
        continue;
      }
      const size_t n = rows.next_length(p);
      corners.clear();
      for (size_t k = 0; k < n; ++k) {
        const double index = rows.next(*p.type);
        if (!(index >= 0 && index < 2147483648.0) || index != std::floor(index))
          throw InputError(rows.where(), "a face index is out of range", kExportAgain);
        corners.push_back(static_cast<int32_t>(index));
      }
      text::add_fan(corners, n, faces);
    }
    rows.end_row();
  }
}

/// Strips of triangles, each begun anew behind -1; every second triangle of a strip is turned over.
void read_strips(Rows& rows, const Element& element, std::vector<Triangle>& faces) {
  for (uint64_t i = 0; i < element.count; ++i) {
    rows.begin_row();
    for (const Property& p : element.properties) {
      if (!p.count || (p.name != "vertex_indices" && p.name != "vertex_index")) {
        skip_property(rows, p);
        continue;
      }
      const size_t n = rows.next_length(p);
      size_t length = 0;  // of the strip so far
      Triangle last{};    // its last three corners
      for (size_t k = 0; k < n; ++k) {
        const double index = rows.next(*p.type);
        if (!(index >= -1 && index < 2147483648.0) || index != std::floor(index))
          throw InputError(rows.where(), "an index of a strip is out of range", kExportAgain);
        length = index < 0 ? 0 : length + 1;
        if (index < 0) continue;
        last = {last[1], last[2], static_cast<int32_t>(index)};
        const bool flat = last[0] == last[1] || last[1] == last[2] || last[0] == last[2];
        if (length < 3 || flat) continue;
        faces.push_back(length % 2 == 1 ? last : Triangle{last[1], last[0], last[2]});
      }
    }
    rows.end_row();
  }
}

}  // namespace

Mesh parse_ply(std::string_view content, const std::string& path, const Vec3& origin, NonFinite how,
               Colours* colours, size_t* faint) {
  text::Lines lines(content);
  const PlyHeader header = parse_header(lines, path);
  Rows rows(lines, header, path);
  Mesh mesh;
  Faint unseen;
  std::vector<Chunk> chunks;
  const bool packed =
      std::any_of(header.elements.begin(), header.elements.end(),
                  [](const Element& e) { return e.name == "vertex" && is_packed(e); });
  for (const Element& element : header.elements) {
    rows.begin(element);
    if (element.name == "chunk" && packed) {
      chunks = read_chunks(rows, element, path);
    } else if (element.name == "vertex" && packed) {
      read_packed(rows, element, chunks, path, origin, how, mesh.vertices, unseen);
    } else if (element.name == "vertex") {
      read_vertices(rows, element, path, origin, how, mesh.vertices, colours, unseen);
    } else if (element.name == "tristrips") {
      read_strips(rows, element, mesh.faces);
    } else if (element.name == "face") {
      read_faces(rows, element, mesh.faces);
    } else {
      for (uint64_t i = 0; i < element.count; ++i) {
        rows.begin_row();
        for (const Property& p : element.properties) skip_property(rows, p);
        rows.end_row();
      }
    }
  }
  if (faint != nullptr) *faint = mesh.faces.empty() ? unseen.leave_out(mesh.vertices) : 0;
  return mesh;
}

}  // namespace restage
