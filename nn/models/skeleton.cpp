#include "nn/models/skeleton.h"

namespace restage {

SkeletonAnswer on_host(const SkeletonAnswer& answer) {
  return {answer.joints.value.cpu(), answer.turns.value.cpu(), answer.uncertainty.value.cpu()};
}

}  // namespace restage
