// Texts that may be packed: .bvh.xz, .asf.xz, .amc.xz.
#pragma once

#include <cstdint>
#include <string>

namespace restage {

/// The text of a file, unpacked if it is an xz file. InputError: no such file, a damaged xz file,
/// more than `limit` bytes packed or unpacked. The decoder itself takes at most 80 MiB, as
/// much as xz -9 needs.
std::string read_packed_text(const std::string& path, uint64_t limit = uint64_t{1} << 30);

}  // namespace restage
