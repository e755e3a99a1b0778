// import_data() of moving skeletons: BVH and ASF/AMC recordings, rigged glTF characters.
#include "autograd/base/error.h"
#include "datasets/importers/amc.h"
#include "datasets/importers/bvh.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/importers/import_detail.h"
#include "datasets/readers/word_lines.h"

namespace restage {
namespace {

bool is_a(const std::string& path, const std::string& ending) {
  const std::string name = lower_case(path);
  return name.ends_with(ending) || name.ends_with(ending + ".xz");
}

void add_character(const std::string& file, const ImportOptions& options, DatasetWriter& writer,
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
  if (character.body) {
    writer.add(*character.body);
    ++summary.bodies;
  }
  for (const Motion& motion : character.motions) add_motion(motion, writer, summary);
  summary.reports.push_back(std::move(character.report));
}

void add_recording(const std::string& file, const ImportOptions& options, DatasetWriter& writer,
                   ImportSummary& summary) {
  if (!options.clip.empty())
    throw InputError(file, "has no clips to choose from", "leave --clip out");
  MotionClip clip = is_a(file, ".amc") ? read_amc(file, options.asf, options.motion)
                                       : read_bvh(file, options.motion);
  add_motion(clip.motion, writer, summary);
  summary.reports.push_back(std::move(clip.report));
}

}  // namespace

bool is_recording_name(const std::string& path) {
  return is_a(path, ".bvh") || is_a(path, ".amc") || is_gltf_name(path);
}

ImportSummary import_recordings(const std::vector<std::string>& files, const std::string& source,
                                const std::string& out, const ImportOptions& options) {
  asked_profile(options.motion);  // a mistake there is not the files'
  ImportSummary summary;
  DatasetWriter writer(out, file_info(source, options));
  add_each(files, summary, [&](const std::string& file) {
    is_gltf_name(file) ? add_character(file, options, writer, summary)
                       : add_recording(file, options, writer, summary);
  });
  if (summary.bodies + summary.motions == 0)
    throw InputError(source, "none of its " + std::to_string(files.size()) + " files could be used",
                     "import one alone to see why");
  writer.commit();
  return summary;
}

}  // namespace restage
