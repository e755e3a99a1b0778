// Bone-name profiles: which bone of a family of skeletons is which of the 22 joints. The built-in
// ones are the YAML files of datasets/importers/profiles, compiled into the library.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage {

struct Profile {
  /// Where a joint goes that a file lacks: on the way `from` - `to`, turning with `with`. Names are
  /// of the 22 joints or of the file's bones.
  struct Place {
    std::string with, from, to;
    double share = 0;
  };

  std::string name;   ///< the file's, without ".yaml"
  std::string title;  ///< for people
  /// Of names that stand in the file of the skeleton itself: what holds them there ("VRM's list of
  /// bones"), and how to mend it. Empty: a profile.
  std::string list, mend;
  /// Bones that may stand for each joint, the preferred first; empty: always placed.
  std::array<std::vector<std::string>, kJoints> bones;
  std::array<std::optional<Place>, kJoints> places;  ///< none: placed by the general rules
  /// Bones of the family's spine that are no joint. With any other unnamed bone there, a skeleton
  /// is of another family, as it then has a joint where this one places it.
  std::vector<std::string> unused;
  /// What files of the family usually are; a file that differs gets a remark. Empty or 0: no say.
  std::string units, up;
  double fps = 0;
  /// Frames that files of the family begin with before the recording: a T-pose and a blend out of
  /// it. A file that does not begin so keeps all frames.
  size_t lead = 0;
};

/// The texts of datasets/importers/profiles/*.yaml, by name; CMake writes their source file.
struct ProfileText {
  std::string_view name, yaml;
};
std::span<const ProfileText> builtin_profile_texts();

/// All built-in profiles, by name.
const std::vector<Profile>& builtin_profiles();

/// Parses a profile; `path` is for messages and gives the name. InputError with file:line for what
/// is no YAML, an unknown key or joint (with the nearest known), or a missing title or joint.
Profile parse_profile(std::string_view yaml, const std::string& path);

/// A built-in profile by name, or the one of a file (any name that ends in .yaml or .yml, in any
/// case, or with a "/"). InputError with the nearest known name.
Profile find_profile(const std::string& name_or_file);

}  // namespace restage
