#include "datasets/fetch/fetch.h"

#include <zlib.h>

#include <charconv>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "datasets/fetch/download.h"
#include "datasets/fetch/fetch_cmu.h"
#include "datasets/importers/bodies/makehuman_pack.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/frames/folders.h"
#include "datasets/readers/sha256.h"
#include "datasets/readers/text/packed_text.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostList = uint64_t{16} << 20;
constexpr std::string_view kMakehuman = "makehuman:",
                           kCmu = "cmu:";             // packed from the files of a list
constexpr uint64_t kMostPacked = uint64_t{64} << 20;  // of files that are packed here

using Addresses = std::map<std::string, std::string>;  // what "@NAME" stands for

/// "@NAME/rest" with what the name stands for.
std::string resolved(const std::string& address, const Addresses& known, const std::string& where) {
  if (address.empty() || address[0] != '@') return address;
  const size_t end = std::min(address.find('/'), address.size());
  const auto at = known.find(address.substr(0, end));
  if (at == known.end())
    throw InputError(where, "uses an @ name that no line above it explains", "mend the list");
  return at->second + address.substr(end);
}

bool is_remote(const std::string& address) { return address.find("://") != std::string::npos; }

FetchEntry entry_of(const std::string& line, const std::string& where, const Addresses& known) {
  std::istringstream words(line);
  FetchEntry out;
  std::string bytes, rest;
  words >> out.sha256 >> bytes >> out.path >> out.address;
  const auto [end, error] = std::from_chars(bytes.data(), bytes.data() + bytes.size(), out.bytes);
  if (!is_sha256(out.sha256) || error != std::errc() || end != bytes.data() + bytes.size() ||
      out.address.empty() || words >> rest)
    throw InputError(where, "is no line 'SHA256 BYTES PATH ADDRESS'", "mend the list");
  if (!is_inside(out.path))
    throw InputError(where, "names a file outside of the data folder", "mend the list");
  out.address = resolved(out.address, known, where);
  if (is_remote(out.address) && !out.address.starts_with("https://") &&
      !out.address.starts_with("file://"))
    throw InputError(where, "names an address that is neither https:// nor file://",
                     "mend the list");
  return out;
}

bool packed_here(const FetchEntry& e) {
  return e.path.ends_with(".gz") && !e.address.ends_with(".gz");
}

