#include "datasets/benchmark/sequence.h"

#include "datasets/importers/batches.h"
#include "datasets/readers/clouds/mesh_io.h"

namespace restage {

std::vector<std::string> sequence_files(const std::string& folder) {
  return {folder + "/source.h5", folder + "/target.ply", folder + "/rest.h5", folder + "/truth.h5"};
}

void write_sequence(const Performance& performance, const FileInfo& info, const std::string& folder,
                    bool rotations) {
  ScanWriter scans(folder + "/source.h5", info);
  scans.set_definition(performance.source().definition);
  in_batches<Points>(
      performance.frames(), [&](size_t i) { return performance.cloud(i); },
      [&](size_t i, const Points& cloud) { scans.append(cloud, performance.joints_a(i)); });
  scans.commit();
  write_truth(performance, info, folder, nullptr, rotations);
}

void write_source_mesh(const Performance& performance, const FileInfo& info,
                       const std::string& folder) {
  const Mesh& rest = performance.source().rest;
  PredictionWriter meshes(folder + "/source_mesh.h5", std::ssize(rest.vertices), rest.faces, info);
  meshes.set_definition(performance.source().definition);
  in_batches<Points>(
      performance.frames(), [&](size_t i) { return performance.vertices_a(i); },
      [&](size_t i, const Points& surface) { meshes.append(performance.joints_a(i), surface); });
  meshes.commit();
}

void write_truth(const Performance& performance, const FileInfo& info, const std::string& folder,
                 const Eigen::Matrix<double, 3, 4>* source_to_world, bool rotations) {
  const Body& target = performance.target();
  const int64_t vertices = target.rest.vertices.size();
  PredictionWriter truth(folder + "/truth.h5", vertices, target.rest.faces, info);
  truth.set_definition(target.definition);
  if (source_to_world) truth.set_source_to_world(*source_to_world);
  in_batches<Points>(
      performance.frames(), [&](size_t i) { return performance.vertices_b(i); },
      [&](size_t i, const Points& surface) {
        truth.append(performance.joints_b(i), surface);
        if (rotations) truth.append_rotations(performance.rotations_b(i));
      });
  truth.commit();
  PredictionWriter rest(folder + "/rest.h5", vertices, target.rest.faces, info);
  rest.set_definition(target.definition);
  rest.append(target.joints, target.rest.vertices);
  rest.commit();
  write_ply(folder + "/target.ply", target.rest);
}

}  // namespace restage
