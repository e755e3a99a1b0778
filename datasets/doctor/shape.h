// What one cloud or surface shows, in its own units and axes; the pieces of examine.h.
#pragma once

#include <algorithm>
#include <array>

#include "datasets/doctor/orientation.h"
#include "datasets/doctor/parts.h"

namespace restage {

/// For each point the index of the first that is exactly equal to it: its own, if none is.
std::vector<size_t> first_equals(const Points& points);
/// Indices of the points that are not exactly equal to an earlier one, in order. Repeats are no
/// measurements: a depth camera's pixels without answer are all at one place.
std::vector<size_t> distinct(const Points& points);
/// Those points.
Points without_repeats(const Points& points);
/// How many the others are.
size_t repeats(const Points& points);

/// Points evenly over the surface, so that a face modelled in detail weighs no more than a back; of
/// a cloud its own points, each once. The same for the same mesh.
Points shape_points(const Mesh& mesh);
/// The same, and a vertex that each is at or beside: of a surface, a corner of its triangle.
struct ShapePoints {
  Points points;
  std::vector<size_t> vertex;
};
ShapePoints located_shape_points(const Mesh& mesh);

/// A person's points and what is wrong with the rest.
struct PersonShape {
  Points points;    ///< those of the person that were judged: evenly spread
  Parts parts;      ///< of shape_points()
  double size = 0;  ///< median distance to the median point: 0.26 to 0.63 m in any pose
};
PersonShape shape_of(const Mesh& mesh);

struct LengthUnit {
  const char* name;  ///< empty: as the user gave it
  double metres;
};
/// Metre, decimetre, inch, centimetre, millimetre.
inline constexpr std::array<LengthUnit, 5> kUnits = {
    {{"m", 1}, {"dm", 0.1}, {"inch", 0.0254}, {"cm", 0.01}, {"mm", 0.001}}};

struct UnitGuess {
  LengthUnit unit = kUnits[0];
  double sure = 0;  ///< probability; low if no unit makes a person of it
};
/// By PersonShape::size.
UnitGuess guess_unit(double size);

/// PersonShape::size in metres of anybody from half a metre, crouching, to three, arms and legs
/// spread; what is not of this size is no person in metres, and retargeting refuses it. (Adults in
/// feet are larger.)
inline constexpr double kSmallestSize = 0.07, kLargestSize = 1.0;
inline bool is_person_sized(double metres) {
  return metres >= kSmallestSize && metres <= kLargestSize;
}
/// The size of somebody who stands, times their height.
inline constexpr double kSizeOfHeight = 0.23;

/// Value that a share `q` of them lie below; 0 if there are none.
double quantile(std::vector<double> values, double q);
/// The same of points along `axis`.
double quantile(const Points& points, const Vec3& axis, double q);
/// The middle one, of an even number the upper of the two; 0 if there are none.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Share of the rays through the cloud, from the direction where it is largest, that hit one side
/// only: about 0.3 of a closed body, 0.8 of what one depth camera saw.
double one_sidedness(const Points& points, double spacing);

/// Edges with one triangle only, and how many closed lines they make.
struct Borders {
  size_t edges = 0, loops = 0;
};
Borders borders(const Mesh& mesh);

}  // namespace restage
