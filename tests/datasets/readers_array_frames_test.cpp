// NPY and NPZ as clouds: which array, which axes, which frames.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "datasets/readers/frames/array_frames.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
using ReadersArrayFrames = FileTest;

using Arrays = std::vector<std::pair<std::string, std::string>>;

TEST_F(ReadersArrayFrames, CloudsAreFrames) {
  const auto one = open_frames(dir.write("one.npy", npy<double>({2, 3}, {1, 2, 3, 4, 5, 6})));
  EXPECT_EQ(one->frames(), 1);
  EXPECT_EQ(one->fps(), kFps);
  const auto frame = one->next();
  EXPECT_EQ(frame->points, (Points{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(frame->source, dir / "one.npy");
  EXPECT_FALSE(one->next());

  // Three frames of two points, in both orders, stored and packed.
  std::vector<float> c(18), f(18);
  for (size_t t = 0; t < 3; ++t)
    for (size_t i = 0; i < 2; ++i)
      for (size_t k = 0; k < 3; ++k)
        c[6 * t + 3 * i + k] = f[t + 3 * i + 6 * k] = static_cast<float>(100 * t + 10 * i + k);
  std::string bytes;
  for (const float value : f) bytes += raw(value);
  const std::string orders[] = {npy<float>({3, 2, 3}, c),
                                npy_of(npy_header("<f4", {3, 2, 3}, true), bytes)};
  for (const std::string& array : orders)
    for (const bool deflate : {false, true}) {
      write_bytes(dir / "s.npz",
                  npz({{"fps", npy<int64_t>({}, {60})}, {"points", array}}, deflate));
      const auto many = open_frames(dir / "s.npz");
      EXPECT_EQ(many->frames(), 3);
      EXPECT_EQ(many->fps(), 60);
      many->skip();
      EXPECT_EQ(many->next()->points, (Points{{100, 101, 102}, {110, 111, 112}}));
      const auto last = many->next();
      EXPECT_EQ(last->points[1], Point(210, 211, 212));
      EXPECT_EQ(last->source, dir / "s.npz:2");
      EXPECT_FALSE(many->next());
      many->rewind();
      EXPECT_EQ(many->next()->points[0], Point(0, 1, 2));
    }
  EXPECT_HAS(error_of([&] { read_array_frame(dir / "s.npz"); }), "sequence of 3");
}

TEST_F(ReadersArrayFrames, WhichArrayIsTheCloud) {
  const std::string cloud = npy<float>({1, 3}, {1, 2, 3}), other = npy<float>({1, 3}, {9, 9, 9});
  const auto first = [&](const Arrays& arrays) {
    return open_frames(dir.write("a.npz", npz(arrays)))->next()->points[0];
  };
  const Arrays with_a_cloud[] = {{{"normals", other}, {"points", cloud}},
                                 {{"transl", npy<float>({3}, {9, 9, 9})},  // CAPE
                                  {"v_cano", other},
                                  {"v_posed", cloud},
                                  {"pose", npy<float>({72}, std::vector<float>(72, 0))}},
                                 {{"faces", npy<int64_t>({1, 3}, {0, 0, 0})}, {"my_scan", cloud}},
                                 {{"labels", npy_as("|O", {}, "x")}, {"my_scan", cloud}}};
  for (const Arrays& arrays : with_a_cloud) EXPECT_EQ(first(arrays), Point(1, 2, 3));
  const std::pair<Arrays, const char*> without[] = {
      {{{"a", cloud}, {"b", other}}, "several arrays of points: 'a', 'b'"},
      {{{"labels", npy<float>({2}, {1, 2})}}, "holds no points (its arrays: 'labels')"},
      {{{"points", npy<float>({0, 5, 3}, {})}}, "holds no points"},
      // Parameters of a body model: `trans` has the shape of a cloud and is none.
      {{{"smpl_thetas", npy<float>({2, 72}, std::vector<float>(144, 0))}, {"trans", cloud}},
       "is a motion of a body model"},
      {{{"global_orient", cloud},
        {"body_pose", npy<float>({1, 69}, std::vector<float>(69, 0))},
        {"transl", cloud}},
       "is a motion of a body model"},
      {{{"trans", cloud}, {"betas", npy<float>({10}, std::vector<float>(10, 0))}},
       "holds no points"},
      {{{"points", cloud}, {"fps", npy<float>({}, {0})}}, "fps: is no frame rate"},
      {{{"points", cloud}, {"fps", npy_text("30")}}, "fps: is no frame rate"}};
  for (const auto& [arrays, says] : without)
    EXPECT_HAS(error_of([&, &held = arrays] { first(held); }), says);
  dir.write("b.npy", npy<float>({4}, {1, 2, 3, 4}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "b.npy"); }), "array [4], which is no cloud");
}

TEST_F(ReadersArrayFrames, FoldersOfArrays) {
  for (const int i : {10, 2, 1})
    write_bytes(dir / ("f" + std::to_string(i) + ".npz"),
                npz({{"v_posed", npy<double>({1, 3}, {double(i), 0, 0})}}));
  const auto frames = open_frames(dir.path());
  EXPECT_EQ(frames->frames(), 3);
  EXPECT_EQ(frames->next()->points[0], Point(1, 0, 0));
  frames->skip();
  const auto last = frames->next();
  EXPECT_EQ(last->points[0], Point(10, 0, 0));
  EXPECT_EQ(last->source, dir / "f10.npz");
  frames->skip();
  EXPECT_FALSE(frames->next());
  // One mesh beside a series of arrays is a template or the like.
  write_bytes(dir / "scan.obj", "v 7 7 7\n");
  EXPECT_EQ(open_frames(dir.path())->frames(), 3);
  EXPECT_HAS(open_frames(dir.path())->remarks().at(0), "left out 1 .obj file");
  // Beside a series of meshes arrays are something else.
  for (const char* name : {"m1.obj", "m2.obj"}) write_bytes(dir / name, "v 7 7 7\n");
  EXPECT_EQ(open_frames(dir.path())->frames(), 2);
}

// ---- axes --------------------------------------------------------------------------------------

/// An array of this shape whose element says what it is: point + 1000 * frame + 0.25 * axis, each
/// of these the index of the axis of that number (-1: none).
std::string marked(const std::vector<int64_t>& shape, int frame, int point, int xyz) {
  int64_t count = 1;
  for (const int64_t n : shape) count *= n;
  std::vector<float> values;
  for (int64_t i = 0; i < count; ++i) {
    std::vector<int64_t> at(shape.size());
    int64_t rest = i;
    for (size_t a = shape.size(); a-- > 0; rest /= shape[a]) at[a] = rest % shape[a];
    const auto index = [&](int axis) { return axis < 0 ? 0 : at[static_cast<size_t>(axis)]; };
    values.push_back(static_cast<float>(index(point) + 1000 * index(frame)) +
                     0.25f * static_cast<float>(index(xyz)));
  }
  return npy<float>(shape, values);
}

TEST_F(ReadersArrayFrames, AxesInAnyOrderAndMoreColumns) {
  struct Case {
    std::vector<int64_t> shape;
    int frame, point, xyz;
    int64_t frames, points;
  };
  const Case cases[] = {
      {{80, 3}, -1, 0, 1, 1, 80},   {{80, 6}, -1, 0, 1, 1, 80},     {{80, 4}, -1, 0, 1, 1, 80},
      {{3, 80}, -1, 1, 0, 1, 80},   {{4, 80, 3}, 0, 1, 2, 4, 80},   {{4, 80, 6}, 0, 1, 2, 4, 80},
      {{80, 3, 4}, 2, 0, 1, 4, 80}, {{4, 3, 80}, 0, 2, 1, 4, 80},   {{3, 80, 4}, 2, 1, 0, 4, 80},
      {{80, 3, 3}, 2, 0, 1, 3, 80}, {{2, 1, 80, 3}, 0, 2, 3, 2, 80}};
  for (const Case& c : cases) {
    const auto frames = open_frames(dir.write("a.npy", marked(c.shape, c.frame, c.point, c.xyz)));
    ASSERT_EQ(frames->frames(), c.frames) << shape_text(c.shape);
    frames->skip();
    frames->rewind();
    for (int64_t f = 0; f < c.frames; ++f) {
      const auto frame = frames->next();
      ASSERT_EQ(std::ssize(frame->points), c.points) << shape_text(c.shape);
      const float x = static_cast<float>(1000 * f + 17);
      EXPECT_EQ(frame->points[17], Point(x, x + 0.25f, x + 0.5f)) << shape_text(c.shape);
    }
    const bool plain = c.shape.back() == 3 && c.shape != std::vector<int64_t>{80, 3, 3};
    EXPECT_EQ(frames->remarks().empty(), plain) << shape_text(c.shape);
  }
  for (const std::vector<int64_t>& shape :
       {std::vector<int64_t>{80}, {80, 2}, {80, 66}, {5, 80, 72}})
    EXPECT_FALSE(cloud_axes(shape)) << shape_text(shape);
  // Pictures of a depth camera are one frame, not 288 of 320 points.
  EXPECT_EQ(cloud_axes({288, 320, 3})->points, 288 * 320);
  EXPECT_FALSE(cloud_axes({288, 320, 3})->sequence);
  EXPECT_EQ(cloud_axes({5, 288, 320, 3})->frames, 5);
  // Who knows the number of vertices knows which axis is which.
  EXPECT_EQ(cloud_axes({70, 3, 300}, 70)->frames, 300);
}

/// Numbers that stand behind each other in an order of their own: frames, points, x y z.
using Element = std::function<double(int64_t frame, int64_t point, int axis)>;

std::string array_in_order(const std::vector<int64_t>& shape, const std::vector<int>& axis_of,
                           const Element& element) {
  std::vector<float> values;
  int64_t count = 1;
  for (const int64_t n : shape) count *= n;
  for (int64_t i = 0; i < count; ++i) {
    int64_t at[3] = {0, 0, 0}, rest = i;
    for (size_t a = shape.size(); a-- > 0; rest /= shape[a]) at[axis_of[a]] = rest % shape[a];
    values.push_back(static_cast<float>(element(at[0], at[1], static_cast<int>(at[2]))));
  }
  return npy<float>(shape, values);
}

/// Somebody of scattered points, who walks along z.
double walker(int64_t frame, int64_t point, int axis) {
  const double spread[] = {0.3, 0.9, 0.2};
  return spread[axis] * std::sin(7.3 * static_cast<double>(point) + 2.1 * axis) +
         (axis == 2 ? 0.03 : 0.004) * static_cast<double>(frame);
}

TEST_F(ReadersArrayFrames, ChannelsAndPointsMayComeFirst) {
  const auto expect = [&](const std::string& array, int64_t frames, int64_t points,
                          const char* says) {
    const auto found = open_frames(dir.write("a.npy", array));
    ASSERT_EQ(found->frames(), frames) << says;
    for (int64_t f = 0; f < frames; ++f) {
      const auto frame = found->next();
      ASSERT_EQ(std::ssize(frame->points), points) << says;
      for (const int64_t i : {int64_t{0}, points / 2, points - 1})
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_EQ(frame->points[static_cast<size_t>(i)][axis],
                    static_cast<float>(walker(f, i, axis)))
              << says;
    }
    ASSERT_EQ(found->remarks().size(), 1u) << says;
    EXPECT_HAS(found->remarks()[0], says);
  };
  const auto with_colours = [](int64_t f, int64_t i, int axis) {
    return axis < 3 ? walker(f, i, axis) : 255.0;
  };
  expect(array_in_order({6, 90}, {2, 1}, with_colours), 1, 90, "[6 numbers, 90 points]");
  expect(array_in_order({4, 6, 90}, {0, 2, 1}, with_colours), 4, 90, "[frames, 6 numbers, 90");
  expect(array_in_order({90, 70, 3}, {1, 0, 2}, walker), 70, 90, "[90 points, 70 frames, xyz]");
  expect(array_in_order({900, 20, 3}, {1, 0, 2}, walker), 20, 900, "[900 points, 20 frames");
  expect(array_in_order({90, 5, 3}, {1, 0, 2}, walker), 5, 90, "[90 points, 5 frames");
  const auto still = [](int64_t, int64_t i, int axis) { return walker(0, i, axis); };
  const auto seen = open_frames(dir.write("a.npy", array_in_order({90, 70, 3}, {1, 0, 2}, still)));
  EXPECT_EQ(seen->frames(), 70);
  // A camera's picture.
  EXPECT_EQ(cloud_axes({3, 288, 320})->points, 288 * 320);
  EXPECT_EQ(cloud_axes({3, 288, 320})->frames, 1);
  EXPECT_EQ(cloud_axes({5, 3, 288, 320})->frames, 5);
}

TEST_F(ReadersArrayFrames, FramesThatComeFirstStayFramesHoweverFarSomebodyRuns) {
  for (const double speed : {0.0, 0.03, 0.3}) {
    const auto runner = [&](int64_t f, int64_t i, int axis) {
      return walker(0, i, axis) + (axis == 2 ? speed * static_cast<double>(f) : 0.0);
    };
    const auto found =
        open_frames(dir.write("a.npy", array_in_order({300, 70, 3}, {0, 1, 2}, runner)));
    EXPECT_EQ(found->frames(), 300) << speed;
    EXPECT_TRUE(found->remarks().empty()) << speed;
  }
}

TEST_F(ReadersArrayFrames, AColumnThatCountsThePointsIsNoCoordinate) {
  for (const double first : {0.0, 1000.0})
    for (const double step : {1.0, 0.033})
      for (const int64_t columns : {4, 7}) {
        const auto numbered = [&](int64_t f, int64_t i, int axis) {
          if (axis == 0) return first + step * static_cast<double>(i);
          return axis < 4 ? walker(f, i, axis - 1) : 0.5;
        };
        const std::string arrays[] = {array_in_order({90, columns}, {1, 2}, numbered),
                                      array_in_order({columns, 90}, {2, 1}, numbered),
                                      array_in_order({5, 90, columns}, {0, 1, 2}, numbered)};
        for (const std::string& array : arrays) {
          const auto found = open_frames(dir.write("a.npy", array));
          const auto frame = found->next();
          EXPECT_EQ(frame->points[17], Point(static_cast<float>(walker(0, 17, 0)),
                                             static_cast<float>(walker(0, 17, 1)),
                                             static_cast<float>(walker(0, 17, 2))));
          EXPECT_HAS(found->remarks().at(0), "numbers the points");
        }
      }
  // A cloud in the order of x has unequal steps.
  const auto sorted = [](int64_t f, int64_t i, int axis) {
    return axis == 0 ? static_cast<double>(i) + 0.4 * std::sin(5.0 * static_cast<double>(i))
                     : walker(f, i, axis - 1);
  };
  const auto found = open_frames(dir.write("a.npy", array_in_order({90, 4}, {1, 2}, sorted)));
  EXPECT_FLOAT_EQ(found->next()->points[1].x(), 1 + 0.4f * std::sin(5.0f));
}

TEST_F(ReadersArrayFrames, PathsAndSignalsAreNoCloudsByTheirNames) {
  const std::string path = npy<float>({80, 3}, std::vector<float>(240, 1));
  for (const char* name : {"root_pos", "rootPos", "com", "gyro", "imu_accel", "trans", "pelvis",
                           "angular_velocity", "keypoints3d", "markers", "cam_trans"}) {
    dir.write("a.npz", npz({{name, path}}));
    EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "holds no points") << name;
    dir.write("b.npz", npz({{name, path}, {"frames", npy<float>({1, 3}, {1, 2, 3})}}));
    EXPECT_EQ(open_frames(dir / "b.npz")->next()->points.size(), 1u) << name;
  }
  for (const char* name : {"camera_points", "pose_vertices", "scan_of_root", "pose_0001"})
    EXPECT_EQ(open_frames(dir.write("a.npz", npz({{name, path}})))->next()->points.size(), 80u);
}

