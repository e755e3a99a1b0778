// Weights by file or by the run that made them.
#pragma once

#include <filesystem>
#include <string>

namespace restage::cli {

/// A run directory stands for its finished weights; everything else for itself.
inline std::string weights_path(const std::string& file_or_run) {
  return std::filesystem::is_directory(file_or_run) ? file_or_run + "/weights.safetensors"
                                                    : file_or_run;
}

}  // namespace restage::cli
