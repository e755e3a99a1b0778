// One picture for a mesh, from the colours of clouds that it was fitted to.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "infer/render/image.h"
#include "infer/track/atlas.h"

namespace restage {

using PointColour = std::array<float, 3>;  ///< sRGB, 0 to 1

class TextureFit {
 public:
  /// `mesh`: at rest. `size`: rows of the picture.
  TextureFit(Mesh mesh, Atlas atlas, int size);
  /// A cloud, and where the mesh's vertices lie in it, metres. A texel gets a colour where points
  /// are within a centimetre.
  void add(const std::vector<Vec3>& vertices, const std::vector<Vec3>& points,
           const std::vector<PointColour>& colours);
  /// How much of the surface got a colour from any cloud, 0 to 1.
  double seen() const;
  /// Of each texel the median of the clouds that show it, channel by channel. What none shows gets
  /// what is seen about it on the surface. Texels beside a chart have the chart's colours, so that
  /// no seam shows. Grey, if nothing was seen.
  Image picture() const;

 private:
  struct Texel {
    int32_t face;
    std::array<float, 3> share;  ///< of the face's corners
  };
  std::vector<PointColour> vertex_colours(const std::vector<PointColour>& seen) const;
  PointColour median_of(size_t texel) const;

  Mesh mesh_;
  Atlas atlas_;
  int size_;
  std::vector<size_t> places_;  ///< of each texel in the picture
  std::vector<Texel> texels_;
  std::vector<std::vector<std::array<uint8_t, 3>>> samples_;
};

}  // namespace restage
