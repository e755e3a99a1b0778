// `restage data fetch`: fills a data folder from public addresses, every file pinned by its
// SHA-256.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace restage {

/// One line of a list: `SHA256 BYTES PATH ADDRESS`. A line `@NAME ADDRESS` above lets addresses
/// begin with `@NAME`.
struct FetchEntry {
  std::string sha256;
  uint64_t bytes = 0;
  std::string path;     ///< in the data folder; ends in .gz, but `address` does not: packed here,
                        ///< and sum and bytes are those of what is inside
  std::string address;  ///< https://, file://, a file beside the list, "-": none, or
                        ///< packed from the files of a list: "makehuman:LIST" (pack_makehuman),
                        ///< "cmu:LIST" (pack_cmu)
};

/// InputError file:line for what is no entry, a path out of the folder, or a path given twice.
std::vector<FetchEntry> read_fetch_list(const std::string& list);

struct FetchSummary {
  size_t fetched = 0, present = 0;
  uint64_t bytes = 0;                ///< of what was fetched
  std::vector<std::string> missing;  ///< have no address and were not in `from`
};

/// Brings every file of `list` into `out`, which is made if needed. With `from`, a folder laid out
/// alike, files are copied from there. A file that is there already and right is left alone;
/// downloads go on where they broke off (PATH.part); a file takes its place only after its sum was
/// checked; what is packed from others has no sum of its own, its parts have. InputError, before
/// anything is written: lists, what they name, or what is in `from` are wrong. WorkError: the
/// network or the disk fails, or what arrives is not what is pinned.
FetchSummary fetch_data(const std::string& list, const std::string& out,
                        const std::string& from = "");

}  // namespace restage
