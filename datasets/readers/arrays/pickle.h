// Python's pickles, protocols 0 to 5, without running anything: an own machine knows containers,
// numbers, text, numpy's arrays, torch's tensors and the arrays that joblib writes between, and
// nothing else. Whatever else a pickle asks for is refused by its name.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "datasets/readers/arrays/value_tree.h"
#include "datasets/readers/byte_stream.h"

namespace restage {

struct PickleLimits {
  uint64_t max_memory = kMaxMemory;  ///< that all values together may take
  /// Of a file of torch, the bytes of a storage (its key, and how many bytes it should have).
  std::function<std::string_view(const std::string& key, uint64_t bytes)> storage = {};
};

/// Reads the pickle that `bytes` begin with into `tree`, whose root it becomes. Returns how many
/// bytes it takes. InputError about tree.path(): damaged, too large, a name or an operation that is
/// not known.
size_t read_pickle(std::string_view bytes, const PickleLimits& limits, ValueTree& tree);

/// Whether bytes begin as a pickle of protocol 2 or later does.
bool starts_as_pickle(std::string_view bytes);

}  // namespace restage
