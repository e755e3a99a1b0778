// Every op of autograd/ops passes the gradient harness, and no op is left out. And what each op
// keeps for its backward pass, by name and size: nothing for its shape alone, and nothing that
// nobody will ask for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include "autograd/base/parallel.h"
#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"

namespace restage::gradcheck {
namespace {

class GradcheckOps : public ::testing::TestWithParam<size_t> {};

TEST_P(GradcheckOps, Passes) {
  const Report r = check(all_samples()[GetParam()]);
  EXPECT_TRUE(r.ok()) << r.text();
  EXPECT_GT(r.compared, 0);
}

INSTANTIATE_TEST_SUITE_P(All, GradcheckOps, ::testing::Range(size_t{0}, all_samples().size()),
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
  for (int i = 0; i < kUnaryOps; ++i) names.insert(name_of(static_cast<Unary>(i)));
  for (int i = 0; i < kBinaryOps; ++i) names.insert(name_of(static_cast<Binary>(i)));
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
      std::memcpy(holes.bytes(), g[0].bytes(),
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

TEST(GradcheckTable, StaysWhereItIsWhenOpsAreAdded) {
  const OpSamples* first = &all_samples().front();
  for (int i = 0; i < 200; ++i) {
    OpSamples more = product_samples<Defect::none>();
    more.op = "product " + std::to_string(i);
    register_op(more);
  }
  EXPECT_EQ(&all_samples().front(), first);
  EXPECT_EQ(all_samples().back().op, "product 199");
  OpSamples again = product_samples<Defect::none>();
  again.op = "product 0";
  EXPECT_THROW(register_op(again), Error);
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

/// "x0 y 96": the first input, the result, and 96 bytes of the op's own; "-" for what is left out.
std::string kept_by(const Saved& saved, const std::vector<Var>& inputs, const Var& result) {
  std::string text;
  for (const Tensor& t : saved.tensors()) {
    std::string name =
        t.defined() ? std::to_string(t.numel() * static_cast<int64_t>(size_of(t.dtype()))) : "-";
    for (size_t k = inputs.size(); t.defined() && k-- > 0;)
      if (t.address() == inputs[k].value.address()) name = "x" + std::to_string(k);
    if (t.defined() && t.address() == result.value.address()) name = "y";
    text += (text.empty() ? "" : " ") + name;
  }
  return text;
}

/// Of the op itself in a call on these inputs, all of them leaves; empty if it is composed of
/// others.
std::string kept(const OpSamples& op, const Sample& sample, bool* found) {
  Tape tape;
  std::vector<Var> x;
  for (size_t k = 0; k < sample.inputs.size(); ++k) x.push_back(tape.leaf(sample.inputs[k], k + 1));
  const Var y = sample.build(x);
  *found = tape.size() == x.size() + 1 && tape.name(x.size()) == op.op;
  return *found ? kept_by(*tape.saved(x.size()), x, y) : "";
}

TEST(SavedTensors, AreThoseOfTheTable) {
  std::map<std::string, std::string> table = {
      {"add", ""},
      {"sub", ""},
      {"mul", "x0 x1"},
      {"div", "x0 x1"},
      {"expand", ""},
      {"dropout", ""},
      {"reshape", ""},
      {"permute", ""},
      {"slice", ""},
      {"concat", ""},
      {"gather", "32"},       // the index
      {"scatter_add", "24"},  // the index
      {"unfold", ""},
      {"linear", "x0 x1 -"},
      {"matmul", "x0 x1"},
      {"sum", ""},
      {"max", "16"},  // where the maxima are
      {"softmax", "y"},
      {"batch_norm", "x0 24 24 x1"},  // means and deviations
      {"layer_norm", "x0 40 40 x1"},
      {"instance_norm", "x0 48 48"},
      {"elain", "x0 x1 x2 x3 x4"},
      {"modulate", "x0 x1 x2 x3 x4 x5"},
      {"pooled_norm", "240 x1 x3 32 64 32 y"},  // x less its mean, deviations, peaks and where
      {"gru", "x0 x1 x2 x3 y 576"},             // the gates
      {"attention_pool", "x1 480 y"},           // the softmax
      {"cross_attention", "x0 x1 x2"},
      {"neighbour_attention", "x0 x1 x2 x3 x4 x5 x6 x7 8 y 4"},  // the softmax, the index
      {"to_matrix", "x0"},
      {"minimum", "x0 x1"},
      {"maximum", "x0 x1"},
      {"pow", "x0 x1"},
      {"atan2", "x0 x1"},
      {"prelu", "x0 x1"},
      {"sinkhorn", "x0 64 48 64 48 64"},  // what both margins are divided by, step by step
      {"forward_kinematics", "x0 x1 y"},
      {"swing_twist", "x0 x1 x2"},
      {"recurrence", "x0 x2 y"},
      {"linear_blend_skinning", "x0 x1 x2 x3"},
  };
  for (int i = 0; i < kUnaryOps; ++i) {
    const Derivative of = derivative(static_cast<Unary>(i));
    table[name_of(static_cast<Unary>(i))] = of == Derivative::of_x   ? "x0"
                                            : of == Derivative::of_y ? "y"
                                                                     : "";
  }
  size_t seen = 0;
  for (const OpSamples& op : all_samples()) {
    bool found = false;
    const std::string is = kept(op, op.samples[0], &found);
    if (!found) continue;
    ++seen;
    ASSERT_TRUE(table.count(op.op)) << op.op << " keeps '" << is << "': say so in the table";
    EXPECT_EQ(is, table.at(op.op)) << op.op << " " << op.samples[0].title;
  }
  EXPECT_EQ(seen, table.size());
}

TEST(SavedTensors, AreNotKeptForConstants) {
  const Tensor a = random({2, 3}, 1), w = random({4, 3}, 2);
  const auto of = [](bool first, bool second, const Tensor& p, const Tensor& q, auto&& op) {
    Tape tape;
    const std::vector<Var> x{first ? tape.leaf(p, 1) : Var(p), second ? tape.leaf(q, 2) : Var(q)};
    const Var y = op(x[0], x[1]);
    return kept_by(*tape.saved(tape.size() - 1), x, y);
  };
  const auto product = [](const Var& x, const Var& y) { return linear(x, y); };
  EXPECT_EQ(of(true, false, a, w, product), "- x1 -");
  EXPECT_EQ(of(false, true, a, w, product), "x0 - -");
  const auto times = [](const Var& x, const Var& y) { return matmul(x, y, false, true); };
  EXPECT_EQ(of(true, false, a, w, times), "- x1");
  EXPECT_EQ(of(false, true, a, w, times), "x0 -");
  EXPECT_EQ(of(true, false, a, a.clone(), mul), "- x1");
  EXPECT_EQ(of(false, true, a, a.clone(), mul), "x0 -");
  EXPECT_EQ(of(true, false, a, a.clone(), div), "- x1");
  EXPECT_EQ(of(false, true, a, a.clone(), div), "x0 x1");
}

}  // namespace
}  // namespace restage::gradcheck
