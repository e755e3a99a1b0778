// Linear blend skinning (spec 5.2): y = sum_j W_j (G_j x + b_j) with b_j = P_j - G_j rest_j. It
// runs over every vertex of every frame.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "autograd/cpu/skinning.cpp"
#include <hwy/foreach_target.h>  // once per instruction set

#include <algorithm>

#include "autograd/cpu/common.h"
#include "autograd/cpu/kernels.h"
#include "autograd/cpu/targets.h"
#include "autograd/kernels/scratch.h"

HWY_BEFORE_NAMESPACE();
namespace restage::cpu::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int64_t kVertices = 1024;  // per piece
constexpr int64_t kEntries = 12;     // of [G | b], by rows
constexpr int64_t kStride = 16;      // from joint to joint and vertex to vertex: whole vectors

/// Numbers for `joints` joints, to whole vectors.
template <class T>
constexpr int64_t padded(int64_t joints) {
  constexpr int64_t lanes = 64 / sizeof(T);
  return (joints + lanes - 1) / lanes * lanes;
}

/// [G | b] of every joint of every sample, [n, joints, kStride].
template <class T>
Scratch<T> skinning_transforms(const Tensor& transforms, const Tensor& rest) {
  const int64_t count = transforms.size(0) * transforms.size(1);
  Scratch<T> out(static_cast<size_t>(count * kStride), T(0));
  for (int64_t j = 0; j < count; ++j)
    for (int64_t r = 0; r < 3; ++r) {
      const T *row = transforms.data<T>() + kEntries * j + 4 * r, *at = rest.data<T>() + 3 * j;
      T* to = out.data() + kStride * j + 4 * r;
      std::copy_n(row, 3, to);
      to[3] = row[3] - (row[0] * at[0] + row[1] * at[1] + row[2] * at[2]);
    }
  return out;
}

/// Calls f(s, p, first, last) for every piece p of the vertices of every sample s.
template <class F>
void for_pieces(int64_t samples, int64_t vertices, F&& f) {
  const int64_t pieces = (vertices + kVertices - 1) / kVertices;
  parallel_for(samples * pieces, 1, [&](int64_t from, int64_t to) {
    for (int64_t i = from; i < to; ++i) {
      const int64_t p = i % pieces;
      f(i / pieces, p, p * kVertices, std::min(vertices, (p + 1) * kVertices));
    }
  });
}

/// The blended transforms of Rows vertices: each entry one chain over the joints.
template <int Rows, class T>
void blend_rows(const T* weights, int64_t joints, const T* transforms, T* blend) {
  const hn::CappedTag<T, kStride> d;
  constexpr auto width = static_cast<int64_t>(hn::MaxLanes(hn::CappedTag<T, kStride>()));
  constexpr int64_t vectors = (kEntries + width - 1) / width;
  hn::Vec<decltype(d)> sum[Rows][vectors];
  for (auto& row : sum)
    for (auto& s : row) s = hn::Zero(d);
  for (int64_t j = 0; j < joints; ++j)
    for (int64_t v = 0; v < vectors; ++v) {
      const auto t = hn::LoadU(d, transforms + kStride * j + v * width);
      for (int r = 0; r < Rows; ++r)
        sum[r][v] = hn::MulAdd(hn::Set(d, weights[r * joints + j]), t, sum[r][v]);
    }
  for (int r = 0; r < Rows; ++r)
    for (int64_t v = 0; v < vectors; ++v) hn::StoreU(sum[r][v], d, blend + kStride * r + v * width);
}

template <class T>
void blend_all(const T* weights, int64_t vertices, int64_t joints, const T* transforms, T* blend) {
  constexpr int kRows = 4;  // at a time: their sums are independent
  int64_t i = 0;
  for (; i + kRows <= vertices; i += kRows)
    blend_rows<kRows>(weights + i * joints, joints, transforms, blend + i * kStride);
  for (; i < vertices; ++i)
    blend_rows<1>(weights + i * joints, joints, transforms, blend + i * kStride);
}

template <class T>
void skin(const LbsArgs& args) {
  const int64_t v = args.points.size(1), joints = args.transforms.size(1);
  const Scratch<T> transforms = skinning_transforms<T>(args.transforms, args.rest);
  for_pieces(args.points.size(0), v, [&](int64_t s, int64_t, int64_t first, int64_t last) HWY_ATTR {
    Scratch<T> blends(static_cast<size_t>((last - first) * kStride));
    blend_all(args.weights.data<T>() + (s * v + first) * joints, last - first, joints,
              transforms.data() + s * joints * kStride, blends.data());
    const T *x = args.points.data<T>() + 3 * (s * v + first), *b = blends.data();
    T* y = args.out.data<T>() + 3 * (s * v + first);
    for (int64_t i = first; i < last; ++i, x += 3, y += 3, b += kStride)
      for (int r = 0; r < 3; ++r)
        y[r] = b[4 * r] * x[0] + b[4 * r + 1] * x[1] + b[4 * r + 2] * x[2] + b[4 * r + 3];
  });
}

