// The deformation networks' short cut over the points of a sample is the network itself.
#include "nn/models/deformation.h"

#include <gtest/gtest.h>

#include "autograd/gradcheck/gradcheck.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/reduce.h"

namespace restage {
namespace {

using gradcheck::random;

TEST(Mlp3, SharesWhatIsTheSameForAllPointsOfASample) {
  for (const int64_t n : {1, 3, 80}) {  // the last has more samples than numbers to a vector
    WeightNet model({16, 0.2}, Init{RngKey{4, 0}, DType::f64});
    const Mlp3* net = &model.net;
    const Tensor vector = random({n, 3 * kJoints}, 1), points = random({n, 5, 3}, 2);
    std::vector<Gradients> gradients;
    std::vector<Tensor> values;
    for (const bool shared : {false, true}) {
      Tape tape;
      Context ctx{&tape, true, RngKey{9, 0}};  // with dropout
      const Var v = tape.leaf(vector, 1000001), p = tape.leaf(points, 1000002);
      const Var y = shared ? net->at_points(ctx, v, p) : (*net)(ctx, join_points(v, p));
      values.push_back(y.value);
      const Var weighted = y * Var(random(y.shape(), 3));
      gradients.push_back(tape.backward(sum(reshape(weighted, {-1}), 0)));
    }
    const auto expect_near = [](const Tensor& a, const Tensor& b) {
      ASSERT_EQ(a.shape(), b.shape());
      for (int64_t i = 0; i < a.numel(); ++i) ASSERT_NEAR(a.item(i), b.item(i), 1e-11);
    };
    expect_near(values[0], values[1]);
    std::vector<uint64_t> ids = {1000001, 1000002};
    for (const Parameter* parameter : parameters_of(model)) ids.push_back(parameter->id);
    for (const uint64_t id : ids) {
      ASSERT_TRUE(gradients[0].find(id) && gradients[1].find(id));
      expect_near(*gradients[0].find(id), *gradients[1].find(id));
    }
  }
}

}  // namespace
}  // namespace restage
