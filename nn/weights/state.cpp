#include "nn/weights/state.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <span>

#include "autograd/base/atomic_file.h"
#include "autograd/base/words.h"

namespace restage {
namespace {

constexpr uint64_t kLongestMap = 1 << 18;
constexpr size_t kMostStars = 3;  // since a match may try every length for every star

bool ignored(const std::string& name) {
  static const std::string ending = "num_batches_tracked";
  return name.size() >= ending.size() &&
         name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// Why `found` cannot take the place of `wanted`; "" if it can.
std::string misfit(const Tensor& found, const Tensor& wanted) {
  if (!(found.shape() == wanted.shape()))
    return found.shape().str() + " instead of " + wanted.shape().str();
  if (found.dtype() != DType::f32 && found.dtype() != DType::f64)
    return std::string("holds ") + name_of(found.dtype());
  return all_finite(found) ? "" : "holds NaN or infinity";
}

/// "3 missing ('a', 'b', ...)"; at most `most` names, so that all fits into one line.
void describe(std::string* text, const std::vector<std::string>& names, const char* what,
              size_t most) {
  if (names.empty()) return;
  const std::span<const std::string> shown(names.data(), std::min(names.size(), most));
  *text += cat(text->empty() ? "" : ", ", names.size(), " ", what, " (",
               joined(shown, name_in_quotes), names.size() > most ? ", ...)" : ")");
}

/// Whether `pattern` matches all of `text`; the texts for its stars then.
bool match(std::string_view pattern, std::string_view text, std::vector<std::string>* stars) {
  const size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == text;
  if (text.substr(0, star) != pattern.substr(0, star)) return false;
  text.remove_prefix(star);
  for (size_t n = 0; n <= text.size(); ++n) {
    stars->emplace_back(text.substr(0, n));
    if (match(pattern.substr(star + 1), text.substr(n), stars)) return true;
    stars->pop_back();
  }
  return false;
}

size_t count_stars(const std::string& s) {
  return static_cast<size_t>(std::count(s.begin(), s.end(), '*'));
}

/// The YAML parser calls itself for every level of nesting. A map of names has one level; deeper
/// levels come from brackets, from "- - -" on one line, or (quadratic in length) from indentation.
bool may_nest_deeply(const std::string& yaml) {
  const auto count = [&](char c) { return std::count(yaml.begin(), yaml.end(), c); };
  size_t dashes = 0;
  for (size_t i = 1; i < yaml.size(); ++i) {
    if (yaml[i] == '\n') dashes = 0;
    if (yaml[i] == ' ' && (yaml[i - 1] == '-' || yaml[i - 1] == '?') && ++dashes > 64) return true;
  }
  return count('[') + count('{') > 64;
}

}  // namespace

void append(TensorFile* file, Module& module, const std::string& prefix) {
  for (const StateEntry& e : state_of(module, prefix))
    file->tensors[e.name] = e.value->clone().cpu();
}

TensorFile to_file(Module& module, const std::string& prefix) {
  TensorFile out;
  append(&out, module, prefix);
  return out;
}

std::string StateError::details() const {
  std::string out;
  for (const std::string& n : missing) out += "missing     " + n + "\n";
  for (const std::string& n : unexpected) out += "unexpected  " + n + "\n";
  for (const std::string& n : unfit) out += "unfit       " + n + "\n";
  return out;
}

void load_state(Module& module, const TensorFile& file, const std::string& prefix,
                const std::string& where) {
  std::vector<std::string> missing, unexpected, unfit;
  std::map<std::string, const Tensor*> rest;
  for (const auto& [name, tensor] : file.tensors)
    if (name.compare(0, prefix.size(), prefix) == 0 && !ignored(name)) rest[name] = &tensor;
  std::vector<std::pair<Tensor*, const Tensor*>> pairs;
  for (const StateEntry& e : state_of(module, prefix)) {
    const auto found = rest.find(e.name);
    if (found == rest.end()) {
      missing.push_back(e.name);
      continue;
    }
    const std::string why = misfit(*found->second, *e.value);
    if (!why.empty()) unfit.push_back(e.name + ": " + why);
    pairs.emplace_back(e.value, found->second);
    rest.erase(found);
  }
  for (const auto& item : rest) unexpected.push_back(item.first);
  std::string text;
  const int kinds = !missing.empty() + !unexpected.empty() + !unfit.empty();
  const size_t most = kinds == 1 ? 3 : kinds == 2 ? 2 : 1;
  describe(&text, missing, "missing", most);
  describe(&text, unexpected, "unexpected", most);
  describe(&text, unfit, "unfit", most);
  if (!text.empty()) {
    StateError error(
        where,
        "does not fit " + (module.scope.empty() ? module.kind() : module.scope) + ": " + text,
        "give weights of this model");
    error.missing = missing;
    error.unexpected = unexpected;
    error.unfit = unfit;
    throw error;
  }
  for (const auto& [to, from] : pairs)
    *to = (from->dtype() == to->dtype() ? from->clone() : from->cast(to->dtype())).to(to->device());
}

NameMap NameMap::read(const std::string& path) { return parse(read_file(path, kLongestMap), path); }

NameMap NameMap::parse(const std::string& yaml, const std::string& where) {
  constexpr const char* fix = "write lines like \"module.*: '*'\"";
  if (may_nest_deeply(yaml)) throw InputError(where, "is no map of names", fix);
  NameMap out;
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::Exception& e) {
    throw InputError(where + ":" + std::to_string(e.mark.line + 1), "is not YAML", fix);
  }
  if (!root.IsMap()) throw InputError(where, "is no map of names", fix);
  for (const auto& line : root) {
    const std::string at = where + ":" + std::to_string(line.first.Mark().line + 1);
    if (!line.first.IsScalar() || !(line.second.IsScalar() || line.second.IsNull()))
      throw InputError(at, "does not map one name to one name", fix);
    Rule rule{line.first.Scalar(), line.second.IsNull() ? "" : line.second.Scalar(),
              line.second.IsNull()};
    if (count_stars(rule.from) > kMostStars || count_stars(rule.to) > count_stars(rule.from))
      throw InputError(at, "has more than three stars or more on the right than on the left", fix);
    out.rules_.push_back(std::move(rule));
  }
  return out;
}

bool NameMap::rename(const std::string& name, std::string* ours) const {
  for (const Rule& rule : rules_) {
    std::vector<std::string> stars;
    if (!match(rule.from, name, &stars)) continue;
    ours->clear();
    size_t next = 0;
    for (const char c : rule.to) {
      if (c == '*')
        *ours += stars[next++];
      else
        *ours += c;
    }
    return !rule.drop;
  }
  *ours = name;
  return true;
}

TensorFile NameMap::apply(const TensorFile& file, const std::string& where) const {
  TensorFile out;
  out.metadata = file.metadata;
  for (const auto& [name, tensor] : file.tensors) {
    std::string ours;
    if (!rename(name, &ours)) continue;
    if (!out.tensors.emplace(ours, tensor).second)
      throw InputError(where, "gets two tensors named " + name_in_quotes(ours),
                       "mend the name map");
  }
  return out;
}

}  // namespace restage
