// Damaged files: a few hundred seeded mutations of valid PLY, OBJ, NPY, NPZ and HDF5 bytes. A
// reader may succeed or throw InputError; anything else (a crash, another exception) fails. The
// sanitizer build runs the same test.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/importers/amass.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/schema.h"
#include "tests/datasets/schema_support.h"
#include "tests/datasets/smpl_support.h"
#include "tests/fuzz/old_layout.h"

#if defined(__SANITIZE_ADDRESS__)
// The HDF5 library itself forgets some memory when it refuses a damaged file.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\n"; }
#endif

namespace restage {
namespace {

/// One to four random edits: a bit, a byte, a number of eight bytes, a cut, a removal, a repeat.
std::string mutate(std::string bytes, Rng& rng) {
  for (uint64_t edits = 1 + rng.below(4); edits > 0 && !bytes.empty(); --edits) {
    const size_t at = rng.below(bytes.size());
    const size_t n = std::min<size_t>(1 + rng.below(16), bytes.size() - at);
    switch (rng.below(6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << rng.below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(rng.below(256));
        break;
      case 2:
        bytes.replace(at, n, n, rng.below(2) ? '\xff' : '9');
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.erase(at, n);
        break;
      default:
        bytes.insert(at, bytes.substr(at, n));
        break;
    }
  }
  return bytes;
}

/// Runs `read` on mutations of the file's bytes; how many were read and how many refused.
template <class Read>
std::pair<int, int> attack(const std::string& original, const std::string& target, int rounds,
                           uint64_t seed, const Read& read) {
  const std::string valid = test::bytes_of(original);
  std::pair<int, int> outcome = {0, 0};
  for (int round = 0; round < rounds; ++round) {
    Rng rng(RngKey{seed, static_cast<uint64_t>(round)});
    std::filesystem::remove(target);  // much faster than cutting the old one to nothing
    test::write_bytes(target, mutate(valid, rng));
    try {
      read(target);
      ++outcome.first;
    } catch (const InputError& error) {
      ++outcome.second;
      const std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      EXPECT_LT(text.size(), 390u) << text;
    } catch (const std::exception& error) {
      ADD_FAILURE() << "seed " << seed << " round " << round << ": " << error.what();
    }
  }
  return outcome;
}

Mesh patch() {
  Mesh mesh;
  for (int i = 0; i < 64; ++i) {
    mesh.vertices.emplace_back(0.1f * static_cast<float>(i % 8), std::sin(static_cast<float>(i)),
                               0.5f);
    if (i >= 2) mesh.faces.push_back({i - 2, i - 1, i});
  }
  return mesh;
}

TEST(ReadersFuzz, DamagedPlyAndObj) {
  const test::TempDir dir;
  const Mesh mesh = patch();
  write_ply(dir / "a.ply", mesh);
  write_obj(dir / "a.obj", mesh);
  std::string ascii =
      "ply\nformat ascii 1.0\nelement vertex 64\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Point& p : mesh.vertices)
    ascii += std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n";
  test::write_bytes(dir / "b.ply", ascii + "4 0 1 2 3\n");
  const auto read = [](const std::string& path) { read_mesh(path); };
  for (const char* name : {"a.ply", "b.ply", "a.obj"}) {
    const std::string original = dir / name;
    const auto [good, refused] =
        attack(original, dir / ("x" + original.substr(original.size() - 4)), 500, 7, read);
    EXPECT_GT(good, 0) << name;
    EXPECT_GT(refused, 50) << name;
  }
}

TEST(ReadersFuzz, DamagedArrays) {
  const test::TempDir dir;
  const std::vector<float> values(2 * 64 * 3, 0.5f);
  const std::string cloud = test::npy<float>({2, 64, 3}, values);
  test::write_bytes(dir / "a.npy", cloud);
  test::write_bytes(dir / "a.npz", test::npz({{"points", cloud}, {"fps", test::npy_text("30")}}));
  test::write_bytes(dir / "b.npz", test::npz({{"points", cloud}}, false));
  const auto frames = [](const std::string& path) {
    const std::unique_ptr<FrameSource> source = open_frames(path);
    while (source->next()) {
    }
  };
  for (const char* name : {"a.npy", "b.npz"}) {
    const std::string original = dir / name;
    const auto [good, refused] =
        attack(original, dir / ("x" + original.substr(original.size() - 4)), 500, 19, frames);
    // An archive's checksums let nothing pass.
    EXPECT_TRUE(good > 0 || original.ends_with(".npz")) << name;
    EXPECT_GT(refused, 50) << name;
  }
  EXPECT_EQ(attack(dir / "a.npz", dir / "x.npz", 300, 20, frames).first, 0);  // no number as fps
}

/// Damage inside the arrays, which an archive's checksums would keep from the importers.
TEST(ReadersFuzz, DamagedMotionsAndModels) {
  const test::TempDir dir;
  test::TinyClip clip;
  clip.frames = 3;
  const test::TinySmpl model;
  test::write_bytes(dir / "model.npz", model.file());
  BodyModels models(dir / "model.npz");
  int refused = 0;
  for (uint64_t round = 0; round < 600; ++round) {
    Rng rng(RngKey{23, round});
    const bool motion = round % 2 == 0;
    auto arrays = motion ? clip.arrays() : model.arrays();
    std::string& bytes = arrays[rng.below(arrays.size())].second;
    bytes = mutate(bytes, rng);
    std::filesystem::remove(dir / "x.npz");
    test::write_bytes(dir / "x.npz", test::npz(arrays, false));
    try {
      ImportReport report;
      if (motion)
        import_amass(Npz(dir / "x.npz"), models, {}, report);
      else
        SmplModel(dir / "x.npz").body({1, 2});
    } catch (const InputError& error) {
      ++refused;
      EXPECT_LT(std::string(error.what()).size(), 390u) << error.what();
    }
  }
  EXPECT_GT(refused, 100);
}

/// Reads a file in every way there is; the first refusal ends it.
void read_everything(const std::string& path) {
  inspect(path);
  verify(path);
  const std::unique_ptr<FrameSource> frames = open_frames(path);
  while (frames->next()) {
  }
}

TEST(ReadersFuzz, DamagedHdf5) {
  const test::TempDir dir;
  {
    ScanWriter scans(dir / "s.h5", {});
    PredictionWriter prediction(dir / "p.h5", 64, patch().faces, {});
    for (int f = 0; f < 3; ++f) {
      scans.append(patch().vertices);
      prediction.append(Joints{}, patch().vertices);
    }
    scans.commit();
    prediction.commit();
    Body body;
    body.id = "a";
    body.split = "train";
    body.rest = patch();
    body.weights.setZero(64, kJoints);
    body.weights.col(3).setOnes();
    Motion motion;
    motion.id = "m";
    motion.global.resize(5);
    for (auto& frame : motion.global) frame.fill(Eigen::Quaternionf::Identity());
    motion.hips.assign(5, Point::UnitY());
    motion.rest.fill(Vec3::Ones());
    body.joints.fill(Vec3::Ones());
    write_dataset(dir / "d.h5", {body}, {motion}, {});
  }
  const auto [scan_good, scan_refused] =
      attack(dir / "s.h5", dir / "x.h5", 300, 11, read_everything);
  EXPECT_GT(scan_refused, 50);
  const auto [good, refused] = attack(dir / "p.h5", dir / "x.h5", 300, 12, read_everything);
  EXPECT_GT(refused, 50);
  const auto read_dataset = [](const std::string& path) {
    inspect(path);
    read_bodies(path);
    read_motions(path);
  };
  const auto [set_good, set_refused] = attack(dir / "d.h5", dir / "x.h5", 300, 13, read_dataset);
  EXPECT_GT(set_refused, 50);
  RecordProperty("read", scan_good + good + set_good);
}

TEST(ReadersFuzz, DamagedHdf5OfTheOldLayout) {
  const test::TempDir dir;
  test::write_old_layout(dir / "old.h5");
  EXPECT_EQ(read_prediction(dir / "old.h5").frames, 6);
  const auto [good, refused] = attack(dir / "old.h5", dir / "x.h5", 200, 17,
                                      [](const std::string& path) { read_prediction(path); });
  EXPECT_GT(good, 0);
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace restage
