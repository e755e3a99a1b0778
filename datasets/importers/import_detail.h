// What the files behind import_data() share.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "datasets/importers/import.h"

namespace restage {

/// Without "..", "." and a slash at its end; links stay as they are called.
std::filesystem::path absolute_path(const std::filesystem::path& path);
/// Licence as given, provenance by the source's name.
FileInfo file_info(const std::string& source, const ImportOptions& options);
void add_motion(const Motion& motion, DatasetWriter& writer, ImportSummary& summary);
enum class InputKind { data_folder, bvh, amc, character, amass, body_model, scans };
/// InputError for an option that none of these kinds takes: none is ignored without a word.
void check_options(const std::set<InputKind>& kinds, const std::string& source,
                   const ImportOptions& options);
/// Counts the files below the folder that are not `considered`, by the ends of their names.
void count_ignored(const std::string& folder, bool (*considered)(const std::string&),
                   ImportSummary& summary);
/// Calls `add` for each file; of several, those that it throws an InputError for are skipped with a
/// warning and listed.
void add_each(const std::vector<std::string>& files, ImportSummary& summary,
              const std::function<void(const std::string&)>& add);

/// BVH, AMC and glTF files (import_recordings.cpp).
bool is_recording_name(const std::string& path);
ImportSummary import_recordings(const std::vector<std::string>& files, const std::string& source,
                                const std::string& out, const ImportOptions& options);

/// An NPY, NPZ, PLY or OBJ file; a folder with such files somewhere below (import_arrays.cpp).
ImportSummary import_array_file(const std::string& source, const std::string& out,
                                const ImportOptions& options);
ImportSummary import_array_folder(const std::string& source, const std::string& out,
                                  const ImportOptions& options);

}  // namespace restage
