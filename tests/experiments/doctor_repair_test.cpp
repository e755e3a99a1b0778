// What `restage doctor --fix` takes along of an HDF5 file, value by value.
#include "datasets/doctor/mended_file.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/doctor_people.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using test::TempDir;

constexpr int64_t kFrames = 4;

/// Numbers that differ: 0.25, 0.5, ...
template <class T>
std::vector<T> rising(int64_t count) {
  std::vector<T> out(static_cast<size_t>(count));
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<T>(0.25 * static_cast<double>(i + 1));
  return out;
}

Subject subject_of(const std::string& path) {
  Subject out;
  out.path = path;
  out.stored = inspect(path);
  out.frames = open_frames(path);
  return out;
}

/// The transform of a repair is the test's, not what the doctor makes of the surface.
Diagnosis diagnosis_of(const Subject& subject) {
  Diagnosis d;
  d.frames = subject.frames->frames();
  d.fps = subject.frames->fps();
  d.transform = Similarity{0.5, turn_about_y(0.5), Vec3(1, 2, 3)};
  return d;
}

void write_more(h5::File& file) {
  file.write<float>("/confidence", {kFrames}, {0.25f, 0.5f, 0.75f, 1.0f});
  file.write<float>("/radius", {kFrames, kJoints}, rising<float>(kFrames * kJoints));
  std::vector<double> turns;
  for (int64_t i = 0; i < kFrames * kJoints; ++i) {
    const Quat q(Eigen::AngleAxisd(0.1 * static_cast<double>(i), Vec3::UnitX()));
    turns.insert(turns.end(), {q.w(), q.x(), q.y(), q.z()});
  }
  file.write<double>("/rotations", {kFrames, kJoints, 4}, turns);
  file.write<int64_t>("/take/number", {kFrames}, {7, 8, 1LL << 40, 10});
  file.write_text("/take/note", {"a", "b", "c", "d"});
  file.write<double>("/extra", {kFrames, 2, 3}, rising<double>(kFrames * 6));
  file.write<double>("/skeleton", {3, 5}, rising<double>(15));  // of no frame
  file.create_group("/source");
  file.set_text("/source", "path", "scans/");
  file.set_number("/source", "scale", 0.001);
  file.write<int64_t>("/filled", {2}, {1, 3});
  file.set_number("/", "shutter", 0.125);
  file.set_text("/extra", "unit", "newton");
}

void expect_more(const std::string& path, const std::vector<int64_t>& rows, const Similarity& t) {
  const h5::File file = h5::File::open(path);
  const auto n = std::ssize(rows);
  const auto confidence = file.read<double>("/confidence", {n});
  const auto radius = file.read<double>("/radius", {n, kJoints});
  const auto turns = file.read<double>("/rotations", {n, kJoints, 4});
  const auto number = file.read<int64_t>("/take/number", {n});
  const auto extra = file.read<double>("/extra", {n, 2, 3});
  const auto note = file.dataset("/take/note", {n}).read_text();
  for (int64_t k = 0; k < n; ++k) {
    const auto f = static_cast<double>(rows[static_cast<size_t>(k)]);
    const auto i = static_cast<size_t>(k);
    EXPECT_EQ(confidence[i], 0.25 * (f + 1));
    EXPECT_EQ(number[i], f == 2 ? 1LL << 40 : 7 + f);
    EXPECT_EQ(note[i], std::string(1, static_cast<char>('a' + rows[i])));
    EXPECT_EQ(extra[6 * i], 0.25 * (6 * f + 1)) << "as it stands";
    EXPECT_NEAR(radius[kJoints * i + 1], t.scale * 0.25 * (kJoints * f + 2), 1e-6);
    const double* q = &turns[4 * (kJoints * i + 1)];
    const Quat want =
        Quat(t.rotation) * Quat(Eigen::AngleAxisd(0.1 * (kJoints * f + 1), Vec3::UnitX()));
    EXPECT_NEAR(std::abs(Quat(q[0], q[1], q[2], q[3]).dot(want)), 1, 1e-12);
  }
  EXPECT_EQ(file.text("/source", "path"), "../scans/") << "the file is a folder deeper";
  EXPECT_EQ(file.number("/source", "scale"), 0.001);
  const auto filled = file.read<int64_t>("/filled", {-1});
  EXPECT_EQ(std::ssize(filled),
            std::count_if(rows.begin(), rows.end(), [](int64_t f) { return f % 2 == 1; }));
  for (const int64_t k : filled) EXPECT_EQ(rows[static_cast<size_t>(k)] % 2, 1);
  EXPECT_EQ(file.number("/", "shutter"), 0.125);
  EXPECT_EQ(file.text("/extra", "unit"), "newton");
  EXPECT_FALSE(file.has("/skeleton"));
}

bool remarked(const Repaired& done, const std::string& words) {
  return std::any_of(done.remarks.begin(), done.remarks.end(), [&](const std::string& remark) {
    return remark.find(words) != std::string::npos;
  });
}

