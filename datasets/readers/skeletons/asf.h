// Acclaim skeleton and motion files (ASF and AMC), as the CMU set is recorded in.
// Form: an ASF file holds bones (direction, length, axis of their own frame, degrees of freedom)
// and their hierarchy; an AMC file gives the values of those freedoms frame by frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "datasets/readers/skeletons/skeleton_file.h"

namespace restage {

/// What a value of an AMC file does to its bone: a channel, or (nothing) its length.
using AsfFreedom = std::optional<Channel>;

struct AsfBone {
  std::string name;
  int parent = -1;                ///< a bone that comes before; bone 0 is the root
  Vec3 direction = Vec3::Zero();  ///< from its start to its end, zero pose; of length 1 within 1e-4
  double length = 0;              ///< file units
  Quat axis = Quat::Identity();   ///< its own frame against the world's
  /// Freedoms in the order of their values; rotations are about the axes of its own frame, the
  /// first applied first. Only the root's positions are used: of other bones positions and length
  /// (`dof tx`, `dof l`) are read and left unused, as bones of a person keep their length.
  std::vector<AsfFreedom> freedoms;
  std::vector<std::array<double, 2>> limits;  ///< least and most of each freedom, if the file says
};

struct AsfFile {
  std::vector<AsfBone> bones;  ///< the root first, parents before their children
  /// The axes that the root's rotations are about, the first applied first; its values may come in
  /// another order (`freedoms`).
  std::array<Channel, 3> root_axes{};
  Vec3 root_position = Vec3::Zero();
  double length_unit = 0;  ///< inches = file units / length_unit; 0: the file does not say
  bool radians = false;
};

struct AmcFile {
  /// The values of all freedoms of all bones, bones in the skeleton's order; as in the file.
  std::vector<std::vector<double>> frames;
  std::vector<int64_t>
      numbers;                ///< of the frames, rising; where some are lacking, by more than one
  double largest_unused = 0;  ///< of the values that move or stretch other bones than the root
  bool radians = false;
};

/// InputError with file:line: not ASF, not finite, unknown or repeated bones, a bone without a
/// place in the hierarchy or with two, more than 4,096 bones.
AsfFile parse_asf(std::string_view text, const std::string& path);

/// InputError with file:line: not AMC, not finite, a bone that the skeleton lacks or a frame that
/// lacks a bone, wrong counts, frame numbers that do not rise.
AmcFile parse_amc(std::string_view text, const std::string& path, const AsfFile& skeleton);

/// The skeleton: every bone a joint at its start, its end site at its end.
SourceSkeleton asf_skeleton(const AsfFile& asf);
/// One frame as local rotations; `position` becomes the root's.
std::vector<Quat> asf_pose(const AsfFile& asf, const std::vector<double>& values, bool radians,
                           Vec3& position);

}  // namespace restage