/// Gzip without name and time, so equal content gives equal bytes.
std::string packed(const std::string& content) {
  z_stream stream{};
  if (deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw WorkError("a file cannot be packed: zlib does not start");
  std::string out(deflateBound(&stream, content.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int done = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (done != Z_STREAM_END) throw WorkError("a file cannot be packed by zlib");
  return out;
}

/// Whether the file `path` holds what the entry pins.
bool is_right(const FetchEntry& e, const std::string& path, bool inside_gz) {
  std::error_code none;
  if (!fs::is_regular_file(path, none)) return false;
  if (inside_gz) {
    const std::optional<std::string> content = read_gz(path, kMostPacked);
    return content && content->size() == e.bytes && sha256(*content) == e.sha256;
  }
  return fs::file_size(path, none) == e.bytes && sha256_of_file(path) == e.sha256;
}

void copy_in(const std::string& source, const std::string& target) {
  AtomicFile file(target);
  std::error_code failed;
  fs::copy_file(source, file.path(), fs::copy_options::overwrite_existing, failed);
  if (failed) throw WorkError(target + ": cannot be written; check space and permissions");
  using Who = fs::perms;  // the source may be read-only
  fs::permissions(file.path(),
                  Who::owner_read | Who::owner_write | Who::group_read | Who::others_read, failed);
  file.commit();
}

/// Where a file of an address without protocol lies: beside the list.
std::string beside(const std::string& list, const std::string& address) {
  return (fs::path(list).parent_path() / address).string();
}

/// Whether the file `path` is what the entry of `list` means; clips may have been packed by anyone.
bool is_right(const FetchEntry& e, const std::string& path, const std::string& list) {
  return is_right(e, path, packed_here(e)) ||
         (e.address.starts_with(kCmu) && fs::is_regular_file(path) &&
          is_packed_cmu(read_cmu_originals(beside(list, e.address.substr(kCmu.size()))), path));
}

/// From an address into its place.
void bring(const FetchEntry& e, const std::string& target) {
  const std::string part = target + ".part";
  std::error_code none;
  download(e.address, part, e.bytes);
  if (!is_right(e, part, false)) {
    fs::remove(part, none);
    throw WorkError(e.address + ": is not the file that the list pins (SHA-256 " +
                    e.sha256.substr(0, 12) + "...); nothing was put in place");
  }
  if (packed_here(e)) {
    write_file_atomically(target, packed(read_file(part, kMostPacked)));
    fs::remove(part, none);
    return;
  }
  put_in_place(part, target);
}

// ---- what is to be done, found out before anything is ------------------------------------------

struct Folders {
  const std::string &out, &from;
};

enum class Way { present, copy, download, makehuman, cmu, missing };

struct Step {
  FetchEntry entry;
  Way way = Way::missing;
  std::string source;       ///< what is copied; of cmu the list
  std::vector<Step> parts;  ///< of makehuman
};

std::vector<Step> plan(const std::string& list, const Folders& folders);

Step plan_makehuman(const FetchEntry& e, const std::string& list, const Folders& folders) {
  for (const FetchEntry& part : read_fetch_list(list))
    if (part.address.starts_with(kMakehuman) || part.address.starts_with(kCmu))
      throw InputError(list, "lists a file that is packed from others again", "mend the list");
  Step out{e, Way::makehuman, "", plan(list, folders)};
  for (const Step& part : out.parts)
    if (part.way == Way::missing) out.way = Way::missing;
  return out;
}

Step plan_cmu(const FetchEntry& e, const std::string& list, const Folders& folders) {
  const CmuOriginals originals = read_cmu_originals(list);
  const bool there = folders.from.empty() || has_cmu_originals(originals, folders.from);
  return {e, there ? Way::cmu : Way::missing, list, {}};
}

Step plan_one(const FetchEntry& e, const std::string& list, const Folders& folders) {
  if (is_right(e, folders.out + "/" + e.path, list)) return {e, Way::present, "", {}};
  const std::string copy = folders.from + "/" + e.path;
  const bool copied = !folders.from.empty() && fs::exists(copy);
  if (copied && is_right(e, copy, list)) return {e, Way::copy, copy, {}};
  Step out{e, Way::missing, "", {}};
  if (e.address.starts_with(kMakehuman)) {  // packed elsewhere it may differ, its parts do not
    out = plan_makehuman(e, beside(list, e.address.substr(kMakehuman.size())), folders);
  } else if (e.address.starts_with(kCmu)) {
    out = plan_cmu(e, beside(list, e.address.substr(kCmu.size())), folders);
  } else if (is_remote(e.address)) {
    if (folders.from.empty()) out.way = Way::download;
  } else if (e.address != "-" && !copied) {
    out = {e, Way::copy, beside(list, e.address), {}};
    if (!is_right(e, out.source, false))
      throw InputError(out.source, "is not the file that the list pins",
                       "restore it, or correct the list");
  }
  if (copied && out.way == Way::missing)
    throw InputError(copy, "is not the file that the list pins",
                     "give a folder with the right one");
  return out;
}

/// InputError for lists, copies and files beside the list that are not what they should be.
std::vector<Step> plan(const std::string& list, const Folders& folders) {
  std::vector<Step> out;
  for (const FetchEntry& e : read_fetch_list(list)) {
    throw_if_stopped();
    out.push_back(plan_one(e, list, folders));
  }
  return out;
}

// ---- doing it ----------------------------------------------------------------------------------

void perform(const Step& step, const Folders& folders) {
  if (step.way == Way::present || step.way == Way::missing) return;
  throw_if_stopped();
  const FetchEntry& e = step.entry;
  const std::string target = folders.out + "/" + e.path;
  make_folder_of(target);
  log_info(cat("fetching ", e.path, " (", (e.bytes + 999) / 1000, " kB)"));
  if (step.way == Way::copy) copy_in(step.source, target);
  if (step.way == Way::download) bring(e, target);
  if (step.way == Way::makehuman) {
    for (const Step& part : step.parts) perform(part, folders);
    pack_makehuman(folders.out + "/body/makehuman", target);
  }
  if (step.way == Way::cmu) {
    const CmuOriginals originals = read_cmu_originals(step.source);
    const std::string found = folders.from.empty() ? folders.out + "/cmu/originals" : folders.from;
    if (folders.from.empty()) fetch_cmu_originals(originals, found);
    log_info(cat("packing ", originals.clips.size(), " clips"));
    pack_cmu(originals, found, target);
  }
}

}  // namespace

std::vector<FetchEntry> read_fetch_list(const std::string& list) {
  const std::string text = read_file(list, kMostList);
  std::vector<FetchEntry> out;
  std::set<std::string> paths;
  Addresses known;
  std::istringstream lines(text);
  std::string line;
  for (size_t number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const std::string where = cat(list, ":", number);
    if (line[0] == '@') {
      std::istringstream words(line);
      std::string name, address, rest;
      if (!(words >> name >> address) || words >> rest || !known.emplace(name, address).second)
        throw InputError(where, "is no line '@NAME ADDRESS' of a new name", "mend the list");
      continue;
    }
    out.push_back(entry_of(line, where, known));
    if (!paths.insert(out.back().path).second)
      throw InputError(where, "names a file that stands above already", "name each file once");
  }
  if (out.empty()) throw InputError(list, "lists no files", "give a list of files to fetch");
  return out;
}

FetchSummary fetch_data(const std::string& list, const std::string& out, const std::string& from) {
  const StopScope stop;
  if (!from.empty() && !fs::is_directory(from))
    throw InputError(from, "is no folder", "give {source} a data folder");
  const Folders folders{out, from};
  const std::vector<Step> steps = plan(list, folders);
  std::error_code failed;
  fs::create_directories(out, failed);
  if (failed) throw InputError(out, "cannot be made a folder", "give a place you can write to");
  FetchSummary summary;
  for (const Step& step : steps) {
    try {
      perform(step, folders);
    } catch (const InputError& error) {  // what could be checked before was: a damaged recording
      throw WorkError(error.what());
    }
    if (step.way == Way::present) {
      ++summary.present;
    } else if (step.way == Way::missing) {
      summary.missing.push_back(step.entry.path);
    } else {
      ++summary.fetched;
      summary.bytes += step.entry.bytes;
    }
  }
  return summary;
}

}  // namespace restage