TEST(DoctorRepair, APredictionKeepsAllThatItHoldsOfEveryFrame) {
  const TempDir dir;
  std::filesystem::create_directories(dir / "below");
  const std::string path = dir / "p.h5", out = dir / "below/out.h5";
  {
    h5::File file = h5::File::create(path);
    file.write<double>("/joints", {kFrames, kJoints, 3}, rising<double>(kFrames * kJoints * 3));
    file.write<float>("/vertices", {kFrames, 5, 3}, rising<float>(kFrames * 15));
    file.write<int64_t>("/faces", {1, 3}, {0, 1, 4});
    file.write<int64_t>("/sequence_offset", {3}, {0, 1, kFrames});
    write_more(file);
    file.commit();
  }
  const Subject subject = subject_of(path);
  Diagnosis d = diagnosis_of(subject);
  const Repaired done = write_repaired(subject, out, d);
  expect_more(out, {0, 1, 2, 3}, *d.transform);
  EXPECT_TRUE(remarked(done, "/skeleton"));
  EXPECT_TRUE(remarked(done, "as they stand")) << "nobody knows what /extra is";
  const Prediction was = read_prediction(path), is = read_prediction(out);
  for (size_t i = 0; i + 2 < was.joints.size(); i += 3) {
    const Vec3 want = (*d.transform)(Vec3(Eigen::Map<const Vec3>(&was.joints[i])));
    EXPECT_TRUE(want.isApprox(Eigen::Map<const Vec3>(&is.joints[i]), 1e-14));
  }
  const Vec3 last = (*d.transform)(Vec3(Eigen::Map<const Vec3>(&was.vertices[3 * 19])));
  EXPECT_TRUE(last.isApprox(Eigen::Map<const Vec3>(&is.vertices[3 * 19]), 1e-6));
  EXPECT_EQ(is.faces, was.faces);
  EXPECT_EQ(is.sequence_offset, was.sequence_offset);
  EXPECT_EQ(h5::File::open(out).dataset("/vertices").value_size(), 4u) << "no larger than it was";

  d.keep_every = 2;  // every frame was there twice
  write_repaired(subject_of(path), out, d);
  expect_more(out, {0, 2}, *d.transform);
  EXPECT_EQ(read_prediction(out).sequence_offset, (std::vector<int64_t>{0, 1, 2}));
  EXPECT_EQ(inspect(out).fps, 15);
}

TEST(DoctorRepair, ScansKeepAllThatTheyHoldOfEveryFrame) {
  const TempDir dir;
  std::filesystem::create_directories(dir / "below");
  const std::string path = dir / "s.h5", out = dir / "below/out.h5";
  {
    const Points points = scan(somebody());
    ScanWriter writer(path, {}, 60);
    Joints joints;
    for (int f = 0; f < kFrames; ++f) {
      for (size_t j = 0; j < joints.size(); ++j) joints[j] = Vec3(f, static_cast<double>(j), 1);
      writer.append(points, joints);
    }
    write_more(writer.file());
    writer.file().write<float>("/normals", {kFrames * std::ssize(points), 1},
                               rising<float>(kFrames * std::ssize(points)));
    writer.commit();
  }
  const Subject subject = subject_of(path);
  Diagnosis d = diagnosis_of(subject);
  d.gap[2] = 2;  // two frames are missing before number 2: they have no points
  const Repaired done = write_repaired(subject, out, d);
  const std::vector<int64_t> rows = {0, 1, 1, 1, 2, 3};
  expect_more(out, rows, *d.transform);
  EXPECT_TRUE(remarked(done, "/normals, /skeleton") || remarked(done, "/skeleton, /normals"));
  const auto joints = h5::File::open(out).read<double>("/joints", {6, kJoints, 3});
  for (size_t k = 0; k < rows.size(); ++k) {
    const Vec3 want = (*d.transform)(Vec3(static_cast<double>(rows[k]), 3, 1));
    EXPECT_TRUE(want.isApprox(Eigen::Map<const Vec3>(&joints[3 * (kJoints * k + 3)]), 1e-6));
  }
  EXPECT_EQ(inspect(out).fps, 60);
  EXPECT_TRUE(verify(out).empty());
  const Repaired folder = write_repaired(subject_of(path), dir / "frames/", d);
  for (const char* name : {"joints", "confidence", "radius", "take/number"})
    EXPECT_TRUE(remarked(folder, name)) << name;
}

/// The confidence of each frame of a repaired file whose frame `empty` has no points, and what is
/// said.
std::vector<double> repaired_without(int empty, std::vector<std::string>* said) {
  const TempDir dir;
  const std::string path = dir / "s.h5", out = dir / "out.h5";
  {
    const Points points = scan(somebody());
    ScanWriter writer(path, {}, 30);
    for (int f = 0; f < kFrames; ++f) writer.append(f == empty ? Points{} : points);
    writer.file().write<float>("/confidence", {kFrames}, {0.25f, 0.5f, 0.75f, 1.0f});
    writer.commit();
  }
  Subject subject = subject_of(path);
  subject.frames = without_empty_frames(std::move(subject.frames));
  Diagnosis d = diagnosis_of(subject);
  d.frames = kFrames - 1;  // that show something
  if (empty < kFrames - 1) d.gap[empty] = 1;
  write_repaired(subject, out, d);
  *said = subject.frames->remarks();
  return h5::File::open(out).read<double>("/confidence", {-1});
}

TEST(DoctorRepair, RowsBesideAnEmptyFrameStayWithTheirFrames) {
  std::vector<std::string> said;
  EXPECT_EQ(repaired_without(1, &said), (std::vector<double>{0.25, 0.5, 0.75, 1.0}));
  EXPECT_EQ(repaired_without(0, &said), (std::vector<double>{0.5, 0.75, 1.0})) << "none in front";
  EXPECT_TRUE(said.empty());
  EXPECT_EQ(repaired_without(3, &said), (std::vector<double>{0.25, 0.5, 0.75}));
  ASSERT_EQ(said.size(), 1u) << "nothing behind it could tell when it was";
  EXPECT_HAS(said[0], "its last 1 frames");
}

}  // namespace
}  // namespace restage
