#include "experiments/cli/perform/standard_weights.h"

#include "autograd/base/error.h"
#include "autograd/base/shipped.h"

namespace restage::cli {

std::string standard_weights() {
  const std::string found = shipped("experiments/weights/standard.safetensors");
  if (found.empty())
    throw InputError("",
                     "--weights is missing, and the standard weights are not beside the program",
                     "give a weights file or a run");
  return found;
}

}  // namespace restage::cli
