// What pose estimators write, each kind by its own names and nesting: all are the same motion.
#include <gtest/gtest.h>

#include "datasets/importers/import.h"
#include "datasets/importers/motions/estimated.h"
#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/schema.h"
#include "tests/datasets/importers_support.h"
#include "tests/datasets/pickle_support.h"
#include "tests/datasets/smpl_support.h"

namespace restage {
namespace {

using namespace test;
namespace p = test::pickle;

constexpr int64_t kLength = 9;

/// Somebody who stands, turns and bends knees and elbows, y up; `camera`: as a camera sees it.
struct Seen {
  std::vector<double> turns, path, betas = {0.5, -1, 0.25, 2};
  explicit Seen(bool camera = false, double away = 0) {
    const Mat3 flip = camera ? Mat3(Vec3(1, -1, -1).asDiagonal()) : Mat3(Mat3::Identity());
    for (int64_t f = 0; f < kLength; ++f) {
      const double t = static_cast<double>(f) / kLength;
      for (int j = 0; j < kJoints; ++j) {
        Vec3 turn(0.02 * j, 0.1 * t, 0.03 * std::sin(j));
        if (j == 4 || j == 5) turn = {0.4 + t, 0, 0};
        if (j == 18 || j == 19) turn = {0, j == 18 ? -0.6 - t : 0.6 + t, 0.1};
        if (j == 0) {
          const Mat3 root = flip * Eigen::AngleAxisd(0.2 + t, Vec3::UnitY()).toRotationMatrix();
          const Eigen::AngleAxisd whole(root);
          turn = whole.angle() * whole.axis();
        }
        turns.insert(turns.end(), turn.data(), turn.data() + 3);
      }
      const Vec3 at = flip * Vec3(0.3 * t + away, 0.9, 0.2 * t);
      path.insert(path.end(), at.data(), at.data() + 3);
    }
  }
  Mat3 matrix(int64_t f, int64_t j) const {
    const Vec3 turn(&turns[static_cast<size_t>(66 * f + 3 * j)]);
    return Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }
  /// Columns `first` to `last` of each frame's 66.
  std::vector<double> columns(size_t first, size_t last) const {
    std::vector<double> out;
    for (size_t i = 0; i < turns.size(); ++i)
      if (i % 66 >= first && i % 66 < last) out.push_back(turns[i]);
    return out;
  }
  std::vector<double> each(const std::function<std::vector<double>(const Mat3&)>& numbers) const {
    std::vector<double> out;
    for (int64_t f = 0; f < kLength; ++f)
      for (int64_t j = 0; j < kJoints; ++j)
        for (const double x : numbers(matrix(f, j))) out.push_back(x);
    return out;
  }
};

using Arrays = std::vector<std::pair<std::string, std::string>>;
using Shape = std::vector<int64_t>;
std::string array(const Shape& shape, const std::vector<double>& values) {
  return npy<double>(shape, values);
}

/// The arrays of GVHMR's names.
Arrays parts(const Seen& s, const std::string& before) {
  return {{before + "body_pose", array({kLength, 63}, s.columns(3, 66))},
          {before + "global_orient", array({kLength, 3}, s.columns(0, 3))},
          {before + "transl", array({kLength, 3}, s.path)},
          {before + "betas", array({4}, s.betas)}};
}
std::string parts_map(const Seen& s) {
  return p::map({{p::text("body_pose"), p::array({kLength, 63}, s.columns(3, 66))},
                 {p::text("global_orient"), p::array({kLength, 1, 3}, s.columns(0, 3))},
                 {p::text("transl"), p::array({kLength, 3}, s.path)},
                 {p::text("betas"), p::array({1, 4}, s.betas)}});
}
/// WHAM's: the camera's motion and the world's.
std::string wham_map(const Seen& world, const Seen& camera) {
  return p::map({{p::text("pose"), p::array({kLength, 66}, camera.turns)},
                 {p::text("trans"), p::array({kLength, 3}, camera.path)},
                 {p::text("pose_world"), p::joblib_array({kLength, 66}, world.turns)},
                 {p::text("trans_world"), p::array({kLength, 3}, world.path)},
                 {p::text("verts"), p::array({kLength, 2, 3}, std::vector<double>(kLength * 6))},
                 {p::text("betas"), p::array({4}, world.betas)}});
}

class ImportersEstimated : public FileTest {
 protected:
  ImportersEstimated() { dir.write("model.npz", TinySmpl{SmplFamily::smpl}.file()); }

