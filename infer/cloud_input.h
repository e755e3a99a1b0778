// What systems without an extractor do with a cloud before a network sees it.
#pragma once

#include "autograd/base/rng.h"
#include "autograd/tensor/tensor.h"
#include "nn/geometry/body.h"
#include "nn/weights/bundle.h"

namespace restage {

/// Points of a cloud in the training of these weights (setting `points`); 0: as many as the target
/// has vertices. 1,024 where the weights do not say it. InputError naming `where`: no such number.
int64_t trained_points(const TrainedModel& model, const std::string& where);

/// Vertices that bodies were thinned to in the training of these weights (setting `vertices`); 0:
/// they were not. InputError naming `where`: no such number.
int64_t trained_vertices(const TrainedModel& model, const std::string& where);
/// Where vertices had to correspond: which vertices were kept (setting `kept`: "0,17,20"),
/// ascending. InputError naming `where`: there is no such list, or it is damaged.
std::vector<int32_t> kept_vertices(const TrainedModel& model, const std::string& where);

/// Of how many vertices these were (setting `kept_of`); 0: not known.
int64_t kept_of(const TrainedModel& model, const std::string& where);

/// UnusableCloud naming `source`: too few points for a body, or one that is not finite.
void require_body(const Points& cloud, const std::string& source);

/// `count` points of the cloud in random order, each once while there are enough.
Points some_of(const Points& cloud, size_t count, const RngKey& key);

/// Points one after the other, float32, in a tensor of a shape of as many numbers.
Tensor tensor_of_points(const Points& points, const Shape& shape);

}  // namespace restage
