// Which options belong to which kind of input (--force, a permission, goes with all).
#include <algorithm>
#include <regex>

#include "datasets/importers/import_detail.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

using Kinds = std::set<InputKind>;

struct Given {
  const char* option;
  bool given;
  Kinds takers;
  const char* whose;
};

std::vector<Given> all_of(const ImportOptions& options) {
  using enum InputKind;
  const MotionOptions& motion = options.motion;
  const Kinds recordings = {bvh, amc}, moving = {bvh, amc, character},
              motions = {bvh, amc, character, amass, joints},
              bodies = {bvh, amc, character, amass, joints, body_model},
              files = {bvh, amc, character, amass, joints, body_model, scans, depth},
              scaled = {bvh, amc, character, amass, joints, scans},
              timed = {bvh, amc, amass, joints, scans, depth},
              turned = {bvh, amc, character, amass, joints, scans};
  const char *of_recordings = "BVH and AMC recordings",
             *of_moving = "recordings and glTF characters",
             *of_scaled = "recordings, glTF characters, AMASS motions, joints and scans",
             *of_timed =
                 "recordings, AMASS motions, joints and scans (glTF files state their key times)",
             *of_turned = "recordings, characters, AMASS motions, joints and scans";
  const ImportOptions none;
  const RestOptions& rest = motion.rest;
  return {
      {"{license}", options.license != none.license, files, "files whose licence is not known"},
      {"{subject}", !motion.subject.empty(), motions,
       "recordings, characters, AMASS motions and joints"},
      {"{subjects}", !options.subjects.empty(), motions, "motions"},
      {"{split}", motion.split != none.motion.split, bodies,
       "recordings, characters, AMASS motions, joints and body models"},
      {"{scale}", motion.scale > 0, scaled, of_scaled},
      {"{fps}", motion.fps > 0, timed, of_timed},
      {"{up}", rest.up != Axis::automatic, turned, of_turned},
      {"{facing}", rest.facing != Axis::automatic, recordings, of_recordings},
      {"{rest-frame}", rest.frame >= 0, recordings, of_recordings},
      {"{drop-leading}", motion.drop_leading >= 0, recordings, of_recordings},
      {"{bones}", !motion.profile.empty(), moving, of_moving},
      {"{layout}", !motion.layout.empty(), {joints}, "joints without rotations"},
      {"{asf}", !options.asf.empty(), {amc}, "AMC recordings"},
      {"{clip}", !options.clip.empty(), {character}, "glTF characters"},
      {"{body-model}", !options.body_model.empty(), {amass}, "AMASS motions"},
      {"{person}", !options.person.empty(), {amass, joints}, "pose estimators' files and joints"},
      {"{betas}", !options.betas.empty(), {body_model}, "body models"},
      {"{without}", !options.without.empty(), {packed_clips}, "packed clips"},
      {"{intrinsics}", !options.intrinsics.empty(), {depth}, "depth pictures"},
      {"{depth-scale}", options.depth_scale > 0, {depth}, "depth pictures"},
      {"{keep-background}", options.keep_background, {depth}, "depth pictures"},
      {"{garment}", !options.garment.empty(), {data_folder}, "data folders"},
  };
}

}  // namespace

void check_options(const Kinds& kinds, const std::string& source, const ImportOptions& options) {
  for (const Given& one : all_of(options)) {
    const bool taken = std::any_of(kinds.begin(), kinds.end(),
                                   [&](InputKind kind) { return one.takers.count(kind) > 0; });
    if (one.given && !taken)
      throw InputError(source,
                       cat("has nothing to do with ", one.option, ", which is for ", one.whose),
                       cat("leave ", one.option, " out"));
  }
}

void check_fps(const ImportOptions& options) {
  const double fps = options.motion.fps;
  if (fps != 0 && !(fps >= 1 && fps <= 2000))
    throw InputError("", "{fps} is out of range", "give frames per second, 1 to 2000");
}

std::map<std::string, std::string> subjects_of(const std::vector<std::string>& files,
                                               const std::string& root,
                                               const std::string& expression) {
  std::map<std::string, std::string> out;
  if (expression.empty()) return out;
  std::regex wanted;
  try {
    wanted = std::regex(expression);
  } catch (const std::regex_error& error) {
    throw InputError("", "{subjects} '" + expression + "' is no regular expression",
                     "put who moves into a group, as in '([^/]+)/.*' for folders of people");
  }
  if (wanted.mark_count() == 0)
    throw InputError("", "{subjects} '" + expression + "' has no group",
                     "put who moves into one, as in '([^/]+)/.*' for folders of people");
  std::vector<std::string> strangers;
  for (const std::string& file : files) {
    const std::string below =
        absolute_path(file).lexically_relative(absolute_path(root)).generic_string();
    const std::string path = below == "." ? std::filesystem::path(file).filename().string() : below;
    std::smatch found;
    if (std::regex_search(path, found, wanted) && found[1].length() > 0)
      out[file] = found[1];
    else
      strangers.push_back(path);
  }
  if (!strangers.empty())
    throw InputError(root,
                     cat("does not name who moves in ", strangers.size(), " of ", files.size(),
                         " files by {subjects}, the first being ", strangers[0].substr(0, 120)),
                     "widen the expression, or move those files away");
  return out;
}

}  // namespace restage
