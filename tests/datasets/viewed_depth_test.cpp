// Pictures of a depth camera: its numbers, PNG and arrays, points of pixels, and what is
// background.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>

#include "autograd/base/words.h"
#include "datasets/importers/depth/walls.h"
#include "datasets/importers/import.h"
#include "datasets/readers/depth/depth_pictures.h"
#include "datasets/readers/depth/grey_png.h"
#include "datasets/sampling/scanner.h"
#include "datasets/schema.h"
#include "nn/geometry/box.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/npz_support.h"
#include "tests/support/doctor_people.h"

namespace restage {
namespace {

using namespace test;
using ReadersDepth = FileTest;
using ImportersDepth = FileTest;

std::string big_endian(uint32_t value, int bytes = 4) {
  std::string out;
  for (int k = bytes - 1; k >= 0; --k) out += static_cast<char>(value >> (8 * k));
  return out;
}

/// A PNG of these rows; `colour`: 0 grey, 2 colours.
std::string png_of(int width, int height, const std::string& rows, int bits = 16, int colour = 0) {
  const auto chunk = [](const std::string& kind, const std::string& data) {
    const std::string all = kind + data;
    const auto crc = static_cast<uint32_t>(crc32(
        0, reinterpret_cast<const unsigned char*>(all.data()), static_cast<unsigned>(all.size())));
    return big_endian(static_cast<uint32_t>(data.size())) + all + big_endian(crc);
  };
  std::string head = big_endian(static_cast<uint32_t>(width)) +
                     big_endian(static_cast<uint32_t>(height)) + static_cast<char>(bits) +
                     static_cast<char>(colour) + std::string(3, '\0');
  std::string raw_rows;
  const size_t row = rows.size() / static_cast<size_t>(height);
  for (int v = 0; v < height; ++v)
    raw_rows += '\0' + rows.substr(static_cast<size_t>(v) * row, row);
  // zlib's frame about what deflated() packs.
  const auto sum =
      static_cast<uint32_t>(adler32(1, reinterpret_cast<const unsigned char*>(raw_rows.data()),
                                    static_cast<unsigned>(raw_rows.size())));
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", head) +
         chunk("IDAT", "\x78\xda" + deflated(raw_rows) + big_endian(sum)) + chunk("IEND", "");
}

constexpr int kSide = 120;
const double kFocal = kSide / 2.0 / std::tan(0.5);  // as DepthCamera's opening angle
const std::string kNumbers = std::to_string(kFocal) + "," + std::to_string(kFocal) + ",59.5,59.5";

/// What a camera at the origin that looks along -z measures, exactly.
Points seen_at(double z, double sway = 0) {
  Mesh body = somebody().rest;
  for (Point& p : body.vertices) p += Point(static_cast<float>(sway), -1, static_cast<float>(-z));
  const DepthCamera camera{Vec3::Zero(), Vec3(0, 0, -1), 1.0, kSide, kSide};
  return scan_surface(body, {camera}, ScannerNoise{0, 0, 0, 0, 0, 1e9, 0, 0}, RngKey{0, 0});
}

using Depths = std::vector<double>;  // metres; 0: nothing

Depths picture_of(const Points& points) {
  Depths out(kSide * kSide, 0.0);
  for (const Point& p : points) {
    const double z = -p.z(), u = p.x() / z * kFocal + 59.5, v = -p.y() / z * kFocal + 59.5;
    EXPECT_NEAR(u, std::round(u), 1e-2);
    EXPECT_NEAR(v, std::round(v), 1e-2);
    double& at = out[static_cast<size_t>(std::lround(v) * kSide + std::lround(u))];
    at = at > 0 ? std::min(at, z) : z;
  }
  return out;
}

/// A wall, 1 m behind the person, and a floor, 1 m below the camera.
void add_room(Depths& picture, double wall) {
  for (int v = 0; v < kSide; ++v)
    for (int u = 0; u < kSide; ++u) {
      double& at = picture[static_cast<size_t>(v * kSide + u)];
      const double down = (v - 59.5) / kFocal, floor = down > 0 ? 1 / down : 1e9;
      const double room = std::min(wall, floor);
      at = at > 0 ? std::min(at, room) : room;
    }
}

std::string png_of(const Depths& picture, double unit = 0.001) {
  std::string rows;
  for (const double z : picture)
    rows += big_endian(static_cast<uint32_t>(std::lround(z / unit)), 2);
  return png_of(kSide, kSide, rows);
}

Points frame_of(const Scans& scans, size_t f) {
  const auto begin = scans.points.begin();
  return {begin + scans.frame_offset[f], begin + scans.frame_offset[f + 1]};
}

double farthest(const Points& from, const Points& to) {
  double out = 0;
  for (const Point& p : from) {
    float nearest = 1e9f;
    for (const Point& q : to) nearest = std::min(nearest, (p - q).norm());
    out = std::max<double>(out, nearest);
  }
  return out;
}

TEST_F(ReadersDepth, NumbersOfACamera) {
  const auto is = [](const Intrinsics& camera) {
    EXPECT_EQ(camera.fx, 500);
    EXPECT_EQ(camera.fy, 510);
    EXPECT_EQ(camera.cx, 320);
    EXPECT_EQ(camera.cy, 240);
  };
  is(read_intrinsics("500,510,320,240"));
  is(read_intrinsics(dir.write("a.txt", "500 510 320 240\n")));
  is(read_intrinsics(dir.write("b.txt", "500 0 320\r\n0 510 240\r\n0 0 1\r\n")));
  is(read_intrinsics(dir.write("c.txt", "[[500, 0, 320], [0, 510, 240], [0, 0, 1]]")));
  is(read_intrinsics(dir.write("open3d.json", R"({"width": 640, "height": 480,
      "intrinsic_matrix": [500, 0, 0, 0, 510, 0, 320, 240, 1]})")));
  is(read_intrinsics(dir.write("realsense.json", R"({"depth": {"fx": 500, "fy": 510, "ppx": 320,
      "ppy": 240}})")));
  is(read_intrinsics(dir.write("opencv.json", R"({"camera_matrix": {"rows": 3, "cols": 3,
      "data": [500, 0, 320, 0, 510, 240, 0, 0, 1]}})")));
  const Intrinsics phone = read_intrinsics(dir.write("record3d.json", R"({"w": 1440, "h": 1920,
      "dw": 192, "dh": 256, "fps": 60, "K": [1500, 0, 0, 0, 1500, 0, 720, 960, 1]})"));
  EXPECT_EQ(phone.fps, 60);
  EXPECT_NEAR(fitted_to(phone, 192, 256, "d.png", false).fx, 200, 1e-9);
  EXPECT_NEAR(fitted_to(phone, 192, 256, "d.png", false).cy, 128, 1e-9);
  EXPECT_EQ(fitted_to(phone, 1440, 1920, "d.png", false).fx, 1500);
  EXPECT_HAS(error_of([&] { fitted_to(phone, 640, 480, "d.png", false); }),
             "is of pictures of 1440 x 1920, but d.png has 640 x 480");
  const Intrinsics plain = read_intrinsics("500,510,320,240");
  EXPECT_HAS(error_of([&] { fitted_to(plain, 320, 240, "d.png", false); }), "of 640 x 480");
  EXPECT_EQ(fitted_to(plain, 320, 240, "d.png", true).fx, 500);
  EXPECT_HAS(error_of([] { read_intrinsics("500,510,320"); }), "has 3 numbers");
  EXPECT_HAS(error_of([] { read_intrinsics("0.5,0.5,0.5,0.5"); }), "no camera's numbers");
  EXPECT_HAS(error_of([] { read_intrinsics("not_there.json"); }), "nor a file");
  EXPECT_HAS(error_of([&] { read_intrinsics(dir.write("x.json", "{\"fx\": 0}")); }),
             "x.json: holds no numbers of a camera");
}

TEST_F(ReadersDepth, PngIsGreyOfSixteenBits) {
  const GreyPicture grey =
      read_grey_png(dir.write("a.png", png_of(2, 2, std::string("\0\1\1\0\xff\xff\2\2", 8))));
  EXPECT_EQ(grey.values, (std::vector<uint16_t>{1, 256, 65535, 514}));
  EXPECT_HAS(error_of([&] { read_grey_png(dir.write("b.png", png_of(2, 1, "abcdef", 8, 2))); }),
             "b.png: is a picture of colours");
  EXPECT_HAS(error_of([&] { read_grey_png(dir.write("c.png", png_of(2, 1, "ab", 8))); }), "8 bits");
  EXPECT_HAS(error_of([&] { read_grey_png(dir.write("d.png", "\xff\xd8\xff jpeg")); }), "d.png");
  const std::string whole = png_of(8, 8, std::string(128, 'x'));
  for (size_t n = 0; n < whole.size() - 20; ++n)
    error_of([&] { read_grey_png(dir.write("e.png", whole.substr(0, n))); });
}

TEST_F(ReadersDepth, TimesAsNamesGiveTheRate) {
  const std::string png = png_of(8, 8, std::string(128, 'x'));
  for (const char* name :
       {"1305031102.160407", "1305031102.194330", "1305031102.226738", "1305031102.262886"})
    dir.write(cat("tum/depth/", name, ".png"), png);
  const auto tum = open_depth_pictures(dir / "tum", 0.0002);
  EXPECT_EQ(tum->frames(), 4);
  EXPECT_NEAR(tum->fps().value(), 29.3, 0.2);
  EXPECT_NEAR(tum->picture(0).depth[0], 0x7878 * 0.0002, 1e-5);
  for (const int64_t at : {0, 50, 100, 150}) dir.write(cat("ms/", 1700000000000 + at, ".png"), png);
  EXPECT_NEAR(open_depth_pictures(dir / "ms", 0)->fps().value(), 20, 1e-3);
  for (int k = 1; k < 12; ++k) dir.write(cat("plain/", k, ".png"), png);
  const auto plain = open_depth_pictures(dir / "plain", 0);
  EXPECT_FALSE(plain->fps());
  EXPECT_TRUE(plain->picture(9).source.ends_with("/10.png"));
}

TEST_F(ImportersDepth, PointsAreWhereTheyWere) {
  const Points truth = seen_at(2);
  dir.write("in/0.png", png_of(picture_of(truth)));
  ImportOptions options;
  options.intrinsics = kNumbers;
  options.keep_background = true;
  const ImportSummary done = import_data(dir / "in", dir / "out.h5", options);
  EXPECT_EQ(done.frames, 1u);
  EXPECT_HAS(fact(done.reports[0], "depth"), "0.001 m a unit");
  EXPECT_EQ(fact(done.reports[0], "pixels"), "all");
  const Points found = frame_of(read_scans(dir / "out.h5"), 0);
  EXPECT_GT(found.size(), 1000u);
  EXPECT_LT(farthest(truth, found), 0.002);
  EXPECT_LT(farthest(found, truth), 0.002);
}

TEST_F(ImportersDepth, ArraysOfAnyUnit) {
  const Points truth = seen_at(2);
  const Depths depth = picture_of(truth);
  std::vector<float> metres;
  std::string millimetres;
  for (int f = 0; f < 2; ++f)
    for (const double z : depth) {
      metres.push_back(z > 0 ? static_cast<float>(z) : f == 0 ? NAN : INFINITY);
      millimetres += raw(static_cast<uint16_t>(z > 0 ? std::lround(1000 * z) : f * 65535));
    }
  const std::string matrix = npy<double>({3, 3}, {kFocal, 0, 59.5, 0, kFocal, 59.5, 0, 0, 1});
  const std::vector<int64_t> shape = {2, kSide, kSide};
  dir.write("m.npz", npz({{"depth", npy(shape, metres)}, {"K", matrix}}));
  dir.write("mm.npz", npz({{"depth", npy_as("<u2", shape, millimetres)},
                           {"intrinsics", npy<double>({4}, {kFocal, kFocal, 59.5, 59.5})}}));
  dir.write("mm.npy", npy_as("<u2", shape, millimetres));
  for (const char* name : {"m.npz", "mm.npz", "mm.npy"}) {
    ImportOptions options;
    options.keep_background = true;
    if (std::string(name) == "mm.npy") options.intrinsics = kNumbers;
    EXPECT_EQ(import_data(dir / name, dir / "out.h5", options).frames, 2u) << name;
    for (size_t f = 0; f < 2; ++f)
      EXPECT_LT(farthest(frame_of(read_scans(dir / "out.h5"), f), truth), 0.002) << name;
  }
  dir.write("none.npz", npz({{"depth", npy(shape, metres)}}));
  EXPECT_HAS(error_of([&] { import_data(dir / "none.npz", dir / "x.h5"); }), "FX,FY,CX,CY");
  ImportOptions wrong;
  wrong.intrinsics = kNumbers;
  wrong.depth_scale = 1;
  EXPECT_HAS(error_of([&] { import_data(dir / "mm.npy", dir / "x.h5", wrong); }), "no room is");
}

/// Somebody who stands still before a wall, on a floor, beside a cupboard that touches neither; and
/// who walks.
TEST_F(ImportersDepth, ThePersonAloneIsLeft) {
  for (const bool walks : {false, true}) {
    const std::string folder = walks ? "walks" : "stands";
    for (int f = 0; f < 10; ++f) {
      Depths picture = picture_of(seen_at(2.5, walks ? 0.06 * f - 0.6 : -0.4));
      for (int v = 50; v < 90; ++v)  // a cupboard
        for (int u = 106; walks && u < 119; ++u) picture[static_cast<size_t>(v * kSide + u)] = 2.4;
      add_room(picture, 3.5);
      dir.write(cat(folder, "/", f, ".png"), png_of(picture));
    }
    ImportOptions options;
    options.intrinsics = kNumbers;
    const ImportSummary done = import_data(dir / folder, dir / "out.h5", options);
    EXPECT_HAS(remarks(done.reports[0]), "on floors and walls");
    EXPECT_HAS(remarks(done.reports[0]), "it is level, and it is y = 0");
    const Scans scans = read_scans(dir / "out.h5");
    for (const size_t f : {size_t{0}, size_t{5}, size_t{9}}) {
      Points truth = seen_at(2.5, walks ? 0.06 * static_cast<double>(f) - 0.6 : -0.4);
      for (Point& p : truth) p.y() += 1;  // the floor is at y = 0
      const Points found = frame_of(scans, f);
      EXPECT_GT(5 * found.size(), 4 * truth.size()) << folder << f;
      EXPECT_LT(farthest(found, truth), 0.03) << folder << f;
    }
  }
}

TEST(ImportersDepthWalls, APersonIsNoWall) {
  EXPECT_TRUE(find_walls(seen_at(2)).empty());
  Depths picture = picture_of(seen_at(2));
  add_room(picture, 3);
  Points points;
  for (int v = 0; v < kSide; ++v)
    for (int u = 0; u < kSide; ++u) {
      const double z = picture[static_cast<size_t>(v * kSide + u)];
      points.push_back(Vec3((u - 59.5) * z / kFocal, -(v - 59.5) * z / kFocal, -z).cast<float>());
    }
  const std::vector<Wall> walls = find_walls(points);
  ASSERT_EQ(walls.size(), 2u);
  for (const Wall& wall : walls) {
    const bool floor = wall.plane.normal.y() > 0.5;
    EXPECT_GT(floor ? wall.plane.normal.y() : wall.plane.normal.z(), 0.999);
    EXPECT_NEAR(wall.plane.offset, floor ? -1 : -3, 0.01);
  }
}

TEST_F(ImportersDepth, WhatIsNoDepthIsRefused) {
  const std::string good = png_of(kSide, kSide, std::string(2 * kSide * kSide, '\7'));
  ImportOptions options;
  options.intrinsics = kNumbers;
  options.keep_background = true;
  const auto refused = [&](const std::string& source) {
    return error_of([&] { import_data(dir / source, dir / "x.h5", options); });
  };
  dir.write("colours/0.png", png_of(2, 1, "abcdef", 8, 2));
  EXPECT_HAS(refused("colours"), "0.png: is a picture of colours");
  dir.write("empty/readme.md", "");
  EXPECT_HAS(refused("empty"), "holds no depth pictures");
  dir.write("sizes/0.png", good);
  dir.write("sizes/1.png", png_of(8, 8, std::string(128, '\7')));
  EXPECT_HAS(refused("sizes"), "is 8 x 8, but the first is 120 x 120");
  EXPECT_HAS(refused(dir.write("a.bvh", "").substr(dir.path().size() + 1)), "of no kind");
  dir.write("in/0.png", good);
  EXPECT_HAS(error_of([&] { import_data(dir / "in", dir / "x.h5"); }),
             "give intrinsics FX,FY,CX,CY");
  options.motion.scale = 2;
  EXPECT_HAS(refused("in"), "has nothing to do with");
}

}  // namespace
}  // namespace restage
