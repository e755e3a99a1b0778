// InputError and WorkError, and their texts put together from words and numbers.
#pragma once

#include <string>
#include <type_traits>

#include "autograd/base/error.h"

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

}  // namespace restage
