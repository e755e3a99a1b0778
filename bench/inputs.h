// The folder that all programs of one benchmark read: the same clouds, motions and weights.
//   inputs.safetensors            batches and the frames of one performance
//   initial/MODEL.safetensors     paper-size models as they start, PyTorch's names
//   trained/MODEL.safetensors     the same after training, where there are such weights
//   lite.safetensors              a whole lite system (nn/weights/bundle.h)
//   lite.yaml, paper.yaml         trainings of all stages, on the data given
#pragma once

#include <string>

#include "nn/weights/bundle.h"
#include "train/training/train_config.h"

namespace restage::bench {

inline constexpr int64_t kSurfacePoints = 6890;  ///< of deformation, as many as SMPL has vertices
inline constexpr int64_t kMostAttended = 13380;  ///< points of the largest cross attention
inline constexpr int64_t kFrames = 48;           ///< of the performance that online items play

/// At least one point, as rows.
Tensor tensor_of(const Points& points);

struct InputSettings {
  std::string data = "builtin";     ///< or a data set file
  std::string trained;              ///< weights file with a paper-size extractor, may be empty
  std::string lite;                 ///< weights file of a lite system
  std::string configs = "configs";  ///< the folder with lite/all.yaml and paper/all.yaml
};

/// Makes the folder; everything is a function of the settings. InputError for unusable files.
void make_inputs(const std::string& folder, const InputSettings& settings);

/// Reads it.
class Inputs {
 public:
  explicit Inputs(std::string folder);
  /// A tensor of inputs.safetensors.
  const Tensor& at(const std::string& name) const;
  /// Whether `variant` ("initial", "trained") has weights of the model.
  bool has(const std::string& variant, const std::string& model) const;
  /// Fills a module from the model's weights (initial ones if the variant has none); `prefix`
  /// selects a part of the model.
  void load(Module& module, const std::string& variant, const std::string& model,
            const std::string& prefix = "") const;
  std::string lite() const { return folder_ + "/lite.safetensors"; }
  /// The training configuration "lite" or "paper".
  TrainConfig training(const std::string& size) const;

 private:
  std::string path(const std::string& variant, const std::string& model) const;
  std::string folder_;
  TensorFile file_;
};

}  // namespace restage::bench
