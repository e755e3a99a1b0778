// What a file holds (inspect) and whether it holds together (verify).
#include <algorithm>
#include <functional>
#include <limits>

#include "autograd/base/error.h"
#include "datasets/schema.h"
#include "datasets/schema_detail.h"

namespace restage {
namespace {

/// By what is in the file, so that a file without attributes has a kind too.
std::string kind_of(const h5::File& file) {
  const bool bodies = file.has("/bodies"), motions = file.has("/motions");
  if (bodies || motions) return !motions ? "bodies" : !bodies ? "motions" : "dataset";
  if (file.has("/points")) return "scans";
  if (file.has("/joints") || file.has("/vertices")) return "prediction";
  throw InputError(file.path(), "holds no bodies, motions, scans or predictions",
                   "give a file laid out as in datasets/README.md");
}

double height_of(const h5::Dataset& vertices) {
  std::vector<float> values;
  vertices.read_rows(0, vertices.rows(), values);
  float low = std::numeric_limits<float>::max(), high = -low;
  for (size_t i = 1; i < values.size(); i += 3) {
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  return values.empty() ? 0 : high - low;
}

/// Adds one body or motion of a group to what its attributes say of it.
void count_member(const h5::File& file, const std::string& object, const std::string& kind,
                  Inspection& out) {
  ++out.counts[kind];
  const auto said = [&](const char* name) { return file.text(object, name).value_or(""); };
  if (const std::string split = said("split"); !split.empty()) ++out.splits[split][kind];
  if (kind != "motions") return;
  if (const std::string subject = said("subject"); !subject.empty()) ++out.subjects[subject];
  if (const std::string action = said("action"); !action.empty()) ++out.actions[action];
}

void count_dataset(const h5::File& file, Inspection& out) {
  if (file.has("/bodies")) {
    out.counts["bodies"] = out.counts["vertices"] = 0;
    for (const std::string& id : file.children("/bodies")) {
      const h5::Dataset vertices = file.dataset("/bodies/" + id + "/vertices", {-1, 3});
      out.counts["vertices"] += vertices.rows();
      out.heights.push_back(height_of(vertices));
      count_member(file, "/bodies/" + id, "bodies", out);
      if (const JointDefinition name = read_definition(file, "/bodies/" + id); !name.empty())
        ++out.definitions[name];
    }
    std::sort(out.heights.begin(), out.heights.end());
  }
  if (file.has("/motions")) {
    out.counts["motions"] = out.counts["frames"] = 0;
    for (const std::string& id : file.children("/motions")) {
      const int64_t frames = file.dataset("/motions/" + id + "/hips", {-1, 3}).rows();
      out.counts["frames"] += frames;
      count_member(file, "/motions/" + id, "motions", out);
      if (const auto split = file.text("/motions/" + id, "split"))
        out.splits[*split]["frames"] += frames;
    }
  }
}

void count_frames(const h5::File& file, std::map<std::string, int64_t>& counts) {
  if (file.has("/points")) {
    counts["points"] = file.dataset("/points", {-1, 3}).rows();
    counts["frames"] = file.dataset("/frame_offset", {-1}).rows() - 1;
  }
  if (file.has("/joints")) {
    counts["frames"] = file.dataset("/joints", {-1, kJoints, 3}).rows();
    counts["joints"] = kJoints;
  }
  if (file.has("/vertices")) {
    const h5::Dataset set = file.dataset("/vertices", {-1, -1, 3});
    counts["frames"] = set.rows();
    counts["vertices"] = set.shape()[1];
  }
  if (file.has("/faces")) counts["faces"] = file.dataset("/faces", {-1, 3}).rows();
  if (file.has("/filled")) counts["filled"] = file.dataset("/filled", {-1}).rows();
  counts["sequences"] =
      file.has("/sequence_offset") ? file.dataset("/sequence_offset", {-1}).rows() - 1 : 1;
}

void collect(std::vector<std::string>& problems, const std::function<void()>& check) {
  try {
    check();
  } catch (const InputError& error) {
    problems.push_back(error.what());
  }
}

void check_split(const h5::File& file, const std::string& object, const std::string& split) {
  if (!is_split(split))
    throw InputError(file.path() + ":" + object, "has the split '" + split + "'",
                     "use train, validation or test");
}

void verify_members(const h5::File& file, std::vector<std::string>& problems) {
  SharedShapes shared;
  if (file.has("/bodies"))
    for (const std::string& id : file.children("/bodies"))
      collect(problems,
              [&] { check_split(file, "/bodies/" + id, read_body(file, id, shared).split); });
  if (file.has("/motions"))
    for (const std::string& id : file.children("/motions"))
      collect(problems, [&] { check_split(file, "/motions/" + id, read_motion(file, id).split); });
}

void verify_scans(const h5::File& file) {
  const h5::Dataset points = file.dataset("/points", {-1, 3});
  check_all_finite<float>(points);
  const int64_t frames = std::ssize(read_offsets(file, "/frame_offset", points.rows(), false)) - 1;
  sequence_offsets(file, frames);
  if (file.has("/joints")) check_all_finite<double>(file.dataset("/joints", {frames, kJoints, 3}));
}

}  // namespace

JointDefinition read_definition(const h5::File& file, const std::string& object) {
  return checked_definition(file.text(object, kJointDefinition).value_or(""),
                            object == "/" ? file.path() : file.path() + ":" + object);
}

double read_fps(const h5::File& file) {
  const double fps = file.number("/", "fps").value_or(kFps);
  if (!(fps > 0 && fps < 1e6))
    throw InputError(file.path(), "has an impossible frame rate (attribute fps)",
                     "store frames per second");
  return fps;
}

Inspection inspect(const std::string& path) {
  const h5::File file = open_schema_file(path);
  Inspection out;
  out.kind = kind_of(file);
  out.units = file.text("/", "units").value_or("metres");
  out.license = file.text("/", "license").value_or("unknown");
  out.provenance = file.text("/", "provenance").value_or("unknown");
  if (out.kind == "scans" || out.kind == "prediction")
    count_frames(file, out.counts);
  else
    count_dataset(file, out);
  if (const JointDefinition name = read_definition(file, "/"); !name.empty())
    out.definitions[name] = 1;
  out.fps = read_fps(file);
  out.transform = file.text("/", "transform").value_or("");
  if (out.counts.contains("frames"))
    out.seconds = static_cast<double>(out.counts.at("frames")) / out.fps;
  return out;
}

std::vector<std::string> verify(const std::string& path) {
  const h5::File file = open_schema_file(path);
  const std::string kind = kind_of(file);
  std::vector<std::string> problems;
  collect(problems, [&] {
    const std::string units = file.text("/", "units").value_or("metres");
    const bool scanned = kind == "scans" && units == "unknown";  // a scanner's own frame
    if (units != "metres" && !scanned)
      throw InputError(path, "is in '" + units + "'", "convert it to metres");
  });
  collect(problems, [&] { read_fps(file); });
  if (kind == "scans") {
    collect(problems, [&] { verify_scans(file); });
  } else if (kind == "prediction") {
    collect(problems, [&] { PredictionReader(path).check(); });
    collect(problems, [&] { read_filled(path); });
    collect(problems, [&] { read_source_record(path); });
  } else
    collect(problems, [&] { verify_members(file, problems); });
  return problems;
}

}  // namespace restage
