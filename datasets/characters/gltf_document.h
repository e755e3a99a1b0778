// A glTF document as it is written again: its structure, untouched where nobody asks for a change,
// and its bytes.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "datasets/readers/gltf/gltf.h"
#include "nn/geometry/skeleton.h"

namespace restage {

class GltfDocument {
 public:
  /// `content`: of the file `path`, which read_gltf() has accepted; it must outlive the document.
  GltfDocument(std::string_view content, const std::string& path);
  ~GltfDocument();

  struct Clip {
    std::string name;
    double fps;
    size_t frames;
    /// Numbers of nodes and their local rotations (x, y, z, w), one a frame.
    std::vector<std::pair<int, std::vector<std::array<float, 4>>>> turns;
    /// Of all nodes that are turned or moved: translation, rotation (x, y, z, w) and scale, in the
    /// place of a `matrix`, which the format does not let an animation turn.
    std::map<int, std::array<double, 10>> rest;
    /// Numbers of the nodes that are moved, and their translations, 3 numbers a frame.
    std::vector<std::pair<int, std::vector<float>>> moves;
    std::vector<double> confidence;
    std::vector<int64_t> filled;
  };
  void append(const Clip& clip);

  /// How a surface moves beside its bones, in the newest animation: morph targets with weights.
  struct Bulge {
    /// What the surface always has; a target too, so that the meshes stay as they are. As the file
    /// stores vertices.
    Points mean;
    /// Of each target three numbers a vertex, from -127 to 127: units of the file times 127 for a
    /// weight of 1.
    std::vector<std::vector<int8_t>> deltas;
    std::vector<float> weights;  ///< of all targets in the first frame, then in the second, ...
    /// Of each frame, millimetres; less than 0: unknown. And of what is left over.
    std::vector<double> distance;
    double mean_error = 0, p95_error = 0, max_error = 0;
  };
  /// After append(). `file`: parse_gltf() of this document. Targets that meshes have stay, and
  /// come first; their animations stay what they are. Requires KHR_mesh_quantization.
  void bulge(const Bulge& bulge, const Gltf& file);
  /// Gives the meshes of a file without skins the skeleton, the skin and the animation of `glb`,
  /// which GlbWriter has made for gltf_mesh(file, gltf_rest(file)); `file`: parse_gltf() of this
  /// document. Everything else stays as it is: pictures, materials, texture coordinates, the order
  /// of vertices. A mesh whose node is moved goes to a node of its own, since a skin ignores that.
  /// `unposed`: what took the meshes to the T-pose for which `glb` was made; null: they stand so.
  /// `vertex`: of each vertex of the meshes the vertex of `glb`; empty: they are the same. `bulge`:
  /// as bulge(), of the vertices of `glb`; null: none.
  void wear(const std::string& glb, const Gltf& file, const JointMoves* unposed = nullptr,
            const std::vector<int32_t>& vertex = {}, const Bulge* bulge = nullptr);
  /// Drops everything but nodes and scenes; nodes show nothing any more.
  void keep_nodes_only();

  /// InputError where write() would have to replace files of others beside `out`.
  void check_place(const std::string& out) const;
  /// By the ending of `out`: .gltf as text, else binary.
  void write(const std::string& out) const;

 private:
  struct State;
  struct Worn;
  class Tailor;
  class Bulger;
  std::unique_ptr<State> state_;
};

}  // namespace restage
