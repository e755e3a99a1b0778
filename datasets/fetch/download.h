// One file from an address, by libcurl: the only place that knows it.
#pragma once

#include <cstdint>
#include <string>

namespace restage {

/// Brings `address` (https:// or file://) into the file `part`, which may hold its beginning from
/// an earlier try: only the rest is asked for, nothing if it has `bytes` already. Never writes more
/// than `bytes`. WorkError naming the address if it cannot be reached, is not there or breaks off;
/// what has arrived stays.
void download(const std::string& address, const std::string& part, uint64_t bytes);

/// Makes the folder of a file that is to come. WorkError.
void make_folder_of(const std::string& path);
/// Renames. WorkError.
void put_in_place(const std::string& part, const std::string& target);

}  // namespace restage
