// Every kernel with its contract, once. Each backend declares a function of that name for each and
// enters it into its table, so each has all of them.
#pragma once

#include "autograd/kernels/attention.h"
#include "autograd/kernels/deform.h"
#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/layout.h"
#include "autograd/kernels/matmul.h"
#include "autograd/kernels/modulate.h"
#include "autograd/kernels/norm.h"
#include "autograd/kernels/points.h"
#include "autograd/kernels/pooled_norm.h"
#include "autograd/kernels/reduce.h"
#include "autograd/kernels/rnn.h"
#include "autograd/kernels/rotation.h"
#include "autograd/kernels/update.h"

#define RESTAGE_KERNELS(K)                                \
  K(unary, UnaryArgs)                                     \
  K(unary_grad, UnaryGradArgs)                            \
  K(binary, BinaryArgs)                                   \
  K(binary_grad, BinaryGradArgs)                          \
  K(accumulate, AccumulateArgs)                           \
  K(dropout, DropoutArgs)                                 \
  K(relu_dropout_grad, ReluDropoutGradArgs)               \
  K(expand, ExpandArgs)                                   \
  K(cast, CastArgs)                                       \
  K(non_finite, NonFiniteArgs)                            \
  K(sum, SumArgs)                                         \
  K(max, MaxArgs)                                         \
  K(max_grad, MaxGradArgs)                                \
  K(softmax, SoftmaxArgs)                                 \
  K(softmax_grad, SoftmaxGradArgs)                        \
  K(matmul, MatmulArgs)                                   \
  K(copy_blocks, CopyBlocksArgs)                          \
  K(permute, PermuteArgs)                                 \
  K(gather, GatherArgs)                                   \
  K(scatter_add, ScatterAddArgs)                          \
  K(unfold, UnfoldArgs)                                   \
  K(fold, FoldArgs)                                       \
  K(norm, NormArgs)                                       \
  K(norm_grad, NormGradArgs)                              \
  K(pooled_norm, PooledNormArgs)                          \
  K(pooled_norm_grad, PooledNormGradArgs)                 \
  K(modulate, ModulateArgs)                               \
  K(modulate_grad, ModulateGradArgs)                      \
  K(elain, ElainArgs)                                     \
  K(elain_grad, ElainGradArgs)                            \
  K(gru, GruArgs)                                         \
  K(gru_grad, GruGradArgs)                                \
  K(recurrence, RecurrenceArgs)                           \
  K(recurrence_grad, RecurrenceGradArgs)                  \
  K(knn, KnnArgs)                                         \
  K(fps, FpsArgs)                                         \
  K(neighbour_attention, NeighbourAttentionArgs)          \
  K(neighbour_attention_grad, NeighbourAttentionGradArgs) \
  K(attention_pool, AttentionPoolArgs)                    \
  K(attention_pool_grad, AttentionPoolGradArgs)           \
  K(to_matrix, ToMatrixArgs)                              \
  K(to_matrix_grad, ToMatrixGradArgs)                     \
  K(from_matrix, FromMatrixArgs)                          \
  K(fk, FkArgs)                                           \
  K(fk_grad, FkGradArgs)                                  \
  K(swing_twist, SwingTwistArgs)                          \
  K(swing_twist_grad, SwingTwistGradArgs)                 \
  K(lbs, LbsArgs)                                         \
  K(lbs_grad, LbsGradArgs)                                \
  K(squared_norm, SquaredNormArgs)                        \
  K(adam, AdamArgs)                                       \
  K(mix, MixArgs)                                         \
  K(deform, DeformArgs)
