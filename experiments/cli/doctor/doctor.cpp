// restage doctor: says what a file is, what stands out in it, what is wrong with it, and mends it.
// A file that is broken ends as bad input does anywhere else: one line, exit code 2. A new kind of
// file: a function that examines it and a line in kKinds.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <utility>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/doctor/examine.h"
#include "datasets/doctor/mended_file.h"
#include "datasets/importers/motions/amc.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/foreign_kinds.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/doctor/doctor_people.h"
#include "experiments/cli/doctor/doctor_report.h"
#include "experiments/cli/perform/joint_source.h"
#include "experiments/cli/perform/source_options.h"
#include "nn/config/config.h"
#include "nn/weights/safetensors.h"

namespace restage::cli {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string path, picture, up, facing, bones;
  std::optional<std::string> fix;
  std::optional<double> scale, fps;
  bool target = false, self = false, people = false;
  uint64_t max_memory = kMaxMemory;
};

/// What is said of any kind of file.
struct Report {
  explicit Report(std::string what) : kind(std::move(what)) {}
  std::string kind;
  Json facts = Json::object();
  std::vector<Finding> findings;
  std::optional<Diagnosis> diagnosis;  ///< of clouds, surfaces and sequences,
  Subject subject;                     ///< and what was examined, drawn and repaired
  bool usable() const {
    return std::none_of(findings.begin(), findings.end(),
                        [](const Finding& f) { return f.weight == Weight::wrong; });
  }
};

// ---- scans, surfaces, sequences ----------------------------------------------------------------

int direction_of(const std::string& option, const std::string& text) {
  for (size_t i = 0; i < kDirections.size(); ++i)
    if (text == kDirections[i] || (i % 2 == 0 && text == kDirections[i] + 1))
      return static_cast<int>(i);
  throw InputError("", option + " '" + text + "' is no direction", "give one of +x -x +y -y +z -z");
}

/// `known`: what the file says of itself.
ExamineOptions examine_options(const Options& options, ExamineOptions known = {}) {
  ExamineOptions out = std::move(known);
  out.fps = options.fps;
  if (out.fps && !(*out.fps >= 1 && *out.fps <= 1000))
    throw InputError("", "--fps is out of range",
                     "give the sequence's frames per second, 1 to 1000");
  out.target = options.target;
  out.scale = options.scale;
  if (out.scale && !(*out.scale >= kLeastScale && *out.scale <= kMostScale))
    throw InputError("", "--scale is out of range", "give metres per unit, 1e-9 to 1e6");
  if (!options.up.empty()) out.up = direction_of("--up", options.up);
  if (!options.facing.empty()) out.facing = direction_of("--facing", options.facing);
  return out;
}

