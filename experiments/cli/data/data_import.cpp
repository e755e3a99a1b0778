// restage data import: what users hold, into one data file.
#include <cstdlib>
#include <map>

#include "autograd/base/error.h"
#include "autograd/base/words.h"
#include "datasets/importers/import.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/data/import_text.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/source_options.h"

namespace restage::cli {
namespace {

/// For options that are left out to have them found: what is given must mean something.
std::string positive(const std::string& text) {
  const double value = std::strtod(text.c_str(), nullptr);
  return value > 0 ? "" : "is '" + text.substr(0, 40) + "', but must be above 0";
}
std::string positive_scale(const std::string& text) {
  return metres_per_unit(text) > 0 ? "" : positive(text);
}
std::string not_negative(const std::string& text) {
  return text.starts_with("-") ? "is '" + text.substr(0, 40) + "', but frames count from 0" : "";
}

struct ImportArguments {
  std::string source, out, up = "auto", facing = "auto";
  ImportOptions options;
};

std::string counts_text(const ImportSummary& done) {
  std::vector<std::string> out;
  const auto add = [&](size_t n, const char* what) {
    if (n > 0) out.push_back(cat(n, " ", what));
  };
  add(done.bodies, "bodies");
  add(done.motions, "motions");
  add(done.sequences, "scan sequences");
  add(done.frames, "frames");
  return joined(out);
}

/// "3 files of other kinds: 2 .npz, 1 .txt".
std::string ignored_text(const std::map<std::string, size_t>& ignored) {
  size_t all = 0;
  for (const auto& [end, count] : ignored) all += count;
  const std::string kinds = joined(ignored, [](const auto& one) {
    return cat(one.second, " ",
               one.first.empty() ? std::string("without an ending") : one.first.substr(0, 20));
  });
  return std::to_string(all) + " files of other kinds: " + kinds.substr(0, 300);
}

int run_import(ImportArguments arguments, const Common& common) {
  MotionOptions& motion = arguments.options.motion;
  motion.rest.up = parse_axis(arguments.up, "--up");
  motion.rest.facing = parse_axis(arguments.facing, "--facing");
  if (motion.scale > 1e6 || motion.fps > 1e4)
    throw InputError("", "--scale and --fps must be sensible positive numbers",
                     "leave them out to have them found");
  arguments.options.max_memory = common.max_memory;
  const ImportSummary done = import_data(arguments.source, arguments.out, arguments.options);
  if (common.json) {
    print_json({{"out", arguments.out},
                {"bodies", done.bodies},
                {"motions", done.motions},
                {"frames", done.frames},
                {"sequences", done.sequences},
                {"shapes", done.shapes},
                {"ignored", done.ignored},
                {"skipped", done.skipped},
                {"reports", reports_json(done.reports)}});
    return 0;
  }
  print(reports_text(done.reports, common.verbose));
  print("wrote " + arguments.out + ": " + counts_text(done) + "\n");
  if (done.shapes > 0)
    print("left out " + std::to_string(done.shapes) + " files that hold a shape and no motion\n");
  if (!done.ignored.empty()) print("ignored " + ignored_text(done.ignored) + "\n");
  for (const std::string& file : done.skipped) print("skipped " + file + "\n");
  return 0;
}

}  // namespace

void add_data_import(Program& program, CommandOptions group) {
  auto [app, given] = program.add(
      group, "import", "turn bodies, motions, characters or scans into a data file",
      "restage data import DATA_FOLDER --out real.h5\n"
      "restage data import walk.bvh --subject ann --license CC0-1.0 --out walk.h5\n"
      "restage data import recordings/ --subjects '([^/]+)/.*' --out people.h5\n"
      "restage data import 07_01.amc --asf 07.asf --out walk.h5\n"
      "restage data import hero.glb --license CC0-1.0 --out hero.h5\n"
      "restage data import AMASS/ --body-model smplh/ --out amass.h5\n"
      "restage data import joints.npy --layout coco17 --fps 25 --out seen.h5\n"
      "restage data import wham_output.pkl --body-model SMPL_NEUTRAL.npz --person 3 "
      "--out seen.h5\n"
      "restage data import SMPLX_NEUTRAL.npz --betas zeros people.npz --out bodies.h5\n"
      "restage data import scans/ --fps 60 --scale 0.001 --out scans.h5\n"
      "restage data import --source a.bvh --bones mixamo --up z --facing x --split "
      "test --out a.h5\n"
      "restage data import a.bvh --rest-frame 0 --drop-leading 1 --force --out a.h5\n"
      "restage data import cmu_more/clips30_more.h5 --without ShovelHand --out "
      "more.h5\n"
      "restage data import hero.glb --clip Walk --out walk.h5\n"
      "restage data import depth/ --intrinsics 525,525,319.5,239.5 --depth-scale 0.0002 "
      "--out seen.h5\n"
      "restage data import depth/ --intrinsics camera.json --keep-background --out "
      "room.h5\n"
      "restage data import DATA_FOLDER --garment male_casualsuit04 --out dressed.h5",
      run_import);
  ImportOptions& options = given.options;
  MotionOptions& motion = options.motion;
  app.add_option(
         "--source,SOURCE", given.source,
         "data folder; recording (.bvh, .amc; also .xz); character (.glb, .gltf, .vrm, .vrma, "
         ".fbx); "
         "AMASS motion or body model (.npz); motion of a pose estimator (.npz, .npy, .pkl, .pt); "
         "scans (.ply, .obj, .pcd, .xyz, .csv, .npy, .npz, "
         ".h5); depth pictures (.png, .npz); or a folder of one kind")
      .required();
  app.add_option("--out", given.out, "file to write").required();
  app.add_option("--license", options.license, "licence of the files");
  app.add_option("--subject", motion.subject, "who moves (default: by the file's name)");
  app.add_option("--subjects", options.subjects,
                 "folders: regular expression on a file's path below SOURCE whose first group "
                 "names who moves");
  app.add_option("--split", motion.split, "train, validation or test");
  add_scale(app, motion.scale, "metres per unit of the file", "found; of scans metres")
      .check(positive_scale);
  app.add_option("--fps", motion.fps, "true frame rate (default: the file's, else 30; AMC: 120)")
      .check(positive);
  app.add_option("--up", given.up, "up axis of the file: auto, x, y, z, -x, -y or -z");
  app.add_option("--facing", given.facing,
                 "recordings: axis that the rest pose faces: auto, z, -y ...");
  app.add_option("--rest-frame", motion.rest.frame,
                 "recordings: a frame that is a T-pose (default: -1, the pose without turns)")
      .check(not_negative);
  app.add_option(
         "--drop-leading", motion.drop_leading,
         "recordings: frames to leave out at the beginning (default: the T-pose in front of "
         "the Daz release of CMU)")
      .check(not_negative);
  app.add_option("--bones", motion.profile,
                 "recordings, characters: which bone is which joint, a .yaml file or a known "
                 "family (default: the one that fits)")
      .formerly("--profile");
  add_force(app, motion.force,
            "recordings and characters whose left and right are exchanged, scans of no person's "
            "size or shape, motions of a body model whose numbers look as if they were not metres "
            "and radians");
  app.add_option("--layout", motion.layout,
                 "joints without rotations: their order, such as smpl22, h36m17, coco17, coco133, "
                 "mediapipe33, openpose25, kinect25, azure32 or humanml263 (default: the one that "
                 "fits)");
  app.add_option("--asf", options.asf, "skeleton of .amc files (default: the one beside)");
  app.add_option("--clip", options.clip, "characters: this animation only (default: all)");
  app.add_option("--body-model", options.body_model,
                 "SMPL, SMPL-H or SMPL-X model (.npz), or a folder of them: AMASS needs it, a "
                 "pose estimator's motion then has the person's own skeleton");
  app.add_option("--person", options.person,
                 "of a file with several people's motions this one (default: all)");
  app.add_option("--betas", options.betas,
                 "people of a body model: NPZ or NPY files, or zeros for the mean person");
  app.add_option("--without", options.without,
                 "packed clips: leave out these, by name or by a part of the attribute 'source' "
                 "(the user in user/repository)");
  app.add_option("--intrinsics", options.intrinsics,
                 "depth pictures (folder of 16-bit PNG, .npz, .npy): FX,FY,CX,CY in pixels, or a "
                 "file: text of 4 or 9 numbers, or the camera's JSON (default: the file's own)");
  app.add_option("--depth-scale", options.depth_scale,
                 "depth pictures: metres a unit (default: 0.001 for whole numbers, else 1)")
      .check(positive);
  app.add_flag("--keep-background", options.keep_background,
               "depth pictures: floor, walls and furniture too (default: the person alone)");
  app.add_option("--garment", options.garment,
                 "data folder: dress the bodies (a file of body/clothes) (default: naked)");
}

}  // namespace restage::cli
