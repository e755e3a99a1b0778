#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "infer/writers/bvh.h"
#include "infer/writers/frames.h"
#include "tests/infer/toy_body.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

class WritersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("restage_writers_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  size_t entries() const {
    return static_cast<size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

// A reader of what the writer promises: names, offsets and channels by depth-first order.
struct ReadBvh {
  std::vector<std::string> names;
  std::vector<int> parents;
  std::vector<Vec3> offsets;
  size_t frames = 0;
  double frame_time = 0;
  std::vector<std::vector<double>> rows;
};

ReadBvh read_bvh(const std::string& path) {
  ReadBvh bvh;
  std::ifstream in(path);
  std::string word, line;
  std::vector<int> stack;
  int pending = -1;
  while (in >> word && word != "MOTION") {
    if (word == "ROOT" || word == "JOINT") {
      in >> word;
      bvh.names.push_back(word);
      bvh.parents.push_back(stack.empty() ? -1 : stack.back());
      pending = static_cast<int>(bvh.names.size()) - 1;
    } else if (word == "End") {
      pending = -2;
    } else if (word == "{") {
      stack.push_back(pending);
    } else if (word == "}") {
      stack.pop_back();
    } else if (word == "OFFSET") {
      Vec3 v;
      in >> v.x() >> v.y() >> v.z();
      if (stack.back() >= 0) bvh.offsets.push_back(v);
    }
  }
  in >> word >> bvh.frames >> word >> word >> bvh.frame_time;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream row(line);
    bvh.rows.emplace_back(std::istream_iterator<double>(row), std::istream_iterator<double>());
  }
  return bvh;
}

TEST_F(WritersTest, BvhPosesTheSameJoints) {
  const Body body = testing::toy_body();
  BvhWriter writer(path("walk.bvh"), body.joints);
  for (int f = 0; f < 12; ++f) writer.push(testing::toy_pose(body, f / 12.0));
  EXPECT_FALSE(fs::exists(path("walk.bvh")));
  writer.commit();
  const ReadBvh bvh = read_bvh(path("walk.bvh"));
  ASSERT_EQ(bvh.names.size(), 22u);
  EXPECT_EQ(bvh.frames, 12u);
  ASSERT_EQ(bvh.rows.size(), 12u);
  EXPECT_DOUBLE_EQ(bvh.frame_time, 1.0 / 30.0);
  std::vector<double> last;
  for (size_t f = 0; f < 12; ++f) {
    const auto& row = bvh.rows[f];
    ASSERT_EQ(row.size(), 69u);
    const PosedSkeleton truth =
        forward_kinematics(body.joints, testing::toy_pose(body, static_cast<double>(f) / 12));
    std::vector<Vec3> at(22);
    std::vector<Mat3> turned(22);
    for (size_t i = 0; i < 22; ++i) {
      const double* a = &row[3 + 3 * i];
      const double degree = std::numbers::pi / 180;
      const Mat3 local = (Eigen::AngleAxisd(a[0] * degree, Vec3::UnitZ()) *
                          Eigen::AngleAxisd(a[1] * degree, Vec3::UnitY()) *
                          Eigen::AngleAxisd(a[2] * degree, Vec3::UnitX()))
                             .toRotationMatrix();
      const int p = bvh.parents[i];
      turned[i] = p < 0 ? local : Mat3(turned[static_cast<size_t>(p)] * local);
      at[i] =
          p < 0
              ? Vec3(row[0], row[1], row[2])
              : Vec3(at[static_cast<size_t>(p)] + turned[static_cast<size_t>(p)] * bvh.offsets[i]);
      const auto joint =
          std::find(kJointNames.begin(), kJointNames.end(), bvh.names[i]) - kJointNames.begin();
      ASSERT_LT(joint, 22);
      EXPECT_LT((at[i] / 100 - truth.joints[static_cast<size_t>(joint)]).norm(), 1e-6)
          << bvh.names[i];
    }
    for (size_t k = 3; k < last.size(); ++k)
      EXPECT_LT(std::abs(row[k] - last[k]), 120) << "channel " << k;
    last = row;
  }
}

