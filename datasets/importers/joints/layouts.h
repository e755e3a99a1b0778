// Which joints the numbers of a tracker, a lifter or a data set are, in their order.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "datasets/importers/joints/turn_net.h"

namespace restage {

/// An order of joints that somebody uses. Words of `joints` are names of our 22 joints, or of
/// places that tell how head, hands and feet are turned (left_ear, left_index ...); "-" is passed
/// over.
struct JointLayout {
  std::string_view name;   ///< of the option: "h36m17"
  std::string_view title;  ///< for people: "Human3.6M, 17 joints"
  std::vector<std::string_view> joints;
  size_t count = 0;  ///< how many joints a frame has; those behind `joints` are passed over
  std::vector<std::string> unknown = {};  ///< names of joints that say none of `joints`
};

const std::vector<JointLayout>& joint_layouts();
/// InputError naming {layout} and all that there are.
const JointLayout& joint_layout(const std::string& name);
/// Those with so many joints a frame.
std::vector<const JointLayout*> layouts_of(size_t count);

/// One moment as a file has it; what is not known is left out.
using FileFrame = std::vector<std::optional<Vec3>>;

/// A moment with our joints, and what else is known of head, hands and feet.
struct MappedFrame {
  joints_detail::SeenFrame joints;
  std::optional<Vec3> nose, left_ear, right_ear;
  /// Of the left and of the right side.
  std::array<std::optional<Vec3>, 2> hand, index, pinky;
};
MappedFrame mapped(const FileFrame& frame, const JointLayout& layout);

/// How much somebody's bones change and how much left and right differ, as a share of the trunk's
/// length: below 0.1 of a person whose joints are in this order. Infinite where it cannot be told.
double misfit(const std::vector<FileFrame>& frames, const JointLayout& layout);

}  // namespace restage
