// import_data() of moving skeletons: BVH and ASF/AMC recordings, rigged glTF characters.
#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "datasets/importers/import_detail.h"
#include "datasets/importers/motions/amc.h"
#include "datasets/importers/motions/bvh.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/readers/text/packed_text.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

bool is_amc_name(const std::string& path) { return text::ends_in(path, {".amc", ".amc.xz"}); }

InputKind kind_of(const std::string& file) {
  return is_gltf_name(file)  ? InputKind::character
         : is_amc_name(file) ? InputKind::amc
                             : InputKind::bvh;
}

/// What some files of a folder take others may not: those are skipped. A skeleton for the AMC files
/// is no business of theirs.
void check_file_options(const std::string& file, ImportOptions options) {
  if (kind_of(file) != InputKind::amc) options.asf.clear();
  check_options({kind_of(file)}, file, options);
}

void add_character(const std::string& file, const ImportOptions& options, ImportWriter& writer,
                   ImportSummary& summary) {
  Character character = read_character(file, options.motion, options.clip);
  std::vector<Body> bodies;
  if (character.body) bodies.push_back(std::move(*character.body));
  writer.add(file, bodies, character.motions);
  summary.reports.push_back(std::move(character.report));
}

void add_recording(const std::string& file, const ImportOptions& options, ImportWriter& writer,
                   ImportSummary& summary) {
  MotionClip clip = is_amc_name(file) ? read_amc(file, options.asf, options.motion)
                                      : read_bvh(file, options.motion);
  writer.add(file, {}, {std::move(clip.motion)});
  summary.reports.push_back(std::move(clip.report));
}

std::string name_of(const std::string& file) {
  return is_gltf_name(file) ? std::filesystem::path(file).stem().string() : stem_of(file);
}

/// An id for each file whose name another one has too: where it lies below `root` ("a/walk.bvh":
/// "a_walk").
std::map<std::string, std::string> ids_by_place(const std::vector<std::string>& files,
                                                const std::string& root) {
  std::map<std::string, size_t> count;
  for (const std::string& file : files) ++count[name_of(file)];
  std::map<std::string, std::string> out;
  for (const std::string& file : files) {
    if (count[name_of(file)] == 1) continue;
    const auto below = absolute_path(file).lexically_relative(absolute_path(root)).parent_path();
    std::string id = (below / name_of(file)).generic_string();
    std::replace(id.begin(), id.end(), '/', '_');
    out[file] = id;
  }
  return out;
}

}  // namespace

bool is_recording_name(const std::string& path) {
  return text::ends_in(path, {".bvh", ".bvh.xz"}) || is_amc_name(path) || is_gltf_name(path);
}

bool are_bare_surfaces(const std::vector<std::string>& files) {
  const bool one = files.size() == 1;
  for (const std::string& path : files) {
    if (!is_gltf_name(path)) return false;
    try {
      const Gltf file = read_gltf(path);
      const bool bare = file.skin_nodes.empty() && file.clips.empty() && file.humanoid.empty();
      if (!bare || file.vertices.empty() || (one && !file.faces.empty())) return false;
    } catch (const InputError&) {
      return false;
    }
  }
  return !files.empty();
}

ImportSummary import_recordings(const std::vector<std::string>& files, const std::string& source,
                                const std::string& out, const ImportOptions& options) {
  // Mistakes in the options are not the files'.
  asked_profile(options.motion);
  std::set<InputKind> kinds;
  for (const std::string& file : files) kinds.insert(kind_of(file));
  check_options(kinds, source, options);
  if (!options.asf.empty()) parse_asf(read_packed_text(options.asf), options.asf);
  std::vector<std::string> inputs = files;
  for (const char* part : {".asf", ".asf.xz", ".bin"})  // what recordings and characters refer to
    if (lower_case(out).ends_with(part)) inputs.push_back(out);
  check_output(out, inputs);
  ImportSummary summary;
  ImportWriter writer(out, file_info(source, options), summary);
  const std::map<std::string, std::string> ids = ids_by_place(files, source);
  const std::map<std::string, std::string> people = subjects_of(files, source, options.subjects);
  add_each(files, summary, [&](const std::string& file) {
    check_file_options(file, options);
    ImportOptions how = options;
    if (const auto id = ids.find(file); id != ids.end()) how.motion.id = id->second;
    if (const auto who = people.find(file); who != people.end()) how.motion.subject = who->second;
    is_gltf_name(file) ? add_character(file, how, writer, summary)
                       : add_recording(file, how, writer, summary);
  });
  check_any(summary, source);
  writer.commit();
  return summary;
}

}  // namespace restage
