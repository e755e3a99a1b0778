// What a file of nested values holds (a pickle, an archive of arrays): maps, lists, arrays,
// numbers, text.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "datasets/readers/arrays/array_source.h"

namespace restage {

/// Values by number. Who looks into a hostile file meets one list in many places, and lists that
/// hold themselves: bound how deep and how often you look.
class ValueTree {
 public:
  using Id = uint32_t;
  enum class Kind : uint8_t {
    none,   ///< Python's None
    truth,  ///< number() is 0 or 1
    number,
    text,  ///< also of bytes, as they are
    list,  ///< of items(); also a tuple, a set, an array of objects
    map,   ///< items() are key, value, key, value ...
    array,
    other,  ///< something that is not read; text() says what
  };

  explicit ValueTree(std::string path) : path_(std::move(path)) {}
  const std::string& path() const { return path_; }  ///< the file, for messages

  Id root = 0;
  size_t size() const { return nodes_.size(); }
  Kind kind(Id id) const { return nodes_.at(id).kind; }
  bool is(Id id, Kind kind) const { return nodes_.at(id).kind == kind; }
  double number(Id id) const { return nodes_.at(id).number; }
  const std::string& text(Id id) const { return texts_.at(nodes_.at(id).index); }
  const std::vector<Id>& items(Id id) const { return items_.at(nodes_.at(id).index); }
  const SharedArray& array(Id id) const { return arrays_.at(nodes_.at(id).index); }
  /// Of a map's key, as words: "body_pose", "3"; empty if it is neither text nor a number.
  std::string key(Id id) const;
  /// Of a map, the value of this key; none if it has none.
  Id none() const { return kNone; }
  Id find(Id map, const std::string& key) const;

  Id add_none() { return add(Kind::none, 0, 0); }
  Id add_truth(bool value) { return add(Kind::truth, value ? 1 : 0, 0); }
  Id add_number(double value) { return add(Kind::number, value, 0); }
  Id add_text(std::string text);
  Id add_other(std::string what);
  Id add_list(std::vector<Id> items);
  Id add_map(std::vector<Id> keys_and_values = {});
  Id add_array(SharedArray array);
  std::vector<Id>& grow(Id id) { return items_.at(nodes_.at(id).index); }  ///< of a list or a map
  /// `id` becomes another name of what `of` is.
  void alias(Id id, Id of) { nodes_.at(id) = nodes_.at(of); }

  /// What it holds, in words for a message: "pose [12, 72], people (1, 2)".
  std::string summary() const;

 private:
  struct Node {
    Kind kind;
    double number;
    uint32_t index;
  };
  static constexpr Id kNone = UINT32_MAX;
  Id add(Kind kind, double number, size_t index);
  std::string words(Id id, bool inside) const;

  std::string path_;
  std::vector<Node> nodes_;
  std::vector<std::string> texts_;
  std::vector<std::vector<Id>> items_;
  std::vector<SharedArray> arrays_;
};

}  // namespace restage
