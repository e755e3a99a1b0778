// What the files behind import_data() share.
#pragma once

#include <filesystem>
#include <string>

#include "datasets/importers/import.h"
#include "datasets/schema.h"

namespace restage {

/// Without "..", "." and a slash at its end; links stay as they are called.
std::filesystem::path absolute_path(const std::filesystem::path& path);
/// Licence as given, provenance by the source's name.
FileInfo file_info(const std::string& source, const ImportOptions& options);
void add_motion(const Motion& motion, DatasetWriter& writer, ImportSummary& summary);

/// An NPY, NPZ, PLY or OBJ file; a folder with such files somewhere below (import_arrays.cpp).
ImportSummary import_array_file(const std::string& source, const std::string& out,
                                const ImportOptions& options);
ImportSummary import_array_folder(const std::string& source, const std::string& out,
                                  const ImportOptions& options);

}  // namespace restage
