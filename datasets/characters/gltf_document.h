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
  /// Gives the meshes of a file without skins the skeleton, the skin and the animation of `glb`,
  /// which GlbWriter has made for gltf_mesh(file, gltf_rest(file)); `file`: parse_gltf() of this
  /// document. Everything else stays as it is: pictures, materials, texture coordinates, the order
  /// of vertices. A mesh whose node is moved goes to a node of its own, since a skin ignores that.
  /// `unposed`: what took the meshes to the T-pose for which `glb` was made; null: they stand so.
  /// `vertex`: of each vertex of the meshes the vertex of `glb`; empty: they are the same.
  void wear(const std::string& glb, const Gltf& file, const JointMoves* unposed = nullptr,
            const std::vector<int32_t>& vertex = {});
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
  std::unique_ptr<State> state_;
};

}  // namespace restage
