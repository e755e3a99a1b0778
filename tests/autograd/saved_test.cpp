// What each op keeps for its backward pass, by name and size: nothing for its shape alone, and
// nothing that nobody will ask for.
#include <gtest/gtest.h>

#include <map>

#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"

namespace restage::gradcheck {
namespace {

/// "x0 y 96": the first input, the result, and 96 bytes of the op's own; "-" for what is left out.
std::string kept_by(const Saved& saved, const std::vector<Var>& inputs, const Var& result) {
  std::string text;
  for (const Tensor& t : saved.tensors()) {
    std::string name =
        t.defined() ? std::to_string(t.numel() * static_cast<int64_t>(size_of(t.dtype()))) : "-";
    for (size_t k = inputs.size(); t.defined() && k-- > 0;)
      if (t.raw() == inputs[k].value.raw()) name = "x" + std::to_string(k);
    if (t.defined() && t.raw() == result.value.raw()) name = "y";
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
  const std::map<std::string, std::string> table = {
      {"neg", ""},
      {"exp", "y"},
      {"log", "x0"},
      {"sqrt", "y"},
      {"square", "x0"},
      {"abs", "x0"},
      {"sigmoid", "y"},
      {"tanh", "y"},
      {"relu", "y"},
      {"leaky_relu", "x0"},
      {"softplus", "x0"},
      {"scale", ""},
      {"add_scalar", ""},
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
      {"pooled_norm", "240 x1 x3 32 64 32 y"},  // x less its mean, deviations, peaks and where
      {"gru", "x0 x1 x2 x3 y 576"},             // the gates
      {"attention_pool", "x1 480 y"},           // the softmax
      {"neighbour_attention", "x0 x1 x2 x3 x4 x5 x6 x7 8 y 4"},  // the softmax, the index
      {"to_matrix", "x0"},
      {"atan2", "x0 x1"},
      {"forward_kinematics", "x0 x1 y"},
      {"linear_blend_skinning", "x0 x1 x2 x3"},
  };
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
