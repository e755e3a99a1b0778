#include "datasets/readers/arrays/npy.h"

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "autograd/base/words.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

using Json = nlohmann::json;

constexpr size_t kMaxHeader = 1 << 16;
constexpr size_t kMaxAxes = 32;
constexpr const char* kSaveWithNumpy = "save it again with numpy.save or savez";

[[noreturn]] void unreadable(const std::string& where) {
  throw InputError(where, "has no readable NPY header", kSaveWithNumpy);
}

/// The header's Python literal, {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }, as
/// JSON: brackets for tuples, no comma behind the last item, no "L" as Python 2 wrote it.
std::string json_of(std::string_view literal) {
  std::string out;
  char quote = 0;
  for (const char c : literal) {
    if (c == quote || (quote == 0 && (c == '\'' || c == '"'))) {
      quote = quote == 0 ? c : '\0';
      out += '"';
    } else if (quote != 0) {
      out += c;
    } else if (c == ')' || c == ']' || c == '}') {
      out.resize(out.find_last_not_of(" \n") + 1);
      if (out.ends_with(',')) out.pop_back();
      out += c == ')' ? ']' : c;
    } else if (c == 'T' || c == 'F') {
      out += c == 'T' ? 't' : 'f';
    } else if (c != 'L') {
      out += c == '(' ? '[' : c;
    }
  }
  return out;
}

/// The kind of number that numpy names so; null for another.
const Number* number_of(char kind, size_t width) {
  struct Named {
    char kind;
    const Number* type;
  };
  static constexpr Named kNames[] = {
      {'b', &kNumber<uint8_t>},  {'i', &kNumber<int8_t>},      {'i', &kNumber<int16_t>},
      {'i', &kNumber<int32_t>},  {'i', &kNumber<int64_t>},     {'u', &kNumber<uint8_t>},
      {'u', &kNumber<uint16_t>}, {'u', &kNumber<uint32_t>},    {'u', &kNumber<uint64_t>},
      {'f', &kNumber<float>},    {'f', &kNumber<Eigen::half>}, {'f', &kNumber<double>}};
  for (const Named& known : kNames)
    if (kind == known.kind && width == known.type->bytes) return known.type;
  return nullptr;
}

void read_type(const std::string& type, const std::string& where, NpyHeader& out) {
  const size_t at = !type.empty() && std::strchr("<>|=", type[0]) != nullptr ? 1 : 0;
  const std::string digits = type.substr(std::min(type.size(), at + 1));
  if (type.size() > at && type[at] == 'O') {
    out.is_object = true;
    out.kind = 'O';
    out.width = 0;
    return;
  }
  int64_t width = 0;
  if (type.size() <= at || !text::parse(digits, width) || width < 0 || width > (1 << 16))
    unreadable(where);
  out.kind = type[at];
  out.big_endian = type[0] == '>';
  out.width = static_cast<size_t>(width) * (out.kind == 'U' ? 4 : 1);
  out.type = number_of(out.kind, out.width);
  if (out.type == nullptr && !out.is_text())
    throw InputError(where,
                     cat("holds values of the type ", text::quote(type), ", which is not read"),
                     "save it as float32, float64 or whole numbers");
}

/// Records of points, [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ...], are columns where x, y and z
/// come first, in one type, and all fields are as wide. Gives their number; others are refused.
int64_t read_record(const Json& fields, const std::string& where, NpyHeader& out) {
  std::vector<std::string> names;
  bool simple = true;
  for (const Json& field : fields) {
    names.push_back(field.at(0).is_array() ? field.at(0).at(1) : field.at(0));
    simple = simple && field.size() == 2 && field.at(1).is_string();
  }
  const auto is_axis = [&](size_t i, const char* name, const char* capital) {
    return fields.at(i).at(0) == name || fields.at(i).at(0) == capital;
  };
  const bool points = simple && fields.size() >= 3 && is_axis(0, "x", "X") &&
                      is_axis(1, "y", "Y") && is_axis(2, "z", "Z") &&
                      fields[0][1] == fields[1][1] && fields[0][1] == fields[2][1];
  bool columns = points;
  if (points) read_type(fields[0][1], where, out);
  for (size_t i = 3; columns && i < fields.size(); ++i) {
    const std::string type = fields[i][1];
    int64_t width = 0;
    columns = type.size() > 2 && text::parse(std::string_view(type).substr(2), width) &&
              width == static_cast<int64_t>(out.width);
  }
  if (!columns)
    throw InputError(where, cat("holds records of the fields ", joined(names).substr(0, 200)),
                     "save the points alone, numpy.stack([a['x'], a['y'], a['z']], -1), with your "
                     "fields' names");
  return std::ssize(fields);
}

