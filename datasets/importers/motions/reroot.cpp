#include "datasets/importers/motions/reroot.h"

#include <algorithm>
#include <cmath>

#include "datasets/importers/motions/source_motion.h"
#include "datasets/importers/rigs/bone_dictionary.h"
#include "datasets/importers/rigs/bone_tree.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr double kInDegrees = 180.0 / M_PI;

/// The lowest bone that carries all bones of these parts on both sides; -1: a side has none.
int carrier_of_parts(const BoneTree& tree, std::initializer_list<BonePart> parts) {
  int out = -1;
  std::array<bool, 2> sides{};
  for (size_t b = 0; b < tree.words.size(); ++b) {
    const BoneWords& words = tree.words[b];
    if (words.helper || words.side == BoneWords::middle ||
        std::find(parts.begin(), parts.end(), words.part) == parts.end())
      continue;
    const int bone = static_cast<int>(b);
    out = out < 0 && !sides[0] && !sides[1] ? bone : carrier_of(tree.skeleton, out, bone);
    sides[static_cast<size_t>(words.side)] = true;
  }
  return sides[0] && sides[1] ? out : -1;
}

bool hangs_below(const SourceSkeleton& skeleton, int pelvis, int arms) {
  return pelvis >= 0 && arms >= 0 && pelvis != arms && hangs_on(skeleton, pelvis, arms);
}

/// Whether all bones from the pelvis up to the root are called as the bones of a trunk are.
bool hangs_on_trunk(const BoneTree& tree, int pelvis) {
  for (int b = pelvis; b >= 0; b = tree.skeleton.parents[static_cast<size_t>(b)]) {
    const BonePart part = tree.words[static_cast<size_t>(b)].part;
    const bool trunk = part == BonePart::spine || part == BonePart::neck ||
                       part == BonePart::head || part == BonePart::pelvis || part == BonePart::hip;
    if (!trunk && tree.skeleton.parents[static_cast<size_t>(b)] >= 0) return false;
  }
  return true;
}

int bone_called(const SourceSkeleton& skeleton, const std::vector<std::string>& names) {
  for (const std::string& name : names)
    for (size_t b = 0; b < skeleton.size(); ++b)
      if (lower_case(skeleton.names[b]) == lower_case(name)) return static_cast<int>(b);
  return -1;
}

/// Where each joint is and how it turns, in the world.
struct WorldPose {
  std::vector<Vec3> at;
  std::vector<Mat3> turn;
};

WorldPose world_pose(const BvhFile& file, const std::vector<double>& frame) {
  WorldPose out;
  for (size_t j = 0; j < file.skeleton.size(); ++j) {
    Vec3 at = file.skeleton.offsets[j];
    Quat local = Quat::Identity();
    for (size_t c = 0; c < file.channels[j].size(); ++c) {
      const Channel channel = file.channels[j][c];
      const double value = frame[file.first_channel[j] + c];
      if (is_rotation(channel))
        local = local * channel_rotation(channel, value);
      else
        at[axis_of(channel)] = value;
    }
    const int above = file.skeleton.parents[j];
    const auto p = static_cast<size_t>(std::max(above, 0));
    const Mat3 turn = local.toRotationMatrix();
    out.at.push_back(above < 0 ? at : Vec3(out.at[p] + out.turn[p] * at));
    out.turn.push_back(above < 0 ? turn : Mat3(out.turn[p] * turn));
  }
  return out;
}

/// Degrees about z, x and y, in this order, that make the rotation.
std::array<double, 3> angles_zxy(const Mat3& r) {
  const double sine = std::clamp(r(2, 1), -1.0, 1.0);
  if (std::abs(sine) > 1 - 1e-12)
    return {std::atan2(r(1, 0), r(0, 0)) * kInDegrees, std::asin(sine) * kInDegrees, 0};
  const double x = std::atan2(sine, std::hypot(r(0, 1), r(1, 1)));
  return {std::atan2(-r(0, 1), r(1, 1)) * kInDegrees, x * kInDegrees,
          std::atan2(-r(2, 0), r(2, 2)) * kInDegrees};
}

/// The old joints in the order in which they hang on the new root, parents first; `above` gets each
/// old joint's new parent (an old number), -1 of the root.
std::vector<int> new_order(const SourceSkeleton& old, int root, std::vector<int>& above) {
  above = old.parents;
  for (int b = root; old.parents[static_cast<size_t>(b)] >= 0;) {
    const int p = old.parents[static_cast<size_t>(b)];
    above[static_cast<size_t>(p)] = b;
    b = p;
  }
  above[static_cast<size_t>(root)] = -1;
  std::vector<std::vector<int>> children(old.size());
  for (size_t b = 0; b < old.size(); ++b)
    if (above[b] >= 0) children[static_cast<size_t>(above[b])].push_back(static_cast<int>(b));
  std::vector<int> out, open{root};
  while (!open.empty()) {
    const int b = open.back();
    open.pop_back();
    out.push_back(b);
    const std::vector<int>& below = children[static_cast<size_t>(b)];
    open.insert(open.end(), below.rbegin(), below.rend());
  }
  return out;
}

}  // namespace