  Motion read(const std::string& path, ImportReport& report, const std::string& person = "") {
    BodyModels models(dir / "model.npz");
    const EstimatedMotion from = one_person(read_estimated(path), person, path);
    return import_amass(*from.arrays, models, {}, report, nullptr, from.hints);
  }

  /// The same motion as that of the plain file.
  void same(const std::string& path, const std::string& person = "", double within = 1e-5) {
    SCOPED_TRACE(path);
    const Seen s;
    ImportReport plain, report;
    const Motion wanted =
        read(dir.write("plain.npz", npz({{"pose_world", array({kLength, 66}, s.turns)},
                                         {"trans_world", array({kLength, 3}, s.path)},
                                         {"betas", array({4}, s.betas)}})),
             plain);
    const Motion got = read(path, report, person);
    ASSERT_EQ(got.frames(), wanted.frames());
    const Point shift = got.hips[0] - wanted.hips[0];
    for (size_t f = 0; f < got.frames(); ++f) {
      EXPECT_LT((got.hips[f] - wanted.hips[f] - shift).norm(), within) << f;
      for (size_t j = 0; j < kJoints; ++j)
        EXPECT_LT(got.global[f][j].angularDistance(wanted.global[f][j]), 1e-3) << f << " " << j;
    }
    said = remarks(report);
    layout = fact(report, "layout");
  }
  std::string said, layout;
};

TEST_F(ImportersEstimated, PlacesInNames) {
  const Seen world, camera(true, 5);
  for (const std::string separator : {"_", ".", "/"}) {
    Arrays all = parts(camera, "smpl_params_incam" + separator);
    const Arrays more = parts(world, "smpl_params_global" + separator);
    all.insert(all.end(), more.begin(), more.end());
    all.emplace_back("K_fullimg", array({3, 3}, std::vector<double>(9, 1)));
    same(dir.write("flat.npz", npz(all)));
  }
  EXPECT_EQ(read_estimated(dir / "flat.npz")[0].place, "smpl_params_global");
}

TEST_F(ImportersEstimated, DictionariesInWhateverFile) {
  const std::string value =
      p::map({{p::text("smpl_params_incam"), parts_map(Seen(true, 5))},
              {p::text("smpl_params_global"), parts_map(Seen())},
              {p::text("K_fullimg"), p::array({3, 3}, std::vector<double>(9, 1))}});
  same(dir.write("a.pkl", p::file(value)));
  same(dir.write("a.npy", p::npy_objects({}, {value})));
  same(dir.write("a.npz", npz({{"results", p::npy_objects({}, {value})}})));
  const Seen s;
  const std::string tensors =
      p::map({{p::text("body_pose"), p::tensor("0", kLength * 66, 3, {kLength, 63}, {66, 1})},
              {p::text("global_orient"), p::tensor("0", kLength * 66, 0, {kLength, 3}, {66, 1})},
              {p::text("transl"), p::tensor("1", kLength * 3, 0, {kLength, 3}, {3, 1})},
              {p::text("betas"), p::tensor("2", 4, 0, {kLength, 4}, {0, 1})}});
  same(dir.write("a.pt", p::torch_file(p::map({{p::text("smpl_params_global"), tensors}}),
                                       {s.turns, s.path, s.betas})));
}

TEST_F(ImportersEstimated, TheWorldGoesBeforeACameraAndVertices) {
  const Seen world, camera(true, 5);
  same(dir.write("w.npz",
                 npz({{"pose", array({kLength, 66}, camera.turns)},
                      {"trans", array({kLength, 3}, camera.path)},
                      {"pose_world", array({kLength, 66}, world.turns)},
                      {"trans_world", array({kLength, 3}, world.path)},
                      {"verts", array({kLength, 70, 3}, std::vector<double>(kLength * 210))},
                      {"betas", array({4}, world.betas)}})));
  same(dir.write("w.pkl", p::file(p::map({{p::number(0), wham_map(world, camera)}}))));
  const std::string both = p::map(
      {{p::text("smplx_cam"), parts_map(camera)}, {p::text("smplx_world"), parts_map(world)}});
  same(dir.write("prompt.pkl",
                 p::file(p::map({{p::text("people"), p::map({{p::text("1"), both}})}}))));
}

TEST_F(ImportersEstimated, ACamerasMotionIsTurnedAboutX) {
  same(dir.write("c.npz", npz(parts(Seen(true), "smpl_params_incam_"))));
  EXPECT_HAS(said, "turned about x by 180 degrees");
  const Seen seen(true);
  const std::string tram = p::map({{p::text("pred_pose"), p::array({kLength, 66}, seen.turns)},
                                   {p::text("pred_trans"), p::array({kLength, 1, 3}, seen.path)},
                                   {p::text("pred_cam"), p::array({kLength, 3}, seen.path)},
                                   {p::text("pred_shape"), p::array({1, 4}, seen.betas)}});
  same(dir.write("tram.npy", p::npy_objects({}, {tram})));
  EXPECT_HAS(said, "turned about x by 180 degrees");
  same(dir.write("c.pkl", p::file(p::map({{p::text("incam"), parts_map(Seen())}}))));
  EXPECT_EQ(said.find("180"), std::string::npos);  // had been turned before
}

TEST_F(ImportersEstimated, RotationsInEveryForm) {
  const Seen s;
  const auto file = [&](const std::string& name, const Shape& shape,
                        const std::vector<double>& numbers) {
    return dir.write("r.npz", npz({{name, array(shape, numbers)},
                                   {"transl", array({kLength, 1, 3}, s.path)},
                                   {"betas", array({4}, s.betas)}}));
  };
  const auto all = [](const Mat3& m) {
    return std::vector<double>{m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1),
                               m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
  };
  same(file("pred_rotmat", {kLength, 22, 3, 3}, s.each(all)));
  same(file("poses", {kLength, 198}, s.each(all)));
  const auto rows = [](const Mat3& m) {
    return std::vector<double>{m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2)};
  };
  for (const Shape& shape : {Shape{kLength, 22, 6}, Shape{kLength, 132}}) {
    same(file("poses", shape, s.each(rows)));
    EXPECT_HAS(layout, "two rows");
  }
  same(file("poses", {kLength, 22, 6}, s.each([](const Mat3& m) {
    return std::vector<double>{m(0, 0), m(1, 0), m(2, 0), m(0, 1), m(1, 1), m(2, 1)};
  })));
  same(file("poses", {kLength, 22, 6}, s.each([](const Mat3& m) {
    return std::vector<double>{m(0, 0), m(0, 1), m(1, 0), m(1, 1), m(2, 0), m(2, 1)};
  })));
  EXPECT_HAS(layout, "in turn");
  for (const bool last : {false, true}) {
    same(file("poses", {kLength, 22, 4}, s.each([&](const Mat3& m) {
      const Quat q(m);
      return last ? std::vector<double>{q.x(), q.y(), q.z(), q.w()}
                  : std::vector<double>{q.w(), q.x(), q.y(), q.z()};
    })));
    EXPECT_HAS(layout, last ? "x y z w" : "w x y z");
  }
}

TEST_F(ImportersEstimated, PeopleAreMotionsOfTheirOwn) {
  const Seen first, second(false, 1);
  const std::string path = dir.write(
      "two.pkl",
      p::file(p::map({{p::number(3), parts_map(second)}, {p::number(7), parts_map(first)}})));
  same(path, "7");
  EXPECT_HAS(error_of([&] { one_person(read_estimated(path), "", path); }),
             "holds 2 people: '3', '7'; choose one with person '3'");
  EXPECT_HAS(error_of([&] { one_person(read_estimated(path), "5", path); }), "no person '5'");
  ImportOptions options;
  options.body_model = dir / "model.npz";
  EXPECT_EQ(import_data(path, dir / "o.h5", options).motions, 2u);
  const std::vector<Motion> motions = read_motions(dir / "o.h5");
  EXPECT_EQ(motions[0].id + " " + motions[1].id, "two_3 two_7");
  EXPECT_NE(motions[0].subject, motions[1].subject);
  options.person = "7";
  EXPECT_EQ(import_data(path, dir / "o.h5", options).motions, 1u);
  EXPECT_EQ(read_motions(dir / "o.h5")[0].id, "two");
  TakeOptions take;
  EXPECT_HAS(error_of([&] { read_take(path, take); }), "choose one with person '3'");
  take.person = "3";
  EXPECT_EQ(read_take(path, take).frames.size(), static_cast<size_t>(kLength));

  const auto twice = [](std::vector<double> a, const std::vector<double>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  same(dir.write("s.npz",
                 npz({{"trans", array({2, kLength, 3}, twice(first.path, second.path))},
                      {"root_orient",
                       array({2, kLength, 3}, twice(first.columns(0, 3), second.columns(0, 3)))},
                      {"pose_body",
                       array({2, kLength, 63}, twice(first.columns(3, 66), second.columns(3, 66)))},
                      {"betas", array({2, 4}, twice(first.betas, second.betas))}})),
       "0");
}

/// Frames as 4DHumans keeps them: numbers of people, and a map of each of them.
std::string tracked(const Seen& s, int64_t missing) {
  std::vector<std::pair<std::string, std::string>> frames;
  for (int64_t f = 0; f < kLength; ++f) {
    std::vector<std::string> ids, bodies, places;
    for (const int person : {4, 1}) {
      if (person == 1 && f == missing) continue;
      std::vector<double> root, rest;
      for (int64_t j = 0; j < 24; ++j)
        for (int k = 0; k < 9; ++k)
          (j == 0 ? root : rest)
              .push_back(j < kJoints ? s.matrix(f, j)(k / 3, k % 3)
                                     : static_cast<double>(k % 4 == 0));
      ids.push_back(p::number(person));
      bodies.push_back(p::map({{p::text("global_orient"), p::array({1, 3, 3}, root)},
                               {p::text("body_pose"), p::array({23, 3, 3}, rest)},
                               {p::text("betas"), p::array({4}, s.betas)}}));
      places.push_back(p::array(
          {3}, {s.path[static_cast<size_t>(3 * f)] + person, s.path[static_cast<size_t>(3 * f + 1)],
                s.path[static_cast<size_t>(3 * f + 2)]}));
    }
    frames.emplace_back(p::text("img/" + std::to_string(100 + f) + ".jpg"),
                        p::map({{p::text("tid"), p::list(ids)},
                                {p::text("smpl"), p::list(bodies)},
                                {p::text("camera"), p::list(places)}}));
  }
  return p::file(p::map(frames));
}

TEST_F(ImportersEstimated, FramesBecomeMotionsOfThosePeople) {
  const std::string whole = dir.write("phalp.pkl", tracked(Seen(), -1));
  same(whole, "1");
  same(whole, "4");
  same(dir.write("gap.pkl", tracked(Seen(), 3)), "4");
  same(dir / "gap.pkl", "1", 0.002);
  EXPECT_HAS(said, "1 frame without this person: interpolated");
}

/// Rows of the frames `kept`.
std::vector<double> rows(const std::vector<double>& all, const std::vector<int64_t>& kept) {
  const auto width = std::ssize(all) / kLength;
  std::vector<double> out;
  for (const int64_t f : kept)
    out.insert(out.end(), all.begin() + f * width, all.begin() + (f + 1) * width);
  return out;
}

TEST_F(ImportersEstimated, FramesThatNumbersLeaveOutAreFilled) {
  const Seen s;
  const std::vector<int64_t> kept = {0, 1, 2, 5, 6, 8};
  const auto n = std::ssize(kept);
  const auto ids = [&](double first, double step = 1) {
    std::vector<double> out;
    for (const int64_t f : kept) out.push_back(first + step * static_cast<double>(f));
    return out;
  };
  const auto wham = [&](const std::vector<double>& numbers) {
    return p::map({{p::text("pose_world"), p::array({n, 66}, rows(s.turns, kept))},
                   {p::text("trans_world"), p::array({n, 3}, rows(s.path, kept))},
                   {p::text("betas"), p::array({n, 4}, std::vector<double>(4 * kept.size()))},
                   {p::text("frame_ids"), p::array({n}, numbers)}});
  };
  const std::string left_out =
      "frame_ids leaves out 3 frames between the first and the last (at most 2 in a row): "
      "interpolated";
  const auto check = [&](const std::string& path) {
    SCOPED_TRACE(path);
    ImportReport plain, report;
    const Motion wanted =
        read(dir.write("plain.npz", npz({{"pose_world", array({kLength, 66}, s.turns)},
                                         {"trans_world", array({kLength, 3}, s.path)}})),
             plain);
    const Motion got = read(path, report);
    ASSERT_EQ(got.frames(), wanted.frames());
    EXPECT_NE(remarks(report).find(left_out), std::string::npos) << remarks(report);
    for (const size_t f : {size_t{1}, size_t{5}, size_t{8}})
      for (size_t j = 0; j < kJoints; ++j)
        EXPECT_LT(got.global[f][j].angularDistance(wanted.global[f][j]), 1e-3) << f << " " << j;
    for (size_t f = 1; f < got.frames(); ++f)  // the path is straight, so between is between
      EXPECT_LT((got.hips[f] - got.hips[0] - (wanted.hips[f] - wanted.hips[0])).norm(), 1e-4) << f;
  };
  check(dir.write("wham.pkl", p::file(p::map({{p::number(0), wham(ids(17))}}))));
  check(dir.write("flat.npz", npz({{"pose_world", array({n, 66}, rows(s.turns, kept))},
                                   {"trans_world", array({n, 3}, rows(s.path, kept))},
                                   {"frame_ids", array({n}, ids(3))}})));
  ImportReport report;
  EXPECT_EQ(read(dir.write("back.pkl", p::file(p::map({{p::number(0), wham(ids(8, -1))}}))), report)
                .frames(),
            kept.size());
  EXPECT_NE(remarks(report).find("frame_ids does not count up, and is not used"),
            std::string::npos);
  check(dir.write("steps.pkl", p::file(p::map({{p::number(0), wham(ids(17, 4))}}))));
  ImportReport fourth;
  read(dir / "steps.pkl", fourth);
  EXPECT_HAS(remarks(fourth), "frame_ids counts in steps of 4: a step is taken for a frame");
  std::vector<double> far = ids(0);
  far.back() = 8e12;
  EXPECT_EQ(error_of([&] {
              read(dir.write("far.pkl", p::file(p::map({{p::number(0), wham(far)}}))), report);
            }),
            dir / "far.pkl" +
                ": frame_ids counts over 8000000000001 frames, for 6 poses; number the frames of "
                "one video, or leave frame_ids out");
}

TEST_F(ImportersEstimated, RompsPicturesAndSequences) {
  const Seen s;
  std::vector<std::pair<std::string, std::string>> frames;
  std::vector<std::string> thetas, places, shapes;
  for (int64_t f = 0; f < kLength; ++f) {
    std::vector<double> theta(s.turns.begin() + 66 * f, s.turns.begin() + 66 * (f + 1));
    theta.resize(72, 0);
    const std::vector<double> at(s.path.begin() + 3 * f, s.path.begin() + 3 * (f + 1));
    frames.emplace_back(p::text(std::to_string(f) + ".png"),
                        p::map({{p::text("smpl_thetas"), p::array({1, 72}, theta)},
                                {p::text("cam_trans"), p::array({1, 3}, at)},
                                {p::text("smpl_betas"), p::array({1, 4}, s.betas)}}));
    thetas.push_back(p::array({72}, theta));
    places.push_back(p::array({3}, at));
    shapes.push_back(p::array({4}, s.betas));
  }
  const std::string pictures = p::npy_objects({}, {p::map(frames)});
  same(dir.write("r.npz", npz({{"results", pictures}})));
  const std::string sequence = p::map({{p::text("smpl_thetas"), p::list(thetas)},
                                       {p::text("cam_trans"), p::list(places)},
                                       {p::text("smpl_betas"), p::list(shapes)}});
  dir.write("v.npz",
            npz({{"results", pictures},
                 {"sequence_results", p::npy_objects({}, {p::map({{p::number(1), sequence}})})}}));
  same(dir / "v.npz");
  EXPECT_EQ(read_estimated(dir / "v.npz").size(), 1u);
}

TEST_F(ImportersEstimated, WithoutAPathTheBodyStays) {
  const Seen s;
  ImportReport report;
  const std::string path = dir.write(
      "vibe.pkl",
      p::file(p::map({{p::number(1), p::map({{p::text("pose"), p::array({kLength, 66}, s.turns)},
                                             {p::text("orig_cam"),
                                              p::array({kLength, 4}, std::vector<double>(36, 1))},
                                             {p::text("betas"), p::array({4}, s.betas)}})}})));
  const Motion motion = read(path, report);
  EXPECT_LT((motion.hips[0] - motion.hips[kLength - 1]).norm(), 0.1);
  EXPECT_HAS(remarks(report), "does not say where the body goes");
}

TEST_F(ImportersEstimated, WithoutABodyModelAnAverageBodyStandsIn) {
  const std::string path = dir.write("a.pkl", p::file(parts_map(Seen())));
  const ImportSummary summary = import_data(path, dir / "o.h5");
  EXPECT_EQ(summary.motions, 1u);
  EXPECT_HAS(remarks(summary.reports[0]), "no body model: turns go over as they are");
}

TEST_F(ImportersEstimated, WhatIsNoneIsNamed) {
  const auto why = [&](const std::string& name, const std::string& bytes) {
    return error_of([&] { import_data(dir.write(name, bytes), dir / "o.h5"); });
  };
  EXPECT_HAS(why("u.pkl", p::file(p::map({{p::text("a"), p::array({2, 2}, {1, 2, 3, 4})},
                                          {p::text("b"), p::map({{p::text("c"), "N"}})}}))),
             "u.pkl: holds no motion of a body model (it holds 'a' [2, 2], 'b' ('c')); load it");
  EXPECT_HAS(why("s.pkl", p::file(p::list({p::map({{p::text("pred_vertices"), "N"}})}))),
             "each with ('pred_vertices')); load it in Python and save each frame's vertices");
  EXPECT_HAS(why("u.pt", p::torch_file("}", {})), "is a file of torch.save");
  EXPECT_HAS(why("u.pt", p::torch_file("}", {})), "torch.load");
  EXPECT_HAS(why("e.pkl", p::file(p::name("os", "system"))), "asks to run 'os.system'");
  EXPECT_HAS(
      why("e.npz", npz({{"r", npy_of(npy_header("|O", {}), p::file(p::name("os", "system")))}})),
      "asks to run 'os.system'");
  EXPECT_HAS(why("d.npz", npz({{"depth", array({2, 8, 9}, std::vector<double>(144, 1))},
                               {"intrinsics", array({3, 3}, std::vector<double>(9, 1))}})),
             "is 9 x 8, but the camera's middle is at 1, 1");
  EXPECT_FALSE(std::filesystem::exists(dir / "o.h5"));
}

TEST_F(ImportersEstimated, VerticesAsACameraSawThemAreTurned) {
  std::vector<double> points;
  for (int i = 0; i < 100; ++i)
    for (const double x : {0.2 * std::sin(i), 0.018 * i - 0.9, 0.15 * std::cos(i)})
      points.push_back(x);
  const Arrays arrays = {{"pred_vertices", array({100, 3}, points)},
                         {"pred_cam_t", array({3}, {0, 0, 4})}};
  dir.write("in/0.npz", npz(arrays));
  dir.write("in/1.npz", npz(arrays));
  const ImportSummary summary = import_data(dir / "in", dir / "o.h5");
  EXPECT_HAS(remarks(summary.reports[0]), "turned about x by 180 degrees");
  EXPECT_NEAR(read_scans(dir / "o.h5").points[99].y(), -(0.018 * 99 - 0.9), 1e-5);
  ImportOptions options;
  options.motion.rest.up = Axis::y;
  import_data(dir / "in", dir / "o.h5", options);
  EXPECT_NEAR(read_scans(dir / "o.h5").points[99].y(), 0.018 * 99 - 0.9, 1e-5);
}

}  // namespace
}  // namespace restage
