// Indices of rows, as gathers and neighbours have them: i32, within a cloud.
#pragma once

#include "autograd/cuda/device_code.h"

namespace restage::cuda {

/// Notes an index outside of [0, limit); whoever waits is told (take_index_fault()). Until then
/// kernels that use the index read nothing outside of their tensors.
void look_at(const Tensor& index, int64_t limit);

/// For every target the places of an index [n, m] that name it, in order. With these lists, sums
/// over the places need no atomics and no search. What is outside is on no list.
struct Askers {
  Tensor start;  ///< [n * targets + 1]: where the places of a target (a row of the batch) begin
  Tensor place;  ///< [n * m]: rows of the index
};
Askers askers_of(const Tensor& index, int64_t targets);

/// Sorts i32 keys from 0 on that are below `limit`, and `values` with them; equal ones stay in
/// order.
void sort_by_key(Tensor& keys, Tensor& values, int64_t limit);

/// The same lists as kernels see them.
struct AskersAt {
  explicit AskersAt(const Askers& of)
      : start(at<int32_t>(of.start)), place(at<int32_t>(of.place)) {}
  /// The sum of f(place) over the places of the index that name a target.
  template <class F>
  RESTAGE_DEVICE double sum(int64_t target, F f) const {
    double total = 0;
    for (int64_t k = start[target]; k < start[target + 1]; ++k) total += f(int64_t{place[k]});
    return total;
  }
  const int32_t *start, *place;
};

}  // namespace restage::cuda
