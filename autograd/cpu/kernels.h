// Every kernel of the CPU backend; backend.cpp enters them into its table.
#pragma once

#include "autograd/kernels/attention.h"
#include "autograd/kernels/deform.h"
#include "autograd/kernels/elementwise.h"
#include "autograd/kernels/layout.h"
#include "autograd/kernels/matmul.h"
#include "autograd/kernels/norm.h"
#include "autograd/kernels/points.h"
#include "autograd/kernels/pooled_norm.h"
#include "autograd/kernels/reduce.h"
#include "autograd/kernels/rnn.h"
#include "autograd/kernels/rotation.h"
#include "autograd/kernels/update.h"

namespace restage::cpu {

void unary(const UnaryArgs&);
void unary_grad(const UnaryGradArgs&);
void binary(const BinaryArgs&);
void accumulate(const AccumulateArgs&);
void dropout(const DropoutArgs&);
void relu_dropout_grad(const ReluDropoutGradArgs&);
void expand(const ExpandArgs&);
void non_finite(const NonFiniteArgs&);
void sum(const SumArgs&);
void max(const MaxArgs&);
void max_grad(const MaxGradArgs&);
void softmax(const SoftmaxArgs&);
void softmax_grad(const SoftmaxGradArgs&);
void matmul(const MatmulArgs&);
void matmul_bf16(const MatmulArgs&);  // matmul() calls it
void copy_blocks(const CopyBlocksArgs&);
void permute(const PermuteArgs&);
void gather(const GatherArgs&);
void scatter_add(const ScatterAddArgs&);
void unfold(const UnfoldArgs&);
void fold(const FoldArgs&);
void norm(const NormArgs&);
void norm_grad(const NormGradArgs&);
void pooled_norm(const PooledNormArgs&);
void pooled_norm_grad(const PooledNormGradArgs&);
void gru(const GruArgs&);
void gru_grad(const GruGradArgs&);
void knn(const KnnArgs&);
void fps(const FpsArgs&);
void neighbour_attention(const NeighbourAttentionArgs&);
void neighbour_attention_grad(const NeighbourAttentionGradArgs&);
void attention_pool(const AttentionPoolArgs&);
void attention_pool_grad(const AttentionPoolGradArgs&);
void to_matrix(const ToMatrixArgs&);
void to_matrix_grad(const ToMatrixGradArgs&);
void from_matrix(const FromMatrixArgs&);
void fk(const FkArgs&);
void fk_grad(const FkGradArgs&);
void lbs(const LbsArgs&);
void lbs_grad(const LbsGradArgs&);
void squared_norm(const SquaredNormArgs&);
void adam(const AdamArgs&);
void deform(const DeformArgs&);

}  // namespace restage::cpu
