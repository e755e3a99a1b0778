#include "datasets/readers/arrays/array_source.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "autograd/base/words.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

class ArrayInMemory : public LazyArray {
 public:
  explicit ArrayInMemory(NpyArray array) : array_(std::move(array)) {}
  NpyHeader header() const override { return array_.header(); }
  NpyArray read() const override { return array_; }

 private:
  NpyArray array_;
};

class Stack : public LazyArray {
 public:
  Stack(std::vector<SharedArray> parts, NpyHeader header)
      : parts_(std::move(parts)), header_(std::move(header)) {}
  NpyHeader header() const override { return header_; }
  NpyArray read() const override {
    std::vector<char> bytes;
    bytes.reserve(header_.bytes());
    std::string where;
    for (const SharedArray& part : parts_) {
      const NpyArray one = part->read();
      const std::vector<char> row = one.in_order();
      bytes.insert(bytes.end(), row.begin(), row.end());
      where = one.where();
    }
    return {header_, std::move(bytes), where};
  }

 private:
  std::vector<SharedArray> parts_;
  NpyHeader header_;
};

class Part : public LazyArray {
 public:
  Part(SharedArray whole, int64_t i) : whole_(std::move(whole)), i_(i) {}
  NpyHeader header() const override {
    NpyHeader out = whole_->header();
    out.count /= out.shape[0];
    out.shape.erase(out.shape.begin());
    out.fortran = false;
    return out;
  }
  NpyArray read() const override { return whole_->read().part(i_); }

 private:
  SharedArray whole_;
  int64_t i_;
};

class Rows : public LazyArray {
 public:
  Rows(SharedArray whole, std::vector<int64_t> rows)
      : whole_(std::move(whole)), rows_(std::move(rows)) {}
  NpyHeader header() const override {
    NpyHeader out = whole_->header();
    out.count = out.count / out.shape[0] * std::ssize(rows_);
    out.shape[0] = std::ssize(rows_);
    out.fortran = false;
    return out;
  }
  NpyArray read() const override {
    const NpyArray whole = whole_->read();
    const std::vector<char> from = whole.in_order();
    const size_t size = from.size() / static_cast<size_t>(whole.shape()[0]);
    std::vector<char> bytes(size * rows_.size());
    for (size_t k = 0; k < rows_.size(); ++k)
      std::copy_n(from.begin() + rows_[k] * static_cast<std::ptrdiff_t>(size), size,
                  bytes.begin() + static_cast<std::ptrdiff_t>(k * size));
    return {header(), std::move(bytes), whole.where()};
  }

 private:
  SharedArray whole_;
  std::vector<int64_t> rows_;
};

}  // namespace

std::string list_of(const std::vector<std::string>& names) {
  constexpr size_t kLong = 120;  // names may be anything, and a message is one line
  return names.empty() ? "none" : cut_list(names, kLong, text::quote);
}

SharedArray shared_array(NpyArray array) {
  return std::make_shared<ArrayInMemory>(std::move(array));
}

SharedArray shared_numbers(const std::vector<int64_t>& shape, const std::vector<double>& values,
                           const std::string& where) {
  std::vector<char> bytes(values.size() * sizeof(double));
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  const char* type = std::endian::native == std::endian::big ? ">f8" : "<f8";
  return shared_array(NpyArray(npy_header_of(type, shape, where), std::move(bytes), where));
}

SharedArray stacked(const std::vector<SharedArray>& parts) {
  if (parts.empty()) return nullptr;
  NpyHeader header = parts[0]->header();
  for (const SharedArray& part : parts) {
    const NpyHeader other = part->header();
    if (other.shape != header.shape || other.kind != header.kind || other.width != header.width ||
        other.big_endian != header.big_endian)
      return nullptr;
  }
  constexpr uint64_t kMost = uint64_t{1} << 40;  // bytes
  if (header.shape.size() >= 32 || header.bytes() > kMost / parts.size()) return nullptr;
  header.count *= static_cast<int64_t>(parts.size());
  header.shape.insert(header.shape.begin(), static_cast<int64_t>(parts.size()));
  header.fortran = false;
  return std::make_shared<Stack>(parts, header);
}

SharedArray part_of(const SharedArray& whole, int64_t i) {
  return std::make_shared<Part>(whole, i);
}

SharedArray rows_of(const SharedArray& whole, std::vector<int64_t> rows) {
  return std::make_shared<Rows>(whole, std::move(rows));
}

std::vector<std::string> GatheredArrays::names() const {
  std::vector<std::string> out;
  for (const auto& [name, array] : arrays_) out.push_back(name);
  return out;
}

const LazyArray& GatheredArrays::at(const std::string& name) const {
  const auto found = arrays_.find(name);
  if (found == arrays_.end())
    throw InputError(path_, "has no array '" + name + "' (it has " + list_of(names()) + ")",
                     "give a file that has one");
  return *found->second;
}

NpyArray GatheredArrays::array(const std::string& name) const { return at(name).read(); }
NpyHeader GatheredArrays::header(const std::string& name) const { return at(name).header(); }

}  // namespace restage
