// Skeletons as programs of all kinds name them: how they are written down here. A line is a chain
// of bones, each hanging on the one before it; its first word is a bone of a line above (of the
// first line: the root). "t:" before a bone says which of the 22 joints it is. A '@' is the side: a
// line with one is there twice. A '~' is a blank.
#pragma once

#include <array>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "datasets/readers/skeletons/skeleton_file.h"
#include "tests/datasets/importers_bvh_text.h"

namespace restage::test {

struct RigList {
  const char* name;
  const char* left;  ///< what '@' stands for
  const char* right;
  const char* bones;
};

struct BuiltRig {
  SourceSkeleton skeleton;
  std::array<int, kJoints> bone{};  ///< which is which joint; -1: none
};

/// Bones of joints lie where a person's do, others a centimetre above their parents.
class RigBuilder {
 public:
  explicit RigBuilder(const RigList& list) : list_(list) {
    out_.bone.fill(-1);
    std::istringstream lines(list.bones);
    for (std::string line; std::getline(lines, line);) {
      if (line.find('@') == std::string::npos) {
        add(line, 0);
      } else {
        add(line, 1);
        add(line, 2);
      }
    }
  }
  BuiltRig built() const { return out_; }

 private:
  /// `side`: 1 left, 2 right, 0 outside of a limb.
  void add(const std::string& line, int side) {
    std::istringstream words(line);
    int parent = -1;
    for (std::string word; words >> word;) {
      const bool joint = word.size() > 2 && word[1] == ':';
      std::string name = joint ? word.substr(2) : word;
      std::replace(name.begin(), name.end(), '~', ' ');
      for (size_t at = 0; (at = name.find('@')) != std::string::npos;)
        name.replace(at, 1, side == 1 ? list_.left : list_.right);
      const auto known = bones_.find(name);
      if (parent < 0 && known != bones_.end()) {
        parent = known->second;
        continue;
      }
      if (parent < 0 && out_.skeleton.size() > 0) throw std::runtime_error(name + " hangs nowhere");
      parent = add_bone(name, joint ? joint_of(word[0], side) : -1, parent);
    }
  }

  int add_bone(const std::string& name, int joint, int parent) {
    const int bone = static_cast<int>(out_.skeleton.size());
    const Vec3 from = parent < 0 ? Vec3(Vec3::Zero()) : places_[static_cast<size_t>(parent)];
    const Vec3 place = joint < 0 ? Vec3(from + Vec3(0, 0.01, 0)) : bvh_test::rest()[joint];
    if (joint >= 0) out_.bone[static_cast<size_t>(joint)] = bone;
    out_.skeleton.add(name, parent, place - from);
    places_.push_back(place);
    bones_[name] = bone;
    return bone;
  }

  static int joint_of(char letter, int side) {
    static const std::map<char, int> joints = {
        {'p', 0},  {'1', 3},  {'2', 6},  {'3', 9},  {'n', 12}, {'h', 15},  // trunk
        {'t', 1},  {'k', 4},  {'a', 7},  {'f', 10},                        // thigh, knee ...
        {'c', 13}, {'s', 16}, {'e', 18}, {'w', 20}};                       // collar, shoulder ...
    return joints.at(letter) + (side == 2 ? 1 : 0);
  }

  const RigList& list_;
  std::map<std::string, int> bones_;
  std::vector<Vec3> places_;
  BuiltRig out_;
};

}  // namespace restage::test
