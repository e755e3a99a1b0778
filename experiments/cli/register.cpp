// restage register: the reference without learning, "register then repose".
#include <memory>

#include "autograd/base/error.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "datasets/readers/frame_folder.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "infer/registration/registration.h"

namespace restage::cli {
namespace {

struct RegisterOptions {
  std::string source, target, rest, out;
  int64_t every = 1;
};

Joints rest_joints(const std::string& path) {
  const Prediction rest = read_prediction(path);
  if (rest.joints.empty() || rest.frames != 1)
    throw InputError(path + ":/joints", "is not one skeleton",
                     "give the target's rest joints as [1, 22, 3]");
  Joints out;
  for (size_t j = 0; j < out.size(); ++j) out[j] = Eigen::Map<const Vec3>(&rest.joints[3 * j]);
  return out;
}

int run_register(const RegisterOptions& o, const Common& common) {
  if (o.every < 1 || o.every > 1000000)
    throw InputError("", "--every is out of range", "give 1 or more frames");
  if (!o.out.ends_with(".h5"))
    throw InputError(o.out, "is of no kind that is written here", "end --out in .h5");
  check_output(o.out, {o.source, o.target, o.rest});
  const auto frames = open_frames(o.source, {"", common.max_memory});
  Mesh target = read_mesh(o.target);
  const std::vector<Triangle> faces = target.faces;
  const auto vertices = static_cast<int64_t>(target.vertices.size());
  Registration registration(std::move(target), rest_joints(o.rest), o.target);

  PredictionWriter writer(o.out, vertices, faces, FileInfo{},
                          frames->fps() / static_cast<double>(o.every));
  int64_t made = 0, sequence = 0, in_sequence = 0;
  while (const auto frame = frames->next()) {
    if (frame->sequence != sequence) {
      writer.end_sequence();
      registration.restart();
      sequence = frame->sequence;
      in_sequence = 0;
    }
    if (in_sequence++ % o.every != 0) continue;
    const RetargetedFrame found = registration.push(frame->points, frame->source);
    writer.append(found.joints, found.vertices);
    log_debug(frame->source + ": registered");
    ++made;
  }
  if (made == 0) throw InputError(o.source, "holds no frames", "give at least one cloud");
  writer.commit();
  if (common.json)
    print_json({{"out", o.out}, {"frames", made}, {"every", o.every}});
  else
    print("wrote " + o.out + ": " + std::to_string(made) + " frames\n");
  return 0;
}

}  // namespace

void add_register(Program& program) {
  const auto o = std::make_shared<RegisterOptions>();
  CLI::App& app = program.add(
      "register", "retarget without learning: register the target to each cloud, then repose it",
      "restage register --source scans.h5 --target hero.ply --rest rest.h5 --out result.h5\n"
      "restage register --source scans.h5 --target hero.ply --rest rest.h5 --every 30 --out one.h5",
      [o, &program] { return run_register(*o, program.common()); });
  app.add_option("--source", o->source, "clouds, as of restage retarget; metres, y up")->required();
  app.add_option("--target", o->target, "mesh or cloud in T-pose, y up, facing +z")->required();
  app.add_option("--rest", o->rest, "the target's 22 rest joints (HDF5, /joints [1, 22, 3])")
      ->required();
  app.add_option("--out", o->out, "X.h5")->required();
  app.add_option("--every", o->every, "only every so many frames of a sequence, from its first");
}

}  // namespace restage::cli
