// Floating-point operations of one forward pass (work.h) of the systems without a skeleton: the
// products of matrices. `points` are the source's, `vertices` the target's, both v here.
#pragma once

#include "bench/work.h"
#include "nn/models/corenet.h"
#include "nn/models/lart.h"
#include "nn/models/npt.h"

namespace restage::bench {

inline int64_t pose_encoder_work(const std::array<int64_t, 3>& w) {
  return 3 * w[0] + w[0] * w[1] + w[1] * w[2];
}

/// Of one vertex: three convolutions, three scales and shifts.
inline int64_t spadain_block_work(int64_t c) { return 3 * c * c + 18 * c; }

/// One pair.
inline double npt_gflop(const NptConfig& m, int64_t v) {
  const int64_t full = m.widths[2] + 3;
  int64_t total = pose_encoder_work(m.widths), in = full;
  for (const int64_t c : {full, full / 2, full / 4}) {
    total += in * c + spadain_block_work(c);
    in = c;
  }
  return gflop_of(static_cast<double>(v * (total + 3 * in)));
}

/// One window: codes and answers of its frames, and of the mixture that the metric loss wants.
inline double lart_gflop(const LartConfig& m, int64_t v) {
  const int64_t full = m.widths[2], encoder = pose_encoder_work(m.widths);
  int64_t decoder = encoder, in = full;
  for (const int64_t c : {full, full / 2, full / 2, full / 4}) {
    decoder += 2 * in * c + 3 * c * c + 2 * v * c + spadain_block_work(c);
    in = c;
  }
  const int64_t all = 2 * m.frames * encoder + (m.frames + 1) * (decoder + 3 * in);
  return gflop_of(static_cast<double>(v * all));
}

/// One pair.
inline double corenet_gflop(const CoreNetConfig& m, int64_t v) {
  const int64_t w = m.widths[2];
  const int64_t features = pose_encoder_work(m.widths) + m.blocks * 2 * w * w + w * w;
  const int64_t transport = v * w + 10 * v + 3 * v;
  int64_t total = 2 * features + transport + 9 * m.generator[0], in = m.generator[0];
  for (const int64_t c : m.generator) {
    total += in * c + 3 * (w * c + 2 * c * c + c * c);
    in = c;
  }
  return gflop_of(static_cast<double>(v * (total + 3 * in)));
}

}  // namespace restage::bench