TEST(BvhAngles, EveryRotationComesBack) {
  const Vec3 before(3, -7, 20);
  for (const double y : {-90.0, -89.9999999, -40.0, 0.0, 90.0, 130.0})
    for (const double z : {-170.0, 0.0, 45.0})
      for (const double x : {-100.0, 0.0, 179.0}) {
        const auto matrix = [](const Vec3& a) {
          return Mat3(Eigen::AngleAxisd(a[0], Vec3::UnitZ()) *
                      Eigen::AngleAxisd(a[1], Vec3::UnitY()) *
                      Eigen::AngleAxisd(a[2], Vec3::UnitX()));
        };
        const Mat3 r = matrix(Vec3(z, y, x) * std::numbers::pi / 180);
        EXPECT_LT((matrix(euler_zyx(r, before)) - r).norm(), 1e-6) << z << ' ' << y << ' ' << x;
      }
}

TEST_F(WritersTest, BvhLeavesNothingWithoutCommit) {
  const Body body = testing::toy_body();
  {
    BvhWriter writer(path("x.bvh"), body.joints);
    Pose pose = testing::toy_pose(body, 0);
    pose.local[4](0, 0) = NAN;
    EXPECT_THROW(writer.push(pose), WorkError);
  }
  EXPECT_EQ(entries(), 0u);
  EXPECT_THROW(BvhWriter(path("no/such/x.bvh"), body.joints), InputError);
}

TEST_F(WritersTest, FoldersAppearWhole) {
  const Body body = testing::toy_body();
  {
    FrameFolderWriter writer(path("out/"), body.rest.faces);
    writer.push(body.rest.vertices);
    EXPECT_FALSE(fs::exists(path("out")));
  }
  EXPECT_EQ(entries(), 0u);
  for (const size_t frames : {3, 2}) {  // the second time over the first
    FrameFolderWriter writer(path("out"), body.rest.faces);
    for (size_t f = 0; f < frames; ++f) writer.push(body.rest.vertices);
    writer.commit();
    EXPECT_EQ(entries(), 1u);
    EXPECT_TRUE(fs::exists(path("out/frame_000001.ply")));
    EXPECT_EQ(fs::exists(path("out/frame_000002.ply")), frames == 3);
  }
}

TEST_F(WritersTest, FoldersWithOtherFilesAreKept) {
  fs::create_directory(path("mine"));
  write_file_atomically(path("mine/thesis.txt"), "precious");
  EXPECT_THROW(FrameFolderWriter(path("mine"), {}), InputError);
  write_file_atomically(path("file"), "x");
  EXPECT_THROW(FrameFolderWriter(path("file"), {}), InputError);
  EXPECT_THROW(FrameFolderWriter(path("no/such/folder"), {}), InputError);
  EXPECT_TRUE(fs::exists(path("mine/thesis.txt")));
  EXPECT_EQ(entries(), 2u);
}

TEST_F(WritersTest, CloudsMayChangeTheirCountAndBadFramesAreRefused) {
  FrameFolderWriter writer(path("clouds"), {}, MeshFormat::obj);
  writer.push({{0, 0, 0}, {1, 2, 3}});
  writer.push({{0.1f, 0, 0}});
  EXPECT_THROW(writer.push({}), InputError);
  EXPECT_THROW(writer.push({{NAN, 0, 0}}), InputError);
  writer.commit();
  EXPECT_EQ(read_file(path("clouds/frame_000000.obj")),
            "# restage, metres, y up\nv 0 0 0\nv 1 2 3\n");
  EXPECT_EQ(read_file(path("clouds/frame_000001.obj")),
            "# restage, metres, y up\nv 0.100000001 0 0\n");
}

TEST(MeshFile, PlyBytesAreWhatTheHeaderSays) {
  const std::string bytes = ply_bytes({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, {{0, 1, 2}});
  const size_t body = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size(), body + 3 * 12 + 13);
  EXPECT_NE(bytes.find("element vertex 3\n"), std::string::npos);
  EXPECT_NE(bytes.find("element face 1\n"), std::string::npos);
  float x = 0;
  std::memcpy(&x, bytes.data() + body + 12, 4);
  EXPECT_EQ(x, 4.0f);
  EXPECT_EQ(bytes[body + 36], 3);
  int32_t last = 0;
  std::memcpy(&last, bytes.data() + bytes.size() - 4, 4);
  EXPECT_EQ(last, 2);
  EXPECT_EQ(ply_bytes({{1, 2, 3}}, {}).find("face"), std::string::npos);
}

}  // namespace
}  // namespace restage
