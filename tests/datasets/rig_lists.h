// Skeletons as programs of all kinds name them: how they are written down here. A bone a line,
// indented below its parent, "= joint" where it is one of the 22. A '@' is the side: such a bone
// and all below it are there twice.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "datasets/readers/skeleton_file.h"
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
    parse(list.bones);
    for (size_t i = 0; i < lines_.size(); ++i)
      if (parent_line(i) < 0) add(static_cast<int>(i), -1, "");
  }
  BuiltRig built() const { return out_; }

 private:
  struct Line {
    int indent;
    std::string bone, joint;
  };

  void parse(const std::string& text) {
    for (size_t at = 0; at < text.size();) {
      const size_t end = std::min(text.find('\n', at), text.size());
      const std::string line = text.substr(at, end - at);
      at = end + 1;
      const size_t begin = line.find_first_not_of(' ');
      if (begin == std::string::npos) continue;
      const size_t equals = line.find(" = ");
      lines_.push_back({static_cast<int>(begin), line.substr(begin, equals - begin),
                        equals == std::string::npos ? "" : line.substr(equals + 3)});
    }
  }
  int parent_line(size_t i) const {
    for (size_t p = i; p-- > 0;)
      if (lines_[p].indent < lines_[i].indent) return static_cast<int>(p);
    return -1;
  }

  /// `side`: "left", "right", or "" outside of a limb.
  void add(int line, int parent, const std::string& side) {
    const Line& it = lines_[static_cast<size_t>(line)];
    if (side.empty() && it.bone.find('@') != std::string::npos) {
      add(line, parent, "left");
      add(line, parent, "right");
      return;
    }
    std::string name = it.bone;
    for (size_t at = 0; (at = name.find('@')) != std::string::npos;)
      name.replace(at, 1, side == "left" ? list_.left : list_.right);
    const int bone = static_cast<int>(out_.skeleton.size());
    Vec3 place = parent < 0 ? Vec3(Vec3::Zero()) : Vec3(places_[static_cast<size_t>(parent)]);
    place.y() += 0.01;
    if (!it.joint.empty()) {
      const std::string full = (side.empty() ? "" : side + "_") + it.joint;
      const auto at = std::find(kJointNames.begin(), kJointNames.end(), full);
      if (at == kJointNames.end()) throw std::runtime_error(full + " is no joint");
      const auto j = static_cast<size_t>(at - kJointNames.begin());
      out_.bone[j] = bone;
      place = bvh_test::rest()[j];
    }
    const Vec3 from = parent < 0 ? Vec3(Vec3::Zero()) : Vec3(places_[static_cast<size_t>(parent)]);
    out_.skeleton.add(name, parent, place - from);
    places_.push_back(place);
    for (size_t i = 0; i < lines_.size(); ++i)
      if (parent_line(i) == line) add(static_cast<int>(i), bone, side);
  }

  const RigList& list_;
  std::vector<Line> lines_;
  std::vector<Vec3> places_;
  BuiltRig out_;
};

}  // namespace restage::test
