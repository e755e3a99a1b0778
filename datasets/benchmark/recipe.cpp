#include "datasets/benchmark/recipe.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>

#include "autograd/base/error.h"

namespace restage {
namespace {

constexpr std::array<std::pair<const char*, SplitRecipe BenchmarkRecipe::*>, 3> kRecipeSplits = {
    {{"train", &BenchmarkRecipe::train},
     {"validation", &BenchmarkRecipe::validation},
     {"test", &BenchmarkRecipe::test}}};

constexpr int64_t kLeastVertices = 200;

class Checker {
 public:
  Checker(const BenchmarkRecipe& recipe, const std::string& where) : r_(recipe), where_(where) {}

  void run() {
    disjoint("body", &SplitRecipe::bodies);
    disjoint("clip", &SplitRecipe::clips);
    const std::set<std::string> characters = ids("character", r_.characters);
    const std::set<std::string> motions = ids("motion", r_.motions);
    const std::set<std::string> scanners = ids("scanner", r_.scanners);
    for (const CharacterRecipe& c : r_.characters) {
      held_out("body", c.body, &SplitRecipe::bodies);
      if (!c.body.empty() && c.shape != ShapeRecipe{})
        fail("the character '" + c.id + "' has both a body and a shape", "keep one of the two");
      if (r_.vertices > 0 && !c.garment.empty())
        fail("the character '" + c.id + "' wears a garment, which has vertices of its own",
             "leave out the garment, or 'vertices'");
    }
    if (r_.vertices > 0 && r_.vertices < kLeastVertices)
      fail("bodies of " + std::to_string(r_.vertices) + " vertices have no hands or feet",
           "keep " + std::to_string(kLeastVertices) + " or more");
    for (size_t i = 0; i < r_.more.size(); ++i) below_the_folder(i);
    for (const MotionRecipe& m : r_.motions) held_out("clip", m.clip, &SplitRecipe::clips);
    for (const auto* pairs : {&r_.naked, &r_.clothed})
      for (const PairRecipe& p : *pairs) {
        known("character", p.source, characters);
        known("character", p.target, characters);
        for (const std::string& m : p.motions) known("motion", m, motions);
      }
    for (const ScanRecipe& s : r_.scans) {
      known("scanner", s.scanner, scanners);
      known("motion", s.motion, motions);
      known("character", s.source, characters);
      known("character", s.target, characters);
      if (!s.intruder.empty()) known("character", s.intruder, characters);
    }
    each_once();
  }

 private:
  /// The manifest names what a benchmark was made from, and each file once.
  void below_the_folder(size_t i) const {
    namespace fs = std::filesystem;
    const fs::path path = r_.more[i].file;
    const std::string key = "more." + std::to_string(i) + ".file '" + path.string().substr(0, 60);
    if (path.empty() || path.is_absolute() || path != path.lexically_normal() ||
        *path.begin() == "..")
      fail(key + "' is no plain path below the data folder",
           "write it as in cmu_more/clips30_more.h5");
    for (size_t k = 0; k < i; ++k)
      if (r_.more[k].file == r_.more[i].file) fail(key + "' is there twice", "list it once");
    if (path == "cmu/clips30.h5") fail(key + "' is read anyway", "leave it out");
    for (const std::string& word : r_.more[i].without)
      if (word.empty())
        fail("more." + std::to_string(i) + ".without holds an empty text",
             "name a clip or a source");
  }

  [[noreturn]] void fail(const std::string& what, const std::string& fix) const {
    throw InputError(where_, what, fix);
  }

  /// Names become folders, put together with '-'.
  template <class T>
  std::set<std::string> ids(const std::string& kind, const std::vector<T>& list) const {
    std::set<std::string> out;
    for (const T& entry : list) {
      const std::string id = entry.id.substr(0, 40);
      if (entry.id.empty() || entry.id.size() > 40 ||
          entry.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
        fail("'" + id + "' cannot be the id of a " + kind,
             "use up to 40 small letters, digits and '_'");
      if (!out.insert(entry.id).second)
        fail("the " + kind + " '" + id + "' is there twice", "give each its own id");
    }
    return out;
  }

  void known(const std::string& kind, const std::string& name,
             const std::set<std::string>& names) const {
    if (names.count(name) == 0)
      fail("there is no " + kind + " '" + name.substr(0, 40) + "'",
           names.empty() ? "list some" : "name one such as '" + *names.begin() + "'");
  }

  void disjoint(const std::string& kind, std::vector<std::string> SplitRecipe::*list) const {
    std::map<std::string, std::string> split_of;
    for (const auto& [split, lists] : kRecipeSplits)
      for (const std::string& name : (r_.*lists).*list)
        if (const auto [at, added] = split_of.emplace(name, split); !added) {
          const std::string what = "the " + kind + " '" + name.substr(0, 40) + "' is ";
          if (at->second == split) fail(what + "listed twice in " + split, "list it once");
          fail(what + "in " + at->second + " and in " + split, "keep it in one split");
        }
  }

  /// Every sequence is a folder of its own, and there is something to make at all.
  void each_once() const {
    std::set<std::string> folders;
    const auto add = [&](const std::string& folder) {
      if (!folders.insert(folder).second)
        fail("the sequence '" + folder + "' is listed twice", "list it once");
    };
    for (const auto& [set, pairs] : {std::pair{"naked/", &r_.naked}, {"clothed/", &r_.clothed}})
      for (const PairRecipe& p : *pairs) {
        std::vector<std::string> motions = p.motions;
        if (motions.empty())
          for (const MotionRecipe& m : r_.motions) motions.push_back(m.id);
        for (const std::string& m : motions) add(set + m + "-" + p.source + "-" + p.target);
      }
    for (const ScanRecipe& s : r_.scans) add("scans/" + name_of(s));
    const bool splits =
        std::any_of(kRecipeSplits.begin(), kRecipeSplits.end(), [&](const auto& split) {
          return !(r_.*split.second).bodies.empty() || !(r_.*split.second).clips.empty();
        });
    if (!splits && folders.empty())
      fail("makes nothing", "list bodies and clips, or pairs of characters and motions");
  }

  void held_out(const std::string& kind, const std::string& name,
                std::vector<std::string> SplitRecipe::*list) const {
    for (const auto& [split, names] :
         {std::pair{"train", &(r_.train.*list)}, std::pair{"validation", &(r_.validation.*list)}})
      if (!name.empty() && std::find(names->begin(), names->end(), name) != names->end())
        fail("the " + kind + " '" + name.substr(0, 40) + "' of a test set is in " + split,
             "take one that no model has seen");
  }

  const BenchmarkRecipe& r_;
  const std::string& where_;
};

}  // namespace

std::string name_of(const ScanRecipe& scan) {
  return scan.motion + "-" + scan.source + "-" + scan.target + "-" + scan.scanner;
}

void check_recipe(const BenchmarkRecipe& recipe, const std::string& where) {
  Checker(recipe, where).run();
}

}  // namespace restage
