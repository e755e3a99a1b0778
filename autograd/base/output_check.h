// Checks that a command does not write over what it reads, and may write at all.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// InputError if `out` is one of `inputs` or a folder that holds one. Files are compared by device
/// and inode, so links and other spellings are seen. Inputs that are empty names or do not exist
/// are passed over: whoever reads them complains. InputError, too, if the folder of `out` is there
/// and nothing may be written in it.
void check_output(const std::string& out, const std::vector<std::string>& inputs);

}  // namespace restage
