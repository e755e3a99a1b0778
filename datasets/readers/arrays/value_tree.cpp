#include "datasets/readers/arrays/value_tree.h"

#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/words.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {

ValueTree::Id ValueTree::add(Kind kind, double number, size_t index) {
  if (nodes_.size() >= kNone)
    throw InputError(path_, "holds too many values", "save the arrays that matter alone");
  nodes_.push_back({kind, number, static_cast<uint32_t>(index)});
  return static_cast<Id>(nodes_.size() - 1);
}

ValueTree::Id ValueTree::add_text(std::string text) {
  texts_.push_back(std::move(text));
  return add(Kind::text, 0, texts_.size() - 1);
}

ValueTree::Id ValueTree::add_other(std::string what) {
  texts_.push_back(std::move(what));
  return add(Kind::other, 0, texts_.size() - 1);
}

ValueTree::Id ValueTree::add_list(std::vector<Id> items) {
  items_.push_back(std::move(items));
  return add(Kind::list, 0, items_.size() - 1);
}

ValueTree::Id ValueTree::add_map(std::vector<Id> keys_and_values) {
  items_.push_back(std::move(keys_and_values));
  return add(Kind::map, 0, items_.size() - 1);
}

ValueTree::Id ValueTree::add_array(SharedArray array) {
  arrays_.push_back(std::move(array));
  return add(Kind::array, 0, arrays_.size() - 1);
}

std::string ValueTree::key(Id id) const {
  const auto of_number = [](double value) {
    return value == std::floor(value) && std::abs(value) < 1e15
               ? std::to_string(static_cast<int64_t>(value))
               : format("%.6g", value);
  };
  if (is(id, Kind::text)) return text(id);
  if (is(id, Kind::number) || is(id, Kind::truth)) return of_number(number(id));
  if (!is(id, Kind::array) || array(id)->header().count != 1) return "";
  const NpyArray one = array(id)->read();  // numpy.int64(3) as a key
  return one.is_text() ? one.text() : of_number(one[0]);
}

ValueTree::Id ValueTree::find(Id map, const std::string& wanted) const {
  const std::vector<Id>& all = items(map);
  for (size_t i = 0; i + 1 < all.size(); i += 2)
    if (key(all[i]) == wanted) return all[i + 1];
  return kNone;
}

std::string ValueTree::words(Id id, bool inside) const {
  if (is(id, Kind::array)) return " " + shape_text(array(id)->header().shape);
  if (is(id, Kind::list)) return cat(" (a list of ", items(id).size(), ")");
  if (is(id, Kind::other)) return cat(" (", text(id), ")");
  if (!is(id, Kind::map) || inside) return "";
  std::vector<std::string> keys;
  for (size_t i = 0; i + 1 < items(id).size() && keys.size() < 20; i += 2)
    keys.push_back(text::quote(key(items(id)[i])));
  return " (" + cut_list(keys, 60) + ")";
}

std::string ValueTree::summary() const {
  if (nodes_.empty()) return "nothing";
  if (!is(root, Kind::map)) {
    const std::string one = words(root, false);
    const bool maps = is(root, Kind::list) && !items(root).empty() && is(items(root)[0], Kind::map);
    if (maps) return one.substr(1) + ", each with" + words(items(root)[0], false);
    return one.empty() ? "a single value" : one.substr(1);
  }
  std::vector<std::string> parts;
  for (size_t i = 0; i + 1 < items(root).size() && parts.size() < 20; i += 2)
    parts.push_back(text::quote(key(items(root)[i])) + words(items(root)[i + 1], false));
  return parts.empty() ? "nothing" : cut_list(parts, 160);
}

}  // namespace restage