/// One vertex's gradients of its weights [padded joints], and its share of those of the transforms
/// [kEntries, padded joints], added. `outer` is the gradient of its blended transform.
template <class T>
void weight_grads(const T* outer, const T* transforms, const T* weights, int64_t padded_joints,
                  T* g_weights, T* g_transforms) {
  const hn::ScalableTag<T> d;
  const auto lanes = static_cast<int64_t>(hn::Lanes(d));
  for (int64_t j = 0; j < padded_joints; j += lanes) {
    const auto w = hn::LoadU(d, weights + j);
    auto g = hn::Zero(d);
    for (int64_t e = 0; e < kEntries; ++e) {
      const auto o = hn::Set(d, outer[e]);
      T* gt = g_transforms + e * padded_joints + j;
      g = hn::MulAdd(o, hn::LoadU(d, transforms + e * padded_joints + j), g);
      hn::StoreU(hn::MulAdd(o, w, hn::LoadU(d, gt)), d, gt);
    }
    hn::StoreU(g, d, g_weights + j);
  }
}

/// Gradients of one piece of vertices; g_transforms [kEntries, padded joints] of the blended
/// transforms' entries is added to.
template <class T>
void skin_grad_piece(const LbsGradArgs& args, const T* transforms, int64_t first, int64_t last,
                     T* g_transforms) {
  const int64_t joints = args.transforms.size(1), many = padded<T>(joints);
  Scratch<T> blends(static_cast<size_t>((last - first) * kStride));
  Scratch<T> across(static_cast<size_t>(kEntries * many), T(0));  // transforms, joints inside
  Scratch<T> w(static_cast<size_t>(many), T(0)), gw(w);
  for (int64_t j = 0; j < joints; ++j)
    for (int64_t e = 0; e < kEntries; ++e) across[e * many + j] = transforms[kStride * j + e];
  const T* weights = args.weights.data<T>() + first * joints;
  blend_all(weights, last - first, joints, transforms, blends.data());
  for (int64_t i = first; i < last; ++i, weights += joints) {
    const T *x = args.points.data<T>() + 3 * i, *g = args.gy.data<T>() + 3 * i;
    const T* b = blends.data() + (i - first) * kStride;
    T* gx = args.out.data<T>() + 3 * i;
    T outer[kEntries];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) outer[4 * r + c] = g[r] * x[c];
      outer[4 * r + 3] = g[r];
      gx[r] = b[r] * g[0] + b[4 + r] * g[1] + b[8 + r] * g[2];
    }
    std::copy_n(weights, joints, w.data());
    weight_grads(outer, across.data(), w.data(), many, gw.data(), g_transforms);
    std::copy_n(gw.data(), joints, args.g_weights.data<T>() + i * joints);
  }
}

/// Takes the gradients of [G | b] of one sample (`pieces` of them, which are added up in order) to
/// the gradients of [G | P] and of the rest joints.
template <class T>
void transform_grads(const LbsGradArgs& args, int64_t s, int64_t pieces, const T* partial) {
  const int64_t joints = args.transforms.size(1), many = padded<T>(joints);
  for (int64_t j = 0; j < joints; ++j) {
    const int64_t at = s * joints + j;
    const T *t = args.transforms.data<T>() + kEntries * at, *rest = args.rest.data<T>() + 3 * at;
    T *g = args.g_transforms.data<T>() + kEntries * at, *g_rest = args.g_rest.data<T>() + 3 * at;
    std::fill_n(g, kEntries, T(0));
    for (int64_t p = 0; p < pieces; ++p)
      for (int64_t e = 0; e < kEntries; ++e) g[e] += partial[(p * kEntries + e) * many + j];
    for (int c = 0; c < 3; ++c) {
      g_rest[c] = -(t[c] * g[3] + t[4 + c] * g[7] + t[8 + c] * g[11]);
      for (int r = 0; r < 3; ++r) g[4 * r + c] -= g[4 * r + 3] * rest[c];
    }
  }
}

template <class T>
void skin_grad(const LbsGradArgs& args) {
  const int64_t n = args.points.size(0), v = args.points.size(1), joints = args.transforms.size(1);
  const int64_t pieces = (v + kVertices - 1) / kVertices, size = kEntries * padded<T>(joints);
  const Scratch<T> transforms = skinning_transforms<T>(args.transforms, args.rest);
  Scratch<T> partial(static_cast<size_t>(n * pieces * size), T(0));
  for_pieces(n, v, [&](int64_t s, int64_t p, int64_t first, int64_t last) HWY_ATTR {
    skin_grad_piece(args, transforms.data() + s * joints * kStride, s * v + first, s * v + last,
                    partial.data() + (s * pieces + p) * size);
  });
  for (int64_t s = 0; s < n; ++s)
    transform_grads(args, s, pieces, partial.data() + s * pieces * size);
}

}  // namespace

void lbs(const LbsArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { skin<decltype(zero)>(args); });
}

void lbs_grad(const LbsGradArgs& args) {
  dispatch(args.out.dtype(), [&](auto zero) HWY_ATTR { skin_grad<decltype(zero)>(args); });
}

}  // namespace restage::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace restage::cpu {
RESTAGE_KERNEL(lbs, LbsArgs)
RESTAGE_KERNEL(lbs_grad, LbsGradArgs)
}  // namespace restage::cpu
#endif
