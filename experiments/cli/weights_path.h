// Weights by file or by the run that made them.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace restage::cli {

/// A run directory stands for its finished weights; everything else for itself.
inline std::string weights_path(const std::string& file_or_run) {
  std::error_code ignored;
  return std::filesystem::is_directory(file_or_run, ignored) ? file_or_run + "/weights.safetensors"
                                                             : file_or_run;
}

}  // namespace restage::cli
