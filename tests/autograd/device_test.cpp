// What a second device must hold to: tensors cross only where they are told to, ops work where
// their inputs are, and whoever reads its memory on the host is told which op that was.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "autograd/gradcheck/evaluate.h"
#include "autograd/gradcheck/gradcheck.h"
#include "autograd/kernels/reduce.h"
#include "autograd/kernels/update.h"
#include "autograd/ops/attention.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/modulate.h"
#include "autograd/ops/points.h"
#include "autograd/ops/pooled_norm.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"
#include "tests/support/emulated_gpu.h"
#include "tests/support/errors.h"
#include "tests/support/fake_device.h"
#include "tests/support/gpu.h"

namespace restage {
namespace {

using gradcheck::all_samples;
using gradcheck::same_bits;
using test::expect_error;

Tensor numbers(const Shape& shape) {
  std::vector<double> values(static_cast<size_t>(shape.numel()));
  std::iota(values.begin(), values.end(), 1.0);
  return Tensor::from<double>(shape, values);
}

TEST(Device, NumbersComeBackAsTheyWent) {
  for (const DType type : {DType::f32, DType::f64, DType::i32, DType::i64}) {
    const Tensor here = numbers({3, 5}).cast(type), there = here.to(fake_device());
    EXPECT_EQ(there.device(), fake_device());
    EXPECT_TRUE(same_bits(there.cpu(), here));
    EXPECT_TRUE(same_bits(there.clone().cpu(), here));
    EXPECT_TRUE(same_bits(there.rows(1, 3).cpu(), here.rows(1, 3)));
    EXPECT_TRUE(same_bits(there.cast(DType::f32).cpu(), here.cast(DType::f32)));
    EXPECT_TRUE(
        same_bits(Tensor::full({2}, 3, type, fake_device()).cpu(), Tensor::full({2}, 3, type)));
  }
  const Tensor here = numbers({4});
  EXPECT_EQ(here.cpu().address(), here.address()) << "nothing is copied that is there already";
  EXPECT_NE(here.to(fake_device()).address(), here.address());
  EXPECT_FALSE(Tensor().to(fake_device()).defined());
  EXPECT_EQ(Tensor::empty({0, 3}).to(fake_device()).shape(), Shape({0, 3}));
}

TEST(Device, WhoReadsItOnTheHostIsToldByName) {
  const Tensor there = numbers({2, 2}).to(fake_device());
  for (const auto& read : std::vector<std::function<void()>>{
           [&] { (void)there.item(); }, [&] { (void)there.to_vector<double>(); },
           [&] { (void)there.data<double>(); }, [&] { (void)there.bytes(); }})
    expect_error<Error>(read, {"the host reads memory of device 'fake'", "cpu()"});
  const ModuleScope outer("net"), inner("fc1");
  const OpScope op("gather");
  expect_error<Error>([&] { (void)there.item(); }, {"'gather' in net.fc1"});
}

TEST(DeviceDeathTest, ItsAddressesAreNoMemoryOfTheHost) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const Tensor there = numbers({2}).to(fake_device());
  EXPECT_DEATH((void)*static_cast<const volatile double*>(there.address()), "");
}

TEST(Device, AMixedCallNamesBoth) {
  const Tensor here = numbers({2, 3, 4}), there = here.to(fake_device());
  const ModuleScope scope("net");
  expect_error<Error>([&] { add(here, there); }, {"'add' in net", "cpu and fake"});
  expect_error<Error>([&] { concat({there, here}, 0); }, {"'concat' in net", "fake and cpu"});
  const Tensor index = Tensor::from<int32_t>({2, 1}, {0, 0});
  expect_error<Error>([&] { gather(there, index); }, {"'gather' in net", "fake and cpu"});
  const Tensor points = numbers({1, 4, 3});
  expect_error<Error>([&] { knn(points.to(fake_device()), points, 1); }, {"fake and cpu"});
}

TEST(Device, AnIndexOutsideIsToldToWhoWaits) {
  const Tensor x = numbers({1, 2, 3}).to(fake_device());
  const Tensor index = Tensor::from<int32_t>({1, 1}, {2}).to(fake_device());
  const ModuleScope scope("net");
  const Var y = gather(x, index);  // nobody has looked yet
  expect_error<Error>([&] { (void)y.value.cpu(); }, {"'gather' in net", "an index is outside"});
  (void)x.cpu();  // once told it is over
}

TEST(Device, AnUnknownOneIsRefused) {
  EXPECT_EQ(device_of("cpu"), Device{});
  EXPECT_EQ(device_of("fake"), fake_device());
  expect_error<InputError>([] { device_of("abacus"); }, {"'abacus'", "cpu"});
}

class DeviceOps : public ::testing::TestWithParam<size_t> {};

TEST_P(DeviceOps, PassTheHarnessThere) {
  const int64_t before = fake_counts().kernels;
  const gradcheck::Report r = check(all_samples()[GetParam()], 4, fake_device());
  EXPECT_TRUE(r.ok()) << r.text();
  EXPECT_GT(fake_counts().kernels, before);
}

TEST_P(DeviceOps, PassTheHarnessWithTheKernelsOfTheGpu) {
  const int64_t before = emulated_counts().kernels;
  const gradcheck::Report r = check(all_samples()[GetParam()], 4, emulated_gpu());
  EXPECT_TRUE(r.ok()) << r.text();
  EXPECT_GT(emulated_counts().kernels, before);
}

TEST(DeviceGpu, EveryOpPassesTheHarness) {
  RESTAGE_GPU_OR_SKIP(gpu);
  for (const gradcheck::OpSamples& op : all_samples()) {
    const gradcheck::Report r = check(op, 4, gpu);
    EXPECT_TRUE(r.ok()) << r.text();
  }
}

INSTANTIATE_TEST_SUITE_P(All, DeviceOps, ::testing::Range(size_t{0}, all_samples().size()),
                         [](const auto& param) { return all_samples()[param.param].op; });

TEST(Device, TheGpuRoundsWhatItMultipliesAsItIsTold) {
  // 1 + 2^-12 has more bits than tf32 keeps.
  for (const auto& [precision, lost] : std::map<MatmulPrecision, double>{
           {MatmulPrecision::float32, 0}, {MatmulPrecision::tf32, 1 / 4096.}}) {
    const MatmulPrecisionScope scope(precision);
    Tensor x = Tensor::zeros({1, 32}), w = Tensor::zeros({1, 32});
    x.data<float>()[0] = static_cast<float>(1 + 1 / 512. + 1 / 4096.);
    w.data<float>()[0] = 1;
    const Var y = linear(x.to(emulated_gpu()), w.to(emulated_gpu()));
    EXPECT_EQ(1 + 1 / 512. + 1 / 4096. - y.value.cpu().item(), lost);
  }
}

using Op = std::function<Var(const std::vector<Var>&)>;

/// The value of op(inputs) and the gradient of each input, in the host's memory.
std::vector<Tensor> differentiated(Device device, const std::vector<Tensor>& inputs, const Op& op) {
  Tape tape;
  std::vector<Var> x;
  for (const Tensor& t : inputs) x.push_back(tape.leaf(t.to(device), x.size() + 1));
  const Var y = op(x);
  const Gradients gradients = tape.backward(sum_all(square(y)));
  std::vector<Tensor> out{y.value.cpu()};
  for (size_t i = 1; i <= x.size(); ++i) out.push_back(gradients.find(i)->cpu());
  return out;
}

/// The emulated GPU gives the CPU's value and gradients.
void expect_agreement(const std::vector<Tensor>& inputs, const Op& op) {
  const auto here = differentiated({}, inputs, op),
             there = differentiated(emulated_gpu(), inputs, op);
  for (size_t t = 0; t < here.size(); ++t)
    for (int64_t i = 0; i < here[t].numel(); ++i)
      ASSERT_NEAR(there[t].item(i), here[t].item(i), 1e-9 * (1 + std::abs(here[t].item(i))))
          << "tensor " << t << ", number " << i;
}

std::vector<Tensor> normal_inputs(const std::vector<Shape>& shapes, double deviation = 1) {
  Rng rng(RngKey{1, 0});
  std::vector<Tensor> out;
  for (const Shape& shape : shapes) {
    out.push_back(Tensor::empty(shape, DType::f64));
    for (int64_t i = 0; i < out.back().numel(); ++i)
      out.back().data<double>()[i] = deviation * rng.normal();
  }
  return out;
}

/// Points, features and weights of an attention.
std::vector<Tensor> attention_inputs(int64_t n, int64_t v, int64_t d) {
  return normal_inputs({Shape{n, v, 3}, Shape{n, v, d}, Shape{n, v, d}, Shape{n, v, d}, Shape{d, 3},
                        Shape{d}, Shape{2 * d, d}, Shape{d, d}, Shape{d}});
}

/// Attention to k random neighbours of each of v points.
Op attention(int64_t n, int64_t v, int64_t k) {
  Rng rng(RngKey{2, 0});
  Tensor index = Tensor::empty({n, v, k}, DType::i32);
  for (int64_t i = 0; i < index.numel(); ++i)
    index.data<int32_t>()[i] = static_cast<int32_t>(rng.below(static_cast<uint64_t>(v)));
  return [index](const std::vector<Var>& x) {
    return neighbour_attention({x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]},
                               index.to(x[0].value.device()), 0.7);
  };
}

