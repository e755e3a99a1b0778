#include "datasets/importers/motions/amc.h"

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/packed_text.h"
#include "datasets/readers/text/word_lines.h"

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
                     "give one with {asf} FILE.asf");
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

namespace {

/// Where frames are lacking, by their numbers, those around them are blended, up to a second long;
/// where only every so many is there, they are taken as they are, at that lower rate.
void fill_gaps(Recording& recording, const std::vector<int64_t>& numbers, double fps,
               const std::string& path) {
  int64_t step = 0;
  for (size_t i = 1; i < numbers.size(); ++i) step = std::gcd(step, numbers[i] - numbers[i - 1]);
  if (step == 0) return;  // a single frame
  SourceMotion& motion = recording.motion;
  const auto all = static_cast<size_t>((numbers.back() - numbers[0]) / step + 1);
  check_length(all, motion.skeleton.size(), kAmcFps, recording.bytes, path);
  if (step > 1) {
    motion.fps = kAmcFps / static_cast<double>(step);
    recording.rate_of_file += cat(", of which one in ", step, " is there");
    recording.remarks.push_back(cat("its frames are numbered ", numbers[0], ", ", numbers[1],
                                    " ...: one in ", step,
                                    " is there, and they are taken as they are"));
  }
  const double rate = fps > 0 ? fps : motion.fps;
  SourceMotion whole;
  int64_t filled = 0;
  for (size_t i = 0; i < numbers.size(); ++i) {
    const int64_t missing = i == 0 ? 0 : (numbers[i] - numbers[i - 1]) / step - 1;
    if (static_cast<double>(missing) > rate)
      throw InputError(
          path,
          cat("lacks the frames from ", numbers[i - 1], " to ", numbers[i], ", more than a second"),
          "cut the recording there");
    for (int64_t k = 1; k <= missing; ++k) {
      const double t = static_cast<double>(k) / static_cast<double>(missing + 1);
      std::vector<Quat>& local = whole.local.emplace_back();
      for (size_t j = 0; j < motion.local[i].size(); ++j)
        local.push_back(motion.local[i - 1][j].slerp(t, motion.local[i][j]));
      whole.position.push_back({(1 - t) * motion.position[i - 1][0] + t * motion.position[i][0]});
    }
    filled += missing;
    whole.local.push_back(motion.local[i]);
    whole.position.push_back(motion.position[i]);
  }
  if (filled == 0) return;
  motion.local = std::move(whole.local);
  motion.position = std::move(whole.position);
  recording.remarks.push_back(
      cat(counted(filled, "frame is", "frames are"),
          " lacking by the numbers of the others: filled from those around"));
}

}  // namespace

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
  const std::vector<int64_t> numbers = std::move(amc.numbers);
  if (amc.largest_unused > 0)
    recording.remarks.push_back(
        format("bones are moved or stretched, by up to %.4g units: left out, "
               "as a person's bones keep their length",
               amc.largest_unused));
  recording.motion = amc_motion(asf, std::move(amc));
  fill_gaps(recording, numbers, options.fps, path);
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
