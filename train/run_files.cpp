#include "train/run_files.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"

namespace restage::run_files {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kSuffix = ".safetensors";
constexpr size_t kChecksum = 16;

/// Reads what checkpoint_name() wrote; nothing if the name is of another form.
std::optional<Entry> parse_name(const fs::path& path) {
  std::string name = path.filename().string();
  if (name.size() < kSuffix.size() || !name.ends_with(kSuffix)) return {};
  name.resize(name.size() - kSuffix.size());
  const size_t second = name.rfind('-');
  if (second == std::string::npos || second == 0 || name.size() - second - 1 != kChecksum)
    return {};
  const size_t first = name.rfind('-', second - 1);
  if (first == std::string::npos) return {};
  Entry entry;
  entry.path = path.string();
  entry.checksum = name.substr(second + 1);
  const char* end = name.data() + second;
  const auto number = std::from_chars(name.data() + first + 1, end, entry.step);
  if (number.ec != std::errc() || number.ptr != end || entry.step < 0) return {};
  entry.stage = name.substr(0, first);
  return entry;
}

size_t order_of(const std::vector<std::string>& stages, const std::string& stage) {
  return static_cast<size_t>(std::find(stages.begin(), stages.end(), stage) - stages.begin());
}

/// Whether a line of metrics.jsonl is whole, of one of the stages, and not after `last`.
bool keeps(const std::string& line, const std::vector<std::string>& stages,
           const Checkpoint& last) {
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object()) return false;
  const auto step = json.find("step"), stage = json.find("stage");
  if (step == json.end() || stage == json.end() || !step->is_number_integer() ||
      !stage->is_string())
    return false;
  const size_t order = order_of(stages, stage->get<std::string>()),
               last_order = order_of(stages, last.stage);
  return order < last_order || (order == last_order && step->get<int64_t>() <= last.step);
}

void remove_file(const std::string& path) {
  std::error_code ignored;  // a file that cannot be removed does no harm
  fs::remove(path, ignored);
}

}  // namespace

std::string checkpoint_name(const std::string& stage, int64_t step, std::string_view bytes) {
  return stage + format("-%09lld-", static_cast<long long>(step)) + checksum(bytes) +
         std::string(kSuffix);
}

std::vector<Entry> list_checkpoints(const std::string& dir,
                                    const std::vector<std::string>& stages) {
  std::vector<Entry> entries;
  const std::string folder = (fs::path(dir) / "checkpoints").string();
  std::error_code error;
  const fs::directory_iterator items(folder, error);
  if (error && is_there(folder)) throw ReadError(folder, error.value());
  for (const auto& item : items) {
    auto entry = parse_name(item.path());
    if (entry && order_of(stages, entry->stage) < stages.size())
      entries.push_back(std::move(*entry));
  }
  std::sort(entries.begin(), entries.end(), [&stages](const Entry& a, const Entry& b) {
    const size_t order_a = order_of(stages, a.stage), order_b = order_of(stages, b.stage);
    if (order_a != order_b) return order_a < order_b;
    return a.step != b.step ? a.step < b.step : a.path < b.path;
  });
  return entries;
}

std::optional<Checkpoint> newest_good(const std::vector<Entry>& entries,
                                      std::vector<std::string>& passed_over) {
  for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
    try {
      Checkpoint found{entry->path, entry->stage, entry->step, read_file(entry->path)};
      if (checksum(found.bytes) == entry->checksum) return found;
      passed_over.push_back(entry->path + ": the checkpoint is damaged and passed over");
    } catch (const ReadError& error) {
      if (!error.absent()) throw;  // it may be good
      passed_over.push_back(entry->path + ": the checkpoint was removed in the meantime");
    } catch (const Error& error) {
      passed_over.push_back(std::string(error.what()) + " (the checkpoint is passed over)");
    }
  }
  return {};
}

void prune(const std::vector<Entry>& entries, const KeepRule& keep) {
  const int64_t first = std::ssize(entries) - std::max<int64_t>(keep.last, 1);
  for (int64_t i = 0; i < first; ++i) {
    const Entry& entry = entries[static_cast<size_t>(i)];
    const bool marked = keep.every > 0 && entry.step % keep.every == 0;
    if (!marked && entry.step != keep.best) remove_file(entry.path);
  }
}

void remove_leftovers(const std::string& dir) {
  std::error_code ignored;
  for (const fs::path& folder : {fs::path(dir), fs::path(dir) / "checkpoints"})
    for (const auto& item : fs::directory_iterator(folder, ignored))
      if (item.path().extension().string().starts_with(".part")) remove_file(item.path().string());
}

void cut_metrics(const std::string& dir, const std::vector<std::string>& stages,
                 const std::optional<Checkpoint>& last) {
  const std::string path = (fs::path(dir) / "metrics.jsonl").string();
  if (!fs::exists(path)) return;
  const std::string text = read_file(path);
  std::string kept;
  for (size_t at = 0, end; last && (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    const std::string line = text.substr(at, end - at);
    if (keeps(line, stages, *last)) kept += line + "\n";
  }
  if (kept != text) write_file_atomically(path, kept);
}

}  // namespace restage::run_files
