// PCD files of the Point Cloud Library.
#include <array>

#include "datasets/readers/clouds/mesh_parsers.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/numbers.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

const char* const kSaveCloud = "save the cloud again";
constexpr size_t kMaxFields = 256;
constexpr uint64_t kMaxPoints = uint64_t{1} << 32;
constexpr uint64_t kMaxCount = 1 << 16;

struct Field {
  std::string name;
  uint64_t size = 4, count = 1;
  char type = 'F';
  uint64_t bytes() const { return size * count; }
};

struct PcdHeader {
  std::vector<Field> fields;
  uint64_t width = 0, height = 1, points = 0;
  bool has_points = false;
  std::string data;              ///< ascii, binary or binary_compressed
  std::array<size_t, 3> axis{};  ///< which field is x, y, z
  uint64_t row() const {
    uint64_t out = 0;
    for (const Field& field : fields) out += field.bytes();
    return out;
  }
};

/// The kind of number of a field; null for one that PCD does not have.
const Number* number_of(const Field& field) {
  struct Named {
    char type;
    const Number* number;
  };
  static constexpr Named kNames[] = {{'F', &kNumber<float>},    {'F', &kNumber<double>},
                                     {'I', &kNumber<int8_t>},   {'I', &kNumber<int16_t>},
                                     {'I', &kNumber<int32_t>},  {'I', &kNumber<int64_t>},
                                     {'U', &kNumber<uint8_t>},  {'U', &kNumber<uint16_t>},
                                     {'U', &kNumber<uint32_t>}, {'U', &kNumber<uint64_t>}};
  for (const Named& known : kNames)
    if (known.type == field.type && known.number->bytes == field.size) return known.number;
  return nullptr;
}

// ---- header ------------------------------------------------------------------------------------

class HeaderParser {
 public:
  HeaderParser(text::Lines& lines, const std::string& path) : lines_(lines), path_(path) {}

  PcdHeader parse() {
    std::string_view line;
    while (out_.data.empty()) {
      if (!lines_.next(line))
        throw InputError(path_, "is cut short inside the PCD header", kSaveCloud);
      entry(line);
    }
    return checked();
  }

 private:
  std::string where() const { return cat(path_, ":", lines_.number()); }

  void entry(std::string_view line) {
    const std::string key = lower_case(text::take_word(line));
    if (key == "fields" || key == "columns") {
      for (auto word = text::take_word(line); !word.empty(); word = text::take_word(line)) {
        out_.fields.emplace_back().name = lower_case(word);
        if (out_.fields.size() > kMaxFields)
          throw InputError(where(), "has too many fields", kSaveCloud);
      }
    } else if (key == "size") {
      for (Field& field : out_.fields) field.size = number(line, 8);
    } else if (key == "count") {
      for (Field& field : out_.fields) field.count = number(line, kMaxCount);
    } else if (key == "type") {
      for (Field& field : out_.fields) {
        const std::string_view word = text::take_word(line);
        field.type = word.size() == 1
                         ? static_cast<char>(std::toupper(static_cast<unsigned char>(word[0])))
                         : '?';
      }
    } else if (key == "width") {
      out_.width = number(line, kMaxPoints);
    } else if (key == "height") {
      out_.height = number(line, kMaxPoints);
    } else if (key == "points") {
      out_.points = number(line, kMaxPoints);
      out_.has_points = true;
    } else if (key == "data") {
      out_.data = lower_case(text::take_word(line));
      if (out_.data.empty()) throw InputError(where(), "DATA names no format", kSaveCloud);
    }  // VERSION, VIEWPOINT, comments
  }

  uint64_t number(std::string_view& line, uint64_t most) const {
    const std::string_view word = text::take_word(line);
    int64_t value = 0;
    if (!text::parse(word, value) || value < 0 || static_cast<uint64_t>(value) > most)
      throw InputError(where(), text::quote(word) + " is no usable count", kSaveCloud);
    return static_cast<uint64_t>(value);
  }

  PcdHeader checked() {
    if (!out_.has_points)
      out_.points = out_.height > 0 && out_.width > kMaxPoints / out_.height
                        ? kMaxPoints
                        : out_.width * out_.height;
    for (size_t axis = 0; axis < 3; ++axis) {
      const std::string name(1, "xyz"[axis]);
      size_t found = 0;
      while (found < out_.fields.size() && out_.fields[found].name != name) ++found;
      if (found == out_.fields.size())
        throw InputError(path_, "has no field " + name, "save the cloud with x, y and z");
      if (number_of(out_.fields[found]) == nullptr || out_.fields[found].count != 1)
        throw InputError(path_, "its field " + name + " is no single number", kSaveCloud);
      out_.axis[axis] = found;
    }
    if (out_.data != "ascii" && out_.data != "binary" && out_.data != "binary_compressed")
      throw InputError(path_, "has DATA " + text::quote(out_.data),
                       "save it as ascii, binary or binary_compressed");
    return std::move(out_);
  }

  text::Lines& lines_;
  const std::string& path_;
  PcdHeader out_;
};

// ---- points ------------------------------------------------------------------------------------

[[noreturn]] void throw_short(const std::string& path, const PcdHeader& header) {
  throw InputError(path, cat("is cut short: it should have ", header.points, " points"),
                   kSaveCloud);
}

