// Values of ops against plain loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "autograd/base/parallel.h"
#include "autograd/gradcheck/evaluate.h"
#include "autograd/kernels/reduce.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/linear.h"
#include "autograd/ops/modulate.h"
#include "autograd/ops/norm.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rnn.h"
#include "autograd/ops/rotation.h"
#include "tests/support/errors.h"
#include "tests/support/expect_near.h"
#include "tests/support/use_set.h"

namespace restage {
namespace {

using gradcheck::random;
using gradcheck::same_bits;

/// Element (i, j) of matrix b of a batch, of its transpose on request; shared without batch axis.
double element(const Tensor& t, int64_t b, int64_t i, int64_t j, bool transpose) {
  const int64_t rows = t.size(-2), cols = t.size(-1), start = t.rank() == 3 ? b * rows * cols : 0;
  return t.item(start + (transpose ? j * cols + i : i * cols + j));
}

void expect_naive_product(const Tensor& a, const Tensor& b, bool ta, bool tb, double tolerance) {
  const Tensor y = matmul(Var(a), Var(b), ta, tb).value;
  const int64_t m = y.size(-2), n = y.size(-1), k = a.size(ta ? -2 : -1);
  const int64_t batch = y.rank() == 3 ? y.size(0) : 1;
  for (int64_t s = 0; s < batch; ++s)
    for (int64_t i = 0; i < m; ++i)
      for (int64_t j = 0; j < n; ++j) {
        double sum = 0;
        for (int64_t l = 0; l < k; ++l) sum += element(a, s, i, l, ta) * element(b, s, l, j, tb);
        ASSERT_NEAR(y.item((s * m + i) * n + j), sum, tolerance * std::sqrt(1.0 + k))
            << a.shape().str() << ta << " " << b.shape().str() << tb << " at " << i << "," << j;
      }
}

TEST(MatmulValues, AreTheTripleLoopForAllSizesAndTransposes) {
  const auto matrix = [](int64_t batch, int64_t rows, int64_t cols, uint64_t stream) {
    return batch < 0 ? random({rows, cols}, stream) : random({batch, rows, cols}, stream);
  };
  const int64_t sizes[] = {0, 1, 2, 7, 13, 33};
  for (const bool ta : {false, true})
    for (const bool tb : {false, true}) {
      for (const int64_t m : sizes)
        for (const int64_t k : sizes)
          for (const int64_t n : sizes) {
            const Tensor a = matrix(-1, ta ? k : m, ta ? m : k, 1),
                         b = matrix(-1, tb ? n : k, tb ? k : n, 2);
            expect_naive_product(a, b, ta, tb, 1e-13);
            expect_naive_product(a.cast(DType::f32), b.cast(DType::f32), ta, tb, 1e-5);
          }
      for (const int64_t sa : {-1, 0, 3})
        for (const int64_t sb : {-1, 0, 3}) {
          if (sa >= 0 && sb >= 0 && sa != sb) continue;
          expect_naive_product(matrix(sa, ta ? 9 : 5, ta ? 5 : 9, 3),
                               matrix(sb, tb ? 4 : 9, tb ? 9 : 4, 4), ta, tb, 1e-13);
        }
      // Beyond one block in every direction.
      expect_naive_product(matrix(-1, ta ? 300 : 310, ta ? 310 : 300, 5),
                           matrix(-1, tb ? 530 : 300, tb ? 300 : 530, 6), ta, tb, 1e-12);
    }
}

TEST(MatmulValues, ARowDoesNotDependOnTheOthers) {
  // Each of these is cut and packed in another way; the widths and depths leave remainders.
  for (const int64_t k : {5, 40, 69, 578})
    for (const bool transposed : {false, true}) {
      const int64_t n = 150;
      const Tensor a = random({1100, k}, 1).cast(DType::f32);
      const Tensor b = random(transposed ? Shape{n, k} : Shape{k, n}, 2).cast(DType::f32);
      const Tensor bias = random({n}, 3).cast(DType::f32);
      const auto product = [&](int64_t from, int64_t rows) {
        const Var x(a.rows(from, from + rows));
        return (transposed ? linear(x, Var(b), Var(bias), Activation::relu) : matmul(x, Var(b)))
            .value;
      };
      const Tensor all = product(0, 1100);
      for (const int64_t rows : {1, 2, 3, 4, 5, 13, 300, 700})
        for (const int64_t from : {0, 311, 1100 - static_cast<int>(rows)}) {
          if (from + rows > 1100) continue;
          EXPECT_TRUE(same_bits(product(from, rows), all.rows(from, from + rows)))
              << rows << " rows from " << from << ", k " << k << ", transposed " << transposed;
        }
    }
}

/// Cloud with many equal points and equal distances.
Tensor grid_cloud(int64_t n, int64_t v, uint64_t stream) {
  Rng rng(RngKey{40, stream});
  Tensor t = Tensor::empty({n, v, 3}, DType::f64);
  for (int64_t i = 0; i < t.numel(); ++i) t.data<double>()[i] = static_cast<double>(rng.below(3));
  return t;
}

double squared(const Tensor& a, int64_t i, const Tensor& b, int64_t j) {
  double d = 0;
  for (int c = 0; c < 3; ++c) d += std::pow(a.item(3 * i + c) - b.item(3 * j + c), 2);
  return d;
}

TEST(Neighbours, AreTheBruteForceOnesTiesToTheLowerIndex) {
  for (const int64_t v : {1, 4, 50})
    for (const int64_t k : {1, 3, 16, 60}) {
      const Tensor query = grid_cloud(2, 9, 1), points = grid_cloud(2, v, 2);
      const Tensor index = knn(query, points, k);
      const int64_t kept = std::min(k, v);
      ASSERT_EQ(index.shape(), (Shape{2, 9, kept}));
      EXPECT_TRUE(same_bits(index, knn(query.cast(DType::f32), points.cast(DType::f32), k)));
      for (int64_t q = 0; q < 18; ++q) {
        std::vector<std::pair<double, int64_t>> order;
        for (int64_t i = 0; i < v; ++i)
          order.emplace_back(squared(query, q, points, q / 9 * v + i), i);
        std::sort(order.begin(), order.end());
        for (int64_t i = 0; i < kept; ++i)
          ASSERT_EQ(index.item(q * kept + i), order[static_cast<size_t>(i)].second)
              << q << " " << i;
      }
    }
}

TEST(Neighbours, AreThoseOfAPlainSortAlsoOfDuplicatesAndNaN) {
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const RngKey key{9, seed};
    const auto v = static_cast<int64_t>(1 + uniform_int(key, 0, 400));
    const auto k = static_cast<int64_t>(1 + uniform_int(key, 1, static_cast<uint64_t>(v)));
    const uint64_t side = 2 + uniform_int(key, 2, 12);  // whole numbers: distances are exact
    Tensor points = Tensor::empty({1, v, 3}, DType::f32);
    for (int64_t i = 0; i < 3 * v; ++i)
      points.data<float>()[i] = static_cast<float>(uniform_int(key.fold(1), i, side));
    for (int64_t i = 0; seed % 3 == 0 && i < v; i += 5)
      points.data<float>()[3 * i + i % 3] = std::nanf("");
    const Tensor query = points.rows(0, 1), index = knn(query, points, k);
    const Tensor wide = knn(query.cast(DType::f64), points.cast(DType::f64), k);
    EXPECT_TRUE(same_bits(index, wide));
    for (int64_t q = 0; q < v; ++q) {
      std::vector<std::pair<double, int64_t>> order;
      for (int64_t i = 0; i < v; ++i) {
        const double d = squared(query, q, points, i);
        order.emplace_back(std::isnan(d) ? HUGE_VAL : d, i);
      }
      std::sort(order.begin(), order.end());
      for (int64_t i = 0; i < k; ++i)
        ASSERT_EQ(index.item(q * k + i), order[static_cast<size_t>(i)].second)
            << "seed " << seed << ", point " << q << ", neighbour " << i;
    }
  }
}

TEST(Neighbours, FarthestPointsAreTheBruteForceOnes) {
  for (const int64_t v : {1, 7, 60}) {
    const Tensor points = grid_cloud(3, v, 3);
    const Tensor index = fps(points, v);
    for (int64_t s = 0; s < 3; ++s) {
      Tensor centre = Tensor::zeros({3}, DType::f64);
      for (int64_t i = 0; i < v; ++i)
        for (int c = 0; c < 3; ++c)
          centre.data<double>()[c] += points.item((s * v + i) * 3 + c) / static_cast<double>(v);
      std::vector<double> distance;
      for (int64_t i = 0; i < v; ++i) distance.push_back(squared(points, s * v + i, centre, 0));
      for (int64_t m = 0; m < v; ++m) {
        const int64_t chosen = static_cast<int64_t>(index.item(s * v + m));
        const double top = *std::max_element(distance.begin(), distance.end());
        // Equal up to the rounding of the centroid, and the first of exactly equal ones after it.
        ASSERT_NEAR(distance[static_cast<size_t>(chosen)], top, 1e-12);
        if (m > 0) {
          ASSERT_EQ(chosen, std::max_element(distance.begin(), distance.end()) - distance.begin());
        }
        for (int64_t i = 0; i < v; ++i) {
          const double d = squared(points, s * v + i, points, s * v + chosen);
          double& best = distance[static_cast<size_t>(i)];
          best = m == 0 ? d : std::min(best, d);
        }
      }
    }
  }
}

TEST(Neighbours, SurviveNaNAndRefuseNonsense) {
  Tensor points = grid_cloud(1, 40, 4);
  for (int64_t i = 0; i < 60; i += 2) points.data<double>()[i] = std::nan("");
  const Tensor index = knn(points, points, 8);
  for (int64_t i = 0; i < index.numel(); ++i) {
    EXPECT_GE(index.item(i), 0);
    EXPECT_LT(index.item(i), 40);
  }
  fps(points, 8);
  EXPECT_THROW(knn(points, points, 0), ShapeError);
  EXPECT_THROW(knn(points, points.cast(DType::f32), 2), ShapeError);
  EXPECT_THROW(knn(points, grid_cloud(2, 4, 1), 2), ShapeError);
  EXPECT_THROW(fps(random({4, 3}, 1), 2), ShapeError);
  EXPECT_THROW(fps(random({1, 0, 3}, 1), 1), ShapeError);
  EXPECT_EQ(fps(points, 0).numel(), 0);
  EXPECT_EQ(fps(points, 40).numel(), 40);
  test::expect_error<ShapeError>([&] { fps(points, 41); },
                                 {"fps", "cannot choose 41 of 40 points"});
  EXPECT_THROW(fps(points, -1), ShapeError);
}

TEST(Recurrence, RefusesAStateWithoutUnits) {
  const Var x(random({3, 2, 4}, 1)), h0(random({2, 0}, 2)), w_ih(random({0, 4}, 3)),
      w_hh(random({0, 0}, 4)), bias(random({0}, 5));
  test::expect_error<ShapeError>([&] { gru(x, h0, w_ih, w_hh, bias, bias); },
                                 {"gru", "h must be positive"});
}

/// Runs f with 1, 2, 3 and 7 threads and compares the bits.
template <class F>
void expect_same_for_all_threads(F&& f) {
  const auto with = [&](int n) {
    const testing::UseThreads use(n);
    return f();
  };
  const Tensor first = with(1);
  for (const int n : {2, 3, 7}) EXPECT_TRUE(same_bits(first, with(n))) << n << " threads";
}

TEST(Threads, SumsOfManyNumbersHaveTheSameBits) {
  const Tensor x = random({1000003}, 1).cast(DType::f32);
  expect_same_for_all_threads([&] { return sum_all(Var(x)).value; });
  const Tensor wide = random({3001, 37}, 2).cast(DType::f32);
  expect_same_for_all_threads([&] { return sum(Var(wide), 0).value; });
  const Tensor index = knn(random({1, 900, 3}, 3), random({1, 50, 3}, 4), 5).reshape({1, 4500});
  const Tensor rows = random({1, 4500, 70}, 5).cast(DType::f32);
  expect_same_for_all_threads([&] { return scatter_add(Var(rows), index, 50).value; });
}

TEST(Threads, AFewLongRowsAreSharedByColumn) {
  // [16, 3.5 million] over axis 0 was the work of one thread: all of it was one piece.
  for (const auto& shape : {std::pair<int64_t, int64_t>{16, 100003}, {1500, 3001}, {1, 70001}})
    for (const DType type : {DType::f32, DType::f64}) {
      const int64_t n = shape.first, inner = shape.second;
      const Var x(random({n, inner}, 1).cast(type)), g(random({n, inner}, 2).cast(type));
      expect_same_for_all_threads([&] { return sum(x, 0).value; });
      expect_same_for_all_threads([&] { return max(x, 0).value; });
      expect_same_for_all_threads([&] { return softmax(x, 0).value; });
      for (const bool of_max : {true, false})
        expect_same_for_all_threads([&] {
          Tape tape;
          const Var leaf = tape.leaf(x.value, 1);
          const Var y = of_max ? mul(max(leaf, 0), Var(g.value.rows(0, 1).reshape({inner})))
                               : mul(softmax(leaf, 0), g);
          return *tape.backward(sum_all(y)).find(1);
        });
    }
}

/// How many pieces the work of f is cut into.
template <class F>
int64_t pieces_of(F&& f) {
  const int64_t before = pieces_cut();
  f();
  return pieces_cut() - before;
}

TEST(Threads, ShareAFewLongRows) {
  const int64_t n = 16, inner = 300000, many = 16;
  const Tensor x = Tensor::full({n, inner}, 1.5);
  Tensor row = Tensor::empty({inner}), all = Tensor::empty({n, inner}),
         index = Tensor::zeros({inner}, DType::i32);
  EXPECT_GE(pieces_of([&] { launch(SumArgs{x, row, 1, n, inner}); }), many) << "sum";
  EXPECT_GE(pieces_of([&] { launch(MaxArgs{x, row, index, 1, n, inner}); }), many) << "max";
  EXPECT_GE(pieces_of([&] {
              launch(MaxGradArgs{row, index, all, 1, n, inner});
            }),
            many)
      << "max, back";
  EXPECT_GE(pieces_of([&] { launch(SoftmaxArgs{x, all, 1, n, inner}); }), many) << "softmax";
  EXPECT_GE(pieces_of([&] {
              launch(SoftmaxGradArgs{x, x, all, 1, n, inner});
            }),
            many)
      << "its gradient";
}

TEST(Threads, ShareTheItemsOfInstanceNorm) {
  const Tensor x = random({2, 2000, 256}, 1).cast(DType::f32);
  Tape tape;
  Var y;
  EXPECT_GE(pieces_of([&] { y = instance_norm(tape.leaf(x, 1)); }), 16);
  EXPECT_GE(pieces_of([&] { tape.backward(y, x); }), 16);
}

TEST(Threads, ShareTheSumsOfModulatesGradient) {
  // Parts of 128 points, 24 an item: their sums are added up by several threads, too.
  const int64_t n = 2, v = 3072, c = 512;
  for (const int64_t rows : {v, int64_t{1}}) {
    const Tensor x = Tensor::full({n, rows, c}, 0.5), mesh = Tensor::full({n, v, 3}, 0.5),
                 w = Tensor::full({c, 3}, 1), b = Tensor::full({c}, 1),
                 g = Tensor::full({n, v, c}, 1);
    Tape tape;
    const Var y = modulate(tape.leaf(x, 1), Var(mesh), tape.leaf(w, 2), tape.leaf(b, 3), Var(w),
                           Var(b), Activation::none);
    EXPECT_GE(pieces_of([&] { tape.backward(y, g); }), 2 * 24 + 8);
  }
}

TEST(Threads, SumsAreAccurate) {
  const Tensor x = Tensor::full({1 << 20}, 0.1);
  EXPECT_NEAR(sum_all(Var(x)).value.item(), 0.1f * (1 << 20), 0.5);
}

TEST(Threads, NormsOfGradientsHaveTheSameBits) {
  for (const DType type : {DType::f32, DType::f64}) {
    for (const int64_t n : {0, 1, 31, 100003}) {
      const Tensor x = random({n}, 6).cast(type);
      double squares = 0;
      for (const double v : x.to_vector<double>()) squares += v * v;
      const auto norm = [&] {
        Gradients g;
        g.set(1, x);
        g.set(2, Tensor::full({1}, 3, type));
        return Tensor::full({1}, g.norm(), DType::f64);
      };
      EXPECT_NEAR(norm().item(), std::sqrt(squares + 9), 1e-9 * std::sqrt(squares + 9));
      expect_same_for_all_threads(norm);
    }
  }
}

TEST(DropoutMask, IsAFunctionOfTheKey) {
  const Var ones(Tensor::full({100003}, 1, DType::f64));
  const RngKey key{1, 2};
  const Tensor a = dropout(ones, 0.3, key).value;
  EXPECT_TRUE(same_bits(a, dropout(ones, 0.3, key).value));
  EXPECT_FALSE(same_bits(a, dropout(ones, 0.3, key.fold(1)).value));
  expect_same_for_all_threads([&] { return dropout(ones, 0.3, key).value; });
  // Element i is kept or not whatever the size of the tensor.
  const Tensor part = dropout(Var(Tensor::full({1001}, 1, DType::f64)), 0.3, key).value;
  EXPECT_TRUE(same_bits(part, a.rows(0, 1001)));
  const Tensor narrow = dropout(Var(ones.value.cast(DType::f32)), 0.3, key).value;
  for (int64_t i = 0; i < 1001; ++i) EXPECT_EQ(narrow.item(i) == 0, a.item(i) == 0);
}

TEST(DropoutMask, IsThatOfTheScalarGenerator) {
  for (const int64_t n : {1, 5, 255, 257, 40001})
    for (const RngKey key : {RngKey{1, 2}, RngKey{~0ull, 0x123456789abcdefull}}) {
      const auto limit = static_cast<uint32_t>(0.4 * 4294967296.0);
      const Tensor y = dropout(Var(Tensor::full({n}, 1)), 0.4, key).value;
      for (int64_t i = 0; i < n; ++i)
        ASSERT_EQ(y.item(i) == 0, philox(key, static_cast<uint64_t>(i / 4))[i % 4] < limit) << i;
    }
}

TEST(DropoutMask, KeepsTheShareAndTheMean) {
  const int64_t n = 200000;
  const Tensor y = dropout(Var(Tensor::full({n}, 1, DType::f64)), 0.3, RngKey{3, 4}).value;
  int64_t zeros = 0;
  for (int64_t i = 0; i < n; ++i) {
    if (y.item(i) == 0) {
      ++zeros;
    } else {
      ASSERT_DOUBLE_EQ(y.item(i), 1 / 0.7);
    }
  }
  EXPECT_NEAR(static_cast<double>(zeros) / static_cast<double>(n), 0.3, 0.005);
  const Var x(y);
  EXPECT_EQ(dropout(x, 0, RngKey{}).value.address(), y.address()) << "p = 0 does nothing";
}

TEST(Rotations, GoThereAndBack) {
  const Tensor q = random({50, 4}, 1);
  const Tensor r = quaternion_to_matrix(Var(q)).value;
  const Tensor unit = matrix_to_quaternion(r);
  for (int64_t i = 0; i < 50; ++i) {
    double norm = 0, dot = 0;
    for (int c = 0; c < 4; ++c) {
      norm += q.item(4 * i + c) * q.item(4 * i + c);
      dot += q.item(4 * i + c) * unit.item(4 * i + c);
    }
    EXPECT_NEAR(std::abs(dot), std::sqrt(norm), 1e-12);
    EXPECT_GE(unit.item(4 * i), 0);
  }
  expect_near(quaternion_to_matrix(Var(unit)).value, r, 1e-12, "quaternion");
  expect_near(axis_angle_to_matrix(Var(matrix_to_axis_angle(r))).value, r, 1e-12, "axis angle");
  expect_near(sixd_to_matrix(matrix_to_sixd(Var(r))).value, r, 1e-12, "6D");
  EXPECT_THROW(matrix_to_quaternion(q), ShapeError);
}

TEST(Rotations, AreRotationsAlsoForTinyTurnsInFloat32) {
  for (const double angle : {0.0, 1e-7, 1e-5, 1e-4, 3e-4, 1e-3, 0.1, 3.1}) {
    const Tensor w = Tensor::from<double>({1, 3}, {angle * 0.6, 0, angle * 0.8});
    const Tensor r = axis_angle_to_matrix(Var(w)).value,
                 narrow = axis_angle_to_matrix(Var(w.cast(DType::f32))).value;
    expect_near(narrow, r, 3e-7, "float32");
    EXPECT_NEAR(r.item(0), std::cos(angle) + (1 - std::cos(angle)) * 0.36, 1e-15);
    EXPECT_NEAR(r.item(3), std::sin(angle) * 0.8, 1e-15);
  }
}

TEST(Skeletons, AStraightChainTurnsAtItsJoints) {
  // Two bones of length 1 along y; the second joint turns by 90 degrees about z.
  const Tensor rest = Tensor::from<double>({1, 3, 3}, {0, 0, 0, 0, 1, 0, 0, 2, 0});
  const Tensor turns = Tensor::from<double>({1, 3, 3}, {0, 0, 0, 0, 0, std::acos(0.0), 0, 0, 0});
  const std::array parents{-1, 0, 1};
  const Var t = forward_kinematics(axis_angle_to_matrix(Var(turns)), Var(rest),
                                   Var(Tensor::from<double>({1, 3}, {5, 0, 0})), parents);
  expect_near(joints_of(t).value, Tensor::from<double>({1, 3, 3}, {5, 0, 0, 5, 1, 0, 4, 1, 0}),
              1e-15, "joints");
  expect_near(rotations_of(t).value.rows(0, 1).reshape({3, 3, 3}).rows(2, 3),
              Tensor::from<double>({1, 3, 3}, {0, -1, 0, 1, 0, 0, 0, 0, 1}), 1e-15, "rotation");
  // A point on the last bone, bound to the second joint, moves with it.
  const Var skin =
      linear_blend_skinning(Var(Tensor::from<double>({1, 1, 3}, {0, 1.5, 0})),
                            Var(Tensor::from<double>({1, 1, 3}, {0, 1, 0})), t, Var(rest));
  expect_near(skin.value, Tensor::from<double>({1, 1, 3}, {4.5, 1, 0}), 1e-15, "skin");
}

}  // namespace
}  // namespace restage