TEST(Device, TheGpusAttentionRoundsItsProductsAsItIsTold) {
  std::vector<Tensor> x = attention_inputs(1, 20, 32);
  for (Tensor& t : x) t = t.cast(DType::f32);
  const auto exact = differentiated(emulated_gpu(), x, attention(1, 20, 4));
  const MatmulPrecisionScope scope(MatmulPrecision::tf32);
  const auto rounded = differentiated(emulated_gpu(), x, attention(1, 20, 4));
  // The value, then each gradient but that of the last input, which is zero.
  for (size_t t = 0; t + 1 < exact.size(); ++t) {
    double difference = 0, size = 0;
    for (int64_t i = 0; i < exact[t].numel(); ++i) {
      difference += std::pow(rounded[t].item(i) - exact[t].item(i), 2);
      size += std::pow(exact[t].item(i), 2);
    }
    const double off = std::sqrt(difference / size);
    EXPECT_GT(off, 1e-5) << t;
    EXPECT_LT(off, 1e-2) << t;
  }
}

TEST(Device, TheGpusAttentionGoesThroughABatchInParts) {
  // Two clouds of more pairs each than it handles at once.
  expect_agreement(attention_inputs(2, 129, 2), attention(2, 129, 512));
}

TEST(Device, TheGpusPooledNormGoesThroughABatchInParts) {
  // Two clouds, each with as many products as it has at once, of more points than a thread goes
  // through.
  const int64_t n = 2, v = 4200, i = 2, o = 2100;
  expect_agreement(
      normal_inputs({Shape{n, v, i}, Shape{o, i}, Shape{o}, Shape{o}, Shape{o}}),
      [](const auto& x) { return pooled_norm(x[0], x[1], x[2], x[3], x[4], Activation::relu); });
}

