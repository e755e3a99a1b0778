// import_data() of moving skeletons: BVH and ASF/AMC recordings, rigged glTF characters.
#include "autograd/base/error.h"
#include "autograd/base/output_check.h"
#include "datasets/importers/amc.h"
#include "datasets/importers/bvh.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/importers/import_detail.h"
#include "datasets/readers/packed_text.h"
#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

bool is_a(const std::string& path, const std::string& ending) {
  const std::string name = lower_case(path);
  return name.ends_with(ending) || name.ends_with(ending + ".xz");
}

void add_character(const std::string& file, const ImportOptions& options, ImportWriter& writer,
                   ImportSummary& summary) {
  if (options.motion.fps > 0 || options.motion.rest.frame >= 0)
    throw InputError(file,
                     "states its key times and its rest pose, which --fps and --rest-frame "
                     "would change",
                     "leave them out");
  CharacterOptions how;
  how.rig = {options.motion.scale, options.motion.rest.up};
  how.clip = options.clip;
  how.subject = options.motion.subject;
  how.split = options.motion.split;
  how.action = options.motion.action;
  Character character = read_character(file, how);
  std::vector<Body> bodies;
  if (character.body) bodies.push_back(std::move(*character.body));
  writer.add(file, bodies, character.motions);
  summary.reports.push_back(std::move(character.report));
}

void add_recording(const std::string& file, const ImportOptions& options, ImportWriter& writer,
                   ImportSummary& summary) {
  if (!options.clip.empty())
    throw InputError(file, "has no clips to choose from", "leave --clip out");
  MotionClip clip = is_a(file, ".amc") ? read_amc(file, options.asf, options.motion)
                                       : read_bvh(file, options.motion);
  writer.add(file, {}, {std::move(clip.motion)});
  summary.reports.push_back(std::move(clip.report));
}

}  // namespace

bool is_recording_name(const std::string& path) {
  return is_a(path, ".bvh") || is_a(path, ".amc") || is_gltf_name(path);
}

ImportSummary import_recordings(const std::vector<std::string>& files, const std::string& source,
                                const std::string& out, const ImportOptions& options) {
  // Mistakes in the options are not the files'.
  asked_profile(options.motion);
  if (!options.asf.empty()) parse_asf(read_packed_text(options.asf), options.asf);
  std::vector<std::string> inputs = files;
  for (const char* part : {".asf", ".asf.xz", ".bin"})  // what recordings and characters refer to
    if (lower_case(out).ends_with(part)) inputs.push_back(out);
  check_output(out, inputs);
  ImportSummary summary;
  ImportWriter writer(out, file_info(source, options), summary);
  add_each(files, summary, [&](const std::string& file) {
    is_gltf_name(file) ? add_character(file, options, writer, summary)
                       : add_recording(file, options, writer, summary);
  });
  check_any(summary, source);
  writer.commit();
  return summary;
}

}  // namespace restage
