// The bytes of orientation.safetensors.
#pragma once

#include <string_view>

namespace restage::doctor_detail {

std::string_view orientation_weights();

}  // namespace restage::doctor_detail
