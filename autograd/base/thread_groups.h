// Several pieces of work at once that are parallel themselves: small products leave most of many
// threads idle, two of them side by side less.
#pragma once

#include <cstdint>
#include <functional>

namespace restage {

/// Calls body(i) for all i below n on `groups` groups of threads, among which the threads are
/// shared: group g takes g, g + groups, ... in turn. Within body, threads() and parallel_for() are
/// those of its group. The first exception of the lowest group is thrown when all have ended.
void in_groups(int64_t n, int groups, const std::function<void(int64_t)>& body);

}  // namespace restage
