// The container of binary glTF 2.0 (GLB): a structure as JSON text, and one chunk of bytes.
#pragma once

#include <string>

namespace restage {

/// Both chunks behind the header; each is filled up to whole words. No binary chunk where `binary`
/// is empty. WorkError naming `where` beyond 4 GiB, which the format cannot hold.
std::string glb_bytes(std::string json, std::string binary, const std::string& where);

}  // namespace restage
