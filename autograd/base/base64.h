// Bytes as text (RFC 4648, section 4).
#pragma once

#include <cstddef>
#include <string>

namespace restage {

std::string base64(const void* data, size_t size);

}  // namespace restage
