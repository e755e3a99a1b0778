// Chooses points of a cloud that lie evenly on the body, however dense the cloud is in some places.
#pragma once

#include <cstdint>

#include "nn/geometry/body.h"

namespace restage {

/// A cloud as a row in which neighbours on the body are neighbours; points are taken from the row
/// in equal steps. The points in one cell of 1 cm count together as one, since the vertices of a
/// mesh crowd in faces and hands. Keeps its memory between clouds.
class EvenPoints {
 public:
  /// Puts finite `points` (metres) into a row. Neither the order of the points nor exact repeats
  /// change the row.
  void arrange(const Points& points);
  /// How many different points there are.
  size_t size() const { return row_.size(); }
  /// Takes `n` points in equal steps along the row, which must not be empty; points are repeated if
  /// there are fewer. The first point lies `offset` (0 to 1) of a step behind the beginning.
  /// Choices at the offsets 0, 1/k, 2/k ... share the points among them: a point that one choice
  /// leaves out is in another.
  void choose(size_t n, double offset, Points* out) const;

 private:
  struct Place {
    uint64_t cell;
    Point point;
    /// How many cells the row has up to this point; each point of a cell is an equal part of the
    /// cell.
    double upto = 0;
  };
  std::vector<Place> row_;
};

}  // namespace restage
