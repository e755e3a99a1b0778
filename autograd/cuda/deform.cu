// The online frame's deformation (kernels/deform.h): every unit for every point, the layers after
// the first by cuBLAS.
#include "autograd/cuda/kernels.h"

namespace restage::cuda {
namespace {

constexpr int64_t P = kDeformTile;

/// What the offset network gives to all points of all tiles, [t * P, 3].
Tensor offsets(const DeformArgs& args) {
  const OffsetField& f = *args.offset;
  const int64_t n = args.points.size(0) * P, u = f.w2.size(0);
  Tensor first = empty_like(args.points, {n, u}),
         second = empty_like(args.points, {n, f.w2.size(1)}), out = empty_like(args.points, {n, 3});
  const float *x = at<float>(args.points), *w = at<float>(f.w1), *b = at<float>(f.b1);
  float* to = at<float>(first);
  each(n * u, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t point = i / u, unit = i % u;
    const float *of = x + point / P * 3 * P + point % P, *row = w + 3 * unit;
    const float z = fma(row[2], of[2 * P], fma(row[1], of[P], fma(row[0], of[0], b[unit])));
    to[i] = z <= 0 ? 0 : z;  // NaN stays
  });
  matmul({.a = first, .b = f.w2, .out = second, .bias = &f.b2, .activation = Activation::relu});
  matmul({.a = second, .b = f.w3, .out = out, .transpose_b = true, .bias = &f.b3});
  return out;
}

/// How many units of the first layer change their sign in each tile.
void count_active(const DeformArgs& args) {
  const OffsetField& f = *args.offset;
  const int64_t u = f.w2.size(0);
  const float *low = at<float>(f.low), *high = at<float>(f.high), *b = at<float>(f.b1);
  const bool dense = args.dense;
  int32_t* to = at<int32_t>(*args.active);
  each(args.active->numel(), [=] RESTAGE_DEVICE(int64_t t) {
    int32_t count = 0;
    for (int64_t i = 0; i < u; ++i) {
      const float least = low[t * u + i] + b[i], most = high[t * u + i] + b[i];
      if (dense || (!(least > 0) && !(most <= 0))) ++count;
    }
    to[t] = count;
  });
}

}  // namespace

void deform(const DeformArgs& args) {
  const int64_t joints = args.weights.size(1);
  Tensor moved_by;
  if (args.offset != nullptr && args.points.numel() > 0) moved_by = offsets(args);
  if (args.active != nullptr && args.offset != nullptr) count_active(args);
  const float *x = at<float>(args.points), *weights = at<float>(args.weights),
              *bones = at<float>(args.bones),
              *shift = moved_by.defined() ? at<float>(moved_by) : nullptr;
  const int32_t* order = at<int32_t>(args.order);
  float* out = at<float>(args.out);
  each(args.points.size(0) * P, [=] RESTAGE_DEVICE(int64_t i) {
    const int64_t tile = i / P, lane = i % P;
    float blend[12] = {};
    for (int64_t j = 0; j < joints; ++j) {
      const float weight = weights[(tile * joints + j) * P + lane];
      for (int e = 0; e < 12; ++e) blend[e] = fma(weight, bones[12 * j + e], blend[e]);
    }
    float at_rest[3];
    for (int c = 0; c < 3; ++c)
      at_rest[c] = x[(tile * 3 + c) * P + lane] + (shift == nullptr ? 0 : shift[3 * i + c]);
    for (int r = 0; r < 3; ++r) {
      float y = blend[4 * r + 3];
      for (int c = 0; c < 3; ++c) y = fma(blend[4 * r + c], at_rest[c], y);
      out[3 * order[i] + r] = y;
    }
  });
}

}  // namespace restage::cuda
