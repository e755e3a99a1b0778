#include "tests/fuzz/after_reading.h"

#include <stdexcept>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/doctor/examine.h"
#include "datasets/importers/import.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/schema.h"
#include "infer/retargeter.h"
#include "infer/writers/bvh.h"
#include "infer/writers/glb.h"
#include "tests/fuzz/targets.h"
#include "tests/support/small_models.h"

namespace restage::fuzz {
namespace {

/// Which of some ways an input is taken: the same for the same bytes.
int way_of(const std::string& bytes, int ways) {
  return std::stoi(checksum(bytes).substr(0, 4), nullptr, 16) % ways;
}

/// Untrained networks, as small as they can be.
const Bundle& tiny_models() {
  static const Bundle models = testing::untrained_bundle("smrm/rot6d", {"hidden=8"});
  return models;
}

/// What is written must be as good as what is read.
void finite(const Points& points) {
  for (const Point& p : points)
    if (!p.allFinite()) throw std::logic_error("a result is not finite");
}

}  // namespace

void doctor_surface(const std::string& bytes) {
  Vec3 origin;
  LeftOut left_out;
  const Mesh mesh = read_mesh(file_of(bytes, "x.obj"), left_out, origin);
  ExamineOptions options;
  const int way = way_of(bytes, 3);
  options.target = way == 1;
  if (way == 2) {
    options.scale = 1;
    options.up = 2;
    options.facing = 4;
  }
  const Diagnosis found = examine_surface(mesh, options);
  if (way != 2) return;
  if (!found.transform) throw std::logic_error("what the user says is not taken");
  const Mesh repaired = mended(mesh, found);
  if (repaired.vertices.empty()) return;
  const std::string out = file_of("", "mended.ply");
  write_ply(out, repaired);
  examine_surface(read_mesh(out, left_out, origin), options);
}

void doctor_sequence(const std::string& bytes) {
  const auto frames = without_empty_frames(open_frames(file_of(bytes, "x.npy")));
  const Diagnosis found = examine_frames(*frames);
  frames->rewind();
  const auto frame = frames->next();
  if (!frame) throw std::logic_error("frames that were examined are gone");
  mended({frame->points, frame->faces}, found);
}

void import_file(const std::string& bytes) {
  if (bytes.empty()) return;
  const auto kind = static_cast<unsigned char>(bytes[0]);
  if (kind >= std::size(kImported)) return;
  const std::string in = file_of(bytes.substr(1), std::string("in") + kImported[kind]);
  const std::string out = file_of("", "out.h5");
  import_data(in, out);
  if (const auto problems = verify(out); !problems.empty())
    throw std::logic_error("what was imported is no good: " + problems[0]);
}

void extract(const std::string& bytes) {
  const Mesh mesh = parse_mesh(bytes, "x.obj");
  for (const Vec3& joint : extract_joints(tiny_models().need_as<SkeletonModel>("skeleton", "w"),
                                          mesh.vertices, "x.obj", {1, 0}, {.samples = 2}))
    if (!joint.allFinite()) throw std::logic_error("a joint is not finite");
}

void retarget(const std::string& bytes) {
  const Mesh mesh = parse_mesh(bytes, "x.obj");
  RetargetOptions options;
  options.force = way_of(bytes, 4) > 0;
  if (!options.force) {
    check_target(mesh, "x.obj");
    check_source({{mesh.vertices, {}}}, "x.obj");
  }
  Retargeter system(tiny_models(), "w", mesh, "x.obj", options);
  GlbWriter glb(file_of("", "out.glb"), mesh, system.rest(), system.rig()->weights);
  BvhWriter bvh(file_of("", "out.bvh"), system.rest());
  for (const float size : {1.0f, 1.01f}) {
    Points cloud = mesh.vertices;
    for (Point& p : cloud) p *= size;
    system.push(cloud, "x.obj", [&](const RetargetedFrame& frame) {
      finite(frame.vertices);
      glb.push(frame.pose);
      bvh.push(frame.pose);
    });
  }
  glb.commit();
  bvh.commit();
}

}  // namespace restage::fuzz
