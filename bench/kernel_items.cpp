// The kernels in which most of the time goes.
#include <cmath>

#include "autograd/ops/cross_attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/reduce.h"
#include "bench/items.h"
#include "bench/work.h"
#include "nn/layers/gru.h"
#include "nn/layers/vector_attention.h"
#include "train/stage.h"

namespace restage::bench {
namespace {

/// [m, k] times [k, n], no bias.
template <int64_t m, int64_t k, int64_t n, bool transpose_a = false>
class Product : public Item {
 public:
  Product(const Inputs&, const std::string&, bool) {}
  void run() override { c_ = matmul(a_, b_, transpose_a).value; }
  std::vector<double> check() override {
    run();
    return summary(c_);
  }

 private:
  Tensor a_ = Tensor::full(transpose_a ? Shape{k, m} : Shape{m, k}, 0.25),
         b_ = Tensor::full({k, n}, 0.5), c_;
};

/// Forward (and backward) of something with a parameter.
class Layer : public Item {
 public:
  explicit Layer(bool backward) : backward_(backward) {}
  void run() override {
    if (backward_) {
      differentiated_ = differentiate({}, [&](Context& ctx) { return loss(ctx); });
    } else {
      Context ctx;
      value_ = forward(ctx).value;
    }
  }
  std::vector<double> check() override {
    run();
    return backward_ ? std::vector{differentiated_.loss, differentiated_.norm} : summary(value_);
  }

 protected:
  virtual Var forward(Context& ctx) = 0;

 private:
  Var loss(Context& ctx) { return mean_all(square(forward(ctx))); }
  bool backward_;
  Tensor value_;
  Differentiated differentiated_;
};

/// The first attention block of the paper's extractor on one cloud.
template <bool backward>
class Attention : public Layer {
 public:
  Attention(const Inputs& inputs, const std::string& variant, bool)
      : Layer(backward),
        block_(32, 512, 16, Init{}),
        xyz_(inputs.at("clouds.points").rows(0, 1)),
        features_(inputs.at("kernel.features")) {
    inputs.load(block_, variant, "skeleton", "backbone.transformer1.");
    block_.dense = variant == "dense";
  }

 private:
  Var forward(Context& ctx) override { return block_(ctx, xyz_, features_); }
  VectorAttention block_;
  Tensor xyz_, features_;
};

/// Attention of so many points of 64 channels over as many others, with gradients of all three.
template <int64_t points>
class AttentionOver : public Layer {
 public:
  AttentionOver(const Inputs& inputs, const std::string&, bool)
      : Layer(true),
        queries_(first(inputs.at("kernel.queries"))),
        keys_(first(inputs.at("kernel.keys"))),
        values_(first(inputs.at("kernel.values"))) {}

 private:
  static Tensor first(const Tensor& x) {
    return x.reshape({x.size(1), x.size(2)}).rows(0, points).reshape({1, points, x.size(2)});
  }
  Var forward(Context& ctx) override {
    return cross_attention(ctx.bind(queries_), ctx.bind(keys_), ctx.bind(values_));
  }
  Parameter queries_, keys_, values_;
};

/// Two products forward, four backward; what is computed again is not counted.
double attention_over_gflop(int64_t points) {
  return 3 * gflop_of(2.0 * 64 * static_cast<double>(points * points));
}

/// SMRM's decoder on 16 windows of 30 frames.
class Recurrent : public Layer {
 public:
  Recurrent(const Inputs& inputs, const std::string& variant, bool)
      : Layer(true), gru_(578, 512, 2, 0, Init{}), sequence_(inputs.at("kernel.sequence")) {
    inputs.load(gru_, variant, "smrm", "dec.");
  }

 private:
  Var forward(Context& ctx) override {
    Var state;
    return gru_(ctx, sequence_, &state);
  }
  GruLayer gru_;
  Tensor sequence_;
};

}  // namespace

std::vector<ItemInfo> kernel_items() {
  constexpr double pairs = 16384, width = 512, cube = 1024;
  const double wide = gflop_of(pairs * width * width);
  const double attention = attention_gflop(1024, 32), gru = 16 * 30 * gru_gflop(578, 512, 2);
  return {ItemInfo("sgemm_pairs", "[16384 x 512] [512 x 512]", "product", 1, wide,
                   make_item<Product<16384, 512, 512>>),
          ItemInfo("sgemm_gradient", "[16384 x 512]^T [16384 x 512]", "product", 1, wide,
                   make_item<Product<512, 16384, 512, true>>),
          ItemInfo("sgemm_square", "[1024 x 1024] [1024 x 1024]", "product", 1,
                   gflop_of(cube * cube * cube), make_item<Product<1024, 1024, 1024>>),
          ItemInfo("attention", "first attention block, forward", "cloud", 1, attention,
                   make_item<Attention<false>>, {"skeleton"}, {"dense"}),
          ItemInfo("attention_train", "first attention block, forward and backward", "cloud", 1,
                   3 * attention, make_item<Attention<true>>, {"skeleton"}, {"dense"}),
          ItemInfo("gru_train", "SMRM's decoder GRU, batch 16, forward and backward", "step", 1,
                   3 * gru, make_item<Recurrent>),
          ItemInfo("cross_attention_1k", "cross attention of 1,024 points, forward and backward",
                   "step", 1, attention_over_gflop(1024), make_item<AttentionOver<1024>>),
          ItemInfo("cross_attention_7k", "the same of 6,890 points", "step", 1,
                   attention_over_gflop(6890), make_item<AttentionOver<6890>>),
          ItemInfo("cross_attention_13k", "the same of 13,380 points", "step", 1,
                   attention_over_gflop(kMostAttended), make_item<AttentionOver<kMostAttended>>)};
}

void make_dense(SkeletonModel& net, const std::string& variant) {
  auto* transformer = dynamic_cast<PointTransformer*>(&net);
  if (variant != "dense" || transformer == nullptr) return;
  PointTransformerBackbone& b = transformer->backbone;
  b.transformer1.dense = true;
  for (size_t i = 0; i < b.transformers.size(); ++i) b.transformers[i].dense = true;
}

std::vector<double> summary(const Tensor& x) {
  const float* v = x.data<float>();
  const int64_t n = x.numel();
  double sum = 0;
  for (int64_t i = 0; i < n; ++i) sum += std::abs(static_cast<double>(v[i]));
  return {sum, v[n / 3], v[n / 2], v[n - 1]};
}

std::vector<ItemInfo> items() {
  std::vector<ItemInfo> all = training_items();
  for (auto&& more : {transfer_items(), reading_items(), online_items(), kernel_items()})
    all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace restage::bench
