#include "nn/weights/safetensors.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;

// The limit of the format's reference implementation.
constexpr uint64_t kHeaderLimit = 100'000'000;
constexpr int kMostNumbers = 64;  // of a list in the header
constexpr uint64_t kMostElements = uint64_t{1} << 48;
constexpr uint64_t kLargest = std::numeric_limits<int64_t>::max();
constexpr const char* kGiveUndamaged = "give an undamaged safetensors file";

static_assert(std::endian::native == std::endian::little, "the format is little-endian");

enum class Coding { f32, f64, i32, i64, f16, bf16 };
struct Kind {
  const char* name;
  Coding coding;
  DType dtype;
  uint64_t bytes;
};
constexpr Kind kKinds[] = {
    {"F32", Coding::f32, DType::f32, 4}, {"F64", Coding::f64, DType::f64, 8},
    {"I32", Coding::i32, DType::i32, 4}, {"I64", Coding::i64, DType::i64, 8},
    {"F16", Coding::f16, DType::f32, 2}, {"BF16", Coding::bf16, DType::f32, 2},
};

struct Entry {
  std::string name;
  const Kind* kind = nullptr;
  Shape shape;
  uint64_t begin = 0, end = 0;
};

/// IEEE half precision to single: exponent and fraction moved; subnormals by scaling.
float from_half(uint16_t h) {
  const uint32_t sign = static_cast<uint32_t>(h & 0x8000u) << 16, exponent = (h >> 10) & 31u,
                 fraction = h & 0x3ffu;
  uint32_t bits = sign;
  if (exponent == 31) {
    bits |= 0x7f800000u | (fraction << 13);
  } else if (exponent > 0) {
    bits |= ((exponent + 112) << 23) | (fraction << 13);
  } else {
    const float small = static_cast<float>(fraction) * 0x1p-24f;
    return sign != 0 ? -small : small;
  }
  return std::bit_cast<float>(bits);
}

float from_bfloat(uint16_t h) { return std::bit_cast<float>(static_cast<uint32_t>(h) << 16); }

/// What the header says of a tensor, before it has been checked.
struct Claim {
  std::string name, dtype;
  bool has_dtype = false, has_shape = false, has_offsets = false;
  bool shape_is_list = false, offsets_are_list = false;
  bool whole = true;  ///< all numbers of the lists are whole and fit 64 bits
  std::vector<uint64_t> shape, offsets;
};

/// The header as the JSON library reads it, piece by piece, so that no text makes more of itself in
/// memory than it is: { name: { key: [ numbers ] } }, every name and key once. (The library's own
/// tree grows to many times the text, and filtering it takes quadratic time.)
class Header : public Json::json_sax_t {
 public:
  explicit Header(const std::string& where) : where_(where) {}

  std::vector<Claim> claims;
  std::map<std::string, std::string> metadata;

  bool null() override { return other(); }
  bool boolean(bool) override { return other(); }
  // The JSON library calls this for negative numbers only.
  bool number_integer(number_integer_t) override { return other(); }
  bool number_float(number_float_t, const string_t&) override { return other(); }
  bool binary(binary_t&) override { return other(); }

  bool number_unsigned(number_unsigned_t n) override {
    if (depth_ != 3) return other();
    count_number();
    if (list_ != nullptr) list_->push_back(n);
    return true;
  }
  bool string(string_t& text) override {
    if (depth_ != 2) return other();
    if (in_metadata_)
      metadata[key_] = text;
    else if (key_ == "dtype")
      claims.back().has_dtype = true, claims.back().dtype = text;
    else
      other();
    return true;
  }

  bool start_object(size_t) override {
    if (depth_ == 1 && !in_metadata_) claims.emplace_back().name = name_;
    if (++depth_ > 2) fail("has a header nested too deeply");
    keys_.clear();
    return true;
  }
  bool key(string_t& key) override {
    const bool name = depth_ == 1;
    if (!(name ? names_ : keys_).insert(key).second)
      fail("names " + std::string(name ? "the tensor " : "") + name_in_quotes(key) + " twice");
    (name ? name_ : key_) = key;
    if (name) in_metadata_ = key == "__metadata__";
    return true;
  }
  bool end_object() override {
    --depth_;
    return true;
  }
  bool start_array(size_t) override {
    if (depth_ == 2 && in_metadata_) other();
    if (depth_ != 2) fail("has a header nested too deeply");
    ++depth_;
    numbers_ = 0;
    Claim& claim = claims.back();
    list_ = key_ == "shape" ? &claim.shape : key_ == "data_offsets" ? &claim.offsets : nullptr;
    if (key_ == "shape") claim.has_shape = claim.shape_is_list = true;
    if (key_ == "data_offsets") claim.has_offsets = claim.offsets_are_list = true;
    return true;
  }
  bool end_array() override {
    --depth_;
    return true;
  }
  bool parse_error(size_t, const std::string&, const Json::exception&) override { return false; }

