// manifest.json of a benchmark folder: every file with its size and SHA-256.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace restage {

inline constexpr const char* kManifestName = "manifest.json";

struct ManifestFile {
  std::string sha256;  ///< 64 hexadecimal digits
  uint64_t bytes = 0;
};

struct Manifest {
  std::string protocol, license, provenance;
  uint64_t seed = 0;
  std::map<std::string, ManifestFile> inputs;  ///< what it was built from, by name
  std::map<std::string, ManifestFile> files;   ///< by path relative to the folder, with '/'
};

ManifestFile describe_file(const std::string& path);
/// All regular files below `folder` but the manifest itself.
std::map<std::string, ManifestFile> describe_files(const std::string& folder);

/// SHA-256 of what a benchmark is made from: protocol, seed, inputs and recipe (without a recipe,
/// its files). What is built from the same has the same, whatever else a later build writes into
/// files.
std::string content_of(const Manifest& manifest);

/// Writes folder/manifest.json; equal content gives equal bytes.
void write_manifest(const std::string& folder, const Manifest& manifest);
/// InputError: missing, damaged, or with names that lead out of the folder.
Manifest read_manifest(const std::string& folder);

/// Compares the folder with its manifest, checks every HDF5 file (schema's verify()), and that no
/// body, clip or subject is in two of train.h5, validation.h5 and test.h5. One line per problem.
/// InputError if there is no usable manifest.
std::vector<std::string> verify_benchmark(const std::string& folder);

}  // namespace restage