Report examine_one(const std::string& kind, Mesh mesh, const Vec3& origin, const Options& options,
                   ExamineOptions known = {}) {
  Report out(kind);
  Point low = mesh.vertices[0], high = mesh.vertices[0];
  for (const Point& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Point size = high - low;
  out.facts["points"] = mesh.vertices.size();
  if (!mesh.faces.empty()) out.facts["faces"] = mesh.faces.size();
  out.facts["size"] = {size.x(), size.y(), size.z()};
  out.diagnosis = examine_surface(mesh, examine_options(options, std::move(known)));
  out.findings = out.diagnosis->findings;
  out.subject = {options.path, std::move(mesh), nullptr, std::nullopt, "", origin};
  return out;
}

Report examine_mesh(const Options& options) {
  Vec3 origin;
  LeftOut left_out;
  Mesh mesh = read_mesh(options.path, left_out, origin);
  const char* kind = mesh.faces.empty() ? "cloud" : "mesh";
  Report out = examine_one(kind, std::move(mesh), origin, options);
  if (const auto far = far_from_origin(origin, out.subject.mesh->vertices))
    out.findings.push_back(*far);
  if (left_out.non_finite > 0)
    out.findings.push_back(non_finite(left_out.non_finite, "", options.target));
  if (left_out.faint > 0)
    out.findings.push_back({"splats", Weight::note,
                            counted(left_out.faint, "splat") + " of an opacity below a tenth", 1,
                            "nobody sees them", "--fix leaves them out"});
  return out;
}

Report examine_sequence(const Options& options) {
  Report out("frames");
  FrameOptions how{.clip = "", .max_memory = options.max_memory};
  how.origin = far_origin(options.path, how);
  auto source = without_empty_frames(open_frames(options.path, how));
  const std::optional<Frame> first = source->next();
  if (!first)
    throw InputError(options.path, "holds no frame with points", "give at least one cloud");
  source->rewind();
  Diagnosis d = examine_frames(*source, examine_options(options));
  out.facts["frames"] = d.frames;
  out.facts["fps"] = d.fps;
  out.facts["fewest_points"] = d.fewest_points;
  out.facts["most_points"] = d.most_points;
  if (d.faces > 0) out.facts["faces"] = d.faces;
  out.findings = d.findings;
  for (const std::string& remark : source->remarks())
    out.findings.push_back({"remark", Weight::note, remark, 1, "", ""});
  out.diagnosis = std::move(d);
  out.subject = {options.path, std::nullopt, std::move(source), std::nullopt, "", how.origin};
  if (const auto far = far_from_origin(how.origin, first->points)) out.findings.push_back(*far);
  return out;
}

Report examine_folder(const Options& options) {
  const std::string& path = options.path;
  std::error_code ignored;
  if (!fs::exists(path + "/config.yaml", ignored) || !fs::exists(path + "/metrics.jsonl", ignored))
    return examine_sequence(options);
  load_config_tree(path + "/config.yaml");
  Report out("run");
  const std::string lines = read_file(path + "/metrics.jsonl");
  out.facts["records"] = std::count(lines.begin(), lines.end(), '\n');
  return out;
}

/// Left and right, where joints have names: the only place where a mirror image can be told.
void judge_hands(Report& out, const std::vector<Joints>& frames) {
  int mirrored = 0, right = 0;
  for (const Joints& joints : frames)
    if (const auto found = is_mirrored(joints)) ++(*found ? mirrored : right);
  if (mirrored + right == 0) return;
  const double share = static_cast<double>(std::max(mirrored, right)) / (mirrored + right);
  if (mirrored > right)
    out.findings.push_back({"handedness", share > 0.9 ? Weight::wrong : Weight::note, kMirrored,
                            share, kMirroredBecause, kMirroredFix});
  else
    out.findings.push_back({"handedness", Weight::fact, "right-handed, left is left", share,
                            "with toes forwards, the joints named left are on the left", ""});
}

/// What the importer remarks. Of left and right judge_hands() says more.
void add_remarks(Report& out, const ImportReport& report) {
  for (const std::string& remark : report.remarks)
    if (!remark.starts_with(kMirrored))
      out.findings.push_back({"remark", Weight::note, remark, 1, "", ""});
}

/// A rigged character, as retarget would take it: in T-pose, in our frame.
Report examine_character(const Options& options) {
  TargetMesh target = read_target(options.path, options.bones);
  Report out =
      examine_one("character", std::move(target.mesh), Vec3::Zero(), options, target.known());
  out.subject.taken_as = "the surface that retarget takes as its target";
  for (const auto& [name, value] : target.report.facts) out.facts[name] = value;
  if (target.joints) judge_hands(out, {*target.joints});
  add_remarks(out, target.report);
  return out;
}

// ---- files with named joints -------------------------------------------------------------------

std::vector<Joints> some_joints(const PredictionReader& data) {
  std::vector<Joints> out;
  std::vector<double> row;
  const int64_t some = std::min<int64_t>(data.frames(), 64);
  for (int64_t k = 0; k < some; ++k) {
    data.read_joints(k * data.frames() / some, 1, row);
    Joints& joints = out.emplace_back();
    for (size_t j = 0; j < joints.size(); ++j) joints[j] = Eigen::Map<const Vec3>(&row[3 * j]);
  }
  return out;
}

Report examine_hdf5(const Options& options) {
  const std::string& path = options.path;
  if (is_foreign_hdf5(path)) return examine_sequence(options);
  const Inspection found = inspect(path);
  // A foreign unit is the first problem that verify() names; here it is a finding.
  const bool foreign =
      found.units != "metres" && !(found.kind == "scans" && found.units == "unknown");
  if (const auto problems = verify(path); problems.size() > foreign)
    throw Error(problems[foreign ? 1 : 0], 2);
  Report out(found.kind);
  if (found.kind == "scans" || found.counts.contains("vertices")) {
    if (found.kind == "scans" || found.kind == "prediction") out = examine_sequence(options);
    out.kind = found.kind;
    out.subject.stored = found;
  }
  for (const auto& [name, count] : found.counts) out.facts[name] = count;
  out.facts["units"] = found.units;
  if (foreign)
    out.findings.push_back({"declared units", out.diagnosis ? Weight::note : Weight::wrong,
                            "the file says '" + found.units + "', and only metres are read", 1,
                            "its attribute units",
                            out.diagnosis ? "--fix writes metres" : "convert it to metres"});
  out.facts["license"] = found.license;
  if (found.kind == "prediction" && found.counts.contains("joints")) {
    const std::vector<Joints> joints = some_joints(PredictionReader(path));
    if (!found.counts.contains("vertices")) out.findings.push_back(examine_skeletons(joints));
    judge_hands(out, joints);
  }
  if (found.counts.contains("bodies")) {
    std::vector<Joints> rest;
    for (const Body& body : read_bodies(path)) rest.push_back(body.joints);
    judge_hands(out, rest);
  }
  return out;
}

/// A BVH or AMC file.
Report examine_recording(const Options& options) {
  const std::string file = lower_case(options.path);
  const bool amc = file.ends_with(".amc") || file.ends_with(".amc.xz");
  MotionOptions how;
  how.force = true;  // mirrored or not is a finding here
  how.profile = options.bones;
  const ExamineOptions checked = examine_options(options);
  how.fps = checked.fps.value_or(how.fps);
  how.scale = checked.scale.value_or(how.scale);
  if (checked.up) how.rest.up = parse_axis(options.up, "--up");
  if (checked.facing) how.rest.facing = parse_axis(options.facing, "--facing");
  const MotionClip clip = amc ? read_amc(options.path, "", how) : read_bvh(options.path, how);
  Report out(amc ? "amc" : "bvh");
  for (const auto& [name, value] : clip.report.facts) out.facts[name] = value;
  out.facts["frames_at_30_fps"] = clip.motion.frames();
  out.facts["metres_per_unit"] = clip.scale;
  out.facts["leg_length"] = leg_length(clip.motion.rest);
  out.facts["floor"] = clip.floor_y;
  judge_hands(out, {clip.motion.rest});
  add_remarks(out, clip.report);
  return out;
}

// ---- other files -------------------------------------------------------------------------------

Report examine_config(const Options& options) {
  load_config_tree(options.path);
  return Report("config");
}

/// A few bytes from the start; InputError if the file cannot be read.
std::string first_bytes(const std::string& path) {
  FileStream file(path);
  const std::vector<char> bytes = file.take(std::min<uint64_t>(8, file.size()));
  return {bytes.begin(), bytes.end()};
}

Report examine_weights(const Options& options) {
  const TensorFile file = read_safetensors(options.path);
  Report out("weights");
  int64_t values = 0;
  for (const auto& [name, tensor] : file.tensors) values += tensor.numel();
  out.facts["tensors"] = file.tensors.size();
  out.facts["values"] = values;
  for (const auto& [key, text] : file.metadata) out.facts[key] = text;
  return out;
}

/// One cloud or mesh, or a table of points that holds a whole recording.
Report examine_any(const Options& options) {
  const bool table = is_cloud_name(options.path) || may_be_cloud_name(options.path);
  if (table &&
      open_frames(
          options.path,
          {.clip = "", .max_memory = options.max_memory, .sequence = std::nullopt, .far = true})
              ->frames() > 1)
    return examine_sequence(options);
  return examine_mesh(options);
}

struct Kind {
  const char* start;                 ///< first bytes of such a file; empty: any
  std::vector<std::string> endings;  ///< of its name; none: any
  Report (*examine)(const Options& options);
};

const Kind kKinds[] = {
    {"ply", {}, examine_mesh},
    {"",
     {".ply", ".obj", ".pcd", ".xyz", ".xyzn", ".xyzrgb", ".pts", ".asc", ".txt", ".csv", ".bin"},
     examine_any},
    {"", {".bvh", ".bvh.xz", ".amc", ".amc.xz"}, examine_recording},
    {"", {".glb", ".gltf", ".vrm", ".fbx"}, examine_character},
    {"", {".npz", ".npy"}, examine_sequence},
    {"", {".yaml", ".yml"}, examine_config},
    {"", {".safetensors"}, examine_weights},
};

Report examine(const Options& options) {
  const std::string& path = options.path;
  std::error_code ignored;
  refuse_joints(path);
  if (fs::is_directory(path, ignored)) return examine_folder(options);
  if (is_hdf5(path)) return examine_hdf5(options);
  refuse_foreign_content(path);
  const std::string start = first_bytes(path);
  const std::string name = lower_case(path);
  for (const Kind& kind : kKinds) {
    const auto named = [&](const std::string& ending) { return name.ends_with(ending); };
    if (start.starts_with(kind.start) &&
        (kind.endings.empty() || std::any_of(kind.endings.begin(), kind.endings.end(), named)))
      return kind.examine(options);
  }
  refuse_foreign_kind(path);
  throw InputError(
      path, "is of no kind that is known here",
      "give HDF5, PLY, OBJ, glTF, BVH, AMC, NPY, NPZ, safetensors, YAML or a folder of frames");
}

// ---- the command -------------------------------------------------------------------------------

struct Written {
  std::string picture;  ///< empty: none
  std::optional<Repaired> fix;
};

void print_report(const Options& options, const Report& found, const Written& written,
                  const Common& common) {
  if (common.json) {
    Json notes = Json::array(), findings = Json::array();
    for (const Finding& f : found.findings) {
      findings.push_back(to_json(f));
      if (f.weight != Weight::fact) notes.push_back(f.what);
    }
    Json document = {{"file", options.path}, {"kind", found.kind},   {"usable", found.usable()},
                     {"facts", found.facts}, {"findings", findings}, {"notes", notes}};
    if (found.diagnosis) document["frame"] = frame_json(*found.diagnosis);
    if (found.diagnosis && found.diagnosis->transform)
      document["transform"] =
          Json::parse(to_json(from_file(found.subject, *found.diagnosis->transform)));
    if (!written.picture.empty()) document["picture"] = written.picture;
    if (written.fix) document["fixed"] = to_json(*written.fix);
    return print_json(document);
  }
  std::string text =
      options.path + ": " + found.kind + (found.usable() ? "" : ", not usable as it is") + "\n";
  for (const auto& [name, value] : found.facts.items())
    text += "  " + name + ": " + value.dump() + "\n";
  for (const Weight weight : {Weight::wrong, Weight::note, Weight::fact})
    for (const Finding& f : found.findings)
      if (f.weight == weight) text += to_text(f);
  if (found.diagnosis && found.diagnosis->transform)
    text += to_text(from_file(found.subject, *found.diagnosis->transform), found.subject.taken_as);
  if (written.fix) text += to_text(*written.fix);
  if (!written.picture.empty()) text += "wrote " + written.picture + "\n";
  print(text);
}

/// What is wrong with what --fix wrote. What the user said of the data's frame holds of ours now.
std::vector<Finding> still_wrong(const Options& options) {
  Options again;
  again.path = *options.fix;
  again.target = options.target;
  again.max_memory = options.max_memory;
  if (options.scale) again.scale = 1;
  if (!options.up.empty()) again.up = "+y";
  if (!options.facing.empty()) again.facing = "+z";
  std::vector<Finding> out = examine(again).findings;
  std::erase_if(out, [](const Finding& f) { return f.weight != Weight::wrong; });
  return out;
}

/// Options that say nothing about a file of this kind are not ignored.
void check_effect(const Options& options, const Report& found) {
  const bool recording = found.kind == "bvh" || found.kind == "amc";
  const bool lengths = found.diagnosis.has_value() || recording;
  const auto refuse_if = [&](bool given, const char* option, const std::string& why) {
    if (given) throw InputError(options.path, why, std::string("leave ") + option + " out");
  };
  refuse_if(options.fps && !found.subject.frames && !recording, "--fps",
            "is no sequence of frames, so it has no rate");
  refuse_if(!options.bones.empty() && found.kind != "character" && !recording, "--bones",
            "has no bones, which --bones names");
  refuse_if(options.target && !found.subject.mesh, "--as-target",
            "is no cloud or surface that could be a target");
  const std::string kind = "is of the kind '" + found.kind + "', of which ";
  refuse_if(options.scale && !lengths, "--scale", kind + "--scale says nothing");
  refuse_if(!options.up.empty() && !lengths, "--up", kind + "--up says nothing");
  refuse_if(!options.facing.empty() && !lengths, "--facing", kind + "--facing says nothing");
}

int run_people(const Options& options, const Common& common) {
  if (options.target || !options.picture.empty() || !options.facing.empty() ||
      !options.bones.empty())
    throw InputError("", "--people follows people through clouds, of which this says nothing",
                     "leave --as-target, --picture, --facing and --bones out");
  refuse_joints(options.path);
  SourceRecord how{.path = options.path, .fps = options.fps, .scale = options.scale.value_or(1)};
  if (!options.up.empty()) how.up = options.up.substr(options.up[0] == '+' ? 1 : 0);
  return run_doctor_people(how, options.fix, common);
}

int run_doctor(Options options, const Common& common) {
  options.max_memory = common.max_memory;
  if (options.self != options.path.empty())
    throw InputError(
        options.path,
        options.self ? "cannot be examined together with the program" : "no file was given",
        "give a file, or --self alone");
  if (options.self) {
    if (options.fix || options.scale || options.fps || options.target || !options.picture.empty() ||
        !options.up.empty() || !options.facing.empty() || !options.bones.empty())
      throw InputError("", "--self examines the program, and other options are about a file",
                       "give --self alone");
    return run_doctor_self(common);
  }
  if (options.people) return run_people(options, common);
  if (options.fix) repair_kind(*options.fix);
  check_output(options.fix.value_or(""), {options.path, options.bones});
  check_output(options.picture, {options.path, options.bones});
  const Report found = examine(options);
  check_effect(options, found);
  if (!found.diagnosis && (!options.picture.empty() || options.fix))
    throw InputError(
        options.path,
        "is of the kind '" + found.kind + "', which is neither drawn nor repaired here",
        "give a scan, a surface or a sequence of frames; restage data inspect --plot draws data "
        "files");
  Written written;
  std::optional<AtomicFile> picture;  // takes its place last: a repair that fails leaves nothing
  if (!options.picture.empty()) {
    const Diagnosis& d = *found.diagnosis;
    const std::string which = d.frames > 1 ? ", frame " + std::to_string(d.shown) : "";
    const std::string bytes = picture_of(options.picture, options.path + ": " + found.kind + which,
                                         frame_of(found.subject, d.shown), d);
    picture.emplace(options.picture);
    picture->write(bytes);
    written.picture = options.picture;
  }
  if (options.fix) {
    written.fix = write_repaired(found.subject, *options.fix, *found.diagnosis);
    written.fix->still_wrong = still_wrong(options);
  }
  if (picture) picture->commit();
  print_report(options, found, written, common);
  return (written.fix ? written.fix->still_wrong.empty() : found.usable()) ? 0 : 1;
}

}  // namespace

