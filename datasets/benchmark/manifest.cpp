#include "datasets/benchmark/manifest.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/sha256.h"
#include "datasets/schema.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr uint64_t kMostBytes = uint64_t{16} << 20;

Json to_json(const std::map<std::string, ManifestFile>& files) {
  Json out = Json::object();
  for (const auto& [path, file] : files)
    out[path] = {{"sha256", file.sha256}, {"bytes", file.bytes}};
  return out;
}

std::map<std::string, ManifestFile> files_of(const Json& json, const std::string& where) {
  std::map<std::string, ManifestFile> out;
  for (const auto& [name, entry] : json.items()) {
    ManifestFile file{entry.at("sha256").get<std::string>(), entry.at("bytes").get<uint64_t>()};
    if (!is_inside(name) || !is_sha256(file.sha256))
      throw InputError(where, "lists a file that cannot be one of this folder",
                       "build the folder again");
    out[name] = file;
  }
  return out;
}

/// Which split a body, clip or subject was first seen in.
class Splits {
 public:
  explicit Splits(std::vector<std::string>& problems) : problems_(problems) {}
  void add(const std::string& kind, const std::string& name, const std::string& split,
           const std::string& file) {
    const auto [at, added] = seen_.emplace(kind + " '" + name + "'", split);
    if (!added && at->second != split)
      problems_.push_back(file + ": " + at->first + " is in " + at->second + " too; build again");
  }

 private:
  std::map<std::string, std::string> seen_;
  std::vector<std::string>& problems_;
};

void check_splits(const std::string& folder, std::vector<std::string>& problems) {
  Splits splits(problems);
  for (const char* split : {"train", "validation", "test"}) {
    const std::string path = folder + "/" + split + ".h5";
    if (!fs::exists(path)) continue;
    try {
      const std::string kind = inspect(path).kind;
      if (kind != "motions")
        for (const Body& body : read_bodies(path)) splits.add("body", body.id, split, path);
      if (kind == "bodies") continue;
      for (const Motion& motion : read_motions(path)) {
        splits.add("clip", motion.id, split, path);
        splits.add("subject", motion.subject, split, path);
      }
    } catch (const InputError& error) {
      problems.emplace_back(error.what());
    }
  }
}

void check_file(const std::string& folder, const std::string& name, const ManifestFile& listed,
                std::vector<std::string>& problems) {
  const std::string path = folder + "/" + name;
  std::error_code failed;
  const uint64_t bytes = fs::file_size(path, failed);
  if (!is_there(path)) {
    problems.push_back(path + ": is missing; build or copy the folder again");
  } else if (failed || bytes != listed.bytes) {
    problems.push_back(cat(path, ": has ", bytes, " bytes instead of ", listed.bytes,
                           "; build or copy the folder again"));
  } else if (sha256_of_file(path) != listed.sha256) {
    problems.push_back(path + ": is not what the manifest says; build or copy the folder again");
  } else if (path.ends_with(".h5")) {
    const std::vector<std::string> found = verify(path);
    problems.insert(problems.end(), found.begin(), found.end());
  }
}

}  // namespace

std::string content_of(const Manifest& manifest) {
  Json json = {{"protocol", manifest.protocol},
               {"seed", manifest.seed},
               {"inputs", to_json(manifest.inputs)}};
  const auto recipe = manifest.files.find("recipe.yaml");
  json["files"] = to_json(recipe == manifest.files.end() ? manifest.files : std::map{*recipe});
  return sha256(json.dump());
}

ManifestFile describe_file(const std::string& path) {
  std::error_code failed;
  const uint64_t bytes = fs::file_size(path, failed);
  if (failed) throw InputError(path, "cannot be read", "check that it is there");
  return {sha256_of_file(path), bytes};
}

std::map<std::string, ManifestFile> describe_files(const std::string& folder) {
  std::map<std::string, ManifestFile> out;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    if (!entry.is_directory() && name != kManifestName)
      out[name] = describe_file(entry.path().string());
  }
  return out;
}

void write_manifest(const std::string& folder, const Manifest& manifest) {
  const Json json = {{"restage_benchmark", kVersion},
                     {"protocol", manifest.protocol},
                     {"seed", manifest.seed},
                     {"license", manifest.license},
                     {"provenance", manifest.provenance},
                     {"inputs", to_json(manifest.inputs)},
                     {"files", to_json(manifest.files)}};
  write_file_atomically(folder + "/" + kManifestName, json.dump(1) + "\n");
}

Manifest read_manifest(const std::string& folder) {
  const std::string path = folder + "/" + kManifestName;
  const std::string text = read_file(path, kMostBytes);
  try {
    const Json json = Json::parse(text);
    if (json.at("restage_benchmark").get<int>() != kVersion)
      throw InputError(path, "has a version that is unknown", "use the program that wrote it");
    Manifest out;
    out.protocol = json.at("protocol").get<std::string>();
    out.seed = json.at("seed").get<uint64_t>();
    out.license = json.at("license").get<std::string>();
    out.provenance = json.at("provenance").get<std::string>();
    out.inputs = files_of(json.at("inputs"), path);
    out.files = files_of(json.at("files"), path);
    return out;
  } catch (const Json::exception&) {
    throw InputError(path, "is no manifest of a benchmark folder", "build the folder again");
  }
}

std::vector<std::string> verify_benchmark(const std::string& folder) {
  const Manifest manifest = read_manifest(folder);
  std::vector<std::string> problems;
  for (const auto& [name, listed] : manifest.files) check_file(folder, name, listed, problems);
  std::error_code failed;
  fs::recursive_directory_iterator at(folder, failed);
  for (; !failed && at != fs::recursive_directory_iterator(); at.increment(failed)) {
    const std::string name = at->path().lexically_relative(folder).generic_string();
    const bool file = at->is_symlink() || !at->is_directory();  // no link is followed
    if (file && name != kManifestName && manifest.files.count(name) == 0)
      problems.push_back(folder + "/" + name + ": is not in the manifest; remove it");
  }
  if (failed) throw InputError(folder, "cannot be listed", "check its permissions");
  check_splits(folder, problems);
  return problems;
}

}  // namespace restage
