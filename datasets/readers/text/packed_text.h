// Texts that may be packed: .bvh.xz, .asf.xz, .amc.xz, .mhclo.gz.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace restage {

/// The text of a file, unpacked if it is an xz file. InputError: no such file, a damaged xz file,
/// a file of another kind (foreign_kinds.h), more than `limit` bytes packed or unpacked. The
/// decoder itself takes at most 80 MiB, as much as xz -9 needs.
std::string read_packed_text(const std::string& path, uint64_t limit = uint64_t{1} << 30);

/// What is inside a gzip file; nothing if it is missing, damaged or holds more than `limit` bytes.
std::optional<std::string> read_gz(const std::string& path, uint64_t limit = uint64_t{64} << 20);

}  // namespace restage
