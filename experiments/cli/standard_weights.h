// The weights that are used where none are named.
#pragma once

#include <string>

namespace restage::cli {

/// The file of the standard weights: beside the program, where `cmake --install` puts it
/// (share/restage), or in the folder of sources that the program was built in. InputError that asks
/// for --weights if there is none.
std::string standard_weights();

}  // namespace restage::cli