int hanging_pelvis(const SourceSkeleton& skeleton, const Profile* profile) {
  if (profile != nullptr) {
    std::array<int, 4> bones{};
    const std::array<int, 4> joints = {kPelvis, 16, 17, kHead};
    for (size_t i = 0; i < 4; ++i)
      bones[i] = bone_called(skeleton, profile->bones[static_cast<size_t>(joints[i])]);
    const int arms = carrier_of(skeleton, bones[1], bones[2]);
    const bool usual = bones[3] < 0 || hangs_on(skeleton, bones[3], bones[0]);
    return !usual && hangs_below(skeleton, bones[0], arms) ? bones[0] : -1;
  }
  const std::vector<std::string> plain = undecorated(skeleton.names);
  for (size_t language = 0; language < bone_dictionaries().size(); ++language) {
    const BoneTree tree = bone_tree(skeleton, plain, language);
    const int legs = carrier_of_parts(tree, {BonePart::thigh, BonePart::shin, BonePart::leg});
    const int arms = carrier_of_parts(tree, {BonePart::upper_arm, BonePart::forearm});
    if (hangs_below(skeleton, legs, arms) && hangs_on_trunk(tree, legs)) return legs;
  }
  return -1;
}

bool has_root_positions_alone(const BvhFile& file) {
  for (size_t j = 1; j < file.skeleton.size(); ++j) {
    if (file.skeleton.parents[j] < 0) return false;
    if (!std::all_of(file.channels[j].begin(), file.channels[j].end(), is_rotation)) return false;
  }
  return file.skeleton.size() > 1;
}

BvhFile rerooted(const BvhFile& file, int root) {
  const SourceSkeleton& old = file.skeleton;
  std::vector<int> above;
  const std::vector<int> order = new_order(old, root, above);
  std::vector<int> place(old.size());
  for (size_t k = 0; k < order.size(); ++k)
    place[static_cast<size_t>(order[k])] = static_cast<int>(k);
  BvhFile out;
  out.frame_time = file.frame_time;
  out.frame_time_digit = file.frame_time_digit;
  out.lines_left_out = file.lines_left_out;
  for (const int b : order) {
    const auto j = static_cast<size_t>(b);
    const int p = above[j];
    const bool turned_over = p >= 0 && old.parents[static_cast<size_t>(p)] == b;
    const Vec3 offset = p < 0         ? Vec3(Vec3::Zero())
                        : turned_over ? Vec3(-old.offsets[static_cast<size_t>(p)])
                                      : old.offsets[j];
    out.skeleton.add(old.names[j], p < 0 ? -1 : place[static_cast<size_t>(p)], offset);
    out.skeleton.ends.back() = old.ends[j];
    out.skeleton.has_end.back() = old.has_end[j];
    out.first_channel.push_back(out.channel_count);
    std::vector<Channel>& channels = out.channels.emplace_back();
    if (p < 0) channels = {Channel::x_position, Channel::y_position, Channel::z_position};
    for (const Channel c : {Channel::z_rotation, Channel::x_rotation, Channel::y_rotation})
      channels.push_back(c);
    out.channel_count += channels.size();
  }
  const auto old_root = static_cast<size_t>(place[0]);  // a root comes first
  for (const std::vector<double>& frame : file.frames) {
    const WorldPose pose = world_pose(file, frame);
    std::vector<double>& values = out.frames.emplace_back(3);
    std::vector<Vec3> at(order.size());  // seen from the new root
    for (size_t k = 0; k < order.size(); ++k) {
      const Mat3& turn = pose.turn[static_cast<size_t>(order[k])];
      const int p = out.skeleton.parents[k];
      const Mat3 local =
          p < 0 ? turn
                : Mat3(pose.turn[static_cast<size_t>(order[static_cast<size_t>(p)])].transpose() *
                       turn);
      if (p >= 0)
        at[k] =
            at[static_cast<size_t>(p)] +
            pose.turn[static_cast<size_t>(order[static_cast<size_t>(p)])] * out.skeleton.offsets[k];
      for (const double angle : angles_zxy(local)) values.push_back(angle);
    }
    const Vec3 start = pose.at[0] - at[old_root];
    std::copy(start.data(), start.data() + 3, values.begin());
  }
  return out;
}

}  // namespace restage