TEST(Device, TheGpusGruMakesItsProductsInParts) {
  // The emulated GPU has room for 32 columns of the states forward (14 rows), for 64 of the gates
  // backward (28 rows), and for none at all (130 rows).
  const int64_t steps = 3, h = 48, inputs = 5;
  for (const int64_t n : {1, 14, 28, 130}) {
    SCOPED_TRACE(n);
    expect_agreement(normal_inputs({Shape{steps, n, inputs}, Shape{n, h}, Shape{3 * h, inputs},
                                    Shape{3 * h, h}, Shape{3 * h}, Shape{3 * h}},
                                   0.25),
                     [](const auto& x) { return gru(x[0], x[1], x[2], x[3], x[4], x[5]); });
  }
}

TEST(Device, TheGpusMaximumIsTheFirstOfManyLikeIt) {
  for (const int64_t n : {3, 70, 1200})
    for (const int64_t inner : {1, 5, 40}) {
      Rng rng(RngKey{3, static_cast<uint64_t>(n * inner)});
      Tensor x = Tensor::empty({2, n, inner});
      for (int64_t i = 0; i < x.numel(); ++i)
        x.data<float>()[i] = static_cast<float>(rng.below(3)) - 3;
      for (const int64_t row : {n - 2, n - 1}) x.data<float>()[row * inner] = NAN;
      const auto largest = [&](Device device) {
        const Tensor there = x.to(device);
        Tensor value = empty_like(there, {2, inner}),
               index = Tensor::empty({2, inner}, DType::i32, device);
        launch(MaxArgs{there, value, index, 2, n, inner});
        return std::pair{value.cpu(), index.cpu()};
      };
      const auto [value, index] = largest({});
      EXPECT_EQ(index.item(0), n - 2) << "the first NaN";
      const auto [value_there, index_there] = largest(emulated_gpu());
      EXPECT_TRUE(same_bits(value_there, value)) << n << " " << inner;
      EXPECT_TRUE(same_bits(index_there, index)) << n << " " << inner;
    }
}

