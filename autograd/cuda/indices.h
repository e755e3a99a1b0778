// Indices of rows, as gathers and neighbours have them: i32, within a cloud.
#pragma once

#include "autograd/cuda/device_code.h"

namespace restage::cuda {

/// Notes an index outside of [0, limit); whoever waits is told (take_index_fault()). Until then
/// kernels that use the index read nothing outside of their tensors.
void look_at(const Tensor& index, int64_t limit);

/// For every target the places of an index [n, m] that name it, in order. With these lists, sums
/// over the places need no atomics and no search.
struct Askers {
  int64_t m, v;
  Tensor start;  ///< [n, v + 1]: where a target's places begin, from the first of its cloud
  Tensor place;  ///< [n, m]
};
Askers askers_of(const Tensor& index, int64_t targets);

/// The same lists as kernels see them.
struct AskersAt {
  explicit AskersAt(const Askers& of)
      : m(of.m), v(of.v), start(at<int32_t>(of.start)), place(at<int32_t>(of.place)) {}
  /// The sum of f(place) over the places of the index that name a target (a row of the batch).
  template <class F>
  RESTAGE_DEVICE double sum(int64_t target, F f) const {
    const int64_t s = target / v;
    const int32_t* range = start + s * (v + 1) + target % v;
    double total = 0;
    for (int64_t k = range[0]; k < range[1]; ++k) total += f(s * m + place[s * m + k]);
    return total;
  }
  int64_t m, v;
  const int32_t *start, *place;
};

}  // namespace restage::cuda
