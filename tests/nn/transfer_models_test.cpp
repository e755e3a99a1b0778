// NPT, LART, 3D-CoreNet, H4D and TST at their full sizes, LART's two traps, what the losses do at
// lengths of zero, and the memory of attention. Their numbers are checked by the oracle
// (tests/oracle).
#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/references.h"
#include "autograd/ops/cross_attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"
#include "nn/losses/transfer.h"
#include "nn/models/lart.h"
#include "nn/models/registry.h"
#include "nn/models/tst.h"
#include "tests/support/errors.h"

namespace restage {
namespace {

Tensor some_points(const Shape& shape, uint64_t stream) {
  return Init{RngKey{5, stream}}.uniform(shape, 0.5, "x");
}

int64_t parameters(const std::string& name) {
  return count_parameters(*make_model(name, model_config(name), Init{RngKey{1, 0}}));
}

TEST(TransferModels, HaveThePapersNumberOfParameters) {
  EXPECT_EQ(parameters("transfer/npt"), 6'054'941);
  EXPECT_EQ(parameters("transfer/npt_pool"), 6'054'941);
  EXPECT_EQ(parameters("transfer/lart"), 12'012'423);
  EXPECT_EQ(parameters("transfer/corenet"), 24'461'447);
  EXPECT_EQ(parameters("transfer/tst"), 34'936'863);
  EXPECT_EQ(parameters("transfer/tst_discriminator"), 10'649'345);
  EXPECT_EQ(parameters("codes/h4d"), 3'558'828);
}

/// The largest change of LART's answer when the pose is another one.
double change_by_pose(bool first_norm) {
  LartConfig config;
  config.widths = {8, 12, 16};
  config.first_norm = first_norm;
  Lart net(config, Init{RngKey{2, 0}});
  Context ctx;
  const Tensor mesh = some_points({1, 9, 3}, 1);
  const Tensor one = net.forward(ctx, {some_points({1, 3, 14, 3}, 2), mesh}).value;
  const Tensor other = net.forward(ctx, {some_points({1, 3, 14, 3}, 3), mesh}).value;
  double out = 0;
  for (int64_t i = 0; i < one.numel(); ++i)
    out = std::max(out, std::abs(one.item(i) - other.item(i)));
  return out;
}

TEST(TransferModels, LartSeesThePoseOnlyWithoutItsFirstNorm) {
  EXPECT_GT(change_by_pose(false), 1e-3);
  EXPECT_LT(change_by_pose(true), 1e-5);
}

TEST(TransferModels, LartMixesTheCodesOfTwoFrames) {
  LartConfig config;
  config.widths = {4, 6, 8};
  Lart net(config, Init{RngKey{2, 0}});
  Context ctx;
  const Tensor pose = some_points({2, 3, 20, 3}, 3), target = some_points({1, 12, 3}, 4);
  const auto at = [&](double share) {
    return net.between(ctx, {pose, target}, share)->value.reshape({12, 3});
  };
  const auto answer = [&](int64_t window) {
    const Var y = net.forward(ctx, {pose.rows(window, window + 1), target, true});
    return y.value.reshape({12, 3});
  };
  const auto apart = [](const Tensor& a, const Tensor& b) {
    double most = 0;
    for (int64_t i = 0; i < a.numel(); ++i) most = std::max(most, std::abs(a.item(i) - b.item(i)));
    return most;
  };
  ASSERT_GT(apart(answer(0), answer(1)), 1e-3);
  EXPECT_LT(apart(at(0), answer(0)), 1e-6);
  EXPECT_LT(apart(at(1), answer(1)), 1e-6);
  EXPECT_GT(apart(at(0.5), answer(0)), 1e-4);
  EXPECT_GT(apart(at(0.5), answer(1)), 1e-4);
}

TEST(TransferModels, LartsFirstAttentionLearnsNoCorrespondence) {
  LartConfig config;
  config.widths = {8, 12, 16};
  Lart net(config, Init{RngKey{2, 0}});
  cast_module(net, DType::f64);
  for (size_t i = 0; i < 4; ++i) net.att[i].gamma.value = Tensor::full({1}, 0.5, DType::f64);
  Tape tape;
  Context ctx{&tape, true, RngKey{3, 0}};
  const Var y = net.forward(ctx, {some_points({1, 3, 14, 3}, 2).cast(DType::f64),
                                  some_points({1, 9, 3}, 1).cast(DType::f64)});
  const Gradients g = tape.backward(sum_all(square(y)));
  const auto norm = [&](const Parameter& p) { return g.norm(std::array{p.id}); };
  EXPECT_LT(norm(net.att[0].k.weight), 1e-12);  // all keys are equal
  EXPECT_LT(norm(net.att[0].q.weight), 1e-12);
  EXPECT_GT(norm(net.att[1].k.weight), 1e-9);
  EXPECT_GT(norm(net.att[1].q.weight), 1e-9);
}

TEST(TransferModels, WrongInputsAreRefusedInWords) {
  Context ctx;
  const auto npt = make_model_as<TransferModel>(
      "transfer/npt", model_config("transfer/npt", {"widths=[4, 5, 9]"}), Init{});
  EXPECT_HAS(test::error_of<Error>([&] {
               npt->forward(ctx, {some_points({1, 1, 8, 3}, 1), some_points({1, 9, 3}, 2)});
             }),
             "as many points as the target has vertices");
  const auto tst = make_model_as<TransferModel>(
      "transfer/tst", model_config("transfer/tst", {"widths=[4, 5, 9]", "vertices=7"}), Init{});
  EXPECT_HAS(test::error_of<Error>([&] {
               tst->forward(ctx, {some_points({1, 5, 9, 3}, 1), some_points({1, 9, 3}, 2)});
             }),
             "made for 7 vertices");
  const auto lart = make_model_as<TransferModel>(
      "transfer/lart", model_config("transfer/lart", {"widths=[4, 5, 8]"}), Init{});
  EXPECT_HAS(test::error_of<Error>([&] {
               lart->forward(ctx, {some_points({1, 4, 9, 3}, 1), some_points({1, 9, 3}, 2)});
             }),
             "for 3 frames");
  EXPECT_THROW(register_model(models().front()), Error);
}

TEST(TransferLosses, EdgesWithoutLengthGiveNoNan) {
  const Tensor faces = Tensor::from<int32_t>({3, 3}, {0, 1, 2, 1, 2, 3, 0, 0, 0});
  Tensor reference = some_points({1, 4, 3}, 1);
  std::copy_n(reference.data<float>(), 3, reference.data<float>() + 3);  // edge 0-1 has no length
  Tape tape;
  const uint64_t id = Parameter::next_id();
  const Var pred = tape.leaf(Tensor::zeros({1, 4, 3}), id);  // no edge has any
  const Var loss = edge_loss(pred, reference, faces);
  // Two faces, five edges whose reference has a length, each off by 1; 0 0 0 is no face.
  EXPECT_NEAR(loss.value.item(), 5.0 / 2, 1e-6);
  EXPECT_TRUE(tape.backward(sum_all(loss)).finite());
  EXPECT_HAS(test::error_of<Error>([&] {
               edge_loss(pred, reference, Tensor::empty({0, 3}, DType::i32));
             }),
             "faces is needed");
}

TEST(TransferLosses, AFaceWithACornerTwiceIsNone) {
  const std::vector<int32_t> triangle = {0, 1, 2};
  const Tensor reference = Tensor::from<double>({1, 3, 3}, {0, 0, 0, 1, 0, 0, 0, 1, 0});
  const auto loss = [&](std::vector<int32_t> corners, std::vector<double>* gradient) {
    const auto faces = static_cast<int64_t>(corners.size() / 3);
    Tape tape;
    const uint64_t id = Parameter::next_id();
    const Var pred = tape.leaf(Tensor::from<double>({1, 3, 3}, {0, 0, 0, 2, 0, 0, 0, 2, 0}), id);
    const Var out = edge_loss(pred, reference, Tensor::from<int32_t>({faces, 3}, corners));
    *gradient = tape.backward(sum_all(out)).find(id)->to_vector<double>();
    return out.value.item();
  };
  std::vector<double> alone, beside;
  EXPECT_NEAR(loss(triangle, &alone), 3, 1e-9) << "all edges twice as long";
  for (const std::array<int32_t, 3>& none :
       {std::array{0, 1, 1}, {1, 0, 1}, {1, 1, 0}, {2, 2, 2}}) {
    std::vector<int32_t> two = triangle;
    two.insert(two.end(), none.begin(), none.end());
    EXPECT_DOUBLE_EQ(loss(two, &beside), loss(triangle, &alone)) << none[0] << none[1] << none[2];
    EXPECT_EQ(beside, alone);
    two.assign(none.begin(), none.end());
    EXPECT_EQ(loss(two, &beside), 0) << "no face at all";
  }
}

TEST(TransferLosses, AnEdgeWithoutLengthInTheReferenceCountsAsRight) {
  const Tensor faces = Tensor::from<int32_t>({1, 3}, {0, 1, 2});
  const Tensor reference = Tensor::from<double>({1, 3, 3}, {0, 0, 0, 0, 0, 0, 1, 0, 0});
  const Tensor pred = Tensor::from<double>({1, 3, 3}, {0, 0, 0, 0, 3, 0, 2, 0, 0});
  // 0-1 has no length in the reference; 1-2 is sqrt(13) instead of 1, and 0-2 is 2 instead of 1.
  EXPECT_NEAR(edge_loss(Var(pred), reference, faces).value.item(), std::sqrt(13.0) - 1 + 1, 1e-9);
}

TEST(CrossAttentionMemory, GrowsWithThePointsAndNotWithTheirProduct) {
  const auto peak = [](bool blocks) {
    const int64_t points = 4096, width = 8;
    const Tensor q = some_points({1, points, width}, 1), k = some_points({1, points, width}, 2);
    const int64_t before = memory_stats().in_use;
    reset_peak_memory();
    Tape tape;
    const Var leaf = tape.leaf(q, Parameter::next_id());
    const Var y =
        blocks ? cross_attention(leaf, k, k) : gradcheck::cross_attention_reference(leaf, k, k);
    tape.backward(sum_all(y));
    return memory_stats().peak - before;
  };
  EXPECT_LT(peak(true), int64_t{40} << 20);
  EXPECT_GT(peak(false), int64_t{100} << 20);
}

/// Deviation of a tensor of a model, by its name.
double deviation_of(Module& model, const std::string& name) {
  for (const StateEntry& entry : state_of(model)) {
    if (entry.name != name) continue;
    double sum = 0, squares = 0;
    const std::vector<double> x = entry.value->to_vector<double>();
    for (const double v : x) sum += v, squares += v * v;
    const auto n = static_cast<double>(x.size());
    return std::sqrt(squares / n - sum * sum / n / n);
  }
  ADD_FAILURE() << name;
  return 0;
}

TEST(TransferModels, WeightsBeginAsTheirProgramsDo) {
  const Init init{RngKey{5, 0}};
  const auto of = [&](const char* model, const char* name, bool own) {
    const std::vector<std::string> settings = {own ? "own_start=true" : "own_start=false"};
    const auto net = make_model_as<TransferModel>(model, model_config(model, settings), init);
    return deviation_of(*net, name);
  };
  // 128 -> 1,024 channels; PyTorch's: uniform within 1 / sqrt(128).
  const double pytorch = 1 / std::sqrt(128. * 3);
  for (const char* model : {"transfer/npt", "transfer/npt_pool", "transfer/lart"}) {
    EXPECT_NEAR(of(model, "enc.convs.2.weight", false), pytorch, 2e-4) << model;
    EXPECT_NEAR(of(model, "enc.convs.2.weight", true), 0.02, 1e-4) << model;
    EXPECT_NEAR(of(model, "enc.convs.2.bias", true), pytorch, 3e-3) << model;
  }
  const double xavier = 0.02 * std::sqrt(2. / (1024 + 512));
  EXPECT_NEAR(of("transfer/corenet", "convs.1.weight", true), xavier, 0.01 * xavier);
  EXPECT_EQ(of("transfer/corenet", "convs.1.bias", true), 0);
  EXPECT_NEAR(of("transfer/corenet", "blocks.0.c0.weight_orig", true), 1 / std::sqrt(1024. * 3),
              2e-4);
}

}  // namespace
}  // namespace restage
