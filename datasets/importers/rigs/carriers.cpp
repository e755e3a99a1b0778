#include "datasets/importers/rigs/carriers.h"

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

/// Whether a joint would be left behind if it moved with its nearest joint in the file, `nearest`,
/// and not with the one above it in the body, `above`. Trunks are built in many ways: what hangs on
/// another bone of the spine hangs well enough.
bool left_behind(int above, int nearest) {
  const auto upper_trunk = [](int j) {
    return j == kSpine1 || j == kSpine2 || j == kSpine3 || (j >= 12 && j <= 14);
  };
  return nearest != above && !(upper_trunk(above) && nearest >= 0 && upper_trunk(nearest));
}

/// Nodes that move vertices and hang on none of the joints, with the joint that lies nearest: toes,
/// fingers, goals that hang on the armature. What lies far from all joints is somebody else's.
std::vector<std::pair<int, int>> find_strays(const Gltf& file, const GltfRig& rig,
                                             const std::vector<int>& owner) {
  constexpr double kNear = 0.25;  // of the distance from hips to head
  std::vector<bool> weighs(file.nodes.size()), body(file.nodes.size());
  for (const GltfInfluence& by : file.influences)
    if (by.weight > 0) weighs[static_cast<size_t>(file.bones[by.bone].node)] = true;
  for (size_t n = weighs.size(); n-- > 0;)  // children come later
    if (const int p = file.nodes[n].parent; p >= 0 && weighs[n])
      weighs[static_cast<size_t>(p)] = true;
  const auto place = [&](int j) {
    return Vec3(rig.bind[static_cast<size_t>(rig.node[static_cast<size_t>(j)])].translation() +
                rig.offset[static_cast<size_t>(j)]);
  };
  for (int j = 0; j < kJoints; ++j)
    for (int n = rig.node[static_cast<size_t>(j)]; n >= 0;
         n = file.nodes[static_cast<size_t>(n)].parent)
      body[static_cast<size_t>(n)] = true;  // joints, and what they hang on
  std::vector<std::pair<int, int>> out;
  for (size_t n = 0; n < weighs.size(); ++n) {
    const int p = file.nodes[n].parent;
    if (!weighs[n] || body[n] || (p >= 0 && !body[static_cast<size_t>(p)])) continue;
    bool carried = false;  // by a joint above it
    for (int b = p; b >= 0 && !carried; b = file.nodes[static_cast<size_t>(b)].parent)
      carried = owner[static_cast<size_t>(b)] >= 0 || b == rig.hips;
    if (carried) continue;
    int nearest = 0;
    const auto away = [&](int j) { return (place(j) - rig.bind[n].translation()).norm(); };
    for (int j = 1; j < kJoints; ++j)
      if (away(j) < away(nearest)) nearest = j;
    if (away(nearest) < kNear * (place(kHead) - place(kPelvis)).norm())
      out.emplace_back(static_cast<int>(n), nearest);
  }
  return out;
}

/// GltfRig::order. Without recursion: a file may hang its nodes in one long row.
void order_nodes(const Gltf& file, GltfRig& rig) {
  enum class State : uint8_t { open, waits, placed };
  std::vector<State> state(file.nodes.size(), State::open);
  for (size_t first = 0; first < state.size(); ++first)
    for (std::vector<int> row{static_cast<int>(first)}; !row.empty();) {
      const auto n = static_cast<size_t>(row.back());
      if (state[n] == State::placed) {
        row.pop_back();
        continue;
      }
      const bool seen = state[n] == State::waits;
      bool ready = true;
      for (const int before : {file.nodes[n].parent, rig.carrier[n]}) {
        if (before < 0 || state[static_cast<size_t>(before)] == State::placed) continue;
        if (seen || state[static_cast<size_t>(before)] == State::waits)
          throw InputError(file.path,
                           "bone " + text::quote(file.nodes[n].name) +
                               " hangs on a bone that would have to go with it",
                           "name other bones with {bones} names.yaml");
        row.push_back(before);
        ready = false;
      }
      state[n] = ready ? State::placed : State::waits;
      if (ready) rig.order.push_back(static_cast<int>(n));
    }
}

}  // namespace

void find_carriers(const Gltf& file, GltfRig& rig, const std::vector<int>& owner,
                   ImportReport& report) {
  const size_t count = file.nodes.size();
  rig.carrier.resize(count);
  for (size_t n = 0; n < count; ++n) rig.carrier[n] = file.nodes[n].parent;
  const auto own = [&](int j) {  // a node turns with it, and it lies there
    const auto n = static_cast<size_t>(rig.node[static_cast<size_t>(j)]);
    return owner[n] == j && rig.offset[static_cast<size_t>(j)].isZero();
  };
  std::vector<std::string> words;
  for (int j = 1; j < kJoints; ++j) {
    if (!own(j)) continue;
    int above = kParents[j];
    while (above > 0 && !own(above)) above = kParents[above];
    const int node = rig.node[static_cast<size_t>(j)];
    int nearest = file.nodes[static_cast<size_t>(node)].parent;
    while (nearest >= 0 && nearest != rig.hips && owner[static_cast<size_t>(nearest)] < 0)
      nearest = file.nodes[static_cast<size_t>(nearest)].parent;
    const int joint = nearest < 0           ? -1
                      : nearest == rig.hips ? kPelvis
                                            : owner[static_cast<size_t>(nearest)];
    if (!left_behind(above, joint)) continue;
    rig.carrier[static_cast<size_t>(node)] = rig.node[static_cast<size_t>(above)];
    words.push_back(
        text::quote(file.nodes[static_cast<size_t>(node)].name) + " goes with " +
        text::quote(file.nodes[static_cast<size_t>(rig.node[static_cast<size_t>(above)])].name));
  }
  std::vector<bool> stray(count);
  for (const auto& [node, joint] : find_strays(file, rig, owner)) {
    const auto n = static_cast<size_t>(node);
    rig.carrier[n] = rig.node[static_cast<size_t>(joint)];
    rig.strays.push_back(node);
    words.push_back(cat(text::quote(file.nodes[n].name), " goes with the ", kJointNames[joint]));
    stray[n] = true;
    rig.joint[n] = joint;
  }
  for (size_t n = 0; n < count; ++n)  // parents come first
    if (const int p = file.nodes[n].parent; p >= 0 && stray[static_cast<size_t>(p)]) {
      stray[n] = true;
      rig.joint[n] = rig.joint[static_cast<size_t>(p)];
    }
  if (!words.empty()) report.fact("bones that hang elsewhere", joined(words));
  order_nodes(file, rig);
}

}  // namespace restage