NpyHeader parse_header(std::string_view text, const std::string& where) {
  NpyHeader out;
  try {
    const Json json = Json::parse(json_of(text));
    const Json& type = json.at("descr");
    const int64_t fields = type.is_array() ? read_record(type, where, out) : 0;
    if (fields == 0) read_type(type.get<std::string>(), where, out);
    out.fortran = json.at("fortran_order").get<bool>();
    const Json& shape = json.at("shape");
    if (!shape.is_array() || shape.size() > kMaxAxes || json.size() != 3) unreadable(where);
    for (const Json& length : shape) {
      if (!length.is_number_unsigned() || length.get<uint64_t>() > INT64_MAX) unreadable(where);
      out.shape.push_back(length.get<int64_t>());
    }
    if (fields > 0) out.shape.push_back(fields);
  } catch (const Json::exception&) {
    unreadable(where);
  }
  return out;
}

void count_elements(NpyHeader& header, const std::string& where) {
  uint64_t count = 1;
  constexpr uint64_t kMost = uint64_t{1} << 44;  // times the widest element: below 2^64
  for (const int64_t length : header.shape) {
    const auto n = static_cast<uint64_t>(length);
    if (n != 0 && count > kMost / n)
      throw InputError(where, "claims the impossible shape " + shape_text(header.shape),
                       kSaveWithNumpy);
    count *= n;
  }
  header.count = static_cast<int64_t>(count);
}

void add_utf8(std::string& out, uint32_t code) {
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xc0 | (code >> 6));
    out += static_cast<char>(0x80 | (code & 63));
  } else if (code < 0x10000) {
    out += static_cast<char>(0xe0 | (code >> 12));
    out += static_cast<char>(0x80 | ((code >> 6) & 63));
    out += static_cast<char>(0x80 | (code & 63));
  } else if (code < 0x110000) {
    out += static_cast<char>(0xf0 | (code >> 18));
    out += static_cast<char>(0x80 | ((code >> 12) & 63));
    out += static_cast<char>(0x80 | ((code >> 6) & 63));
    out += static_cast<char>(0x80 | (code & 63));
  } else {
    out += '?';
  }
}

}  // namespace

NpyHeader npy_header_of(const std::string& type, const std::vector<int64_t>& shape,
                        const std::string& where) {
  NpyHeader out;
  read_type(type, where, out);
  if (shape.size() > kMaxAxes ||
      std::any_of(shape.begin(), shape.end(), [](auto n) { return n < 0; }))
    throw InputError(where, "claims the impossible shape " + shape_text(shape), kSaveWithNumpy);
  out.shape = shape;
  count_elements(out, where);
  return out;
}

NpyHeader read_npy_header(ByteStream& in, bool objects) {
  char magic[8];
  if (in.left() >= sizeof magic) in.read(magic, sizeof magic);
  if (in.size() < sizeof magic || std::memcmp(magic, "\x93NUMPY", 6) != 0)
    throw InputError(in.where(), "is no NPY array", kSaveWithNumpy);
  const int version = magic[6];
  if (version < 1 || version > 3 || magic[7] != 0)
    throw InputError(in.where(), "is of an unknown version of NPY", kSaveWithNumpy);
  unsigned char length[4] = {0, 0, 0, 0};
  in.read(reinterpret_cast<char*>(length), version == 1 ? 2 : 4);
  const size_t n = length[0] | length[1] << 8 | length[2] << 16 | size_t{length[3]} << 24;
  if (n > kMaxHeader) unreadable(in.where());
  std::string text(n, '\0');
  in.read(text.data(), n);
  NpyHeader out = parse_header(text, in.where());
  count_elements(out, in.where());
  if (out.is_object && objects) return out;
  if (out.is_object)
    throw InputError(in.where(), "holds Python objects (a pickle) and no array of numbers",
                     "save plain numbers (docs/formats.md shows how)");
  if (out.bytes() != in.left())
    throw InputError(
        in.where(),
        cat("should hold ", out.bytes(), " bytes for its shape ", shape_text(out.shape),
            ", but holds ", in.left()),
        in.left() < out.bytes() ? "it is cut short: copy it again" : "save one array a file");
  return out;
}

