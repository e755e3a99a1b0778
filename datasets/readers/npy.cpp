#include "datasets/readers/npy.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "autograd/base/error.h"
#include "datasets/readers/text.h"

namespace restage {
namespace {

constexpr size_t kMaxHeader = 1 << 16;
constexpr size_t kMaxAxes = 32;
constexpr const char* kAgain = "save it again with numpy.save or savez";

/// The header's Python literal, {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }.
class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& where) : rest_(text), where_(where) {}

  NpyHeader parse() {
    expect('{');
    while (!accept('}')) {
      const std::string key = quoted();
      expect(':');
      value_of(key);
      if (!accept(',') && peek() != '}') fail();
    }
    skip_blanks();
    if (!rest_.empty() || !has_type_ || !has_order_ || !has_shape_) fail();
    return out_;
  }

 private:
  [[noreturn]] void fail() const { throw InputError(where_, "has no readable NPY header", kAgain); }
  void skip_blanks() {
    while (!rest_.empty() && (rest_[0] == ' ' || rest_[0] == '\n')) rest_.remove_prefix(1);
  }
  char peek() {
    skip_blanks();
    return rest_.empty() ? '\0' : rest_[0];
  }
  bool accept(char c) {
    if (peek() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void expect(char c) {
    if (!accept(c)) fail();
  }
  bool accept_word(std::string_view word) {
    skip_blanks();
    if (!rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }
  std::string quoted() {
    const char mark = peek();
    if (mark != '\'' && mark != '"') fail();
    const size_t end = rest_.find(mark, 1);
    if (end == std::string_view::npos) fail();
    std::string out(rest_.substr(1, end - 1));
    rest_.remove_prefix(end + 1);
    return out;
  }
  void value_of(const std::string& key) {
    if (key == "descr" && !has_type_) {
      read_type();
      has_type_ = true;
    } else if (key == "fortran_order" && !has_order_) {
      out_.fortran = accept_word("True");
      if (!out_.fortran && !accept_word("False")) fail();
      has_order_ = true;
    } else if (key == "shape" && !has_shape_) {
      read_shape();
      has_shape_ = true;
    } else {
      fail();
    }
  }
  void read_shape() {
    expect('(');
    while (!accept(')')) {
      peek();
      size_t digits = 0;
      while (digits < rest_.size() && rest_[digits] >= '0' && rest_[digits] <= '9') ++digits;
      int64_t length = 0;
      if (!text::parse(rest_.substr(0, digits), length) || out_.shape.size() == kMaxAxes) fail();
      out_.shape.push_back(length);
      rest_.remove_prefix(digits);
      accept('L');  // as Python 2 wrote it
      if (!accept(',') && peek() != ')') fail();
    }
  }
  void read_type();

  std::string_view rest_;
  const std::string& where_;
  NpyHeader out_;
  bool has_type_ = false, has_order_ = false, has_shape_ = false;
};

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

void HeaderParser::read_type() {
  if (peek() == '[' || peek() == '(')
    throw InputError(where_, "holds records (a structured array)", "save each field by itself");
  const std::string type = quoted();
  const size_t at = !type.empty() && std::strchr("<>|=", type[0]) != nullptr ? 1 : 0;
  const std::string digits = type.substr(std::min(type.size(), at + 1));
  if (type.size() > at && type[at] == 'O')
    throw InputError(where_,
                     "holds Python objects (a pickle), which are never read: they can run code",
                     "save plain numbers (docs/data.md shows how)");
  int64_t width = 0;
  if (type.size() <= at || !text::parse(digits, width) || width < 0 || width > (1 << 16)) fail();
  out_.kind = type[at];
  out_.big_endian = type[0] == '>';
  out_.width = static_cast<size_t>(width) * (out_.kind == 'U' ? 4 : 1);
  out_.type = number_of(out_.kind, out_.width);
  if (out_.type == nullptr && !out_.is_text())
    throw InputError(where_,
                     "holds values of the type " + text::quote(type) + ", which is not read",
                     "save it as float32, float64 or whole numbers");
}

void count_elements(NpyHeader& header, const std::string& where) {
  uint64_t count = 1;
  constexpr uint64_t kMost = uint64_t{1} << 44;  // times the widest element: below 2^64
  for (const int64_t length : header.shape) {
    const auto n = static_cast<uint64_t>(length);
    if (n != 0 && count > kMost / n)
      throw InputError(where, "claims the impossible shape " + shape_text(header.shape), kAgain);
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

NpyHeader read_npy_header(ByteStream& in) {
  char magic[8];
  if (in.left() >= sizeof magic) in.read(magic, sizeof magic);
  if (in.size() < sizeof magic || std::memcmp(magic, "\x93NUMPY", 6) != 0)
    throw InputError(in.where(), "is no NPY array", kAgain);
  const int version = magic[6];
  if (version < 1 || version > 3 || magic[7] != 0)
    throw InputError(in.where(), "is of an unknown version of NPY", kAgain);
  unsigned char length[4] = {0, 0, 0, 0};
  in.read(reinterpret_cast<char*>(length), version == 1 ? 2 : 4);
  const size_t n = length[0] | length[1] << 8 | length[2] << 16 | size_t{length[3]} << 24;
  if (n > kMaxHeader) throw InputError(in.where(), "has no readable NPY header", kAgain);
  std::string text(n, '\0');
  in.read(text.data(), n);
  NpyHeader out = HeaderParser(text, in.where()).parse();
  count_elements(out, in.where());
  if (out.bytes() != in.left())
    throw InputError(
        in.where(),
        "should hold " + std::to_string(out.bytes()) + " bytes for its shape " +
            shape_text(out.shape) + ", but holds " + std::to_string(in.left()),
        in.left() < out.bytes() ? "it is cut short: copy it again" : "save one array a file");
  return out;
}

NpyArray::NpyArray(ByteStream& in, uint64_t max_memory)
    : header_(read_npy_header(in)), where_(in.where()) {
  if (header_.bytes() > max_memory)
    throw InputError(where_,
                     "takes " + std::to_string(header_.bytes()) + " bytes, more than the " +
                         std::to_string(max_memory) + " allowed",
                     "allow more with --max-memory");
  bytes_ = in.take(header_.bytes());
}

double NpyArray::operator[](int64_t i) const {
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
  return header_.number(bytes_.data() + static_cast<size_t>(i) * header_.width);
}

std::vector<double> NpyArray::finite() const {
  std::vector<double> out(static_cast<size_t>(header_.count));
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = (*this)[static_cast<int64_t>(i)];
    if (!std::isfinite(out[i]))
      throw InputError(where_,
                       "holds " + std::string(std::isnan(out[i]) ? "NaN" : "infinity") +
                           " at element " + std::to_string(i),
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
  std::string out = "[";
  for (size_t i = 0; i < shape.size() && i < 8; ++i)
    out += (i > 0 ? ", " : "") + std::to_string(shape[i]);
  return out + (shape.size() > 8 ? ", ...]" : "]");
}

}  // namespace restage
