// Offsets and skinning of a surface, tile by tile, so that nothing large leaves the cache. Points
// lie along vectors and every sum is one chain per point, so bits depend neither on threads nor on
// the width of a vector.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/deform.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"
#include "autograd/kernels/stats.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using F = hn::ScalableTag<float>;
using V = hn::Vec<F>;
constexpr int64_t kLanes = hn::MaxLanes(F());
constexpr int64_t P = kDeformTile;

// Register tile of the second layer: units x vectors of points.
constexpr int kUnits = HWY_TARGET == HWY_AVX3 ? 8 : 4;
constexpr int kVectors = 3;
static_assert(P % (kVectors * kLanes) == 0 && kDeformAlign % (2 * kLanes) == 0);

/// A summand of the second layer: weights of all units, and a value per point of the tile.
struct Term {
  const float* weight;
  const float* value;
};

/// Working memory of one thread, kept between calls.
struct TileMemory {
  Scratch<int32_t> on, candidates, active;
  Scratch<float> shared, affine;  // [4, p]: what the units that are on give, per x, y, z and 1
  Scratch<float> values;          // [u, P] of the active units
  Scratch<Term> terms;

  void fit(size_t units, size_t width) {
    for (auto* list : {&on, &candidates, &active}) list->reserve(units);
    shared.resize(4 * width);
    affine.resize(4 * width);
    values.resize(units * P);
    terms.reserve(units + 3);
  }
};

/// The pointers of OffsetField.
struct Field {
  explicit Field(const OffsetField& f)
      : units(f.w2.size(0)),
        width(f.w2.size(1)),
        w1(f.w1.data<float>()),
        b1(f.b1.data<float>()),
        w2(f.w2.data<float>()),
        b2(f.b2.data<float>()),
        w3(f.w3.data<float>()),
        b3(f.b3.data<float>()),
        low(f.low.data<float>()),
        high(f.high.data<float>()) {}
  int64_t units, width;
  const float *w1, *b1, *w2, *b2, *w3, *b3, *low, *high;
};

/// Puts unit i where its sign between `low` and `high` belongs: `on` if the sign is always
/// positive, `changing` if it changes or is not a number, nowhere if it is never positive, since
/// the unit is zero then.
void sort_unit(int32_t i, float low, float high, Scratch<int32_t>& on, Scratch<int32_t>& changing) {
  if (low > 0) {
    on.push_back(i);
  } else if (!(high <= 0)) {
    changing.push_back(i);
  }
}

/// affine [4, p] += what the units in `on` give to the second layer.
void add_units(const Field& f, const Scratch<int32_t>& on, float* affine) {
  const F d;
  for (int64_t at = 0; at < f.width; at += 2 * kLanes) {
    V acc[4][2];
    for (int c = 0; c < 4; ++c)
      for (int v = 0; v < 2; ++v) acc[c][v] = hn::LoadU(d, affine + c * f.width + at + v * kLanes);
    for (const int32_t i : on) {
      const float* w = f.w2 + i * f.width + at;
      const V w0 = hn::LoadU(d, w), w1 = hn::LoadU(d, w + kLanes);
      for (int c = 0; c < 4; ++c) {
        const V factor = hn::Set(d, c < 3 ? f.w1[3 * i + c] : f.b1[i]);
        acc[c][0] = hn::MulAdd(w0, factor, acc[c][0]);
        acc[c][1] = hn::MulAdd(w1, factor, acc[c][1]);
      }
    }
    for (int c = 0; c < 4; ++c)
      for (int v = 0; v < 2; ++v) hn::StoreU(acc[c][v], d, affine + c * f.width + at + v * kLanes);
  }
}

/// Computes what the tiles [from, to) share: the affine part of the units that are on in all of
/// these tiles, and the list of the units whose sign may differ between tiles.
void prepare_group(const Field& f, int64_t from, int64_t to, bool dense, TileMemory& s) {
  s.on.clear();
  s.candidates.clear();
  for (int32_t i = 0; i < f.units; ++i) {
    float low = f.low[from * f.units + i], high = f.high[from * f.units + i];
    for (int64_t t = from + 1; t < to; ++t) {
      low = std::min(low, f.low[t * f.units + i]);
      high = std::max(high, f.high[t * f.units + i]);
    }
    if (dense) {
      s.candidates.push_back(i);
    } else {
      sort_unit(i, low + f.b1[i], high + f.b1[i], s.on, s.candidates);
    }
  }
  std::fill(s.shared.begin(), s.shared.end(), 0.0f);
  std::copy_n(f.b2, f.width, s.shared.begin() + 3 * f.width);
  add_units(f, s.on, s.shared.data());
}

/// The terms of tile t: three coordinates with the affine part, then the active units.
void prepare_tile(const Field& f, int64_t t, const float* points, bool dense, TileMemory& s) {
  const F d;
  s.on.clear();
  s.active.clear();
  for (const int32_t i : s.candidates) {
    if (dense) {
      s.active.push_back(i);
    } else {
      sort_unit(i, f.low[t * f.units + i] + f.b1[i], f.high[t * f.units + i] + f.b1[i], s.on,
                s.active);
    }
  }
  s.affine = s.shared;
  add_units(f, s.on, s.affine.data());
  s.terms.clear();
  for (int64_t c = 0; c < 3; ++c)
    s.terms.push_back({s.affine.data() + c * f.width, points + c * P});
  float* value = s.values.data();
  for (const int32_t i : s.active) {
    const float* w = f.w1 + 3 * i;
    for (int64_t p = 0; p < P; p += kLanes) {
      V z = hn::Mul(hn::Set(d, w[0]), hn::LoadU(d, points + p));
      z = hn::MulAdd(hn::Set(d, w[1]), hn::LoadU(d, points + P + p), z);
      z = hn::MulAdd(hn::Set(d, w[2]), hn::LoadU(d, points + 2 * P + p), z);
      z = hn::Add(z, hn::Set(d, f.b1[i]));
      hn::StoreU(hn::IfThenZeroElse(hn::Le(z, hn::Zero(d)), z), d, value + p);  // NaN stays
    }
    s.terms.push_back({f.w2 + i * f.width, value});
    value += P;
  }
}

