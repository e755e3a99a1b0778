// What a prediction remembers of the source that its motion was taken from.
#include <filesystem>

#include "autograd/base/error.h"
#include "datasets/schema.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

/// From the root, links resolved as far as the path exists.
fs::path whole_path(const fs::path& path) { return fs::weakly_canonical(fs::absolute(path)); }

fs::path folder_of(const std::string& file) { return whole_path(file).parent_path(); }

}  // namespace

void PredictionWriter::set_filled(const std::vector<int64_t>& frames) {
  if (!frames.empty()) file_.write<int64_t>("/filled", {std::ssize(frames)}, frames);
}

std::vector<int64_t> read_filled(const std::string& path) {
  const h5::File file = open_schema_file(path);
  if (!file.has("/filled")) return {};
  const h5::Dataset set = file.dataset("/filled", {-1});
  std::vector<int64_t> out = set.read<int64_t>();
  const int64_t frames = file.dataset(file.has("/joints") ? "/joints" : "/vertices").rows();
  for (size_t i = 0; i < out.size(); ++i)
    if (out[i] < 0 || out[i] >= frames || (i > 0 && out[i] <= out[i - 1]))
      throw InputError(set.where(), "holds a number that is no frame, or not in order",
                       "give frames from 0, rising");
  return out;
}

void PredictionWriter::set_source(const SourceRecord& source) {
  const bool absolute = fs::path(source.path).is_absolute();
  const fs::path path = absolute
                            ? fs::path(source.path)
                            : whole_path(source.path).lexically_relative(folder_of(file_.path()));
  file_.create_group("/source");
  file_.set_text("/source", "path", path.string());
  if (source.fps) file_.set_number("/source", "fps", *source.fps);
  file_.set_number("/source", "scale", source.scale);
  file_.set_text("/source", "up", source.up);
  if (!source.clip.empty()) file_.set_text("/source", "clip", source.clip);
  if (source.sequence) file_.set_integer("/source", "sequence", *source.sequence);
}

std::optional<SourceRecord> read_source_record(const std::string& path) {
  const h5::File file = open_schema_file(path);
  const std::optional<std::string> source = file.text("/source", "path");
  if (!source || source->empty()) return std::nullopt;
  SourceRecord out;
  out.path = *source;
  if (fs::path(out.path).is_relative())
    out.path = (folder_of(path) / out.path).lexically_normal().lexically_proximate(whole_path("."));
  out.clip = file.text("/source", "clip").value_or("");
  out.sequence = file.integer("/source", "sequence");
  out.fps = file.number("/source", "fps");
  out.scale = file.number("/source", "scale").value_or(out.scale);
  out.up = file.text("/source", "up").value_or(out.up);
  return out;
}

}  // namespace restage
