// The statistical model behind orientation.h: where the points of a person lie who stands along y
// and faces +z. A cloud, turned in some way, is scored by what lies where on a coarse grid; the
// coefficients of the places (orientation_prior.inc) are fitted to posed bodies by `doctor_bench
// fit` (bench/doctor). Internal to this folder and to that program.
#pragma once

#include <span>
#include <vector>

#include "nn/geometry/body.h"

namespace restage::doctor_detail {

// A grid around the middle of the cloud, in units of its size (normalised()). Left and right look
// alike, so |x| is taken.
inline constexpr int kAcross = 8, kUpwards = 15, kForward = 11;
inline constexpr float kCell = 0.3f;
inline constexpr int kPlaces = kAcross * kUpwards * kForward;

inline constexpr int kUps = 6,
                     kHeadings = 24;  ///< hypotheses: which axis is up, faced every 15 deg

/// A cloud as the model wants it: evenly thinned to some hundred points, relative to their median,
/// in units of the median distance to it. Neither changes much with a few stray points, a raised
/// arm, or where a scanner put most points.
struct NormalisedCloud {
  Points points;
  Point middle = Point::Zero();  ///< what was taken off,
  float size = 0;                ///< and divided by; 0: all points are one
};
NormalisedCloud normalised(const Points& points);

/// The share of the points near each place, as square roots; only places with any.
struct Places {
  std::vector<int> place;
  std::vector<float> share;
};
/// Where the points of a normalised cloud lie after `turn`.
void look(const Points& points, const Eigen::Matrix3f& turn, Places& out);
/// How well they fit: the coefficients describe several kinds of attitude, kPlaces numbers each,
/// and the score is log sum exp over the kinds of sum (coefficient x share). `kinds` (may be null)
/// gets each kind's part of that sum.
float score(std::span<const float> coefficients, const Places& at, float* kinds = nullptr);

/// Turn that brings axis `up` (+x -x +y -y +z -z) to +y and then a figure that faces `heading` x 15
/// degrees from the first of two level axes to +z. Multiples of six are permutations of axes.
Eigen::Matrix3f hypothesis(int up, int heading);

/// The fitted coefficients: a multiple of kPlaces.
std::span<const float> orientation_prior();

}  // namespace restage::doctor_detail
