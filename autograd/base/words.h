// Texts put together from words and numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <type_traits>

namespace restage {

/// The parts one after the other; numbers as std::to_string() writes them.
template <class... Parts>
std::string cat(const Parts&... parts) {
  std::string out;
  const auto add = [&](const auto& part) {
    using Kind = std::remove_cvref_t<decltype(part)>;
    if constexpr (std::is_arithmetic_v<Kind> && !std::is_same_v<Kind, char>)
      out += std::to_string(part);
    else
      out += part;
  };
  (add(parts), ...);
  return out;
}

/// "a, b, c": `text` makes a text or a number of each item.
template <class Items, class Text = std::identity>
std::string joined(const Items& items, const Text& text = {}, std::string_view between = ", ") {
  std::string out;
  bool first = true;
  for (const auto& item : items) {
    if (!first) out += between;
    out += cat(std::invoke(text, item));
    first = false;
  }
  return out;
}

/// The same of at most `most` items, then `rest(how many more)`: "a, b and 7 more".
template <class Items, class Text = std::identity>
std::string listed(const Items& items, size_t most, const Text& text = {}) {
  const size_t all = static_cast<size_t>(std::distance(std::begin(items), std::end(items)));
  std::string out;
  size_t at = 0;
  for (const auto& item : items) {
    if (at == most) return cat(out, " and ", all - most, " more");
    out += cat(at++ > 0 ? ", " : "", std::invoke(text, item));
  }
  return out;
}

/// Words of a line that must not become long: after `longest` bytes "..." stands for the rest.
template <class Items, class Text = std::identity>
std::string cut_list(const Items& items, size_t longest, const Text& text = {}) {
  std::string out;
  for (const auto& item : items) {
    if (out.size() > longest) return out + ", ...";
    out += cat(out.empty() ? "" : ", ", std::invoke(text, item));
  }
  return out;
}

/// "1 frame", "3 frames"; "1 mesh", "3 meshes".
inline std::string counted(size_t n, std::string_view one, std::string_view many = {}) {
  return cat(n, " ", n == 1 || many.empty() ? one : many, n != 1 && many.empty() ? "s" : "");
}

/// Letters of ASCII in lower case, whatever the locale; the rest stays.
inline std::string lower_case(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

}  // namespace restage
