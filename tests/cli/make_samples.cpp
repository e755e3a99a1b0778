// Writes small files as users hold them, in the styles that the importers' tests have, into a
// folder:
//   make_samples FOLDER
// tests/cli/test_import.py imports each of them.
#include <filesystem>
#include <iostream>

#include "autograd/base/atomic_file.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "tests/datasets/gltf_maker.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/datasets/smpl_support.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  write_file_atomically(path.string(), bytes);
}

/// A toy that walks for two seconds, in the styles of four data sets.
void bvh(const fs::path& folder) {
  for (const std::string family : {"mixamo", "lafan1", "100style", "soma"}) {
    bvh_test::Style style;
    style.names = bvh_test::names_of(family, family == "mixamo" ? "mixamorig:" : "");
    style.walks = true;
    style.fps = family == "100style" ? 60 : family == "soma" ? 120 : 30;
    style.frames = static_cast<int>(2 * style.fps) + 1;
    if (family == "lafan1") style.bind = bvh_test::bones_along_x();
    style.wrapped = style.moving_root = family == "soma";
    write(folder / (family + ".bvh"), bvh_test::text(style));
  }
}

void characters(const fs::path& folder) {
  using namespace testing;
  const KnownCharacter known = known_character();
  write(folder / "mixamo.glb", CharacterMaker(known, mixamo_style()).parts.glb());
  write(folder / "unreal.glb", CharacterMaker(known, unreal_style()).parts.glb());
  write(folder / "hero.vrm", vrm_parts(known, false).glb());
}

/// SMPL-H and SMPL-X of a few dozen vertices, and motions in both layouts of AMASS.
void amass(const fs::path& folder) {
  test::TinySmpl h, x;
  x.family = SmplFamily::smplx;
  write(folder / "models/SMPLH_FEMALE.npz", h.file());
  write(folder / "models/SMPLX_NEUTRAL.npz", x.file());
  test::TinyClip walk, turn;
  turn.family = SmplFamily::smplx;
  turn.rate_key = "mocap_frame_rate";
  turn.gender = "neutral";
  turn.fps = 60;
  turn.type = true;
  write(folder / "AMASS/ann/walk_poses.npz", walk.file());
  write(folder / "AMASS/ben/turn_stageii.npz", turn.file());
  write(folder / "AMASS/ben/shape.npz",
        test::npz({{"betas", test::npy<double>({4}, {0.5, 0, -1, 1})}}));
}

/// A body that performs a motion, frame by frame: vertices as 4D-DRESS and CAPE lay them out.
void scans(const fs::path& folder) {
  const Body body = testing::tiny_body("person", "train");
  const Motion motion = testing::tiny_motion("walk", "person", "train", 12);
  const std::string take = "4D-DRESS/00122/Inner/Take9/Scans", hips = "CAPE/00032_shortlong_hips";
  std::vector<float> all;
  for (size_t f = 0; f < motion.frames(); ++f) {
    const Points points = pose_surface(body, pose_on(motion, body, f));
    std::vector<float> flat;
    for (const Point& p : points) flat.insert(flat.end(), p.data(), p.data() + 3);
    all.insert(all.end(), flat.begin(), flat.end());
    const std::string number = std::to_string(100001 + f).substr(1);
    const auto n = static_cast<int64_t>(points.size());
    write(folder / hips / ("hips." + number + ".npz"),
          test::npz({{"pose", test::npy<float>({72}, std::vector<float>(72, 0))},
                     {"v_posed", test::npy<float>({n, 3}, flat)}}));
    fs::create_directories(folder / take);
    write_ply((folder / take / ("mesh-f" + number + ".ply")).string(), {points, body.rest.faces});
    if (f + 1 == motion.frames())
      write(folder / "walk.npy", test::npy<float>({static_cast<int64_t>(f) + 1, n, 3}, all));
  }
}

}  // namespace
}  // namespace restage

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: make_samples FOLDER");
  for (const auto make : {restage::bvh, restage::characters, restage::amass, restage::scans})
    make(argv[1]);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "make_samples: " << error.what() << "\n";
  return 1;
}
