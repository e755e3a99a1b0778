// What real captures have and bare bodies do not: a thing in the hand or beside the foot, soles
// that were cut away with the floor, a surface that a coarse volume has smoothed.
#pragma once

#include "autograd/base/rng.h"
#include "datasets/sampling/surface.h"

namespace restage {

/// A box, a stick or a ball. Held by a hand, whose joints it follows, or standing on the floor so
/// near a foot that the two touch or nearly so.
struct Thing {
  enum class Shape { box, stick, ball } shape = Shape::box;
  bool held = false;             ///< by a hand; else beside a foot
  bool left = false;             ///< which hand or foot
  Vec3 size = Vec3::Zero();      ///< sides of a box; length, radius of a stick; radius of a ball
  Mat3 turn = Mat3::Identity();  ///< of its axes in the world
  double direction = 0;          ///< where it stands as seen from the foot, radians about y
  double gap = 0;  ///< metres between foot and thing, negative: they touch. Of a held stick: half
                   ///< the share of its length by which the hand is off its middle
};
Thing draw_thing(Rng& rng);
/// `n` points of its surface, drawn uniformly, beside somebody with these joints whose
/// lowest point is at the height `floor`.
Points thing_points(const Thing& thing, const Joints& joints, double floor, size_t n, Rng& rng);

/// How far each vertex of a body in its rest pose goes when its surface is smoothed: 20 times half
/// way to the mean of its neighbours. With the 13,380 vertices of MakeHuman's bodies this is about
/// what a volume with cells of 2 cm does; a coarser mesh is smoothed more.
Points smoothing(const Mesh& rest);

}  // namespace restage