void add_doctor(Program& program) {
  auto [app, options] =
      program.add("doctor", "say what a file is, what is wrong with it, and mend it",
                  "restage doctor scan.ply\nrestage doctor frames/ --json\n"
                  "restage doctor scan.ply --scale 0.001 --up z --facing=-y --fix mended.ply\n"
                  "restage doctor hero.obj --as-target --picture sheet.png\nrestage doctor frames/ "
                  "--fix mended/\n"
                  "restage doctor --source frames60/ --fps 60 --fix mended.h5\n"
                  "restage doctor hero.glb --as-target --bones names.yaml\n"
                  "restage doctor two/ --people --fix apart.h5\n"
                  "restage doctor --self\n"
                  "exit code: 0 usable, 1 read but not usable as it is, 2 not readable",
                  run_doctor);
  app.add_option(
      "--source,SOURCE", options.path,
      "clouds and meshes (PLY, OBJ, PCD, XYZ, NPY, NPZ, glTF), a folder of them, HDF5, BVH, "
      "AMC, safetensors, YAML");
  app.add_flag("--self", options.self,
               "examine the program: instruction set, threads, weights, GPU, time of a frame");
  app.add_option("--picture", options.picture, "draw it from front, side and top (PNG)");
  app.add_option("--fix", options.fix,
                 "write it mended: X.ply or X.obj (one cloud or surface), X.h5 (a sequence), or a "
                 "folder of frames");
  app.add_flag("--people", options.people,
               "say who is in a sequence of clouds; with --fix X.h5 write a sequence of each");
  app.add_flag("--as-target", options.target, "it is meant as a target: in T-pose, facing +z")
      .formerly("--target");
  add_scale(app, options.scale, "metres per unit, where you know better", "found");
  app.add_option("--up", options.up,
                 "the direction that is up: x, y, z, --up=-x ... (default: found)");
  app.add_option(
      "--fps", options.fps,
      "frames per second of a sequence, where you know better than the file (default: the "
      "file's, else 30)");
  app.add_option("--facing", options.facing,
                 "the direction that the person faces, as --up (default: found)");
  app.add_option("--bones", options.bones,
                 "which bone of a character or recording is which joint, a .yaml file or a known "
                 "family (default: found)");
}

}  // namespace restage::cli
