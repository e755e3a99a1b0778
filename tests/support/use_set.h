// Instruction sets and threads in tests.
#pragma once

#include <string>
#include <vector>

#include "autograd/base/parallel.h"
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

/// So many threads work while the object lives.
class UseThreads {
 public:
  explicit UseThreads(int n) : before_(threads()) { set_threads(n); }
  ~UseThreads() { set_threads(before_); }
  UseThreads(const UseThreads&) = delete;
  UseThreads& operator=(const UseThreads&) = delete;

 private:
  int before_;
};

/// All but the baseline.
inline std::vector<std::string> vector_sets() {
  auto sets = instruction_sets();
  sets.pop_back();
  return sets;
}

}  // namespace restage::testing