TEST_F(ReadersArrayFrames, OnePartOfABodysRotationsNamesTheOther) {
  const std::string root = npy<float>({2, 3}, std::vector<float>(6, 0)),
                    body = npy<float>({2, 63}, std::vector<float>(126, 0));
  dir.write("a.npz", npz({{"root_orient", root}, {"trans", root}, {"betas", root}}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "and not of the other joints");
  EXPECT_HAS(error_of([&] { open_frames(dir / "a.npz"); }), "add pose_body");
  dir.write("b.npz", npz({{"pose_body", body}, {"trans", root}, {"betas", root}}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "b.npz"); }), "add root_orient");
  dir.write("c.npz", npz({{"pred_rotmat", npy<float>({2, 24, 3, 3}, std::vector<float>(432, 0))}}));
  EXPECT_HAS(error_of([&] { open_frames(dir / "c.npz"); }), "is a motion of a body model");
}

/// As numpy.savez(*clouds) keeps clouds of unequal size.
TEST_F(ReadersArrayFrames, NumberedArraysAreTheFramesOfASequence) {
  Arrays arrays;
  for (const int i : {0, 1, 10, 2}) {
    std::vector<float> values(static_cast<size_t>(3 * (i + 1)), static_cast<float>(i));
    arrays.emplace_back("arr_" + std::to_string(i), npy<float>({i + 1, 3}, values));
  }
  dir.write("a.npz", npz(arrays));
  EXPECT_TRUE(find_cloud(dir / "a.npz")->axes.sequence);
  const auto frames = open_frames(dir / "a.npz");
  EXPECT_EQ(frames->frames(), 4);
  EXPECT_HAS(frames->remarks().at(0), "'arr_0' to 'arr_10'");
  for (const int i : {0, 1, 2, 10}) {
    const auto frame = frames->next();
    EXPECT_EQ(frame->points,
              Points(static_cast<size_t>(i + 1), Point::Constant(static_cast<float>(i))));
  }
  EXPECT_FALSE(frames->next());
  EXPECT_HAS(error_of([&] { read_array_frame(dir / "a.npz"); }), "sequence of 4");
}

TEST_F(ReadersArrayFrames, NonFinitePointsAreLeftOutAndFramesMayBeEmpty) {
  dir.write("in/1.npy", npy<float>({2, 3}, {1, NAN, 3, 4, 5, 6}));
  dir.write("in/2.npy", npy<float>({0, 3}, {}));
  dir.write("in/3.npy", npy<float>({1, 3}, {INFINITY, 0, 0}));
  const auto frames = open_frames(dir / "in");
  const auto first = frames->next();
  EXPECT_EQ(first->points, (Points{{4, 5, 6}}));
  EXPECT_EQ(first->left_out, 1u);
  EXPECT_TRUE(frames->next()->points.empty());
  EXPECT_EQ(frames->next()->left_out, 1u);
}

}  // namespace
}  // namespace restage
