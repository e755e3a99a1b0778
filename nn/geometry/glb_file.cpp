#include "nn/geometry/glb_file.h"

#include <cstdint>

#include "autograd/base/error.h"

namespace restage {
namespace {

void append_word(std::string& bytes, size_t value) {
  const auto word = static_cast<uint32_t>(value);  // little-endian, as the machines are
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

void append_chunk(std::string& file, const char* kind, const std::string& content) {
  append_word(file, content.size());
  file.append(kind, 4);
  file += content;
}

}  // namespace

std::string glb_bytes(std::string json, std::string binary, const std::string& where) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const size_t size = 12 + 8 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
  if (size > UINT32_MAX)
    throw WorkError(where + ": a GLB cannot hold more than 4 GiB; write shorter pieces");
  std::string file = "glTF";
  append_word(file, 2);
  append_word(file, size);
  append_chunk(file, "JSON", json);
  if (!binary.empty()) append_chunk(file, "BIN\0", binary);
  return file;
}

}  // namespace restage
