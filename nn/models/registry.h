// The models by the names that configurations, weights files and `restage info` use.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nn/models/skeleton.h"

namespace restage {

/// Sizes that may differ from the paper's; 0 or negative means the model's own default. Kept in the
/// metadata of weights files, so that a file says which network it belongs to.
struct ModelSizes {
  int64_t hidden = 0;                                                      ///< SMRM
  int64_t points = 0, width = 0, layers = 0, centres = 0, neighbours = 0;  ///< extractors
  bool standardise = false;
  bool rest_pose_start = false;
  double dropout = -1;
};

struct ModelInfo {
  std::string name;
  std::string help;
  std::unique_ptr<Module> (*make)(const ModelSizes& sizes, const Init& init);
};

const std::vector<ModelInfo>& models();
/// InputError with the nearest known name if there is no such model.
std::unique_ptr<Module> make_model(const std::string& name, const ModelSizes& sizes,
                                   const Init& init);
/// A model as extractor; InputError if `name` is not one.
std::unique_ptr<SkeletonModel> make_skeleton_model(const std::string& name, const ModelSizes& sizes,
                                                   const Init& init);

}  // namespace restage
