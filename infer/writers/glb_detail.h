// What files of our own skeletons are made of: nodes, an animation, the binary chunk. Shared by
// GlbWriter and VrmaWriter.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "infer/writers/glb.h"
#include "infer/writers/tracks.h"

namespace restage::glb {

using Json = nlohmann::ordered_json;

enum Component { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };
enum Target { none = 0, vertices = 34962, indices = 34963 };

/// The binary chunk of the file, with the buffer views and accessors that describe its content.
class Buffer {
 public:
  /// Adds `count` elements to the chunk and returns the number of their accessor.
  int add(const void* data, size_t bytes, size_t count, Component component, const char* type,
          Target target);
  /// The same for `count` elements of three bytes and one that says nothing, -127 to 127, which
  /// stand for -1 to 1.
  int add_bytes(const void* data, size_t count);
  /// The same with their bounds.
  int add_bytes(const void* data, size_t count, const std::array<int, 3>& low,
                const std::array<int, 3>& high);
  /// Whole numbers stand for shares of the largest one.
  void set_normalized(int accessor) { accessors_[accessor]["normalized"] = true; }
  /// Writes the least and the largest value into an accessor: the format wants that for positions
  /// and times.
  void set_bounds(int accessor, const std::vector<float>& low, const std::vector<float>& high);
  void describe(Json& root) const;
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

/// The file's nodes: 0 to 21 are the joints, then the convention's extra nodes and its root.
/// Translations are the offsets of the rest joints, in float32.
Json nodes(const Joints& rest, const RigConvention& rig);
/// The number of the node that nothing carries.
int top_node(const RigConvention& rig);
/// Where a program that adds up the nodes of nodes() puts the joints: the sums of what is in the
/// file, which is rounded.
Joints placed_joints(const Json& nodes, const RigConvention& rig);

/// Adds the targets to the file's only mesh, and their weights to its only animation, which has
/// `frames`. `node`: the mesh's.
void add_morphs(Buffer& buffer, const GlbMorphs& morphs, size_t frames, size_t node, Json& root);

/// LINEAR, at `fps`; only the root is translated. `small`: turns are numbers of 16 bits.
Json animation(Buffer& buffer, const Tracks& tracks, const std::string& name, double fps,
               bool small = false);

std::vector<float> three(const Eigen::Vector3f& p);

}  // namespace restage::glb
