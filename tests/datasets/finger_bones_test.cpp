// Fingers by the names that programs give them.
#include "datasets/importers/rigs/finger_bones.h"

#include <gtest/gtest.h>

#include <functional>

namespace restage {
namespace {

/// A skeleton of two hands whose fingers are called by `name(side, finger, bone)`; bone -1 is one
/// inside the palm and bone 3 the tip, which are there if they have a name.
struct Hands {
  std::vector<std::string> names = {"hips", "hand0", "hand1"};
  std::vector<int> parents = {-1, 0, 0};
  FingerBones wanted;

  explicit Hands(const std::function<std::string(int, int, int)>& name) {
    wanted.fill(-1);
    for (int side = 0; side < 2; ++side)
      for (int finger = 0; finger < 5; ++finger) {
        int parent = 1 + side;
        for (int bone = -1; bone < 4; ++bone) {
          const std::string called = name(side, finger, bone);
          if (called.empty()) continue;
          if (bone >= 0 && bone < 3)
            wanted[static_cast<size_t>(finger_bone(side, finger, bone))] =
                static_cast<int>(names.size());
          names.push_back(called);
          parents.push_back(parent);
          parent = static_cast<int>(names.size()) - 1;
        }
      }
  }
  void check(const std::string& what) const {
    EXPECT_EQ(find_fingers(names, parents, {1, 2}), wanted) << what;
  }
};

std::string number(int n) { return std::to_string(n); }

TEST(FingerBones, OfManyMakers) {
  const char* const english[] = {"Thumb", "Index", "Middle", "Ring", "Pinky"};
  Hands([&](int side, int finger, int bone) -> std::string {
    if (bone < 0) return "";
    return std::string("mixamorig:") + (side ? "Right" : "Left") + "Hand" + english[finger] +
           number(bone + 1);
  }).check("Mixamo, with tips");
  const char* const small[] = {"thumb", "index", "middle", "ring", "pinky"};
  Hands([&](int side, int finger, int bone) -> std::string {
    const std::string end = side ? "_r" : "_l";
    if (bone == 3) return "";
    if (bone < 0) return finger > 0 ? std::string(small[finger]) + "_metacarpal" + end : "";
    return std::string(small[finger]) + "_0" + number(bone + 1) + end;
  }).check("Unreal 5, with bones inside the palm");
  const char* const vrm[] = {"Thumb", "Index", "Middle", "Ring", "Little"};
  const char* const thumb[] = {"Metacarpal", "Proximal", "Distal"};
  const char* const other[] = {"Proximal", "Intermediate", "Distal"};
  Hands([&](int side, int finger, int bone) -> std::string {
    if (bone < 0 || bone > 2) return "";
    return std::string(side ? "right" : "left") + vrm[finger] +
           (finger == 0 ? thumb[bone] : other[bone]);
  }).check("VRM 1");
  Hands([&](int side, int finger, int bone) -> std::string {
    if (bone < 0 || bone > 2) return "";
    return std::string("Bip01 ") + (side ? "R" : "L") + " Finger" + number(finger) +
           (bone > 0 ? number(bone) : "");
  }).check("3ds Max");
  Hands([&](int side, int finger, int bone) -> std::string {
    if (bone > 2) return "";
    const std::string end = side ? ".R" : ".L";
    if (bone < 0) return finger > 0 ? "metacarpal" + number(finger) + end : "";
    return "finger" + number(finger + 1) + "-" + number(bone + 1) + end;
  }).check("MakeHuman");
  const char* const japanese[] = {"親指", "人指", "中指", "薬指", "小指"};
  Hands([&](int side, int finger, int bone) -> std::string {
    if (bone < 0 || bone > 2) return "";
    return std::string(side ? "右" : "左") + japanese[finger] + number(bone);
  }).check("MikuMikuDance");
}

TEST(FingerBones, HandsWithoutFingersHaveNone) {
  FingerBones none;
  none.fill(-1);
  EXPECT_EQ(find_fingers({"hips", "l", "r", "bowstring1", "sword"}, {-1, 0, 0, 1, 2}, {1, 2}),
            none);
  EXPECT_EQ(find_fingers({"hips", "l", "r", "Earring", "SmallSword", "Shoestring", "middleware"},
                         {-1, 0, 0, 1, 1, 2, 2}, {1, 2}),
            none);
  // A ring that hangs elsewhere is no finger.
  EXPECT_EQ(find_fingers({"hips", "l", "r", "ring1"}, {-1, 0, 0, 0}, {1, 2}), none);
}

}  // namespace
}  // namespace restage
