#include "datasets/fetch/fetch_cmu.h"

#include <cctype>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <vector>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "datasets/fetch/download.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/sha256.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr uint64_t kMostTree = uint64_t{64} << 20, kMostFile = uint64_t{256} << 20;

/// A file of a repository at its commit.
struct Blob {
  std::string path, sha1;
  uint64_t bytes = 0;
};

std::set<std::string> wanted_files(const CmuOriginals& originals) {
  std::set<std::string> out;
  for (const CmuOriginal& clip : originals.clips) {
    out.insert(clip.file);
    if (!clip.skeleton.empty()) out.insert(clip.skeleton);
  }
  return out;
}

/// Git's name of a file: SHA-1 over a word, its length and its bytes.
std::string git_sum(const std::string& bytes) {
  return sha1(cat("blob ", bytes.size(), '\0', bytes));
}

/// The list of a commit's files, which never changes: fetched once.
std::string fetch_tree(const CmuRepository& repository, const std::string& target) {
  std::error_code none;
  if (!fs::exists(target, none)) {
    make_folder_of(target);
    const std::string part = target + ".part";
    fs::remove(part, none);  // nobody knows its length, so it cannot be gone on with
    download(repository.tree, part, kMostTree);
    put_in_place(part, target);
  }
  return read_file(target, kMostTree);
}

std::vector<Blob> read_tree(const CmuRepository& repository, const std::string& path) {
  std::vector<Blob> out;
  try {
    const json listed = json::parse(fetch_tree(repository, path));
    for (const json& entry : listed.at("tree")) {
      if (entry.at("type") != "blob") continue;
      out.push_back({entry.at("path"), entry.at("sha"), entry.at("size")});
    }
  } catch (const json::exception&) {
    std::error_code none;
    fs::remove(path, none);
    throw WorkError(repository.tree + ": is not a repository's list of files; run it again later");
  }
  return out;
}

/// A path as part of an address: blanks and the like as %20.
std::string escaped(const std::string& path) {
  constexpr std::string_view kPlain = "-._~/";
  std::string out;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 128 && std::isalnum(byte) != 0) || kPlain.find(c) != std::string_view::npos)
      out += c;
    else
      out += cat("%", "0123456789ABCDEF"[byte >> 4], "0123456789ABCDEF"[byte & 15]);
  }
  return out;
}

void fetch_blob(const Blob& blob, const CmuRepository& repository, const std::string& target) {
  std::error_code none;
  if (fs::file_size(target, none) == blob.bytes && !none &&
      git_sum(read_file(target, kMostFile)) == blob.sha1)
    return;
  log_info(cat("fetching ", blob.path, " (", (blob.bytes + 999) / 1000, " kB)"));
  make_folder_of(target);
  const std::string part = target + ".part", address = repository.files + "/" + escaped(blob.path);
  download(address, part, blob.bytes);
  if (git_sum(read_file(part, kMostFile)) != blob.sha1) {
    fs::remove(part, none);
    throw WorkError(address + ": is not the file that its repository lists; run it again");
  }
  put_in_place(part, target);
}

}  // namespace

bool has_cmu_originals(const CmuOriginals& originals, const std::string& folder) {
  std::set<std::string> missing = wanted_files(originals);
  for (const std::string& path : files_below(folder))
    std::erase_if(missing, [&](const std::string& file) { return is_path_of(path, file); });
  return missing.empty();
}

void fetch_cmu_originals(const CmuOriginals& originals, const std::string& folder) {
  const std::set<std::string> wanted = wanted_files(originals);
  std::set<std::string> missing = wanted, seen;  // seen: sums, as some have copies of others' files
  for (const auto& [name, repository] : originals.repositories) {
    const std::string own = folder + "/" + name.substr(1);
    for (const Blob& blob : read_tree(repository, own + ".json"))
      for (const std::string& file : wanted) {
        if (!is_path_of(blob.path, file)) continue;
        throw_if_stopped();
        missing.erase(file);
        if (blob.bytes <= kMostFile && is_inside(blob.path) && seen.insert(blob.sha1).second)
          fetch_blob(blob, repository, own + "/" + blob.path);
      }
  }
  if (!missing.empty())
    throw WorkError(folder + ": none of the listed repositories has " + *missing.begin() +
                    (missing.size() > 1 ? cat(" or ", missing.size() - 1, " others") : "") +
                    "; correct the list, or put them there by hand");
}

}  // namespace restage