/// Second and third layer of kVectors vectors of points: moved = points + offset, both [3, P].
void offset_points(const Field& f, const TileMemory& s, const float* points, float* moved) {
  const F d;
  const float* constant = s.affine.data() + 3 * f.width;
  V sum[3][kVectors];
  for (int c = 0; c < 3; ++c)
    for (int v = 0; v < kVectors; ++v) sum[c][v] = hn::Set(d, f.b3[c]);
  const int64_t shift = points - s.terms[0].value;  // of these points in their tile
  for (int64_t at = 0; at < f.width; at += kUnits) {
    V acc[kUnits][kVectors];
    for (int i = 0; i < kUnits; ++i)
      for (int v = 0; v < kVectors; ++v) acc[i][v] = hn::Set(d, constant[at + i]);
    for (const Term& term : s.terms) {
      V x[kVectors];
      for (int v = 0; v < kVectors; ++v) x[v] = hn::LoadU(d, term.value + shift + v * kLanes);
      for (int i = 0; i < kUnits; ++i) {
        const V w = hn::Set(d, term.weight[at + i]);
        for (int v = 0; v < kVectors; ++v) acc[i][v] = hn::MulAdd(w, x[v], acc[i][v]);
      }
    }
    for (int i = 0; i < kUnits; ++i)
      for (int v = 0; v < kVectors; ++v) {
        const V h = hn::IfThenZeroElse(hn::Le(acc[i][v], hn::Zero(d)), acc[i][v]);
        for (int c = 0; c < 3; ++c)
          sum[c][v] = hn::MulAdd(hn::Set(d, f.w3[c * f.width + at + i]), h, sum[c][v]);
      }
  }
  for (int c = 0; c < 3; ++c)
    for (int v = 0; v < kVectors; ++v)
      hn::StoreU(hn::Add(hn::LoadU(d, points + c * P + v * kLanes), sum[c][v]), d,
                 moved + c * P + v * kLanes);
}

/// posed [3, P] = sum_j weights_j (bones_j [x; 1]).
void skin_points(const float* x, const float* weights, const float* bones, int64_t joints,
                 float* posed) {
  const F d;
  for (int64_t p = 0; p < P; p += kLanes) {
    V blend[12];
    for (V& b : blend) b = hn::Zero(d);
    for (int64_t j = 0; j < joints; ++j) {
      const V w = hn::LoadU(d, weights + j * P + p);
      for (int i = 0; i < 12; ++i)
        blend[i] = hn::MulAdd(w, hn::Set(d, bones[12 * j + i]), blend[i]);
    }
    for (int r = 0; r < 3; ++r) {
      V y = blend[4 * r + 3];
      for (int c = 0; c < 3; ++c) y = hn::MulAdd(blend[4 * r + c], hn::LoadU(d, x + c * P + p), y);
      hn::StoreU(y, d, posed + r * P + p);
    }
  }
}

void tiles(const DeformArgs& args, const Field* field, int64_t from, int64_t to) {
  thread_local TileMemory s;
  const int64_t joints = args.weights.size(1);
  if (field) {
    s.fit(static_cast<size_t>(field->units), static_cast<size_t>(field->width));
    prepare_group(*field, from, to, args.dense, s);
  }
  for (int64_t t = from; t < to; ++t) {
    const float* x = args.points.data<float>() + t * 3 * P;
    HWY_ALIGN float moved[3 * P];
    HWY_ALIGN float posed[3 * P];
    if (field) {
      prepare_tile(*field, t, x, args.dense, s);
      for (int64_t p = 0; p < P; p += kVectors * kLanes) offset_points(*field, s, x + p, moved + p);
      count_units(std::ssize(s.active), field->units);
      count_flops(2.0 * static_cast<double>(P * field->width) *
                  static_cast<double>(s.terms.size() + 3));
      if (args.active) args.active->data<int32_t>()[t] = static_cast<int32_t>(s.active.size());
      x = moved;
    }
    skin_points(x, args.weights.data<float>() + t * joints * P, args.bones.data<float>(), joints,
                posed);
    const int32_t* order = args.order.data<int32_t>() + t * P;
    float* out = args.out.data<float>();
    for (int64_t p = 0; p < P; ++p)
      for (int64_t c = 0; c < 3; ++c) out[3 * order[p] + c] = posed[c * P + p];
  }
}

}  // namespace

void deform(const DeformArgs& args) {
  const int64_t count = args.points.size(0);
  if (count == 0) return;
  if (args.offset == nullptr) {
    parallel_for(count, kDeformGroup,
                 [&](int64_t from, int64_t to) HWY_ATTR { tiles(args, nullptr, from, to); });
    return;
  }
  const Field field(*args.offset);
  parallel_for(count, kDeformGroup,
               [&](int64_t from, int64_t to) HWY_ATTR { tiles(args, &field, from, to); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(deform, DeformArgs)
}  // namespace restage::cpu
#endif
