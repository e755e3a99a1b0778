// Results at other rates than 30 frames a second.
#include "infer/frame_rate.h"

#include <gtest/gtest.h>

namespace restage {
namespace {

constexpr double kTurn = 0.05;  // radians a frame

RetargetedFrame frame(int number) {
  RetargetedFrame out;
  out.pose.local.fill(Mat3::Identity());
  out.pose.local[kLeftShoulder] =
      Eigen::AngleAxisd(kTurn * number, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  out.pose.root = Vec3(0.1, 0.2, 0.3) * number;
  out.confidence = number == 4 ? 0.5 : 0.9;
  out.filled = number == 4;
  out.fingers.emplace();
  (*out.fingers)[7] = out.pose.local[kLeftShoulder];
  return out;
}

TEST(FrameRate, FramesLieWhereTheirTimeIs) {
  for (const double fps : {24.0, 25.0, 30.0, 60.0, 12.0, 120.0, 29.97}) {
    FrameRate rate(fps);
    std::vector<RetargetedFrame> all;
    constexpr int kFrames = 31;
    for (int f = 0; f < kFrames; ++f)
      for (RetargetedFrame& made : rate.push(frame(f))) all.push_back(std::move(made));
    ASSERT_EQ(std::ssize(all), FrameRate::count(kFrames, fps)) << fps;
    EXPECT_NEAR(static_cast<double>(all.size()), 1 + fps * (kFrames - 1) / kFps, 1) << fps;
    for (size_t k = 0; k < all.size(); ++k) {
      const double at = static_cast<double>(k) * kFps / fps;
      const Eigen::AngleAxisd turn(all[k].pose.local[kLeftShoulder]);
      EXPECT_NEAR(turn.angle(), kTurn * at, 1e-6) << fps << " " << k;
      EXPECT_LT((all[k].pose.root - Vec3(0.1, 0.2, 0.3) * at).norm(), 1e-9);
      EXPECT_LT((*(*all[k].fingers)[7] - all[k].pose.local[kLeftShoulder]).norm(), 1e-9);
      EXPECT_FALSE((*all[k].fingers)[8]);
      const bool doubtful = at > 3 + 1e-6 && at < 5 - 1e-6;
      EXPECT_EQ(all[k].filled, doubtful) << fps << " " << k;
      EXPECT_EQ(*all[k].confidence, doubtful ? 0.5 : 0.9);
    }
  }
  EXPECT_EQ(FrameRate::count(0, 60), 0);
}

}  // namespace
}  // namespace restage
