#include "datasets/doctor/examine.h"
#include "datasets/readers/clouds/non_finite.h"

namespace restage {
namespace {

std::vector<bool> points_to_keep(const Points& points, const std::optional<Point>& before) {
  const std::vector<size_t> once = distinct(points);
  const Parts parts = find_parts(without_repeats(points), before);
  std::vector<bool> keep(points.size());
  for (size_t k = 0; k < once.size(); ++k) keep[once[k]] = parts.part[k] == Part::person;
  return keep;
}

/// Vertices of the pieces of a surface most of which is the person: a piece is what triangles and
/// equal vertices (seams) hold together, and is kept or left out as a whole.
std::vector<bool> vertices_to_keep(const Mesh& mesh, const std::optional<Point>& before) {
  Pieces pieces(mesh.vertices.size());
  for (const Triangle& f : mesh.faces)
    for (const size_t k : {1, 2}) pieces.join(f[0], f[k]);
  const std::vector<size_t> first = first_equals(mesh.vertices);
  for (size_t i = 0; i < first.size(); ++i) pieces.join(first[i], i);

  const ShapePoints shape = located_shape_points(mesh);
  const Parts parts = find_parts(shape.points, before);
  std::vector<int> votes(mesh.vertices.size());
  std::vector<bool> asked(mesh.vertices.size());
  for (size_t i = 0; i < shape.points.size(); ++i) {
    const size_t piece = pieces.of(shape.vertex[i]);
    votes[piece] += parts.part[i] == Part::person ? 1 : -1;
    asked[piece] = true;
  }
  // Pieces too small to have been looked at go with what they are beside.
  std::vector<size_t> small;
  Points at;
  for (size_t i = 0; i < mesh.vertices.size(); ++i)
    if (const size_t piece = pieces.of(i); !asked[piece]) {
      asked[piece] = true;
      small.push_back(piece);
      at.push_back(mesh.vertices[i]);
    }
  const std::vector<Part> beside = parts_at(at, shape.points, parts);
  for (size_t k = 0; k < small.size(); ++k) votes[small[k]] = beside[k] == Part::person ? 1 : -1;

  std::vector<bool> keep(mesh.vertices.size());
  for (size_t i = 0; i < keep.size(); ++i) keep[i] = votes[pieces.of(i)] >= 0;
  return keep;
}

}  // namespace

Mesh mended(const Mesh& mesh, const Diagnosis& diagnosis, std::optional<Point>* person) {
  const std::optional<Point> before = person != nullptr ? *person : std::nullopt;
  Mesh out = mesh;
  keep_points(
      mesh.faces.empty() ? points_to_keep(mesh.vertices, before) : vertices_to_keep(mesh, before),
      out.vertices, out.faces);
  if (person != nullptr && !out.vertices.empty()) {
    Point middle = Point::Zero();
    for (const Point& p : out.vertices) middle += p / static_cast<float>(out.vertices.size());
    *person = middle;
  }
  if (diagnosis.transform)
    for (Point& p : out.vertices) p = (*diagnosis.transform)(p);
  return out;
}

}  // namespace restage
