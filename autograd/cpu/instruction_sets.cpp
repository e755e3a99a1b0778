#include "autograd/kernels/instruction_sets.h"
#include "autograd/base/words.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cctype>

#include "autograd/base/error.h"

namespace restage {
namespace {

std::string name_of(int64_t target) {
  if (target == HWY_AVX3) return "avx512";
  if (target == HWY_STATIC_TARGET) return "baseline";
  return lower_case(hwy::TargetName(target));
}

/// What the processor has, whatever is in use.
const std::vector<int64_t>& targets() {
  static const std::vector<int64_t> found = [] {
    std::vector<int64_t> all = hwy::SupportedAndGeneratedTargets();
    if (all.empty() || all.back() != HWY_STATIC_TARGET) all.push_back(HWY_STATIC_TARGET);
    return all;
  }();
  return found;
}

int64_t& chosen() {
  static int64_t target = targets().front();
  return target;
}

}  // namespace

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const int64_t target : targets()) names.push_back(name_of(target));
  return names;
}

std::string instruction_set() { return name_of(chosen()); }

void use_instruction_set(const std::string& name) {
  for (const int64_t target : targets()) {
    if (name_of(target) != name) continue;
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    chosen() = target;
    return;
  }
  throw InputError("", "no instruction set '" + name + "' here",
                   "choose one of " + joined(instruction_sets()));
}

}  // namespace restage
