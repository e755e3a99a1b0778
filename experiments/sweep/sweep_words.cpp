#include "experiments/sweep/sweep_words.h"

#include <charconv>
#include <cmath>
#include <cstdio>

#include "experiments/search/space.h"

namespace restage::sweep {
namespace {

constexpr double kMostValues = 10'000;

std::string trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

/// Cut at commas that stand in no quotes, brackets or braces.
std::vector<std::string> cut(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  char quote = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote == '"' && c == '\\' && i + 1 < text.size()) {
      parts.back() += c;
      parts.back() += text[++i];
      continue;
    }
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if ((c == '"' || c == '\'') && trimmed(parts.back()).empty()) {
      quote = c;  // YAML's quotes begin a value; elsewhere they are letters
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    }
    if (c == ',' && quote == 0 && depth <= 0)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

/// The inside of `name(...)`, if the text is that.
bool inside_of(const std::string& text, const std::string& name, std::string& inside) {
  if (!text.starts_with(name + "(") || text.back() != ')') return false;
  inside = text.substr(name.size() + 1, text.size() - name.size() - 2);
  return true;
}

std::vector<std::string> range_values(const std::string& inside, const std::string& place) {
  std::vector<double> numbers;
  for (const std::string& part : cut(inside)) {
    const std::string word = trimmed(part);
    double value = 0;
    const auto found = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || found.ec != std::errc() || found.ptr != word.data() + word.size() ||
        !std::isfinite(value))
      throw InputError(place, "range() needs numbers, got " + in_quotes(word),
                       "write range(start,stop,step)");
    numbers.push_back(value);
  }
  if (numbers.size() == 2) numbers.push_back(1);
  const double count = numbers.size() == 3 && numbers[2] != 0
                           ? std::ceil((numbers[1] - numbers[0]) / numbers[2] - 1e-9)
                           : -1;
  if (!(count >= 1 && count <= kMostValues))
    throw InputError(place, "range() gives no values, or more than 10000",
                     "write range(start,stop,step); stop is left out");
  std::vector<std::string> out;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    char text[40];
    std::snprintf(text, sizeof text, "%.12g", numbers[0] + i * numbers[2]);
    out.emplace_back(text);
  }
  return out;
}

}  // namespace

SweepWord read_sweep_word(const std::string& text) {
  SweepWord word;
  word.text = text;
  const std::string place = "override " + in_quotes(text);
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw InputError("", in_quotes(text) + " is no override", "write key=value or key=a,b");
  word.key = text.substr(0, equals);
  const std::string value = trimmed(text.substr(equals + 1));
  std::string inside;
  std::vector<std::string> values;
  if (inside_of(value, "range", inside)) {
    values = range_values(inside, place);
    word.several = true;
  } else {
    for (const char* name : search::kDimensionKinds)
      if (name != std::string("choice") && inside_of(value, name, inside)) word.range = name;
    word.several = inside_of(value, "choice", inside) || !word.range.empty();
    values = cut(word.several ? inside : value);
    word.several = word.several || values.size() > 1;
  }
  if (!word.range.empty() && values.size() != 2)
    throw InputError(place, word.range + "() needs two ends", "write " + word.range + "(low,high)");
  for (const std::string& one : values) {
    if (word.several && trimmed(one).empty())
      throw InputError(place, "has an empty value", "take a comma away, or write ''");
    ConfigNode node = parse_yaml(one, place, true);
    node.place = node.key_place = {place, 0, 0};
    word.values.push_back(std::move(node));
  }
  return word;
}

}  // namespace restage::sweep
