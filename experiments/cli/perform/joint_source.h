// Positions of joints where a command wants clouds.
#pragma once

#include <string>

namespace restage::cli {

/// InputError for a file, or a folder, of joints without rotations: what it is, and the commands
/// that take it.
void refuse_joints(const std::string& path);

}  // namespace restage::cli
