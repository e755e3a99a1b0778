// Every op of autograd/ops passes the gradient harness, and no op is left out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "autograd/base/parallel.h"
#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/elementwise.h"

namespace restage::gradcheck {
namespace {

class GradcheckOps : public testing::TestWithParam<size_t> {};

TEST_P(GradcheckOps, Passes) {
  const Report r = check(all_samples()[GetParam()]);
  EXPECT_TRUE(r.ok()) << r.text();
  EXPECT_GT(r.compared, 0);
}

INSTANTIATE_TEST_SUITE_P(All, GradcheckOps, testing::Range(size_t{0}, all_samples().size()),
                         [](const auto& param) { return all_samples()[param.param].op; });

std::string content(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// The text between every occurrence of `before` and the `after` that follows it.
std::vector<std::string> between(const std::string& text, const std::string& before, char after) {
  std::vector<std::string> found;
  for (size_t at = text.find(before); at != std::string::npos; at = text.find(before, at)) {
    at += before.size();
    found.push_back(text.substr(at, text.find(after, at) - at));
  }
  return found;
}

/// Names of all ops: `name = "..."` in the headers, and those of the element-wise enumerations.
std::set<std::string> names_of_ops() {
  std::set<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(RESTAGE_SOURCE_DIR "/autograd/ops"))
    for (const std::string& name : between(content(file.path()), "const char* name = \"", '"'))
      names.insert(name);
  const std::string kernels = content(RESTAGE_SOURCE_DIR "/autograd/kernels/elementwise.h");
  for (const char* which : {"enum class Unary {", "enum class Binary {"})
    for (std::string list : between(kernels, which, '}')) {
      std::replace(list.begin(), list.end(), ',', ' ');
      std::istringstream words(list);
      names.insert(std::istream_iterator<std::string>(words), {});
    }
  return names;
}

TEST(GradcheckTable, HoldsEveryOp) {
  std::set<std::string> sampled;
  for (const OpSamples& op : all_samples())
    EXPECT_TRUE(sampled.insert(op.op).second) << op.op << " is in the table twice";
  const std::set<std::string> names = names_of_ops();
  EXPECT_GE(names.size(), 35u) << "the scan of autograd/ops found too little";
  for (const std::string& name : names)
    EXPECT_TRUE(sampled.count(name)) << "op '" << name << "' has no samples: add them to "
                                     << "autograd/gradcheck/samples_<group>.cpp";
}

TEST(GradcheckTable, KnowsTheEnumerators) {
  EXPECT_STREQ(name_of(Unary::neg), "neg");
  EXPECT_STREQ(name_of(Unary::add_scalar), "add_scalar");
  EXPECT_STREQ(name_of(Binary::add), "add");
  EXPECT_STREQ(name_of(Binary::div), "div");
}

// The harness itself: ops with one known defect each, and the words by which it must be reported.

enum class Defect {
  none,
  sign,           // gradient of the wrong sign
  scale,          // 0.1 % too large
  broadcast,      // gradient of the broadcast shape
  one_missing,    // one element of the gradient is left unwritten
  needs,          // returns nothing unless both gradients are wanted
  input,          // changes an input
  counter,        // the value depends on how often it was called
  no_shape_check  // accepts everything
};

/// a * b with a defect.
template <Defect D>
struct Product {
  static constexpr const char* name = "product";
  static constexpr const char* letters = "a[...], b[...]";
  void check(Inputs x) const {
    if (D != Defect::no_shape_check && !(x[0].shape() == x[1].shape()) && x[1].numel() != 1)
      shape_error(name, letters, x, "shapes differ");
  }
  Tensor forward(Inputs x, Saved& saved) const {
    saved.keep({x[0], x[1]});
    bool ok = true;
    broadcast_shape(x[0].shape(), x[1].shape(), &ok);
    if (!ok) return x[0];
    Tensor y = binary(Binary::mul, x[0], x[1]);
    if (D == Defect::input && x[0].numel() > 0) Tensor(x[0]).data<double>()[0] += 1e-3;
    static int calls = 0;
    if (D == Defect::counter && y.numel() > 0 && y.dtype() == DType::f64)
      y.data<double>()[0] += 1e-15 * ++calls;
    return y;
  }
  Grads backward(const Saved& saved, const Tensor& gy, Needs needs) const {
    const Tensor &a = saved[0], &b = saved[1];
    Grads g{sum_to(binary(Binary::mul, gy, b), a.shape()),
            sum_to(binary(Binary::mul, gy, a), b.shape())};
    const auto scaled = [](const Tensor& t, double by) { return scale(Var(t), by).value; };
    if (D == Defect::sign) g[1] = scaled(g[1], -1);
    if (D == Defect::scale) g[0] = scaled(g[0], 1.001);
    if (D == Defect::broadcast) g[1] = binary(Binary::mul, gy, a);
    if (D == Defect::needs && !(needs[0] && needs[1])) return Grads(2);
    if (D == Defect::one_missing && g[0].numel() > 0) {
      Tensor holes = Tensor::empty(g[0].shape(), g[0].dtype());
      std::memcpy(holes.raw(), g[0].raw(),
                  static_cast<size_t>(g[0].numel() - 1) * size_of(g[0].dtype()));
      g[0] = holes;
    }
    return g;
  }
};

template <Defect D>
OpSamples product_samples() {
  OpSamples s = samples_for<Product<D>>();
  const Build build = [](Args x) { return call(Product<D>{}, {x[0], x[1]}); };
  s.add("equal", {random({2, 3}, 1), random({2, 3}, 2)}, build);
  s.add("one", {random({4}, 1), random({1}, 2)}, build);
  s.add("none", {random({0}, 1), random({1}, 2)}, build);
  s.samples.back().zero_gradient = true;
  s.large("many", {random({20000}, 1), random({20000}, 2)}, build);
  s.error("sizes differ", {random({2}, 1), random({3}, 2)}, build);
  s.random = [build](Rng& rng) {
    const Shape shape{1 + static_cast<int64_t>(rng.below(4))};
    return Sample{"", {random(shape, rng.below(100)), random(shape, rng.below(100))}, build};
  };
  return s;
}

template <Defect D>
void expect_report(const std::string& words) {
  const Report r = check(product_samples<D>());
  EXPECT_NE(r.text().find(words), std::string::npos) << r.text();
}

TEST(GradcheckSelf, PassesACorrectOp) {
  const Report r = check(product_samples<Defect::none>());
  EXPECT_TRUE(r.ok()) << r.text();
}

TEST(GradcheckSelf, ReportsEachDefect) {
  expect_report<Defect::sign>("finite differences say");
  expect_report<Defect::scale>("finite differences say");
  expect_report<Defect::broadcast>("the gradient of input 1 is [4] float64, the input is [1]");
  expect_report<Defect::one_missing>("nan, finite differences say");
  expect_report<Defect::needs>("the gradient of input 0 is none");
  expect_report<Defect::input>("input 0 was changed");
  expect_report<Defect::counter>("other bits");
  expect_report<Defect::no_shape_check>("sizes differ: was not refused");
}

TEST(GradcheckSelf, ReportsAHoleInALargeGradientToo) {
  const OpSamples s = product_samples<Defect::one_missing>();
  const auto many = std::find_if(s.samples.begin(), s.samples.end(), [](const Sample& sample) {
    return sample.kind == Sample::Kind::large;
  });
  const auto report = [&] { return check_sample(s, *many).text(); };
  EXPECT_NE(report().find("nan, finite differences say"), std::string::npos) << report();
}

TEST(GradcheckSelf, ReportsAnIncompleteTable) {
  OpSamples s = product_samples<Defect::none>();
  s.random = nullptr;
  s.samples.resize(1);
  const std::string text = check(s).text();
  for (const char* lack : {"dimension of 1", "dimension of 0", "refused", "large", "generator"})
    EXPECT_NE(text.find(lack), std::string::npos) << lack << "\n" << text;
}

TEST(GradcheckSelf, ReportsAVacuousComparison) {
  OpSamples s{"zero", ""};
  s.add("times zero", {random({3}, 1)}, [](Args x) { return scale(x[0], 0); });
  EXPECT_NE(check_sample(s, s.samples[0]).text().find("only zeros"), std::string::npos);
}

TEST(GradcheckSelf, ReportsAWrongKinkAndAnErrorWithoutWords) {
  OpSamples s{"relu", "letters that are not in the message"};
  s.kink("claims 1", {Tensor::zeros({1}, DType::f64)}, [](Args x) { return relu(x[0]); },
         {Tensor::full({1}, 1, DType::f64)});
  s.error("integers", {Tensor::zeros({1}, DType::i32)}, [](Args x) { return relu(x[0]); });
  EXPECT_NE(check_sample(s, s.samples[0]).text().find("documented is 1"), std::string::npos);
  EXPECT_NE(check_sample(s, s.samples[1]).text().find("does not name"), std::string::npos);
}

TEST(GradcheckSelf, ReportsSumsThatFollowTheThreads) {
  OpSamples s{"thread_sum", ""};
  s.large("many", {random({5000}, 1)}, [](Args x) { return scale(x[0], 1 + 1e-13 * threads()); });
  EXPECT_NE(check_sample(s, s.samples[0]).text().find("threads"), std::string::npos);
}

}  // namespace
}  // namespace restage::gradcheck
