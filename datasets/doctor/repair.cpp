#include "datasets/doctor/examine.h"

namespace restage {
namespace {

/// The vertices of a mesh that are kept, and the triangles all of whose corners are.
Mesh kept(const Mesh& mesh, const std::vector<bool>& keep) {
  Mesh out;
  std::vector<int32_t> index(mesh.vertices.size(), -1);
  for (size_t i = 0; i < mesh.vertices.size(); ++i)
    if (keep[i]) {
      index[i] = static_cast<int32_t>(out.vertices.size());
      out.vertices.push_back(mesh.vertices[i]);
    }
  for (const Triangle& f : mesh.faces) {
    const Triangle moved = {index[static_cast<size_t>(f[0])], index[static_cast<size_t>(f[1])],
                            index[static_cast<size_t>(f[2])]};
    if (moved[0] >= 0 && moved[1] >= 0 && moved[2] >= 0) out.faces.push_back(moved);
  }
  return out;
}

}  // namespace

Mesh mended(const Mesh& mesh, const Diagnosis& diagnosis) {
  Mesh out = mesh;
  // A surface keeps its vertices (their numbers are what others refer to); a cloud loses what is
  // not the person.
  if (mesh.faces.empty()) {
    const std::vector<size_t> once = distinct(mesh.vertices);
    const Parts parts = find_parts(without_repeats(mesh.vertices));
    std::vector<bool> keep(mesh.vertices.size());
    for (size_t k = 0; k < once.size(); ++k) keep[once[k]] = parts.part[k] == Part::person;
    out = kept(mesh, keep);
  }
  if (diagnosis.transform)
    for (Point& p : out.vertices) p = (*diagnosis.transform)(p);
  return out;
}

}  // namespace restage
