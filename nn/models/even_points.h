// Points of a cloud that lie evenly on what it shows, however dense it is where.
#pragma once

#include <cstdint>

#include "nn/geometry/body.h"

namespace restage {

/// A cloud as a row in which neighbours on the body are neighbours, from which every so many points
/// are taken. What lies in one cell of 1 cm counts once: the vertices of a mesh crowd in faces and
/// hands, which are no larger for that. Keeps its memory between clouds.
class EvenPoints {
 public:
  /// Puts finite `points` (metres) in order. Neither their order nor exact repeats matter.
  void arrange(const Points& points);
  /// How many different points there are.
  size_t size() const { return row_.size(); }
  /// `n` points, of a cloud that has any, in equal steps along the row, repeated if there are
  /// fewer; the first lies the part `offset` (0 to 1) of a step behind the beginning. Choices at
  /// the offsets 0, 1/k, 2/k ... share the points among them: what one leaves out another has.
  void choose(size_t n, double offset, Points* out) const;

 private:
  struct Place {
    uint64_t cell;
    Point point;
    double upto = 0;  ///< cells up to here; each of a cell's points counts as an equal part of it
  };
  std::vector<Place> row_;
};

}  // namespace restage
