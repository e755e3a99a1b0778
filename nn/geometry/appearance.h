// What a surface looks like, beside its shape: materials, pictures, texture coordinates, colours.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace restage {

using Uv = Eigen::Vector2f;    ///< texture coordinates: (0, 0) is a picture's upper left corner
using Rgba = Eigen::Vector4f;  ///< linear light and opacity, each 0 to 1

/// A picture as a file holds it: PNG, JPEG or WebP, not decoded.
struct PictureFile {
  std::string name;
  std::string bytes;  ///< empty: it could not be read
};

/// How a picture lies on a surface.
struct Texture {
  enum class Wrap { repeat, mirror, clamp };  ///< what is seen beyond the picture's edges
  int picture = -1;                           ///< which of Appearance::pictures; -1: none
  Wrap across = Wrap::repeat, down = Wrap::repeat;
  bool nearest = false;  ///< texels are seen as squares
  /// The place in the picture is transform (u, v, 1).
  Eigen::Matrix<float, 2, 3> transform = Eigen::Matrix<float, 2, 3>::Identity();
};

/// The part of glTF's materials that is drawn.
struct Material {
  enum class Alpha { opaque, mask, blend };
  std::string name;
  Rgba colour = Rgba::Ones();  ///< times the texture, times the colour of the vertex
  Texture texture;
  Eigen::Vector3f glow = Eigen::Vector3f::Zero();  ///< light of its own, times the picture of it
  Texture glow_texture;
  Alpha alpha = Alpha::opaque;
  float cutoff = 0.5f;  ///< mask: what is less opaque is not there
  bool two_sided = false;
  bool unlit = false;  ///< shown in its colour, whatever the light
};

/// Of a surface with V vertices and F triangles.
struct Appearance {
  std::vector<Material> materials;
  std::vector<PictureFile> pictures;
  std::vector<int32_t> material;  ///< F numbers of materials
  std::vector<Uv> uv;             ///< V; empty: no pictures are drawn
  std::vector<Rgba> colours;      ///< V; empty: white
  /// V numbers of vertices. Vertices with the same number are one point of a smooth surface: where
  /// a picture is cut apart, the file has a vertex for each side of the cut.
  std::vector<int32_t> smooth;
};

}  // namespace restage
