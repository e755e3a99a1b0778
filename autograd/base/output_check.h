// What a command writes must not lie over what it reads.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// InputError if `out` is one of `inputs` under whatever name (device and inode count, so links and
/// other spellings are seen), or a folder that holds one. Inputs that are empty or not there are
/// passed by: who reads them complains.
void check_output(const std::string& out, const std::vector<std::string>& inputs);

}  // namespace restage
