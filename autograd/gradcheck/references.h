// Ops that have kernels of their own, made of other ops: tests compare the two.
#pragma once

#include "autograd/ops/attention.h"
#include "autograd/ops/cross_attention.h"
#include "autograd/ops/modulate.h"
#include "autograd/ops/pooled_norm.h"
#include "autograd/ops/rnn.h"

namespace restage::gradcheck {

Var gru_reference(const Var& x, const Var& h0, const Var& w_ih, const Var& w_hh, const Var& b_ih,
                  const Var& b_hh);
Var attention_pool_reference(const Var& score, const Var& value, double scale);
/// inputs: as of neighbour_attention().
Var neighbour_attention_reference(std::initializer_list<Var> inputs, const Tensor& index,
                                  double scale);
Var pooled_norm_reference(const Var& x, const Var& weight, const Var& bias, const Var& scale,
                          const Var& shift, Activation activation = Activation::none,
                          double eps = 1e-5, BatchStatistics* statistics = nullptr);
Var modulate_reference(const Var& x, const Var& mesh, const Var& scale, const Var& scale_bias,
                       const Var& shift, const Var& shift_bias,
                       Activation activation = Activation::none);
Var elain_reference(const Var& x, const Var& unit, const Var& gamma, const Var& beta,
                    const Var& share, double slope);
Var sinkhorn_reference(const Var& kernel, int steps, double epsilon);
/// Holds all scores at once.
Var cross_attention_reference(const Var& q, const Var& k, const Var& v, double factor = 1);

}  // namespace restage::gradcheck
