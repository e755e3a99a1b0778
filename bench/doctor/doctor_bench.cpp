// The doctor's model and how often the doctor is right.
//   doctor_bench fit OUT.safetensors FILE     the network of
//                                             datasets/doctor/orientation_model.h, from built-in
//                                             people and those of FILE's training split
//   doctor_bench measure FILE [name=value..]  2,400 cases: 24 permutations of axes x 5 units x 20
//                                             scans of FILE's test split (or `builtin`), as
//                                             Markdown
//   doctor_bench angles FILE [name=value..]   how far off the angle is by which the doctor turns
//                                             people, who face anywhere
// Options of measure and angles: split, seed, scans, dressed=1 (in random clothes), once=1 (each
// scan in one case instead of 120; of measure)
// (in random clothes), one_side=0.5 (share of scans by one depth camera).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/parallel_each.h"
#include "autograd/base/rng.h"
#include "bench/doctor/fit.h"
#include "datasets/doctor/examine.h"
#include "datasets/sampling/dress.h"
#include "nn/weights/state.h"

namespace restage::bench {
namespace {

void say(const std::string& line) { std::cerr << line << std::endl; }

// ---- fit ---------------------------------------------------------------------------------------

Corpus people(const std::string& from, const std::string& split) {
  CorpusSource source;
  source.source = from;
  source.bodies = {40, 0, 8};
  source.motions = {220, 0, 44};
  return load_corpus(source, split);
}

ScanRecipe fit_recipe(double noise) {
  ScanRecipe recipe;
  recipe.noise = noise;
  recipe.heading = 15;
  recipe.one_side_share = 0.35;
  recipe.stray_share = 0.2;
  recipe.by_clip_share = 0.5;  // acrobats are brief
  recipe.mixed_share = 0.4;
  recipe.pose_noise = 6;
  return recipe;
}

/// Built-in people, and FILE's, naked and dressed, all of the training split; and a few things.
class Examples {
 public:
  Examples(const std::string& file, uint64_t seed)
      : key_{seed, 0},
        builtin_(people("builtin", "train")),
        naked_(people(file, "train")),
        dressed_(dressed(naked_, seed)),
        makers_{ScanMaker(builtin_, fit_recipe(0.005), seed),
                ScanMaker(naked_, fit_recipe(0.004), seed + 1),
                ScanMaker(dressed_, fit_recipe(0.008), seed + 2)} {}
  FitExample operator()(uint64_t index) const {
    const RngKey key = key_.fold("example").fold(index);
    const double kind = Rng(key).uniform();
    FitExample out;
    out.person = kind > 0.06;
    out.points = !out.person   ? random_thing(key.fold("thing"))
                 : kind < 0.14 ? makers_[0].make(index).points
                 : kind < 0.57 ? makers_[1].make(index).points
                               : makers_[2].make(index).points;
    out.points = doctor_detail::normalised(out.points).points;
    return out;
  }

