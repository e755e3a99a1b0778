// restage doctor: says what a file is, what stands out in it, and what is wrong with it. A file
// that is broken ends as bad input does anywhere else: one line, exit code 2. A new kind of file: a
// function that examines it and a line in kKinds.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <utility>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/importers/bvh.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "nn/weights/safetensors.h"
#include "train/config.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;

constexpr size_t kEnoughPoints = 64;  // distinct points that the skeleton extractor needs

struct Diagnosis {
  explicit Diagnosis(std::string what) : kind(std::move(what)) {}
  std::string kind;
  Json facts = Json::object();
  std::vector<std::string> notes;  ///< unusual, though readable
};

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

/// What a person's points should look like: metres, standing along y, enough of them.
void examine_points(const Points& points, Diagnosis& out) {
  Point low = points[0], high = points[0];
  std::set<std::array<float, 3>> distinct;
  for (const Point& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    if (distinct.size() < kEnoughPoints) distinct.insert({p.x(), p.y(), p.z()});
  }
  const Point size = high - low;
  out.facts["size"] = {size.x(), size.y(), size.z()};
  out.facts["lowest"] = low.y();
  if (distinct.size() < kEnoughPoints)
    out.notes.push_back("only " + std::to_string(distinct.size()) +
                        " distinct points; networks need " + std::to_string(kEnoughPoints));
  const double largest = size.maxCoeff();
  if (largest > 20)
    out.notes.push_back(number(largest) + " m large; centimetres? then use a scale of 0.01");
  else if (largest < 0.5)
    out.notes.push_back(number(largest) + " m large; not a person in metres");
  else if (size.z() > 1.2F * size.y())
    out.notes.push_back("longer along z than along y; lying, or with z up?");
}

Diagnosis examine_mesh(const std::string& path) {
  const Mesh mesh = read_mesh(path);
  Diagnosis out{mesh.faces.empty() ? "cloud" : "mesh"};
  out.facts["points"] = mesh.vertices.size();
  if (!mesh.faces.empty()) out.facts["faces"] = mesh.faces.size();
  examine_points(mesh.vertices, out);
  return out;
}

Diagnosis examine_folder(const std::string& path) {
  std::error_code ignored;
  if (fs::exists(path + "/config.yaml", ignored) && fs::exists(path + "/metrics.jsonl", ignored)) {
    load_config_tree(path + "/config.yaml");
    Diagnosis out{"run"};
    const std::string lines = read_file(path + "/metrics.jsonl");
    out.facts["records"] = std::count(lines.begin(), lines.end(), '\n');
    return out;
  }
  Diagnosis out{"frames"};
  const auto source = open_frames(path);
  size_t fewest = SIZE_MAX, most = 0;
  while (const auto frame = source->next()) {
    if (most == 0) examine_points(frame->points, out);
    fewest = std::min(fewest, frame->points.size());
    most = std::max(most, frame->points.size());
  }
  out.facts["frames"] = source->frames();
  out.facts["fewest_points"] = fewest;
  out.facts["most_points"] = most;
  return out;
}

Diagnosis examine_hdf5(const std::string& path) {
  const Inspection found = inspect(path);
  if (const auto problems = verify(path); !problems.empty()) throw Error(problems[0], 2);
  Diagnosis out{found.kind};
  for (const auto& [name, count] : found.counts) out.facts[name] = count;
  out.facts["units"] = found.units;
  out.facts["license"] = found.license;
  return out;
}

Diagnosis examine_bvh(const std::string& path) {
  const MotionClip clip = read_bvh(path);
  Diagnosis out{"bvh"};
  out.facts["frames_at_30_fps"] = clip.motion.frames();
  out.facts["metres_per_unit"] = clip.scale;
  out.facts["leg_length"] = leg_length(clip.motion.rest);
  out.facts["floor"] = clip.floor_y;
  return out;
}

Diagnosis examine_config(const std::string& path) {
  load_config_tree(path);
  return Diagnosis("config");
}

/// A few bytes from the start; InputError if the file cannot be read.
std::string first_bytes(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  char bytes[8] = {};
  file.read(bytes, sizeof bytes);
  if (file.bad() || (file.gcount() == 0 && errno != 0))
    throw InputError(path, std::string("cannot be read (") + std::strerror(errno) + ")",
                     "check the path");
  return {bytes, static_cast<size_t>(file.gcount())};
}

Diagnosis examine_weights(const std::string& path) {
  const TensorFile file = read_safetensors(path);
  Diagnosis out{"weights"};
  int64_t values = 0;
  for (const auto& [name, tensor] : file.tensors) values += tensor.numel();
  out.facts["tensors"] = file.tensors.size();
  out.facts["values"] = values;
  for (const auto& [key, text] : file.metadata) out.facts[key] = text;
  return out;
}

struct Kind {
  const char* start;                 ///< first bytes of such a file; empty: any
  std::vector<std::string> endings;  ///< of its name; none: any
  Diagnosis (*examine)(const std::string& path);
};

const Kind kKinds[] = {
    {"\x89HDF\r\n", {}, examine_hdf5},       {"ply", {}, examine_mesh},
    {"", {".ply", ".obj"}, examine_mesh},    {"", {".h5", ".hdf5"}, examine_hdf5},
    {"", {".bvh", ".bvh.xz"}, examine_bvh},  {"", {".yaml", ".yml"}, examine_config},
    {"", {".safetensors"}, examine_weights},
};

Diagnosis examine(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return examine_folder(path);
  const std::string start = first_bytes(path);
  for (const Kind& kind : kKinds) {
    const auto named = [&](const std::string& ending) { return path.ends_with(ending); };
    if (start.starts_with(kind.start) &&
        (kind.endings.empty() || std::any_of(kind.endings.begin(), kind.endings.end(), named)))
      return kind.examine(path);
  }
  throw InputError(path, "is of no kind that is known here",
                   "give HDF5, PLY, OBJ, BVH, safetensors, YAML or a folder of frames");
}

int run_doctor(const std::string& path, const Common& common) {
  const Diagnosis found = examine(path);
  if (common.json) {
    print_json(
        {{"file", path}, {"kind", found.kind}, {"facts", found.facts}, {"notes", found.notes}});
    return 0;
  }
  std::string text = path + ": " + found.kind + "\n";
  for (const auto& [name, value] : found.facts.items())
    text += "  " + name + ": " + value.dump() + "\n";
  for (const std::string& note : found.notes) text += "  note: " + note + "\n";
  print(text);
  return 0;
}

}  // namespace

void add_doctor(Program& program) {
  const auto path = std::make_shared<std::string>();
  CLI::App& app = program.add("doctor", "say what a file is and what is wrong with it",
                              "restage doctor scan.ply\nrestage doctor frames/ --json",
                              [path, &program] { return run_doctor(*path, program.common()); });
  app.add_option("FILE", *path, "HDF5, PLY, OBJ, BVH, safetensors, YAML, or a folder of frames")
      ->required();
}

}  // namespace restage::cli
