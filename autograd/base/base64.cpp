#include "autograd/base/base64.h"

#include <cstdint>

namespace restage {

std::string base64(const void* data, size_t size) {
  static constexpr char digits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* bytes = static_cast<const unsigned char*>(data);
  std::string out;
  out.reserve((size + 2) / 3 * 4);
  for (size_t k = 0; k < size; k += 3) {
    const size_t left = size - k;
    const uint32_t three = uint32_t{bytes[k]} << 16 |
                           (left > 1 ? uint32_t{bytes[k + 1]} << 8 : 0u) |
                           (left > 2 ? uint32_t{bytes[k + 2]} : 0u);
    out += digits[three >> 18];
    out += digits[three >> 12 & 63];
    out += left > 1 ? digits[three >> 6 & 63] : '=';
    out += left > 2 ? digits[three & 63] : '=';
  }
  return out;
}

}  // namespace restage
