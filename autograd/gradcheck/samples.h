// Shared by the samples_<group>.cpp files; each gives the samples of one header of autograd/ops.
#pragma once

#include "autograd/gradcheck/gradcheck.h"

namespace restage::gradcheck {

using Table = std::deque<OpSamples>;

void add_attention(Table& table);
void add_cross_attention(Table& table);
void add_elementwise(Table& table);
void add_layout(Table& table);
void add_linear(Table& table);
void add_modulate(Table& table);
void add_norm(Table& table);
void add_points(Table& table);
void add_pooled_norm(Table& table);
void add_reduce(Table& table);
void add_rnn(Table& table);
void add_rotation(Table& table);
void add_swing(Table& table);
void add_transport(Table& table);

/// A shape of `min_rank` to `max_rank` dimensions of 0 to `most` (zeros are rare).
Shape random_shape(Rng& rng, int min_rank, int max_rank, int64_t most = 4);
/// A dimension of `least` to `most`.
int64_t random_size(Rng& rng, int64_t least, int64_t most);
/// Standard normal numbers, away from zero by `gap`.
Tensor random(const Shape& shape, Rng& rng, double gap = 0);
/// Numbers of which no two are closer than 1e-3, in mixed order.
Tensor distinct(const Shape& shape);
/// Indices (int32) in [0, limit), with repetitions; limit > 0 unless empty.
Tensor random_index(const Shape& shape, Rng& rng, int64_t limit);

Tensor f64(const Shape& shape, const std::vector<double>& values);
Tensor i32(const Shape& shape, const std::vector<int32_t>& values);

}  // namespace restage::gradcheck
