// Which vector instructions the CPU kernels use. By default the best that the processor has.
#pragma once

#include <string>
#include <vector>

namespace restage {

/// Names of the sets that kernels were compiled for and this processor has, the best first:
/// "avx512", "avx2", ..., and last the one that every processor has, e.g. "baseline".
std::vector<std::string> instruction_sets();

/// The name of the set in use.
std::string instruction_set();

/// Uses another set from now on; InputError unless it is one of instruction_sets(). For tests and
/// measurements: not while kernels run. All sets but the baseline give the same bits.
void use_instruction_set(const std::string& name);

}  // namespace restage
