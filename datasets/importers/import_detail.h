// What the files behind import_data() share.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "datasets/importers/import.h"

namespace restage {

/// Without "..", "." and a slash at its end; links stay as they are called.
std::filesystem::path absolute_path(const std::filesystem::path& path);
/// Licence as given, provenance by the source's name.
FileInfo file_info(const std::string& source, const ImportOptions& options);

enum class InputKind {
  data_folder,
  packed_clips,
  bvh,
  amc,
  character,
  amass,
  joints,
  body_model,
  scans,
  depth
};
/// InputError for an option that none of these kinds takes: none is ignored without a word.
void check_options(const std::set<InputKind>& kinds, const std::string& source,
                   const ImportOptions& options);
/// InputError for an fps that no recording has.
void check_fps(const ImportOptions& options);
/// Counts the files below the folder that are not `considered`, by the ends of their names.
void count_ignored(const std::string& folder, bool (*considered)(const std::string&),
                   ImportSummary& summary);

/// A data file that is filled from others. Of each of them all goes in or nothing.
class ImportWriter {
 public:
  ImportWriter(const std::string& out, const FileInfo& info, ImportSummary& summary)
      : writer_(out, info), summary_(summary) {}
  /// What `file` holds, counted in the summary. InputError naming it, before anything is written,
  /// if an id is taken.
  void add(const std::string& file, const std::vector<Body>& bodies,
           const std::vector<Motion>& motions);
  void commit() { writer_.commit(); }

 private:
  DatasetWriter writer_;
  ImportSummary& summary_;
  std::map<std::string, std::string> bodies_, motions_;  ///< id to the file it came from
};

/// Whether a file may hold scans, by its name.
bool holds_scans(const std::string& path);
/// InputError for a body model in a pickle.
[[noreturn]] void refuse_pickle(const std::string& path);

/// InputError for several files, with the reason and the remedy of the first.
[[noreturn]] void refuse_all(const std::string& where, const std::string& what,
                             const InputError& first);
/// Of folders: InputError with the first file's reason if nothing came of any of them.
void check_any(const ImportSummary& summary, const std::string& source);
/// Calls `add` for each file; of several, those that it throws an InputError for are skipped and
/// listed.
void add_each(const std::vector<std::string>& files, ImportSummary& summary,
              const std::function<void(const std::string&)>& add);

/// Who moves in each file, by ImportOptions::subjects; empty without. InputError: an expression
/// that is none or has no group, files that do not match (the first of them, and how many).
std::map<std::string, std::string> subjects_of(const std::vector<std::string>& files,
                                               const std::string& root,
                                               const std::string& expression);

/// BVH, AMC and glTF files (import_recordings.cpp).
bool is_recording_name(const std::string& path);
/// Whether these are glTF files without any skeleton or animation: points alone, or a mesh a frame.
bool are_bare_surfaces(const std::vector<std::string>& files);
ImportSummary import_recordings(const std::vector<std::string>& files, const std::string& source,
                                const std::string& out, const ImportOptions& options);

/// An NPY, NPZ, HDF5, mesh or cloud file; a folder with such files somewhere below
/// (import_arrays.cpp).
ImportSummary import_array_file(const std::string& source, const std::string& out,
                                const ImportOptions& options);
ImportSummary import_array_folder(const std::string& source, const std::string& out,
                                  const ImportOptions& options);

/// Positions of joints (import_joints.cpp): whether a file, or the first array of a folder, holds
/// them, and the motions that they are.
bool holds_joints(const std::string& source, const ImportOptions& options);
ImportSummary import_joints(const std::string& source, const std::string& out,
                            const ImportOptions& options);

/// Pictures of a depth camera (import_depth.cpp): whether the source holds them, or the options say
/// so, and the clouds that they are.
bool is_depth_source(const std::string& source, const ImportOptions& options);
ImportSummary import_depth(const std::string& source, const std::string& out,
                           const ImportOptions& options);

}  // namespace restage
