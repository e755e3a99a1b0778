// Where a search looks, and that looking where it was good before finds better values than chance.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "experiments/search/importance.h"
#include "experiments/search/space.h"
#include "experiments/search/tpe.h"

namespace restage::search {
namespace {

using Kind = Dimension::Kind;
using Function = std::function<double(const Point&)>;

Dimension choice(const std::string& key, int count) {
  Dimension out{key, Kind::choice, 0, 1};
  for (int i = 0; i < count; ++i) {
    ConfigNode node;
    node.kind = ConfigNode::Kind::scalar;
    node.text = "c" + std::to_string(i);
    out.choices.push_back(node);
  }
  return out;
}

const Space kMixed = {{"rate", Kind::log_uniform, 1e-5, 1e-1},
                      {"share", Kind::uniform, 0, 1},
                      {"layers", Kind::integer, 1, 12},
                      {"width", Kind::log_integer, 8, 512},
                      choice("model", 4)};

TEST(SpaceTest, PointsLieInsideAndAreDifferent) {
  for (const auto& points : {random_points(kMixed, 3, 200), latin_points(kMixed, 3, 200)}) {
    ASSERT_EQ(points.size(), 200u);
    EXPECT_EQ(std::set<Point>(points.begin(), points.end()).size(), 200u);
    for (const Point& p : points)
      for (size_t d = 0; d < kMixed.size(); ++d) {
        if (kMixed[d].kind == Kind::choice) {
          EXPECT_TRUE(p[d] >= 0 && p[d] <= 3 && p[d] == std::floor(p[d]));
          continue;
        }
        EXPECT_TRUE(p[d] >= kMixed[d].low && p[d] <= kMixed[d].high) << p[d];
        EXPECT_TRUE(!kMixed[d].whole() || p[d] == std::round(p[d]));
        EXPECT_EQ(std::stod(number_text(p[d])), p[d]);
        EXPECT_LE(number_text(p[d]).size(), 11u) << "five digits";
      }
  }
}

TEST(SpaceTest, RandomPointsGoOnAndDifferBySeed) {
  const auto few = random_points(kMixed, 1, 5), many = random_points(kMixed, 1, 50);
  EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin()));
  EXPECT_NE(random_points(kMixed, 2, 5), few);
}

TEST(SpaceTest, ALogarithmicKeyIsEvenInItsLogarithm) {
  int small = 0, narrow = 0;
  for (const Point& p : random_points(kMixed, 5, 1000)) {
    small += p[0] < 1e-3;
    narrow += p[3] < 64;
  }
  EXPECT_NEAR(small, 500, 60);
  EXPECT_NEAR(narrow, 500, 60);
}

TEST(SpaceTest, ALatinHypercubeUsesEveryPartOfEveryKeyOnce) {
  const int n = 20;
  std::set<int> shares, rates;
  for (const Point& p : latin_points(kMixed, 7, n)) {
    shares.insert(static_cast<int>(p[1] * n));
    rates.insert(static_cast<int>((std::log10(p[0]) + 5) / 4 * n));
  }
  EXPECT_EQ(shares.size(), 20u);
  EXPECT_EQ(rates.size(), 20u);
}

TEST(SpaceTest, ASmallSpaceIsUsedUp) {
  const Space small = {{"layers", Kind::integer, 1, 3}, choice("model", 2)};
  EXPECT_EQ(size_of(small), 6);
  EXPECT_EQ(random_points(small, 0, 50).size(), 6u);
  EXPECT_EQ(latin_points(small, 0, 50).size(), 6u);
  EXPECT_TRUE(std::isinf(size_of(kMixed)));
  std::vector<Told> told;
  std::set<Point> seen;
  while (const auto point = propose(small, told, {.seed = 1, .startup = 2})) {
    EXPECT_TRUE(seen.insert(*point).second) << "asked twice";
    told.push_back({*point, (*point)[0]});
  }
  EXPECT_EQ(seen.size(), 6u);
}

// ---- finding ----

/// The best of `trials` points.
double by_tpe(const Space& space, const Function& f, uint64_t seed, int trials) {
  std::vector<Told> told;
  double best = INFINITY;
  for (int i = 0; i < trials; ++i) {
    const auto point = propose(space, told, {.seed = seed, .startup = 10});
    told.push_back({*point, f(*point)});
    best = std::min(best, *told.back().value);
  }
  return best;
}

double by_chance(const Space& space, const Function& f, uint64_t seed, int trials) {
  double best = INFINITY;
  for (const Point& point : random_points(space, seed, trials)) best = std::min(best, f(point));
  return best;
}

/// Mean of the best over ten seeds, and how often TPE wins.
void expect_better(const Space& space, const Function& f, int trials, double factor) {
  double tpe = 0, chance = 0;
  int wins = 0;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const double a = by_tpe(space, f, seed, trials), b = by_chance(space, f, seed, trials);
    tpe += a / 10;
    chance += b / 10;
    wins += a < b;
  }
  EXPECT_LT(tpe, factor * chance) << "better in " << wins << " of 10";
  EXPECT_GE(wins, 7);
}

TEST(TpeTest, FindsTheMinimaOfBraninSoonerThanChance) {
  const Space space = {{"x", Kind::uniform, -5, 10}, {"y", Kind::uniform, 0, 15}};
  const auto branin = [](const Point& p) {
    const double x = p[0], y = p[1];
    const double bow = y - 5.1 / (4 * M_PI * M_PI) * x * x + 5 / M_PI * x - 6;
    return bow * bow + 10 * (1 - 1 / (8 * M_PI)) * std::cos(x) + 10 - 0.397887;  // 0 at best
  };
  expect_better(space, branin, 60, 0.5);
}

