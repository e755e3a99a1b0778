// The system of networks that move vertices: where the answer stands, gaps, settings of files.
#include "infer/transfer.h"

#include <gtest/gtest.h>

#include "nn/geometry/box.h"
#include "nn/models/registry.h"
#include "tests/support/errors.h"
#include "tests/support/frames.h"

namespace restage {
namespace {

Bundle weights(const std::string& points) {
  const AnyConfig sizes = model_config("transfer/npt_pool", {"widths=[4, 5, 9]"});
  Bundle out;
  out.put("transfer", {"transfer/npt_pool",
                       sizes,
                       make_model("transfer/npt_pool", sizes, Init{RngKey{1, 0}}),
                       {{"points", points}}});
  return out;
}

/// A person's box of points, moved by `by`.
Points cloud(const Point& by) {
  Points out;
  for (int i = 0; i < 100; ++i)
    out.push_back(by + Point(0.01f * static_cast<float>(i % 7), 0.018f * static_cast<float>(i),
                             0.01f * static_cast<float>(i % 5)));
  return out;
}

Transfer system(const std::string& points) {
  return Transfer(weights(points), "weights", {cloud(Point::Zero()), {}}, "target", {});
}

TEST(TransferSystem, StandsWhereTheSourceStands) {
  Transfer transfer = system("50");
  const Points seen = cloud(Point(3, 0.2f, -1));
  const auto frames = pushed(transfer, seen, "a cloud");
  ASSERT_EQ(frames.size(), 1u);
  const Box there = box_of(seen), box = box_of(frames[0].vertices);
  EXPECT_NEAR(box.min().y(), there.min().y(), 1e-5);
  EXPECT_NEAR(box.center().x(), there.center().x(), 1e-5);
  EXPECT_NEAR(box.center().z(), there.center().z(), 1e-5);
  EXPECT_FALSE(frames[0].joints);
}

TEST(TransferSystem, GapsAreFilledBetweenTheirEnds) {
  Transfer transfer = system("0");
  const Point from = pushed(transfer, cloud(Point::Zero()), "first")[0].vertices[0];
  transfer.miss();
  const auto frames = pushed(transfer, cloud(Point(2, 0, 0)), "third");
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].filled);
  EXPECT_FALSE(frames[1].filled);
  const Point between = 0.5f * from + 0.5f * frames[1].vertices[0];
  EXPECT_LT((frames[0].vertices[0] - between).norm(), 1e-5f);
  transfer.miss();
  EXPECT_EQ(finished(transfer).size(), 1u);
}

TEST(TransferSystem, FinishBeginsAnew) {
  Transfer used = system("0"), fresh = system("0");
  Points tall = cloud(Point(1, 0, 0));
  for (Point& p : tall) p.y() *= 1.2f;
  const auto second = [](Transfer& transfer) {
    transfer.miss();
    const auto frames = pushed(transfer, cloud(Point(2, 0, 0)), "second");
    return std::vector<Points>{frames[0].vertices, frames[1].vertices};
  };
  pushed(used, tall, "first");
  used.miss();
  EXPECT_EQ(finished(used).size(), 1u);
  EXPECT_EQ(second(used), second(fresh));
}

/// A body whose height and width follow the performer's, and codes that are these two numbers.
struct Boxes : TransferModel {
  Var forward(Context&, const TransferInput& in) override { return made(box(in.pose, 0), in); }
  std::optional<Var> between(Context&, const TransferInput& in, double share) const override {
    const Point a = box(in.pose, 0), b = box(in.pose, 1);
    return made(a + static_cast<float>(share * share) * (b - a), in);  // on no straight line
  }
  void visit(Fields&) override {}
  const char* kind() const override { return "Boxes"; }

 private:
  static Point box(const Var& pose, int64_t item) {
    Points points(static_cast<size_t>(pose.size(1) * pose.size(2)));
    const float* from = pose.value.data<float>() + item * 3 * std::ssize(points);
    for (size_t i = 0; i < points.size(); ++i) points[i] = Eigen::Map<const Point>(from + 3 * i);
    return box_of(points).sizes();
  }
  static Var made(const Point& size, const TransferInput& in) {
    Tensor out = in.identity.value.clone().reshape({1, 1, in.identity.size(1), 3});
    for (int64_t i = 0; i < out.numel(); ++i) out.data<float>()[i] *= size[i % 3];
    return Var(out);
  }
};

TEST(TransferSystem, CodesAreMixedInGapsWhereAModelHasSome) {
  Bundle weights;
  weights.put(
      "transfer",
      {"transfer/npt_pool", model_config("transfer/npt_pool", {}), std::make_shared<Boxes>(), {}});
  Transfer transfer(weights, "weights", {cloud(Point::Zero()), {}}, "target", {});
  Points wide = cloud(Point(4, 0, 0));
  for (Point& p : wide) p.z() *= 9;
  const float narrow_is =
      box_of(pushed(transfer, cloud(Point::Zero()), "first")[0].vertices).sizes().z();
  transfer.miss();
  const auto frames = pushed(transfer, wide, "third");
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].filled);
  const Box between = box_of(frames[0].vertices), end = box_of(frames[1].vertices);
  EXPECT_NEAR(between.sizes().z(), narrow_is + 0.25f * (end.sizes().z() - narrow_is), 1e-5);
  const float start = box_of(cloud(Point::Zero())).center().x();
  EXPECT_NEAR(between.center().x(), 0.5f * (start + end.center().x()),
              1e-5);  // the path goes straight
}

