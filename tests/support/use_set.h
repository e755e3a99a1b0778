// Instruction sets in tests.
#pragma once

#include <string>
#include <vector>

#include "autograd/kernels/instruction_sets.h"

namespace restage::testing {

/// Kernels use this set while the object lives.
class UseSet {
 public:
  explicit UseSet(const std::string& name) : before_(instruction_set()) {
    use_instruction_set(name);
  }
  ~UseSet() { use_instruction_set(before_); }
  UseSet(const UseSet&) = delete;
  UseSet& operator=(const UseSet&) = delete;

 private:
  std::string before_;
};

/// All but the baseline.
inline std::vector<std::string> vector_sets() {
  auto sets = instruction_sets();
  sets.pop_back();
  return sets;
}

}  // namespace restage::testing
