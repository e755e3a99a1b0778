// Bone-name profiles: the built-in ones, files of one's own, and what is said of mistakes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "autograd/base/error.h"
#include "datasets/importers/source_motion.h"

namespace restage {
namespace {

std::string complaint(const std::string& yaml) {
  try {
    parse_profile(yaml, "suit.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string own_profile() {
  std::string out = "title: Suit\njoints:\n";
  for (const std::string_view joint : kJointNames)
    if (joint != "spine3") out += "  " + std::string(joint) + ": b_" + std::string(joint) + "\n";
  return out;
}

/// A skeleton of the bones that the profile names first.
SourceSkeleton skeleton_of(const Profile& profile) {
  SourceSkeleton out;
  std::array<int, kJoints> at{};
  for (size_t j = 0; j < kJoints; ++j) {
    int parent = j == 0 ? -1 : kParents[j];
    while (parent > 0 && profile.bones[static_cast<size_t>(parent)].empty())
      parent = kParents[static_cast<size_t>(parent)];
    if (profile.bones[j].empty()) continue;
    at[j] = static_cast<int>(out.size());
    out.names.push_back(profile.bones[j][0]);
    out.parents.push_back(parent < 0 ? -1 : at[static_cast<size_t>(parent)]);
    out.offsets.push_back(Vec3(0, 0.1, 0));
    out.ends.push_back(Vec3(0, 0, 0.1));
    out.has_end.push_back(1);
  }
  return out;
}

TEST(ImportersProfiles, EveryBuiltInOneFindsItsOwnNames) {
  std::set<std::string> names;
  for (const Profile& profile : builtin_profiles()) {
    names.insert(profile.name);
    EXPECT_FALSE(profile.title.empty());
    const NamedJoints found = name_joints(skeleton_of(profile), profile.name);
    EXPECT_EQ(found.profile->bones[0].empty(), false);
    if (profile.name != "vrm") {  // unity's names but for case
      EXPECT_EQ(found.profile->name, profile.name);
    }
    EXPECT_EQ(name_joints(skeleton_of(profile), "x", &profile).profile, &profile);
  }
  for (const char* name : {"daz", "cmu", "asf", "mixamo", "lafan1", "100style", "soma", "smpl",
                           "vrm", "unreal", "unity", "makehuman", "restage"})
    EXPECT_EQ(names.count(name), 1u) << name;
}

TEST(ImportersProfiles, OnesOwnFileIsAsGood) {
  const std::string path = ::testing::TempDir() + "importers_suit.yaml";
  std::ofstream(path) << own_profile() +
                             "places: {spine3: {from: spine2, to: b_neck, share: 0.5}}\n"
                             "expect: {units: metres, up: z, fps: 90}\n";
  const Profile profile = find_profile(path);
  EXPECT_EQ(profile.name, "importers_suit");
  EXPECT_EQ(profile.fps, 90);
  const SourceSkeleton skeleton = skeleton_of(profile);
  const NamedJoints found = name_joints(skeleton, "x.bvh", &profile);
  EXPECT_EQ(found.placed, std::vector<int>{9});
  const Joints rest = rest_joints(skeleton, found.map);
  EXPECT_LT((rest[9] - 0.5 * (rest[6] + rest[12])).norm(), 1e-12);
  std::filesystem::remove(path);
}

TEST(ImportersProfiles, MistakesAreNamedWithLineAndNearestName) {
  const std::string good = own_profile();
  EXPECT_EQ(complaint(good), "");
  EXPECT_EQ(complaint(good + "jonts: {}\n"),
            "suit.yaml:24: 'jonts' is not known here; did you mean 'joints'?");
  EXPECT_EQ(complaint(own_profile() + "\"a\\nb\": x\n").find('\n'), std::string::npos);
  EXPECT_NE(complaint(own_profile() + "\"a\\nb\": x\n").find("'a?b' is not known here"),
            std::string::npos);
  EXPECT_NE(complaint(good + "  left_hipp: x\n").find("did you mean 'left_hip'?"),
            std::string::npos);
  EXPECT_NE(complaint(good + "  left_hip: x\n").find("given twice"), std::string::npos);
  EXPECT_NE(complaint("title: x\n").find("names no bone for pelvis"), std::string::npos);
  EXPECT_NE(complaint(good.substr(good.find("joints"))).find("has no title"), std::string::npos);
  EXPECT_NE(complaint(good + "expect: {fps: fast}\n").find("a number is expected"),
            std::string::npos);
  EXPECT_NE(complaint(good + "places: {spine3: {from: spine2}}\n").find("'from' and 'to'"),
            std::string::npos);
  EXPECT_NE(complaint(good + "places: {head: {from: neck, to: neck}}\n").find("not known here"),
            std::string::npos);
  for (const std::string bad : {"", "- a\n", "title: [\n", "\t", "a: &b [*b]\n", "title: {a: b}\n",
                                "%YAML 9.9\n---\n", "title: x\njoints: 3\n"})
    EXPECT_EQ(complaint(bad).find("suit.yaml"), 0u) << bad << ": " << complaint(bad);
  std::string deep = "title: ";
  for (int i = 0; i < 20000; ++i) deep += "[";
  EXPECT_EQ(complaint(deep).find("suit.yaml"), 0u);
  EXPECT_NE(complaint(good + std::string(70000, '#')).find("longer than"), std::string::npos);
  for (size_t cut = 0; cut < good.size(); cut += 7) complaint(good.substr(0, cut));  // no crash
}

TEST(ImportersProfiles, UnknownNamesAreAnsweredWithTheNearest) {
  try {
    find_profile("miximo");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean 'mixamo'?"), std::string::npos);
  }
  EXPECT_THROW(find_profile("no/such.yaml"), InputError);
  SourceSkeleton skeleton = skeleton_of(find_profile("mixamo"));
  for (std::string& name : skeleton.names)
    if (name == "LeftUpLeg") name = "LeftUpLegg";
  try {
    name_joints(skeleton, "a.bvh");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("LeftUpLeg: is it 'leftuplegg'?"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace restage
