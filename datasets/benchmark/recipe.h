// What an open benchmark is made of: who, what, which split, which scanner. Read from
// configs/data/open_benchmark.yaml by the command line; everything random is a function of `seed`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "datasets/sampling/scanner.h"

namespace restage {

/// Bodies (rows of bodies.csv) and clips (of clips30.h5) of one split, by name.
struct SplitRecipe {
  std::vector<std::string> bodies, clips;
};

/// Packed clips of CMU besides cmu/clips30.h5.
struct MoreClipsRecipe {
  std::string file;                  ///< below the data folder
  bool train = true;                 ///< all of them are for training; else only to be named
  std::vector<std::string> without;  ///< as import_cmu() leaves them out
};

/// Macro sliders of a MakeHuman body, 0 to 1; in the middle is the average adult.
struct ShapeRecipe {
  double gender = 0.5, age = 0.5, muscle = 0.5, weight = 0.5, height = 0.5, proportions = 0.5;
  bool operator==(const ShapeRecipe&) const = default;
};

/// Someone who performs or is performed on: a row of bodies.csv or a shape of its own.
struct CharacterRecipe {
  std::string id;
  std::string body;  ///< row of bodies.csv; empty: `shape`
  ShapeRecipe shape;
  std::string garment;  ///< file of body/clothes; empty: naked
  double hair = 0;      ///< thickness, metres
};

/// Part of a test clip.
struct MotionRecipe {
  std::string id, clip;
  int64_t first = 0, frames = 0;  ///< 0 frames: to the end
};

/// The motions of `motions` (empty: all) from one character to another.
struct PairRecipe {
  std::string source, target;
  std::vector<std::string> motions;
};

/// Cameras on a ring around the middle of the path.
struct ScannerRecipe {
  std::string id;
  int cameras = 1, pixels = 160;     ///< each of pixels x pixels
  double margin = 2.4;               ///< metres from the path's edge to the cameras
  double azimuth = 0;                ///< of the first camera, degrees from the front
  std::vector<double> heights{1.1};  ///< of the cameras in turn, metres
  double view = 50;                  ///< opening angle, degrees
  double least_kept = 1;             ///< a frame keeps this share of its points or more
  ScannerNoise noise;
};

/// One scan-like sequence.
struct ScanRecipe {
  std::string scanner, motion, source, target;
  std::string intruder;      ///< character whose arm reaches into view; empty: nobody
  bool known_frame = false;  ///< else units, up axis, facing and origin are drawn
};

struct BenchmarkRecipe {
  std::string protocol = "open-benchmark-1";
  uint64_t seed = 0;
  double floor_window = 1;  ///< seconds within which a foot is taken to touch the floor; 0: floors
                            ///< are left as the clips have them
  bool rotations = false;   ///< truths hold world rotations; protocol 1 of the open benchmark: no
  int64_t vertices = 0;     ///< of every body, the same ones; 0: all. Without garments
  SplitRecipe train, validation, test;
  std::vector<MoreClipsRecipe> more;
  std::vector<CharacterRecipe> characters;
  std::vector<MotionRecipe> motions;
  std::vector<PairRecipe> naked, clothed;
  std::vector<ScannerRecipe> scanners;
  std::vector<ScanRecipe> scans;
};

/// The folder of a sequence of scans.
std::string name_of(const ScanRecipe& scan);

/// InputError "where: what; fix" for names that are not ids, twice given or unknown, for a body or
/// clip in two splits, for characters or motions taken from training or validation, for a sequence
/// that is listed twice, and for a recipe of nothing.
void check_recipe(const BenchmarkRecipe& recipe, const std::string& where);

}  // namespace restage
