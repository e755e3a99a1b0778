// The weights that are used where none are named.
#pragma once

#include <string>

namespace restage::cli {

/// The file of the standard weights (autograd/base/shipped.h). InputError that asks for --weights
/// if there is none.
std::string standard_weights();

}  // namespace restage::cli
