#include "datasets/importers/rigs/profiles.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/nearest.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage {
namespace {

constexpr size_t kLongest = 64 * 1024;  // bytes of a profile
constexpr size_t kMostNames = 32;       // that may stand for one joint
constexpr const char* kSeeForm = "see datasets/importers/profiles/README.md for the form";

/// Reads one profile; every complaint names file and line.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {}

  Profile read(std::string_view yaml) {
    if (yaml.size() > kLongest)
      throw InputError(path_, "is longer than 64 kB, which is no profile", kSeeForm);
    YAML::Node root;
    try {
      root = YAML::Load(std::string(yaml));
    } catch (const YAML::Exception& e) {
      throw InputError(cat(path_, ":", std::max(e.mark.line, 0) + 1), "is not YAML", kSeeForm);
    }
    Profile out;
    out.name = std::filesystem::path(path_).stem().string();
    each(root, {"title", "joints", "places", "unused", "expect", "lead"},
         [&](const std::string& key, const auto& v) {
           if (key == "title") out.title = text(v);
           if (key == "joints") joints(v, out);
           if (key == "places") places(v, out);
           if (key == "unused") out.unused = names(v);
           if (key == "expect") expectations(v, out);
           if (key == "lead") out.lead = static_cast<size_t>(number(v, 1, 1000));
         });
    if (out.title.empty())
      throw InputError(path_, "has no title",
                       "write a first line that says whose bones these are: 'title: My suit'");
    for (const int j : {0, 1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21})
      if (out.bones[j].empty())
        throw InputError(path_, cat("names no bone for ", kJointNames[j]), "add it under 'joints'");
    return out;
  }

 private:
  [[noreturn]] void fail(const YAML::Node& node, const std::string& wrong,
                         const std::string& fix = kSeeForm) const {
    std::string line = wrong;  // a quoted key may hold anything
    for (char& c : line)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    throw InputError(cat(path_, ":", std::max(node.Mark().line, 0) + 1), line, fix);
  }

  std::string text(const YAML::Node& node) const {
    if (!node.IsScalar() || node.Scalar().empty() || node.Scalar().size() > 200)
      fail(node, "a short text is expected");
    return node.Scalar();
  }

  double number(const YAML::Node& node, double least, double most) const {
    double value = 0;
    try {
      value = node.as<double>();
    } catch (const YAML::Exception&) {
      fail(node, "a number is expected");
    }
    if (!(value >= least && value <= most)) fail(node, "is out of range");
    return value;
  }

  /// Calls use(key, value) for all of a map whose keys are among `known`.
  template <class Use>
  void each(const YAML::Node& map, const std::vector<std::string>& known, const Use& use) const {
    if (!map.IsMap()) fail(map, "a map is expected");
    std::vector<std::string> seen;
    for (const auto& entry : map) {
      const std::string key = text(entry.first);
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        if (known.front() == "title" && joint_index(key) < kJoints)
          fail(entry.first, "'" + key + "' is a joint and belongs under 'joints:'",
               "write 'joints:' above the joints and indent them by two blanks");
        const std::string close = nearest(key, known);
        fail(
            entry.first, "'" + key.substr(0, 60) + "' is not known here",
            close.empty() ? "use one of " + cut_list(known, 100) : "did you mean '" + close + "'?");
      }
      if (std::find(seen.begin(), seen.end(), key) != seen.end())
        fail(entry.first, "'" + key + "' is given twice", "keep one");
      seen.push_back(key);
      use(key, entry.second);
    }
  }

  static std::vector<std::string> joint_names() { return {kJointNames.begin(), kJointNames.end()}; }
  static size_t joint_index(const std::string& name) {
    return static_cast<size_t>(std::find(kJointNames.begin(), kJointNames.end(), name) -
                               kJointNames.begin());
  }

  void joints(const YAML::Node& node, Profile& out) const {
    each(node, joint_names(), [&](const std::string& key, const YAML::Node& value) {
      out.bones[joint_index(key)] = names(value);
    });
  }

  /// One name, or a list of them.
  std::vector<std::string> names(const YAML::Node& value) const {
    if (!value.IsSequence()) return {text(value)};
    if (value.size() == 0 || value.size() > kMostNames)
      fail(value, "one to 32 names of bones are expected");
    std::vector<std::string> out;
    for (const auto& bone : value) out.push_back(text(bone));
    return out;
  }

  void places(const YAML::Node& node, Profile& out) const {
    const std::vector<std::string> may_lack = {"spine1",    "spine2",      "spine3",
                                               "neck",      "left_collar", "right_collar",
                                               "left_foot", "right_foot"};
    each(node, may_lack, [&](const std::string& key, const YAML::Node& value) {
      Profile::Place place;
      each(value, {"with", "from", "to", "share"}, [&](const std::string& part, const auto& v) {
        if (part == "with") place.with = text(v);
        if (part == "from") place.from = text(v);
        if (part == "to") place.to = text(v);
        if (part == "share") place.share = number(v, -1, 2);
      });
      if (place.from.empty() || place.to.empty()) fail(value, "'from' and 'to' are needed");
      if (place.with.empty()) place.with = place.from;
      out.places[joint_index(key)] = place;
    });
  }

  void expectations(const YAML::Node& node, Profile& out) const {
    each(node, {"units", "up", "fps"}, [&](const std::string& key, const auto& value) {
      if (key == "units") out.units = text(value);
      if (key == "up") out.up = text(value);
      if (key == "fps") out.fps = number(value, 1, 1000);
    });
  }

  std::string path_;
};

}  // namespace

const std::vector<Profile>& builtin_profiles() {
  static const std::vector<Profile> profiles = [] {
    std::vector<Profile> out;
    for (const ProfileText& text : builtin_profile_texts())
      out.push_back(parse_profile(text.yaml, cat(text.name, ".yaml")));
    return out;
  }();
  return profiles;
}

Profile parse_profile(std::string_view yaml, const std::string& path) {
  return Reader(path).read(yaml);
}

Profile find_profile(const std::string& name) {
  const bool file = text::ends_in(name, {".yaml", ".yml"}) || name.find('/') != std::string::npos;
  if (file) return parse_profile(read_file(name, kLongest), name);
  std::vector<std::string> known;
  for (const Profile& profile : builtin_profiles()) {
    if (profile.name == name) return profile;
    known.push_back(profile.name);
  }
  const std::string close = nearest(name, known);
  throw InputError("", "profile '" + name.substr(0, 60) + "' is not known",
                   close.empty() ? "give a .yaml file or one of " + joined(known)
                                 : "did you mean '" + close + "'?");
}

}  // namespace restage