TEST(TpeTest, FindsAMixedMinimumSoonerThanChance) {
  // Best: rate 3e-3, share 0.2, 7 layers, width 64, the third model, which wants another rate.
  const auto mixed = [](const Point& p) {
    const double rate = std::log10(p[0] / 3e-3) - (p[4] == 2 ? 0 : 0.5);
    return rate * rate + 4 * (p[1] - 0.2) * (p[1] - 0.2) + 0.02 * std::abs(p[2] - 7) +
           0.05 * std::abs(std::log2(p[3] / 64)) + (p[4] == 2 ? 0.0 : 0.3 + 0.1 * p[4]);
  };
  expect_better(kMixed, mixed, 60, 0.6);
}

TEST(TpeTest, FindsTheValleyOfRosenbrockSoonerThanChance) {
  const Space space = {{"x", Kind::uniform, -2, 2}, {"y", Kind::uniform, -1, 3}};
  expect_better(
      space,
      [](const Point& p) { return std::pow(1 - p[0], 2) + 100 * std::pow(p[1] - p[0] * p[0], 2); },
      80, 0.7);
}

TEST(TpeTest, TheSameIsAskedAfterTheSameWasTold) {
  std::vector<Told> told;
  for (int i = 0; i < 30; ++i) {
    const auto one = propose(kMixed, told, {.seed = 4}), two = propose(kMixed, told, {.seed = 4});
    ASSERT_EQ(one, two);
    EXPECT_NE(propose(kMixed, told, {.seed = 5}), one);
    told.push_back({*one, (*one)[1]});
  }
  std::vector<Told> other = told;
  other.back().value = 5;
  EXPECT_NE(propose(kMixed, other, {.seed = 4}), propose(kMixed, told, {.seed = 4}));
}

TEST(TpeTest, FailedAndRunningTrialsAreShunned) {
  const Space space = {choice("model", 3)};
  const Space wide = {{"x", Kind::uniform, 0, 1}, choice("model", 3)};
  for (const std::optional<double>& bad :
       {std::optional<double>(INFINITY), std::optional<double>()}) {
    std::vector<Told> told;
    for (int i = 0; i < 30; ++i) {
      const double x = (i + 0.5) / 30;
      told.push_back({{x, i % 3 * 1.0}, x < 0.5 ? bad : std::optional<double>(x)});
    }
    int low = 0;
    for (uint64_t seed = 0; seed < 20; ++seed)
      low += (*propose(wide, told, {.seed = seed}))[0] < 0.45;
    EXPECT_LE(low, 4);
  }
  std::vector<Told> all_failed(12, Told{{0.5, 1}, INFINITY});
  EXPECT_TRUE(propose(wide, all_failed, {}).has_value());
  EXPECT_FALSE(propose(space, {{{0}, 1}, {{1}, 2}, {{2}, 3}}, {.startup = 1}).has_value());
}

// ---- which key mattered ----

TEST(ImportanceTest, SharesAreThoseOfTheVariance) {
  // The first counts three times as much as the second in the variance, the third not at all.
  Rng rng(RngKey{11, 0});
  std::vector<double> x, y, z, results;
  for (int i = 0; i < 200; ++i) {
    x.push_back(rng.uniform());
    y.push_back(rng.uniform());
    z.push_back(rng.uniform());
    results.push_back(std::sqrt(3.0) * x.back() + y.back());
  }
  const auto shares =
      importance({factor_of_numbers(x), factor_of_numbers(y), factor_of_numbers(z)}, results);
  EXPECT_NEAR(shares[0], 0.75, 0.08);
  EXPECT_NEAR(shares[1], 0.25, 0.08);
  EXPECT_LT(shares[2], 0.03);
}

TEST(ImportanceTest, WhatKeysDoTogetherIsInNoShare) {
  std::vector<double> x, y, results;
  for (int i = 0; i < 64; ++i) {
    x.push_back(i % 2);
    y.push_back(i / 2 % 2);
    results.push_back((i % 2) ^ (i / 2 % 2));  // each alone says nothing
  }
  // Chance decides the first split, and then both are known.
  for (const double share : importance({factor_of_numbers(x), factor_of_numbers(y)}, results))
    EXPECT_LT(share, 0.2);
}

TEST(ImportanceTest, NamesAreTakenInTheOrderOfTheirResults) {
  std::vector<int> names;
  std::vector<double> results, chance;
  Rng rng(RngKey{5, 0});
  for (int i = 0; i < 40; ++i) {
    names.push_back(i % 4);
    chance.push_back(rng.uniform());
    results.push_back((names.back() % 2 == 0 ? 0 : 1) + 0.05 * chance.back());
  }
  const Factor factor = factor_of_names(names, results);
  EXPECT_EQ(factor.levels, 4);
  const auto shares = importance({factor, factor_of_numbers(chance)}, results);
  EXPECT_GT(shares[0], 0.9);
  EXPECT_LT(shares[1], 0.1);
}

TEST(ImportanceTest, TooFewOrEqualResultsGiveNothing) {
  EXPECT_EQ(importance({factor_of_numbers({1, 2, 3})}, {1, 2, 3}), std::vector<double>{0});
  const std::vector<double> ten = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  EXPECT_EQ(importance({factor_of_numbers(ten)}, std::vector<double>(10, 4.0)),
            std::vector<double>{0});
}

}  // namespace
}  // namespace restage::search
