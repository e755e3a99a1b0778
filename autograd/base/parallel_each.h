// parallel_for for items that are made one by one.
#pragma once

#include "autograd/base/parallel.h"

namespace restage {

/// Calls body(i) for every i of [0, n), in pieces of `grain` as parallel_for cuts them.
template <class F>
void parallel_each(int64_t n, int64_t grain, const F& body) {
  parallel_for(n, grain, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) body(i);
  });
}

}  // namespace restage