 private:
  [[noreturn]] void fail(const std::string& wrong) const {
    throw InputError(where_, wrong, kGiveUndamaged);
  }

  void count_number() {
    if (++numbers_ > kMostNumbers)
      fail("has a list of more than " + std::to_string(kMostNumbers) + " numbers in its header");
  }

  /// Notes a value of a kind that does not belong here.
  bool other() {
    if (depth_ == 1 && in_metadata_) fail("has metadata that is no JSON object");
    if (depth_ == 2 && in_metadata_)
      fail("has metadata " + name_in_quotes(key_) + " that is no text");
    if (depth_ == 1) {
      claims.emplace_back().name = name_;  // lacks everything
    } else if (depth_ == 2) {
      claims.back().has_dtype |= key_ == "dtype";
      claims.back().has_shape |= key_ == "shape";
      claims.back().has_offsets |= key_ == "data_offsets";
    } else {
      count_number();
      if (list_ != nullptr) claims.back().whole = false;
    }
    return true;
  }

  const std::string& where_;
  // Seen so far: names in the header, keys of the tensor at hand.
  std::set<std::string> names_, keys_;
  std::string name_, key_;
  std::vector<uint64_t>* list_ = nullptr;
  int depth_ = 0, numbers_ = 0;
  bool in_metadata_ = false;
};

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}

  TensorFile read() {
    Header header(where_);
    parse(header);
    TensorFile out;
    out.metadata = std::move(header.metadata);
    std::vector<Entry> entries;
    for (Claim& claim : header.claims) entries.push_back(read_entry(claim));
    check_layout(entries);
    for (const Entry& e : entries) out.tensors.emplace(e.name, decode(e));
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& wrong) const {
    throw InputError(where_, wrong, kGiveUndamaged);
  }

  void parse(Header& header) {
    if (bytes_.size() < 8) fail("is too short to be a safetensors file");
    uint64_t length = 0;
    std::memcpy(&length, bytes_.data(), 8);
    if (length > bytes_.size() - 8 || length > kHeaderLimit)
      fail("is no safetensors file or is cut off (header of " + std::to_string(length) + " bytes)");
    data_ = bytes_.substr(8 + length);
    const std::string_view text = bytes_.substr(8, length);
    // Nothing may stand before or behind the header's text. (The JSON library takes a zero byte for
    // its end.)
    if (text.empty() || text[0] != '{' || text.find('\0') != std::string_view::npos)
      fail("has a header that is no JSON object");
    if (!Json::sax_parse(text, &header)) fail("has a header that is not JSON");
  }

  Entry read_entry(Claim& claim) const {
    const std::string called = "tensor " + name_in_quotes(claim.name);
    if (!claim.has_dtype || !claim.has_shape || !claim.has_offsets)
      fail(called + " lacks dtype, shape or data_offsets");
    Entry e;
    e.name = std::move(claim.name);
    for (const Kind& k : kKinds)
      if (claim.dtype == k.name) e.kind = &k;
    if (e.kind == nullptr)
      throw InputError(where_, called + " has the unknown dtype " + name_in_quotes(claim.dtype),
                       "store it as F32, F64, I32, I64, F16 or BF16");
    if (!claim.shape_is_list || claim.shape.size() > static_cast<size_t>(Shape::kMaxRank))
      fail(called + " has a shape of more than " + std::to_string(Shape::kMaxRank) + " axes");
    // Product of the lengths; axes of length 0 are left out, lest they hide an overflow.
    uint64_t count = 1;
    bool empty = false;
    if (!claim.whole) fail_number(called);
    for (const uint64_t n : claim.shape) {
      if (n > kLargest) fail_number(called);
      e.shape.push_back(static_cast<int64_t>(n));
      empty = empty || n == 0;
      if (n > kMostElements / count) fail(called + " has an impossible shape");
      count *= std::max<uint64_t>(n, 1);
    }
    if (empty) count = 0;
    if (!claim.offsets_are_list || claim.offsets.size() != 2)
      fail(called + " has no pair of data offsets");
    e.begin = claim.offsets[0];
    e.end = claim.offsets[1];
    if (e.begin > e.end || e.end > data_.size())
      fail(called + " reaches beyond the end of the file");
    if (count * e.kind->bytes != e.end - e.begin)
      fail(called + " has " + std::to_string(e.end - e.begin) + " bytes, which do not fit " +
           e.shape.str());
    return e;
  }

  [[noreturn]] void fail_number(const std::string& called) const {
    fail(called + " has a length or offset that is no whole number");
  }

  /// The format allows neither gaps nor overlaps.
  void check_layout(std::vector<Entry>& entries) const {
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return a.begin != b.begin ? a.begin < b.begin : a.end < b.end;
    });
    uint64_t at = 0;
    for (const Entry& e : entries) {
      if (e.begin != at)
        fail("tensor " + name_in_quotes(e.name) +
             (e.begin < at ? " overlaps another" : " follows a gap"));
      at = e.end;
    }
    if (at != data_.size())
      fail("holds " + std::to_string(data_.size() - at) + " bytes more than its tensors");
  }

  Tensor decode(const Entry& e) const {
    Tensor out = Tensor::empty(e.shape, e.kind->dtype);
    const char* from = data_.data() + e.begin;
    const auto n = static_cast<size_t>(out.numel());
    if (n == 0) return out;
    if (e.kind->coding != Coding::f16 && e.kind->coding != Coding::bf16) {
      std::memcpy(out.bytes(), from, e.end - e.begin);
      return out;
    }
    auto* to = out.data<float>();
    for (size_t i = 0; i < n; ++i) {
      uint16_t h;
      std::memcpy(&h, from + 2 * i, 2);
      to[i] = e.kind->coding == Coding::f16 ? from_half(h) : from_bfloat(h);
    }
    return out;
  }

  std::string_view bytes_, data_;
  const std::string& where_;
};

