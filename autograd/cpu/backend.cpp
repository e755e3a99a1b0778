#include <cstring>

#include "autograd/cpu/kernels.h"
#include "autograd/cpu/pool.h"

namespace restage {
namespace {

class CpuBackend final : public Backend {
 public:
  CpuBackend() {
    add<UnaryArgs, cpu::unary>();
    add<UnaryGradArgs, cpu::unary_grad>();
    add<BinaryArgs, cpu::binary>();
    add<AccumulateArgs, cpu::accumulate>();
    add<DropoutArgs, cpu::dropout>();
    add<ReluDropoutGradArgs, cpu::relu_dropout_grad>();
    add<ExpandArgs, cpu::expand>();
    add<NonFiniteArgs, cpu::non_finite>();
    add<SumArgs, cpu::sum>();
    add<MaxArgs, cpu::max>();
    add<MaxGradArgs, cpu::max_grad>();
    add<SoftmaxArgs, cpu::softmax>();
    add<SoftmaxGradArgs, cpu::softmax_grad>();
    add<MatmulArgs, cpu::matmul>();
    add<CopyBlocksArgs, cpu::copy_blocks>();
    add<PermuteArgs, cpu::permute>();
    add<GatherArgs, cpu::gather>();
    add<ScatterAddArgs, cpu::scatter_add>();
    add<UnfoldArgs, cpu::unfold>();
    add<FoldArgs, cpu::fold>();
    add<NormArgs, cpu::norm>();
    add<NormGradArgs, cpu::norm_grad>();
    add<PooledNormArgs, cpu::pooled_norm>();
    add<PooledNormGradArgs, cpu::pooled_norm_grad>();
    add<GruArgs, cpu::gru>();
    add<GruGradArgs, cpu::gru_grad>();
    add<KnnArgs, cpu::knn>();
    add<FpsArgs, cpu::fps>();
    add<NeighbourAttentionArgs, cpu::neighbour_attention>();
    add<NeighbourAttentionGradArgs, cpu::neighbour_attention_grad>();
    add<AttentionPoolArgs, cpu::attention_pool>();
    add<AttentionPoolGradArgs, cpu::attention_pool_grad>();
    add<ToMatrixArgs, cpu::to_matrix>();
    add<ToMatrixGradArgs, cpu::to_matrix_grad>();
    add<FromMatrixArgs, cpu::from_matrix>();
    add<FkArgs, cpu::fk>();
    add<FkGradArgs, cpu::fk_grad>();
    add<LbsArgs, cpu::lbs>();
    add<LbsGradArgs, cpu::lbs_grad>();
    add<SquaredNormArgs, cpu::squared_norm>();
    add<AdamArgs, cpu::adam>();
    add<DeformArgs, cpu::deform>();
  }
  std::string_view name() const override { return "cpu"; }
  void* allocate(size_t bytes) override { return cpu::pool_allocate(bytes); }
  void release(void* data, size_t bytes) override { cpu::pool_release(data, bytes); }
  void fill_zero(void* data, size_t bytes) override {
    if (bytes > 0) std::memset(data, 0, bytes);
  }
};

}  // namespace

Backend& cpu_backend() {
  static CpuBackend* instance = new CpuBackend;  // never destroyed, like the pool
  return *instance;
}

}  // namespace restage
