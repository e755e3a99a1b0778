#include "datasets/importers/amc.h"

#include <algorithm>
#include <filesystem>

#include "datasets/readers/errors.h"
#include "datasets/readers/packed_text.h"
#include "datasets/readers/word_lines.h"

namespace restage {

namespace fs = std::filesystem;

std::string find_asf(const std::string& amc_path) {
  const fs::path parent = fs::path(amc_path).parent_path();
  const std::string stem = stem_of(amc_path);
  std::vector<std::string> all;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(parent.empty() ? "." : parent, ignored)) {
    const std::string name = lower_case(entry.path().filename().string());
    if (name.ends_with(".asf") || name.ends_with(".asf.xz"))
      all.push_back((parent / entry.path().filename()).string());
  }
  std::sort(all.begin(), all.end());
  std::string best;
  for (const std::string& asf : all)
    if (stem.starts_with(stem_of(asf)) && stem_of(asf).size() > stem_of(best).size()) best = asf;
  if (best.empty() && all.size() == 1) best = all[0];
  if (best.empty())
    throw InputError(amc_path,
                     all.empty() ? "there is no skeleton (.asf) in its folder"
                                 : cat("none of the ", all.size(),
                                       " skeletons (.asf) in its folder has a name it begins with"),
                     "give one with --asf FILE.asf");
  return best;
}

SourceMotion amc_motion(const AsfFile& asf, AmcFile amc) {
  SourceMotion out;
  out.fps = kAmcFps;
  out.skeleton = asf_skeleton(asf);
  out.moving = {0};
  for (std::vector<double>& values : amc.frames) {
    std::vector<Vec3>& position = out.position.emplace_back(1);
    out.local.push_back(asf_pose(asf, values, amc.radians, position[0]));
    values = {};
  }
  return out;
}

MotionClip convert_amc(std::string_view text, const std::string& path, std::string_view asf_text,
                       const std::string& asf_path, const MotionOptions& options) {
  const AsfFile asf = parse_asf(asf_text, asf_path);
  AmcFile amc = parse_amc(text, path, asf);
  const std::optional<Profile> profile = asked_profile(options);
  Recording recording;
  recording.bytes = text.size();
  check_length(amc.frames.size(), asf.bones.size(), kAmcFps, text.size(), path);
  recording.format = "AMC on " + fs::path(asf_path).filename().string();
  recording.rate_of_file = "AMC files say none, the CMU set is 120 fps";
  recording.rate_known = false;
  if (asf.length_unit > 0) recording.metres_per_unit = 0.0254 / asf.length_unit;
  recording.motion = amc_motion(asf, std::move(amc));
  recording.names = name_joints(recording.motion.skeleton, asf_path, profile ? &*profile : nullptr);
  MotionOptions with_subject = options;
  if (options.subject.empty()) with_subject.subject = stem_of(asf_path);
  return make_clip(std::move(recording), path, with_subject);
}

MotionClip read_amc(const std::string& path, const std::string& asf, const MotionOptions& options) {
  const std::string skeleton = asf.empty() ? find_asf(path) : asf;
  const std::string text = read_packed_text(path);
  return convert_amc(text, path, read_packed_text(skeleton), skeleton, options);
}

}  // namespace restage
