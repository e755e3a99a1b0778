// Files of weights that are part of the program (CMakeLists.txt, restage_embed_weights).
#pragma once

#include <string_view>

namespace restage::embedded {

/// The bytes of datasets/doctor/orientation.safetensors.
std::string_view orientation_weights();
/// The bytes of datasets/importers/joints/turns.safetensors.
std::string_view turn_weights();

}  // namespace restage::embedded
