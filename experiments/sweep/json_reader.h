// JSON that others may have written: parts are asked for by kind, and everything else is an
// InputError that names the file.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"

namespace restage::sweep {

/// `Json`: sorted, which a hostile file cannot make slow, or ordered, where the order means
/// something.
template <class Json>
class JsonReader {
 public:
  JsonReader(std::string path, std::string fix) : path_(std::move(path)), fix_(std::move(fix)) {}

  Json parse() const {
    constexpr uint64_t kMaxBytes = uint64_t{1} << 28;
    Json document = Json::parse(read_file(path_, kMaxBytes), nullptr, false);
    if (document.is_discarded()) fail("is no JSON document");
    if (!document.is_object()) fail("is no section");
    return document;
  }
  [[noreturn]] void fail(const std::string& wrong) const { throw InputError(path_, wrong, fix_); }
  void need(bool holds, const std::string& name, const char* what) const {
    if (!holds) fail("'" + name + "' is not " + what);
  }
  /// The entry `name` of an object; null if it is not there.
  const Json& at(const Json& object, const std::string& name) const {
    static const Json null;
    const auto found = object.find(name);
    return found == object.end() ? null : *found;
  }
  std::string text(const Json& object, const std::string& name) const {
    const Json& value = at(object, name);
    need(value.is_string(), name, "text");
    return value.template get<std::string>();
  }
  /// Text; empty for null.
  std::string optional_text(const Json& object, const std::string& name) const {
    return at(object, name).is_null() ? "" : text(object, name);
  }
  uint64_t count(const Json& object, const std::string& name) const {
    const Json& value = at(object, name);
    need(value.is_number_unsigned(), name, "a number from 0");
    return value.template get<uint64_t>();
  }
  double number(const Json& object, const std::string& name) const {
    const Json& value = at(object, name);
    need(value.is_number(), name, "a number");
    return value.template get<double>();
  }
  const Json& section(const Json& parent, const std::string& name) const {
    const Json& value = at(parent, name);
    need(value.is_object(), name, "a section");
    return value;
  }
  const Json& list(const Json& parent, const std::string& name) const {
    const Json& value = at(parent, name);
    need(value.is_array(), name, "a list");
    return value;
  }

 private:
  std::string path_, fix_;
};

}  // namespace restage::sweep