NpyArray::NpyArray(ByteStream& in, uint64_t max_memory)
    : header_(read_npy_header(in)), where_(in.where()) {
  if (header_.bytes() > max_memory)
    throw InputError(
        where_, cat("takes ", header_.bytes(), " bytes, more than the ", max_memory, " allowed"),
        "allow more with {max-memory}");
  bytes_ = in.take(header_.bytes());
}

NpyArray::NpyArray(NpyHeader header, std::vector<char> bytes, std::string where)
    : header_(std::move(header)), bytes_(std::move(bytes)), where_(std::move(where)) {
  if (bytes_.size() != header_.bytes())
    throw InputError(where_,
                     cat("should hold ", header_.bytes(), " bytes for its shape ",
                         shape_text(header_.shape), ", but holds ", bytes_.size()),
                     "it is damaged: copy or save it again");
}

size_t NpyArray::place(int64_t i) const {
  if (header_.fortran) {  // from the last axis, the fastest in C order, to the first
    int64_t rest = i, stride = header_.count;
    i = 0;
    for (size_t axis = header_.shape.size(); axis-- > 0;) {
      const int64_t n = header_.shape[axis];
      stride /= n;
      i += rest % n * stride;
      rest /= n;
    }
  }
  return static_cast<size_t>(i) * header_.width;
}

std::vector<char> NpyArray::in_order() const {
  if (!header_.fortran) return bytes_;
  std::vector<char> out(bytes_.size());
  for (int64_t i = 0; i < header_.count; ++i)
    std::memcpy(out.data() + static_cast<size_t>(i) * header_.width, bytes_.data() + place(i),
                header_.width);
  return out;
}

NpyArray NpyArray::part(int64_t i) const {
  NpyHeader header = header_;
  header.fortran = false;
  header.shape.erase(header.shape.begin());
  header.count = header_.count / header_.shape[0];
  std::vector<char> bytes(header.bytes());
  for (int64_t k = 0; k < header.count; ++k)
    std::memcpy(bytes.data() + static_cast<size_t>(k) * header.width,
                bytes_.data() + place(i * header.count + k), header.width);
  return {header, std::move(bytes), where_};
}

bool NpyArray::is_shaped(const std::vector<int64_t>& wanted) const {
  return !is_text() &&
         std::equal(wanted.begin(), wanted.end(), shape().begin(), shape().end(),
                    [](int64_t want, int64_t length) { return want < 0 || want == length; });
}

double NpyArray::operator[](int64_t i) const { return header_.number(bytes_.data() + place(i)); }

std::vector<double> NpyArray::finite() const {
  std::vector<double> out(static_cast<size_t>(header_.count));
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = (*this)[static_cast<int64_t>(i)];
    if (!std::isfinite(out[i]))
      throw InputError(where_,
                       cat("holds ", std::isnan(out[i]) ? "NaN" : "infinity", " at element ", i),
                       "store finite numbers");
  }
  return out;
}

std::string NpyArray::text(int64_t i) const {
  if (!is_text() || i >= header_.count) return "";
  const char* element = bytes_.data() + static_cast<size_t>(i) * header_.width;
  std::string out;
  if (header_.kind == 'S') out.assign(element, header_.width);
  for (size_t at = 0; header_.kind == 'U' && at < header_.width; at += 4)
    add_utf8(out, static_cast<uint32_t>(number_at<uint32_t>(element + at, header_.big_endian)));
  while (!out.empty() && out.back() == '\0') out.pop_back();
  return out;
}

NpyArray read_npy(const std::string& path, uint64_t max_memory) {
  FileStream in(path);
  return NpyArray(in, max_memory);
}

std::string shape_text(const std::vector<int64_t>& shape) {
  const std::span<const int64_t> first(shape.data(), std::min<size_t>(shape.size(), 8));
  return cat("[", joined(first), shape.size() > 8 ? ", ...]" : "]");
}

}  // namespace restage