/// Answers with the target's mesh, and keeps what it was shown.
struct Same : TransferModel {
  explicit Same(Tensor* shown) : shown_(shown) {}
  Var forward(Context&, const TransferInput& in) override {
    *shown_ = in.identity.value.clone();
    return Var(in.identity.value.reshape({1, 1, in.identity.size(1), 3}));
  }
  void visit(Fields&) override {}
  const char* kind() const override { return "Same"; }
  Tensor* shown_;
};

TEST(TransferSystem, SeesVerticesShuffledAndAnswersInTheTargetsOrder) {
  Tensor shown;
  Bundle bundle;
  bundle.put("transfer", {"transfer/npt_pool",
                          model_config("transfer/npt_pool"),
                          std::make_shared<Same>(&shown),
                          {{"points", "50"}}});
  const Points target = cloud(Point::Zero());
  Transfer transfer(bundle, "weights", {target, {}}, "target", {});
  const Points answer = pushed(transfer, target, "a cloud")[0].vertices;
  ASSERT_EQ(answer.size(), target.size());
  size_t moved = 0;
  for (size_t i = 0; i < target.size(); ++i) {
    EXPECT_LT(((answer[i] - answer[0]) - (target[i] - target[0])).norm(), 1e-5f) << i;
    const Eigen::Map<const Point> there(shown.data<float>() + 3 * i);
    const Eigen::Map<const Point> first(shown.data<float>());
    moved += ((there - first) - (target[i] - target[0])).norm() > 1e-4f;
  }
  EXPECT_GT(moved, target.size() / 2);
}

/// A grid of 30 x 30 vertices, 3 cm apart.
Points grid() {
  Points out;
  for (int i = 0; i < 30; ++i)
    for (int j = 0; j < 30; ++j)
      out.emplace_back(0.03f * static_cast<float>(i), 0.03f * static_cast<float>(j), 0.f);
  return out;
}

Bundle same(Tensor* shown, const Settings& settings) {
  Bundle out;
  out.put("transfer", {"transfer/npt_pool", model_config("transfer/npt_pool"),
                       std::make_shared<Same>(shown), settings});
  return out;
}

/// A network moves as many vertices as it was trained with, and the others follow.
TEST(TransferSystem, VerticesFollowThoseThatTheNetworkMoves) {
  Tensor shown;
  Transfer transfer(same(&shown, {{"points", "50"}, {"vertices", "100"}}), "weights", {grid(), {}},
                    "target", {});
  const Points answer = pushed(transfer, grid(), "a cloud")[0].vertices;
  EXPECT_EQ(shown.size(1), 100);
  ASSERT_EQ(answer.size(), grid().size());
  for (size_t i = 0; i < answer.size(); ++i)
    EXPECT_LT(((answer[i] - answer[0]) - (grid()[i] - grid()[0])).norm(), 1e-5f) << i;
}

/// Fewer vertices than in the training: all are shown.
TEST(TransferSystem, SmallTargetsAreShownWhole) {
  Tensor shown;
  Transfer transfer(same(&shown, {{"points", "50"}, {"vertices", "1000"}}), "weights", {grid(), {}},
                    "target", {});
  pushed(transfer, grid(), "a cloud");
  EXPECT_EQ(shown.size(1), 900);
}

/// A tiny TST of 8 vertices, whose training kept every hundredth of 900.
Bundle tst(const Settings& settings) {
  const AnyConfig sizes =
      model_config("transfer/tst", {"widths=[4, 4, 6]", "vertices=8", "code=4", "hidden=4"});
  Bundle out;
  out.put("transfer",
          {"transfer/tst", sizes, make_model("transfer/tst", sizes, Init{RngKey{1, 0}}), settings});
  return out;
}

TEST(TransferSystem, ANetworkThatNeedsCorrespondence) {
  const Settings settings = {{"vertices", "8"}, {"kept", "0,100,200,300,400,500,600,700"}};
  Transfer transfer(tst(settings), "weights", {grid(), {}}, "target", {});
  EXPECT_EQ(pushed(transfer, grid(), "a mesh")[0].vertices.size(), grid().size());
  EXPECT_HAS(test::error_of([&] { pushed(transfer, cloud(Point::Zero()), "a cloud"); }),
             "900 vertices in their order");
  const auto refused = [&](const Settings& bad) {
    return test::error_of([&] { Transfer(tst(bad), "weights", {grid(), {}}, "target", {}); });
  };
  EXPECT_HAS(refused({}), "another mesh");
  EXPECT_HAS(refused({{"vertices", "8"}}), "does not say which vertices");
  EXPECT_HAS(refused({{"vertices", "8"}, {"kept", "0,1,2,3,4,5,6,6"}}), "damaged list");
  EXPECT_HAS(refused({{"vertices", "8"}, {"kept", "0,1,2,x"}}), "damaged list");
  EXPECT_HAS(refused({{"vertices", "8"}, {"kept", "0,1,2,3,4,5,6,900"}}), "another mesh");
  EXPECT_HAS(refused({{"vertices", "8"}, {"kept", "0,1,2"}}), "damaged list");
  EXPECT_HAS(refused({{"vertices", "3"}, {"kept", "0,1,2"}}), "another mesh");
  EXPECT_HAS(refused({{"vertices", "8"}, {"kept", "0,1,2,3,4,5,6,7,"}}), "damaged list");
  EXPECT_HAS(refused({{"vertices", "8"}, {"kept", "0,1,2,3,4,5,6,7"}, {"kept_of", "901"}}),
             "another mesh");
}

TEST(TransferSystem, DamagedSettingsAreBadInput) {
  for (const char* points : {"many", "", "-3", "99999999999999999999", "70000"})
    EXPECT_HAS(test::error_of([&] { system(points); }), "weights");
}

}  // namespace
}  // namespace restage
