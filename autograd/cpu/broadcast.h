// How element-wise kernels walk two operands that are broadcast to one shape.
#pragma once

#include <array>
#include <cstdint>

#include "autograd/tensor/shape.h"

namespace restage::cpu {

/// Row-major walk with stride 0 along broadcast axes, after merging axes that both sides walk
/// alike.
struct BroadcastPlan {
  int64_t outer = 1, inner = 1;
  std::array<int64_t, Shape::kMaxRank> size{}, step_a{}, step_b{};
  int rank = 0;
  int64_t inner_a = 0, inner_b = 0;  // 1 or 0 along the innermost run

  BroadcastPlan(const Shape& a, const Shape& b, const Shape& out) {
    int64_t sa = 1, sb = 1;
    std::array<int64_t, Shape::kMaxRank> n{}, da{}, db{};
    int count = 0;  // innermost first
    for (int i = out.rank() - 1; i >= 0; --i) {
      const int ia = i - (out.rank() - a.rank()), ib = i - (out.rank() - b.rank());
      const int64_t la = ia < 0 ? 1 : a[ia], lb = ib < 0 ? 1 : b[ib];
      const int64_t ta = la == 1 && out[i] != 1 ? 0 : sa, tb = lb == 1 && out[i] != 1 ? 0 : sb;
      sa *= la;
      sb *= lb;
      if (out[i] == 1) continue;
      if (count > 0 && merges(ta, da[count - 1], n[count - 1]) &&
          merges(tb, db[count - 1], n[count - 1])) {
        n[count - 1] *= out[i];
        continue;
      }
      n[count] = out[i];
      da[count] = ta;
      db[count++] = tb;
    }
    if (count > 0) {
      inner = n[0];
      inner_a = da[0];
      inner_b = db[0];
    }
    rank = std::max(0, count - 1);
    for (int i = 0; i < rank; ++i) {  // outermost first
      size[i] = n[count - 1 - i];
      step_a[i] = da[count - 1 - i];
      step_b[i] = db[count - 1 - i];
      outer *= size[i];
    }
  }
  void offsets(int64_t index, int64_t* a, int64_t* b) const {
    *a = *b = 0;
    for (int i = rank - 1; i >= 0; --i) {
      const int64_t at = index % size[i];
      index /= size[i];
      *a += at * step_a[i];
      *b += at * step_b[i];
    }
  }

 private:
  static bool merges(int64_t outer_step, int64_t inner_step, int64_t inner_size) {
    return inner_step == 0 ? outer_step == 0 : outer_step == inner_step * inner_size;
  }
};

}  // namespace restage::cpu
