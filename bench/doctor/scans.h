// Scans of posed bodies with a known answer, to fit the doctor's model and to measure the doctor.
#pragma once

#include <memory>

#include "autograd/base/rng.h"
#include "datasets/corpus.h"

namespace restage::bench {

struct ScanRecipe {
  int least = 900, most = 1400;  ///< points
  double noise = 0.005;          ///< metres, standard deviation per coordinate
  double rest_share = 0.1;       ///< scans that show the T-pose
  double heading = 20;           ///< degrees to either side of +z
  double one_side_share = 0;     ///< scans that one depth camera sees
  double by_clip_share = 0;      ///< scans of any clip alike; the others of any frame alike
  double stray_share = 0;        ///< scans with a few per cent of stray points
  double mixed_share = 0;        ///< poses whose legs, trunk and arms come from three frames
  double pose_noise = 0;         ///< degrees about each axis of each joint, standard deviation
};

struct TrueScan {
  Points points;       ///< metres, y up, facing +z but for `heading`, floor about y = 0
  double heading = 0;  ///< degrees from +z towards +x
  bool rest = false;
  std::string what;
};

/// Scan number `index`, a function of (corpus, recipe, seed, index).
class ScanMaker {
 public:
  ScanMaker(const Corpus& corpus, const ScanRecipe& recipe, uint64_t seed);
  ScanMaker(ScanMaker&&) noexcept;
  ~ScanMaker();
  TrueScan make(uint64_t index) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// What is no person: a few boxes, rods, plates and balls, hollow or full, here and there.
Points random_thing(const RngKey& key);

}  // namespace restage::bench
