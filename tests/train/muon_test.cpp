// Muon against what it promises: singular vectors kept, singular values about one, steps of Adam's
// size, and the parameters that it leaves to Adam.
#include "train/optim/muon.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "autograd/base/atomic_file.h"
#include "autograd/base/log.h"
#include "autograd/base/rng.h"
#include "autograd/gradcheck/evaluate.h"
#include "nn/layers/linear.h"
#include "tests/support/emulated_gpu.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"
#include "tests/train/tiny_training.h"
#include "train/stages/transfer_stage.h"
#include "train/trainer.h"

namespace restage {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Tensor random_matrix(int64_t rows, int64_t columns, uint64_t seed) {
  Tensor out = Tensor::empty({rows, columns}, DType::f64);
  for (int64_t i = 0; i < out.numel(); ++i)
    out.data<double>()[i] = normal(RngKey{seed, 0}, static_cast<uint64_t>(i));
  return out;
}

Matrix matrix_of(const Tensor& t) {
  return Eigen::Map<const Matrix>(t.data<double>(), t.size(0), t.size(1));
}

/// One matrix, as one of two.
Matrix orthogonal(const Tensor& x) {
  Tensor two = Tensor::zeros({2, x.size(0), x.size(1)}, DType::f64);
  std::copy_n(x.data<double>(), x.numel(), two.data<double>() + x.numel());
  const Tensor out = orthogonalised(two);
  EXPECT_EQ(matrix_of(out.rows(0, 1).reshape(x.shape())).norm(), 0) << "zero stays zero";
  return matrix_of(out.rows(1, 2).reshape(x.shape()));
}

TEST(Orthogonalised, KeepsSingularVectorsAndBringsTheirValuesNearOne) {
  for (const auto& [rows, columns] : {std::pair{64, 40}, {40, 64}, {33, 33}}) {
    const Tensor x = random_matrix(rows, columns, 1);
    const Matrix in = matrix_of(x), out = orthogonal(x);
    const Eigen::JacobiSVD<Matrix> svd(in, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Matrix inner = svd.matrixU().transpose() * out * svd.matrixV();
    const Matrix diagonal = inner.diagonal().asDiagonal();
    EXPECT_LT((inner - diagonal).norm(), 1e-9) << rows << " x " << columns;
    EXPECT_LT((out - svd.matrixU() * diagonal * svd.matrixV().transpose()).norm(), 1e-9);
    for (int64_t i = 0; i < inner.rows(); ++i) {
      if (svd.singularValues()[i] < 1e-3 * in.norm()) continue;
      EXPECT_GT(inner(i, i), 0.65) << i;
      EXPECT_LT(inner(i, i), 1.25) << i;
    }
  }
}

TEST(Orthogonalised, DoesNotDependOnTheScale) {
  const Tensor x = random_matrix(40, 48, 2);
  Tensor small = x.clone();
  for (int64_t i = 0; i < x.numel(); ++i) small.data<double>()[i] *= 1e-8;
  EXPECT_LT((orthogonal(x) - orthogonal(small)).norm(), 1e-9);
}

TEST(Muon, TakesMatricesOnly) {
  const auto takes = [](const Shape& shape) {
    return Muon::takes(Parameter(Tensor::zeros(shape)));
  };
  EXPECT_TRUE(takes({32, 40}));
  EXPECT_FALSE(takes({31, 40}));
  EXPECT_FALSE(takes({40, 3}));
  EXPECT_FALSE(takes({64}));
  EXPECT_FALSE(takes({64, 64, 3}));
  // The weights of PyTorch's 1x1 convolutions are matrices, too.
  EXPECT_TRUE(takes({32, 40, 1}));
  EXPECT_TRUE(takes({32, 40, 1, 1}));
  EXPECT_FALSE(takes({31, 40, 1}));
  EXPECT_FALSE(takes({1, 64, 64}));
}

TEST(Muon, StepsAlongTheOrthogonalisedMomentumByAdamsSize) {
  Linear layer(64, 40, Init{RngKey{1, 0}, DType::f64}, false);
  MuonConfig config;
  Muon muon(named_parameters({{"", &layer}}), config);
  Matrix momentum = Matrix::Zero(40, 64), w = matrix_of(layer.weight.value);
  const double rate = 1e-2, scale = 0.5;
  for (uint64_t i = 0; i < 3; ++i) {
    Gradients g;
    g.set(layer.weight.id, random_matrix(40, 64, 10 + i));
    const Matrix gradient = scale * matrix_of(*g.find(layer.weight.id));
    momentum = config.momentum * momentum + gradient;
    Tensor ahead = Tensor::empty({40, 64}, DType::f64);
    Eigen::Map<Matrix>(ahead.data<double>(), 40, 64) = config.momentum * momentum + gradient;
    const Matrix step = rate * config.step * 8 * orthogonal(ahead);
    muon.step(g, rate, scale);
    EXPECT_LT((matrix_of(layer.weight.value) - (w - step)).norm(), 1e-12);
    EXPECT_NEAR(step.norm() / std::sqrt(40 * 64), rate * config.step, 0.2 * rate * config.step);
    w = matrix_of(layer.weight.value);
  }
}

TEST(Muon, StepsOnADeviceWithoutWaitingForIt) {
  const auto moved = [](Device device) {
    Linear layer(64, 40, Init{RngKey{1, 0}, DType::f64}, false);
    move_module(layer, device);
    Muon muon(named_parameters({{"", &layer}}), {});
    Gradients g;
    g.set(layer.weight.id, random_matrix(40, 64, 10).to(device));
    const int64_t before = emulated_counts().waits;
    muon.step(g, 1e-2, 0.5);
    EXPECT_EQ(emulated_counts().waits, before);
    return matrix_of(layer.weight.value.cpu());
  };
  EXPECT_LT((moved(emulated_gpu()) - moved({})).norm(), 1e-12);
}

/// A weight moves alike, whatever axes of one follow, beside others of its shape or alone.
TEST(Muon, MovesConvolutionsAsMatrices) {
  const auto moved = [](const std::vector<int>& tails) {
    std::vector<std::unique_ptr<Linear>> layers;
    std::vector<std::pair<std::string, Module*>> modules;
    for (const int tail : tails) {
      layers.push_back(
          std::make_unique<Linear>(64, 40, Init{RngKey{1, 0}, DType::f64}, false, tail));
      modules.emplace_back("layer" + std::to_string(layers.size()) + ".", layers.back().get());
    }
    const auto named = named_parameters(modules);
    Muon muon(named, {}), resumed(named, {});
    TensorFile file;
    for (uint64_t i = 0; i < 2; ++i) {
      Gradients g;
      for (const auto& layer : layers)
        g.set(layer->weight.id, random_matrix(40, 64, 10 + i).reshape(layer->weight.value.shape()));
      (i == 0 ? muon : resumed).step(g, 1e-2, 1);
      muon.save("", file);
      resumed.load("", file, "file");
    }
    EXPECT_EQ(file.tensors.at("layer1.weight.m").shape(), layers[0]->weight.value.shape());
    std::vector<std::vector<double>> out;
    for (const auto& layer : layers) out.push_back(layer->weight.value.to_vector<double>());
    return out;
  };
  const std::vector<double> plain = moved({0})[0];
  for (const std::vector<int>& tails : {std::vector{1}, {2}, {0, 1, 2}})
    for (const auto& weight : moved(tails)) EXPECT_EQ(weight, plain);
}

/// What a stage of one of the systems without a skeleton leaves to Adam, and what the log says.
TEST(Muon, TakesMostOfTheSystemsThatAreMadeOfConvolutions) {
  for (const std::string model : {"transfer/npt", "transfer/lart", "transfer/corenet"}) {
    TrainConfig config;
    auto& stage_config = config.section("transfer").config.as<TransferStageConfig>();
    const bool deep = model == "transfer/corenet";
    testing::choose(stage_config.model, model,
                    {deep ? "widths=[32, 64, 64]" : "widths=[32, 64, 125]"});
    if (deep) testing::resize(stage_config.model, {"generator=[64, 64, 32]", "blocks=1"});
    stage_config.pairs.points = 32;
    stage_config.optimiser.kind = OptimiserConfig::Kind::muon;
    const auto stage = testing::tiny_stage("transfer", config);
    TensorFile file;
    stage->save(file);
    int64_t matrices = 0, others = 0;
    for (const auto& [name, value] : file.tensors)
      if (name.starts_with("optimiser.") && name.ends_with(".m"))
        (file.find(name.substr(0, name.size() - 1) + "v") == nullptr ? matrices : others) +=
            value.numel();
    EXPECT_GT(matrices, 3 * others) << model;
    EXPECT_EQ(stage->optimised().muon, matrices) << model;
    EXPECT_EQ(stage->optimised().adam, others) << model;
  }
}

TEST(Muon, LeavesTheRestOfANetworkToAdam) {
  TrainConfig config = testing::tiny_training(1);
  const auto state = [&](OptimiserConfig::Kind kind) {
    testing::skeleton(config).optimiser.kind = kind;
    const auto stage = testing::tiny_stage("skeleton", config);
    stage->step(0);
    TensorFile file;
    stage->save(file);
    return file;
  };
  const TensorFile adam = state(OptimiserConfig::Kind::adam),
                   muon = state(OptimiserConfig::Kind::muon);
  int others = 0, matrices = 0;
  for (const auto& [name, value] : adam.tensors) {
    if (!name.starts_with("optimiser.") || !name.ends_with(".v")) continue;
    const std::string weight = name.substr(10, name.size() - 12);
    const bool same = gradcheck::same_bits(adam.tensors.at(weight), muon.tensors.at(weight));
    const bool by_adam = muon.find(name) != nullptr;
    EXPECT_EQ(same, by_adam) << weight;
    ++(by_adam ? others : matrices);
  }
  EXPECT_GT(others, 10);
  EXPECT_GT(matrices, 4);
}

class MuonLog : public test::FileTest {
 protected:
  void SetUp() override { set_log_level(LogLevel::quiet); }
  void TearDown() override { set_log_level(LogLevel::info); }
  /// The log of a step of training.
  std::string log_of(const std::string& name, TrainConfig config) {
    for (OptimiserConfig* o : testing::optimisers(config)) {
      o->steps = 1;
      o->kind = OptimiserConfig::Kind::muon;
    }
    RunDir run = RunDir::create_at(dir / name, "x: 1\n", "{}\n", {name});
    train(run, {name}, {},
          [&](const std::string&, Bundle*) { return testing::tiny_stage(name, config); },
          {.quiet = true});
    return read_file(run.dir() + "/log.txt");
  }
};

TEST_F(MuonLog, SaysHowManyNumbersEachMoves) {
  TrainConfig config = testing::tiny_training(1);
  const OptimisedNumbers n = testing::tiny_stage("skeleton", config)->optimised();
  EXPECT_HAS(log_of("skeleton", config),
             "Muon moves " + std::to_string(n.muon) + " numbers, Adam " + std::to_string(n.adam));
  // Matrices of fewer than 32 rows are none of Muon's.
  testing::resize(testing::deformation(config).model, {"width=16"});
  const std::string none = log_of("deformation", config);
  EXPECT_HAS(none, "warning: deformation: Muon moves 0 numbers");
  EXPECT_HAS(none, "32 rows and columns");
}

}  // namespace
}  // namespace restage
