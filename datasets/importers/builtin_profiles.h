// The texts of datasets/importers/profiles/*.yaml; CMake writes the source file.
#pragma once

#include <span>
#include <string_view>

namespace restage {

struct ProfileText {
  std::string_view name, yaml;
};

/// By name.
std::span<const ProfileText> builtin_profile_texts();

}  // namespace restage