/// LZF, which PCL packs with: literals of up to 32 bytes, and copies of up to 264 bytes from at
/// most 8 KiB back. InputError unless exactly `size` bytes come out.
std::string unpack_lzf(std::string_view in, uint64_t size, const std::string& path) {
  const auto damaged = [&]() -> InputError {
    return InputError(path, "is damaged: its packed points make no sense", kSaveCloud);
  };
  if (size / 100 > in.size()) throw damaged();  // three bytes make at most 264
  std::string out;
  out.reserve(size);
  const auto byte = [&](size_t at) {
    return static_cast<size_t>(static_cast<unsigned char>(in[at]));
  };
  for (size_t at = 0; at < in.size();) {
    const size_t control = byte(at++);
    if (control < 32) {
      const size_t n = control + 1;
      if (n > in.size() - at || n > size - out.size()) throw damaged();
      out.append(in.substr(at, n));
      at += n;
      continue;
    }
    size_t length = control >> 5;
    if (length == 7) {
      if (at == in.size()) throw damaged();
      length += byte(at++);
    }
    length += 2;
    if (at == in.size()) throw damaged();
    const size_t back = ((control & 31) << 8 | byte(at++)) + 1;
    if (back > out.size() || length > size - out.size()) throw damaged();
    for (size_t i = 0; i < length; ++i) out += out[out.size() - back];
  }
  if (out.size() != size) throw damaged();
  return out;
}

struct Reading {
  const std::string& path;
  const Vec3& origin;
  NonFinite how;
  void add(const Vec3& value, uint64_t index, Points& points) const {
    Point point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = text::coordinate(
          value[axis] - origin[axis], [&] { return cat(path, ": point ", index); }, how);
    points.push_back(point);
  }
};

/// Numbers of `bytes`: field f of point i stands at start[f] + i * step[f].
void read_binary(std::string_view bytes, const PcdHeader& header,
                 const std::vector<uint64_t>& start, const std::vector<uint64_t>& step,
                 const Reading& reading, Points& points) {
  for (uint64_t i = 0; i < header.points; ++i) {
    Vec3 value;
    for (int axis = 0; axis < 3; ++axis) {
      const size_t f = header.axis[static_cast<size_t>(axis)];
      value[axis] = number_of(header.fields[f])->at(bytes.data() + start[f] + i * step[f], false);
    }
    reading.add(value, i, points);
  }
}

void read_packed(std::string_view bytes, const PcdHeader& header, bool packed,
                 const Reading& reading, Points& points) {
  const uint64_t row = header.row();
  std::string unpacked;
  if (packed) {
    if (bytes.size() < 8) throw_short(reading.path, header);
    const auto length = static_cast<uint64_t>(number_at<uint32_t>(bytes.data()));
    const auto size = static_cast<uint64_t>(number_at<uint32_t>(bytes.data() + 4));
    if (length > bytes.size() - 8) throw_short(reading.path, header);
    if (size != row * header.points)
      throw InputError(reading.path, "is damaged: its size is not that of its points", kSaveCloud);
    unpacked = unpack_lzf(bytes.substr(8, length), size, reading.path);
    bytes = unpacked;
  }
  if (header.points > bytes.size() / row) throw_short(reading.path, header);
  std::vector<uint64_t> start, step;
  uint64_t at = 0;
  for (const Field& field : header.fields) {  // packed: field after field, else point after point
    start.push_back(at);
    step.push_back(packed ? field.bytes() : row);
    at += packed ? field.bytes() * header.points : field.bytes();
  }
  read_binary(bytes, header, start, step, reading, points);
}

void read_ascii(text::Lines& lines, const PcdHeader& header, const Reading& reading,
                Points& points) {
  uint64_t words = 0;
  std::vector<uint64_t> first;
  for (const Field& field : header.fields) {
    first.push_back(words);
    words += field.count;
  }
  if (header.points > lines.rest().size() / 5 + 1) throw_short(reading.path, header);  // "0 0 0"
  std::string_view line;
  for (uint64_t i = 0; i < header.points;) {
    if (!lines.next(line)) throw_short(reading.path, header);
    const std::string where = cat(reading.path, ":", lines.number());
    Vec3 value = Vec3::Zero();
    uint64_t k = 0;
    for (auto word = text::take_word(line); !word.empty(); word = text::take_word(line), ++k)
      for (int axis = 0; axis < 3; ++axis)
        if (first[header.axis[static_cast<size_t>(axis)]] == k && !text::parse(word, value[axis]))
          text::throw_no_number(word, where);
    if (k == 0) continue;  // an empty line
    if (k != words)
      throw InputError(where, cat("has ", k, " values, the header says ", words), kSaveCloud);
    reading.add(value, i++, points);
  }
}

}  // namespace

bool starts_as_pcd(std::string_view content) {
  text::Lines lines(content.substr(0, 4096));
  std::string_view line;
  while (lines.next(line)) {
    const std::string_view word = text::take_word(line);
    if (word.empty()) continue;
    if (word == "VERSION" || word == "FIELDS" || word == "COLUMNS") return true;
    if (word[0] != '#') return false;
    if (word == "#" && text::take_word(line) == ".PCD") return true;
  }
  return false;
}

Mesh parse_pcd(std::string_view content, const std::string& path, const Vec3& origin,
               NonFinite how) {
  text::Lines lines(content);
  const PcdHeader header = HeaderParser(lines, path).parse();
  const Reading reading{path, origin, how};
  Mesh out;
  if (header.data == "ascii")
    read_ascii(lines, header, reading, out.vertices);
  else if (header.points > 0)
    read_packed(lines.rest(), header, header.data == "binary_compressed", reading, out.vertices);
  return out;
}

}  // namespace restage
