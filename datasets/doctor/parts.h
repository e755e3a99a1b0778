// Which points of a cloud are the person, which stray points, which somebody or something else.
#pragma once

#include <optional>
#include <vector>

#include "datasets/doctor/planes.h"

namespace restage {

enum class Part : uint8_t { person, stray, other };

struct Parts {
  std::vector<Part> part;  ///< one for each point
  size_t stray = 0;        ///< points with hardly a neighbour
  size_t other = 0;        ///< points of pieces apart from the person
  size_t flat = 0;         ///< points of a floor or walls; they are Part::other, not of `other`
  std::vector<FlatPlane> planes;  ///< these floors and walls
  /// Points that were judged, evenly spread over what there is; the rest go with their nearest.
  std::vector<size_t> judged;
  size_t largest_other = 0;  ///< judged points of the largest such piece; many: a second person
  int pieces = 1;            ///< that the person itself is in (holes, occlusion)
  double gap = 0;            ///< the nearest other piece is this far away, in the data's units
  double spacing = 0;        ///< typical distance between neighbours, in the data's units
};

/// The person, beside floors and walls (planes.h), is the largest piece and what lies within about
/// 0.16 m of it. Works in any unit. No point may be there twice: distances between neighbours say
/// what is usual. `before`: the middle of the person in the frame before; of pieces that are half
/// as large as the largest or more, the one nearest to it is then the person.
Parts find_parts(const Points& points, const std::optional<Point>& before = std::nullopt);

/// What other points are: what the nearest of `points` is, which are judged in `parts`, or stray.
std::vector<Part> parts_at(const Points& others, const Points& points, const Parts& parts);

/// Pieces of a whole, joined two by two.
class Pieces {
 public:
  explicit Pieces(size_t n);
  size_t of(size_t i);  ///< the same number for all members of a piece
  void join(size_t a, size_t b) { parent_[of(a)] = of(b); }

 private:
  std::vector<size_t> parent_;
};

}  // namespace restage