const char* format_name(DType type) {
  for (const Kind& k : kKinds)
    if (k.dtype == type) return k.name;
  return "";
}

}  // namespace

std::string name_in_quotes(std::string_view name) {
  std::string out = "'";
  for (const char c : name.substr(0, 60)) out += c >= ' ' && c <= '~' ? c : '?';
  return out + (name.size() > 60 ? "...'" : "'");
}

const Tensor* TensorFile::find(const std::string& name) const {
  const auto found = tensors.find(name);
  return found == tensors.end() ? nullptr : &found->second;
}

const Tensor& TensorFile::at(const std::string& name, const std::string& where) const {
  if (const Tensor* t = find(name)) return *t;
  throw InputError(where, "lacks the tensor " + name_in_quotes(name), "give a complete file");
}

TensorFile parse_safetensors(std::string_view bytes, const std::string& where) {
  return Reader(bytes, where).read();
}

TensorFile read_safetensors(const std::string& path) {
  return parse_safetensors(read_file(path), path);
}

std::string safetensors_bytes(const TensorFile& file) {
  Json header = Json::object();
  if (!file.metadata.empty()) header["__metadata__"] = file.metadata;
  uint64_t at = 0;
  for (const auto& [name, t] : file.tensors) {
    if (name == "__metadata__")
      throw InputError("", "no tensor of a safetensors file can be called __metadata__",
                       "rename it");
    Json shape = Json::array();
    for (int i = 0; i < t.rank(); ++i) shape.push_back(t.size(i));
    const uint64_t end = at + static_cast<uint64_t>(t.numel()) * size_of(t.dtype());
    header[name] = {
        {"dtype", format_name(t.dtype())}, {"shape", shape}, {"data_offsets", {at, end}}};
    at = end;
  }
  std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 7) / 8 * 8, ' ');
  std::string out;
  out.reserve(8 + text.size() + at);
  const uint64_t length = text.size();
  out.append(reinterpret_cast<const char*>(&length), 8);
  out += text;
  for (const auto& item : file.tensors) {
    const Tensor& t = item.second;
    out.append(static_cast<const char*>(t.bytes()),
               static_cast<size_t>(t.numel()) * size_of(t.dtype()));
  }
  return out;
}

void write_safetensors(const std::string& path, const TensorFile& file) {
  write_file_atomically(path, safetensors_bytes(file));
}

}  // namespace restage
