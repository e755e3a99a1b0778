// The network behind orientation.h: how likely it is that a cloud shows a person who stands along y
// and faces +z, from where its points lie on a coarse grid. Its weights (orientation.safetensors,
// part of the program) are fitted to posed bodies by `doctor_bench fit` (bench/doctor). Internal to
// this folder and to that program.
#pragma once

#include <span>
#include <string_view>

#include "nn/geometry/body.h"
#include "nn/layers/mlp.h"

namespace restage::doctor_detail {

// A grid around the middle of the cloud, in units of its size (normalised()). Left and right look
// alike, so |x| is taken.
inline constexpr int kAcross = 8, kUpwards = 15, kForward = 11;
inline constexpr float kCell = 0.3f;
inline constexpr int kPlaces = kAcross * kUpwards * kForward;

inline constexpr int kUps = 6,
                     kHeadings = 24;  ///< hypotheses: which axis is up, faced every 15 deg

/// A cloud as the network wants it: evenly thinned to some hundred points, relative to their
/// median, in units of the median distance to it. Neither changes much with a few stray points, a
/// raised arm, or where a scanner put most points.
struct NormalisedCloud {
  Points points;
  Point middle = Point::Zero();  ///< what was taken off,
  float size = 0;                ///< and divided by; 0: all points are one
};
NormalisedCloud normalised(const Points& points);

/// How much of a normalised cloud lies near each place after `turn`, as square roots of shares.
void look(const Points& points, const Eigen::Matrix3f& turn, std::span<float, kPlaces> shares);

/// Scores what is seen: [..., kPlaces] to [..., 1]. The exponentials of the scores of one cloud
/// under several turns are to each other as the turns' probabilities.
struct OrientationNet : Module {
  explicit OrientationNet(const Init& init) : layers({kPlaces, 128, 32, 1}, init) {}
  Var operator()(Context& ctx, const Var& seen) const;
  void visit(Fields& f) override { f("layers", layers); }
  const char* kind() const override { return "OrientationNet"; }
  ReluChain layers;
};
/// With the weights that are part of the program.
const OrientationNet& orientation_net();

/// Turn that brings axis `up` (+x -x +y -y +z -z) to +y and then a figure that faces `heading` x 15
/// degrees from the first of two level axes to +z. Multiples of six are permutations of axes.
Eigen::Matrix3f hypothesis(int up, int heading);

}  // namespace restage::doctor_detail
