// The parameters of a built-in body, its joints and its implicit surface. One unit here is the
// body's height; bodies.cpp scales to metres.
#pragma once

#include "autograd/base/rng.h"
#include "datasets/builtin/implicit.h"
#include "nn/geometry/skeleton.h"

namespace restage {

struct BodyShape {
  double height = 1.70;  ///< metres
  double sex = 0.5;      ///< 0 female-like ... 1 male-like
  double fat = 0;        ///< -1 thin ... 1 heavy
  double muscle = 0.4;   ///< 0 ... 1
  double belly = 0.5;    ///< 0 ... 1: how much of the fat sits on the belly
  double legs = 1, arms = 1, shoulders = 1, hips = 1, head = 1, hands = 1, feet = 1;  ///< factors
};

BodyShape draw_body_shape(const RngKey& key);
/// T-pose joints in units of height, the floor at y = 0.
Joints shape_joints(const BodyShape& shape);
ImplicitSurface shape_surface(const BodyShape& shape);
/// Height on a body of a height on the average body: legs, trunk and head stretch differently.
double map_height(const BodyShape& shape, double y);
/// Distance of the wrist from the middle plane, and of the shoulder.
double wrist_x(const BodyShape& shape);
double shoulder_x(const BodyShape& shape);

}  // namespace restage
