// Runs several pieces of work at once, each of which is parallel itself. A small product leaves
// most of many threads idle; two small products side by side leave fewer idle.
#pragma once

#include <cstdint>
#include <functional>

namespace restage {

/// Calls body(i) for all i below n on `groups` groups of threads, among which the threads are
/// shared: group g takes g, g + groups, ... in turn. Within body, threads() and parallel_for() mean
/// the threads of its group. The first exception of the lowest group is thrown when all have ended.
void in_groups(int64_t n, int groups, const std::function<void(int64_t)>& body);

}  // namespace restage