 private:
  RngKey key_;
  Corpus builtin_, naked_, dressed_;
  std::array<ScanMaker, 3> makers_;
};

int fit(const std::string& out, const std::string& file) {
  const FitOptions options;
  OrientationNet net{Init{RngKey{options.seed, 0}}};
  const Examples examples(file, options.seed);
  fit_orientation_net(std::cref(examples), options, say, net);
  TensorFile weights = to_file(net);
  weights.metadata["made by"] = "doctor_bench fit";
  weights.metadata["license"] =
      "From built-in people, MakeHuman bodies (CC0) and CMU motions: the data used in this project "
      "was obtained from mocap.cs.cmu.edu. The database was created with funding from NSF "
      "EIA-0196217.";
  write_safetensors(out, weights);
  return 0;
}

// ---- measure -----------------------------------------------------------------------------------

/// Rows: the truth; columns: the answer, the last one "unsure".
template <size_t N>
struct Confusion {
  std::array<std::array<int, N + 1>, N> count{};
  void add(size_t truth, size_t answer) { ++count[truth][answer]; }
  int right() const {
    int sum = 0;
    for (size_t i = 0; i < N; ++i) sum += count[i][i];
    return sum;
  }
  int unsure() const {
    int sum = 0;
    for (const auto& row : count) sum += row[N];
    return sum;
  }
  int missed() const { return all() - right(); }
  int all() const {
    int sum = 0;
    for (const auto& row : count)
      for (const int n : row) sum += n;
    return sum;
  }
  std::string table(const std::string& title,
                    const std::function<std::string(size_t)>& name) const {
    std::string out = "| " + title + " |", line = "|---|";
    for (size_t i = 0; i < N; ++i) out += " " + name(i) + " |", line += "---:|";
    out += " unsure |\n" + line + "---:|\n";
    for (size_t i = 0; i < N; ++i) {
      out += "| " + name(i) + " |";
      for (const int n : count[i]) out += " " + std::to_string(n) + " |";
      out += "\n";
    }
    return out;
  }
};

struct Tally {
  Confusion<6> up, facing;
  Confusion<5> unit;
};

constexpr double kSureEnough = 0.5;

/// `scan` in a foreign frame: axes permuted, another unit, another place.
void judge(const TrueScan& scan, int up, int facing, size_t unit, Tally& tally) {
  Orientation foreign;  // where our up and forward axes point there
  foreign.up = up;
  foreign.facing = facing;
  const Eigen::Matrix3f back = foreign.turn().transpose().cast<float>();
  const auto size = static_cast<float>(1 / kUnits[unit].metres);
  Mesh mesh;
  for (const Point& p : scan.points)
    mesh.vertices.push_back(back * p * size + Point(0.3f, -0.2f, 0.1f) * size);
  const Diagnosis d = examine_surface(mesh);
  const auto u = static_cast<size_t>(up), f = static_cast<size_t>(facing);
  tally.up.add(u, d.orientation.up_sure < kSureEnough ? 6 : static_cast<size_t>(d.orientation.up));
  // A facing under another up axis is wrong whatever it says.
  size_t answer = static_cast<size_t>(d.orientation.facing);
  if (d.orientation.up_sure < kSureEnough || d.orientation.facing_sure < kSureEnough)
    answer = 6;
  else if (d.orientation.up != up && answer == f)
    answer = f ^ 1;
  tally.facing.add(f, answer);
  size_t said = 5;
  for (size_t i = 0; i < kUnits.size(); ++i)
    if (d.unit.sure >= kSureEnough && d.unit.unit.metres == kUnits[i].metres) said = i;
  tally.unit.add(unit, said);
}

template <size_t N>
std::string row(const std::string& question, const Confusion<N>& c) {
  return format("| %s | %.2f %% | %.2f %% | %.2f %% |\n", question.c_str(),
                100.0 * c.right() / c.all(), 100.0 * c.unsure() / c.all(),
                100.0 * (c.missed() - c.unsure()) / c.all());
}

struct MeasureOptions {
  std::string split = "test";
  uint64_t seed = 1;
  int scans = 20;
  bool dressed = false;  ///< in random clothes
  double one_side = 0;   ///< share of scans by one depth camera
  bool once = false;     ///< one case a scan instead of 120
};

void judge(const TrueScan& scan, size_t index, bool once, Tally& tally) {
  int number = 0;
  for (int up = 0; up < 6; ++up)
    for (int facing = 0; facing < 6; ++facing)
      for (size_t unit = 0; facing / 2 != up / 2 && unit < kUnits.size(); ++unit, ++number)
        if (!once || static_cast<size_t>(number) == index * 7 % 120)
          judge(scan, up, facing, unit, tally);
}

int measure(const std::string& file, const MeasureOptions& options) {
  const int scans = options.scans;
  Corpus corpus = people(file, options.split);
  if (options.dressed) corpus = dressed(corpus, options.seed);
  ScanRecipe recipe;
  recipe.rest_share = 0.2;
  recipe.one_side_share = options.one_side;
  const ScanMaker maker(corpus, recipe, options.seed);
  std::vector<Tally> tallies(static_cast<size_t>(scans));
  std::vector<std::string> what(tallies.size());
  parallel_each(scans, 1, [&](int64_t i) {
    const TrueScan scan = maker.make(static_cast<uint64_t>(i));
    what[i] = scan.what;
    judge(scan, static_cast<size_t>(i), options.once, tallies[i]);
  });
  Tally all;
  std::string faults;
  const auto add = [](auto& to, const auto& from) {
    for (size_t i = 0; i < to.count.size(); ++i)
      for (size_t j = 0; j < to.count[i].size(); ++j) to.count[i][j] += from.count[i][j];
  };
  for (size_t i = 0; i < tallies.size(); ++i) {
    add(all.up, tallies[i].up);
    add(all.facing, tallies[i].facing);
    add(all.unit, tallies[i].unit);
    const int up = tallies[i].up.missed(), facing = tallies[i].facing.missed(),
              unit = tallies[i].unit.missed();
    if (up + facing + unit > 0)
      faults += "* " + what[i] +
                format(": not right in %d (up), %d (facing), %d (unit) of %d cases\n", up, facing,
                       unit, tallies[i].up.all());
  }
  const auto direction_name = [](size_t i) { return std::string(kDirections[i]); };
  std::cout << (options.once ? "" : "24 permutations of axes x 5 units x ") << scans
            << " scans = " << all.up.all() << " cases\n\n"
            << "| question | right | unsure | wrong |\n|---|---:|---:|---:|\n"
            << row("up axis", all.up) << row("unit", all.unit) << row("facing", all.facing) << "\n"
            << all.up.table("up is \\ said", direction_name) << "\n"
            << all.unit.table("unit is \\ said",
                              [](size_t i) { return std::string(kUnits[i].name); })
            << "\n"
            << all.facing.table("faces \\ said", direction_name) << "\nScans with any fault:\n\n"
            << (faults.empty() ? "none\n" : faults);
  return 0;
}

// ---- angles ------------------------------------------------------------------------------------

/// How far off the angle is by which --fix turns, where up, facing and angle are sure.
struct AngleErrors {
  std::vector<double> off;  // degrees
  int all = 0;
  std::string row(const std::string& name) {
    std::sort(off.begin(), off.end());
    const auto at = [&](double share) {
      const auto last = static_cast<double>(off.size() - 1);
      return off.empty() ? 0.0 : off[static_cast<size_t>(share * last)];
    };
    return format("| %s | %d | %.1f %% | %.1f | %.1f | %.1f |\n", name.c_str(), all,
                  100.0 * static_cast<double>(off.size()) / std::max(all, 1), at(0.5), at(0.95),
                  at(1));
  }
};

int angles(const std::string& file, const MeasureOptions& options) {
  Corpus corpus = people(file, options.split);
  if (options.dressed) corpus = dressed(corpus, options.seed);
  ScanRecipe recipe;
  recipe.heading = 180;
  recipe.rest_share = 0.3;
  recipe.one_side_share = options.one_side;
  const ScanMaker maker(corpus, recipe, options.seed);
  std::vector<std::pair<bool, std::optional<double>>> found(static_cast<size_t>(options.scans));
  parallel_each(options.scans, 1, [&](int64_t i) {
    const TrueScan scan = maker.make(static_cast<uint64_t>(i));
    const Diagnosis d = examine_surface({scan.points, {}});
    found[i].first = scan.rest;
    if (!d.orientation.is_turn_sure()) return;
    const Vec3 ahead = direction(d.orientation.facing);
    const double heading =
        std::atan2(ahead.x(), ahead.z()) * 180 / std::numbers::pi + d.orientation.turned;
    found[i].second =
        d.orientation.up == 2 ? std::abs(std::remainder(heading - scan.heading, 360)) : 180;
  });
  AngleErrors rest, moving;
  for (const auto& [is_rest, off] : found) {
    AngleErrors& to = is_rest ? rest : moving;
    ++to.all;
    if (off) to.off.push_back(*off);
  }
  std::cout << "| people | scans | sure of the angle | off by, median [degrees] | 95th percentile "
               "| most |\n|---|---:|---:|---:|---:|---:|\n"
            << rest.row("in T-pose") << moving.row("in motion");
  return 0;
}

void set(const std::string& word, MeasureOptions& options) {
  const size_t is = word.find('=');
  const std::string name = word.substr(0, is), value = is < word.size() ? word.substr(is + 1) : "";
  if (name == "split")
    options.split = value;
  else if (name == "seed")
    options.seed = std::stoull(value);
  else if (name == "scans")
    options.scans = std::stoi(value);
  else if (name == "dressed")
    options.dressed = value == "1";
  else if (name == "one_side")
    options.one_side = std::stod(value);
  else if (name == "once")
    options.once = value == "1";
  else
    throw InputError("", "no option '" + word + "'", "see the head of doctor_bench.cpp");
}

int run(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 3 && words[0] == "fit") return fit(words[1], words[2]);
  if (words.size() >= 2 && (words[0] == "measure" || words[0] == "angles")) {
    MeasureOptions options;
    for (size_t i = 2; i < words.size(); ++i) set(words[i], options);
    return words[0] == "measure" ? measure(words[1], options) : angles(words[1], options);
  }
  std::cerr << "doctor_bench fit OUT.inc FILE | measure|angles FILE|builtin [split=test] [seed=1] "
               "[scans=20] [once=0] [dressed=0] [one_side=0]\n";
  return 2;
}

}  // namespace
}  // namespace restage::bench

int main(int argc, char** argv) {
  try {
    return restage::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "doctor_bench: " << error.what() << "\n";
    return 1;
  }
}
