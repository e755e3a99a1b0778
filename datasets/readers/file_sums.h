// Checksums of large files, kept from command to command.
#pragma once

#include <functional>
#include <string>

namespace restage {

/// The user's folder for what can be made again: $XDG_CACHE_HOME/restage, else ~/.cache/restage; ""
/// without a home. It may not be there yet.
std::string user_cache();

/// The SHA-256 of a file. That of a file of 8 MiB or more is kept in the user's cache folder
/// ($XDG_CACHE_HOME/restage/sums, else ~/.cache/restage/sums), and taken from there as long as the
/// file's path, device, inode, size and both times (of content and of inode) are the same. A file
/// that was changed less than two seconds before it was read is not kept: a later change could have
/// the same time. What is damaged in the cache is not used, and a cache that cannot be read or
/// written does no harm. ReadError if the file cannot be read.
std::string kept_sha256(const std::string& path);
/// The same of another sum (64 hexadecimal digits) that follows from the file's bytes; `kind` tells
/// such sums apart.
std::string kept_sum(const std::string& path, const std::string& kind,
                     const std::function<std::string()>& compute);

}  // namespace restage