TEST(Device, TheGpusModulationSumsInParts) {
  // Channels by threads and by groups of threads; values that are the same at all points.
  for (const auto& [v, c, of_x] : {std::tuple{600, 40, 600}, {80, 5, 80}, {600, 70, 1}}) {
    SCOPED_TRACE(c);
    expect_agreement(normal_inputs({Shape{2, of_x, c}, Shape{2, v, 3}, Shape{c, 3}, Shape{c},
                                    Shape{c, 3}, Shape{c}}),
                     [](const auto& x) {
                       return modulate(x[0], x[1], x[2], x[3], x[4], x[5], Activation::relu);
                     });
  }
}

/// Tensors of a network of more layers than a launch takes: none, few and many numbers, of both
/// types.
std::vector<Tensor> layers(Device device, double deviation) {
  std::vector<Shape> shapes;
  for (int64_t i = 0; i < 600; ++i) shapes.push_back({i == 7 ? 9000 : i % 9});
  std::vector<Tensor> out = normal_inputs(shapes, deviation);
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = out[i].cast(i % 5 == 0 ? DType::f64 : DType::f32).to(device);
  return out;
}

/// What an optimiser's kernels make of them: norms, then weights, moments and averages.
std::vector<Tensor> updated(Device device) {
  const std::vector<Tensor> gradients = layers(device, 2);
  std::vector<Tensor> w = layers(device, 1), m = layers(device, 0.1), v = layers(device, 0),
                      average = layers(device, 3);
  std::vector<AdamArgs::Of> moved;
  std::vector<MixArgs::Of> mixed;
  for (size_t i = 0; i < w.size(); ++i) {
    moved.push_back({gradients[i], w[i], m[i], v[i], static_cast<int64_t>(1 + i % 3)});
    mixed.push_back({w[i], average[i]});
  }
  std::vector<Tensor> out{Tensor::empty({std::ssize(w)}, DType::f64, device)};
  launch(SquaredNormArgs{gradients, out[0]});
  launch_all(AdamArgs{moved, 0.1, 0.9, 0.99, 1e-3, 0.1, 0.5, 0.8});
  launch_all(MixArgs{mixed, 0.75, 0.25});
  for (const auto* part : {&w, &m, &v, &average}) out.insert(out.end(), part->begin(), part->end());
  for (Tensor& t : out) t = t.cpu();
  return out;
}

TEST(Device, TheGpuGoesOverAllTensorsOfAnOptimiserAtOnce) {
  const std::vector<Tensor> here = updated({});
  const int64_t before = emulated_counts().kernels;
  const std::vector<Tensor> there = updated(emulated_gpu());
  EXPECT_EQ(emulated_counts().kernels, before + 3);
  for (size_t t = 0; t < here.size(); ++t)
    for (int64_t i = 0; i < here[t].numel(); ++i)
      ASSERT_NEAR(there[t].item(i), here[t].item(i), 1e-5 * (1 + std::abs(here[t].item(i))))
          << "tensor " << t << ", number " << i;
}

TEST(Device, AKernelThatItLacksIsNamed) {
  const WithoutKernels lacking({typeid(BinaryArgs)});
  const Tensor there = numbers({2}).to(fake_device());
  expect_error<Error>([&] { add(there, there); }, {"no kernel for", "BinaryArgs", "fake"});
}

TEST(Device, GradientsAreWaitedForOnce) {
  Tape tape;
  std::vector<Var> leaves;
  for (uint64_t id = 1; id <= 20; ++id)
    leaves.push_back(tape.leaf(numbers({3}).to(fake_device()), id));
  Var total = leaves[0];
  for (size_t i = 1; i < leaves.size(); ++i) total = total + leaves[i];
  const int64_t before = fake_counts().waits;
  const Gradients gradients = tape.backward(sum_all(square(total)));
  EXPECT_EQ(fake_counts().waits, before) << "a step is launched without waiting";
  EXPECT_GT(gradients.norm(), 0);
  EXPECT_EQ(fake_counts().waits, before + 1);
}

}  // namespace
}  // namespace restage
