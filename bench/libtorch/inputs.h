// The folder that restage_bench wrote (../inputs.h), read into LibTorch's tensors.
#pragma once

#include <torch/torch.h>

#include <map>
#include <string>

namespace bench {

using torch::Tensor;

/// All tensors of a safetensors file that are float32 or int32, which becomes int64.
std::map<std::string, Tensor> read_tensors(const std::string& path);

class Inputs {
 public:
  explicit Inputs(std::string folder);
  const Tensor& at(const std::string& name) const { return tensors_.at(name); }
  /// Which weights load() takes, where there are such ("trained"); else the initial ones.
  std::string variant = "initial";
  /// Fills a module with the weights of a model. Throws unless names and shapes agree one
  /// to one and the module has as many parameters as the paper's model (0: not checked).
  void load(torch::nn::Module& module, const std::string& model, int64_t parameters,
            const std::string& prefix = "") const;

 private:
  std::string folder_;
  std::map<std::string, Tensor> tensors_;
};

}  // namespace bench
