// Shared by the files gltf*.cpp of this folder only.
#pragma once

#include <tiny_gltf.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "autograd/base/error.h"
#include "datasets/readers/gltf/gltf.h"

namespace restage::gltf {

/// Bytes that may still be taken for values of a file. Data may be named any number of times, so
/// what a small file asks for can be without limit.
class Allowance {
 public:
  Allowance(uint64_t payload, std::string path)
      : left_((uint64_t{48} << 20) + 6 * payload), path_(std::move(path)) {}
  void spend(uint64_t count, uint64_t size);

 private:
  uint64_t left_;
  std::string path_;
};

/// The structure as tinygltf reads it, and the bytes it points into.
struct Document {
  std::string path;
  tinygltf::Model model;  ///< without buffers, pictures, materials, extras and extensions
  std::vector<std::string> storage;       ///< what buffers point into, if not into the file
  std::vector<std::string_view> buffers;  ///< as long as they are declared
  std::vector<std::pair<std::string, int>> humanoid;  ///< VRM: name of a bone, number of its node
  std::string standard;                               ///< Gltf::standard
  std::string
      compression;  ///< an extension that is used but not required: data may be there in plain, too
  uint64_t payload = 0;  ///< bytes of the file and of all that it names
  /// JSON, if asked for: the file's "materials", "textures", "images" and "samplers", and per
  /// animation in "ours" whether Restage has written it.
  std::string looks;
};

struct Chunks {
  std::string_view json, binary;
};
/// The parts of a GLB file.
Chunks split_glb(std::string_view content, const std::string& path);
/// The content of a file that a document names: it must lie in the same folder or below.
std::string read_neighbour(const std::string& uri, const std::string& path);
/// Text with "%20" and alike as the bytes that it stands for.
std::string decode_percent(const std::string& text);
std::string decode_data_uri(const std::string& uri, size_t length, const std::string& path);

/// `content` must outlive the document.
Document parse_document(std::string_view content, const std::string& path, bool looks = false);

/// InputError with the command that unpacks such a file.
[[noreturn]] void refuse_compression(const std::string& extension, const std::string& path);
[[noreturn]] void broken(const std::string& path, const std::string& what);
/// `index` as a place in a list of `size`.
size_t checked(int64_t index, size_t size, const std::string& path, const std::string& what);

/// The numbers of accessor `index`, which must be of this type (TINYGLTF_TYPE_...), as floats:
/// normalised integers as the format says, other integers as they are.
std::vector<float> read_floats(const Document& document, int index, int type,
                               const std::string& what, Allowance& allowance);
/// Unsigned integers of any width.
std::vector<uint32_t> read_integers(const Document& document, int index, int type,
                                    const std::string& what, Allowance& allowance);

/// Where the values of primitives came to lie in a Gltf.
struct Runs {
  struct Vertices {
    const tinygltf::Primitive* primitive;
    int node;  ///< a place in Gltf::nodes: the one that shows the mesh
    size_t first, count;
  };
  struct Faces {
    const tinygltf::Primitive* primitive;
    size_t count;
  };
  std::vector<Vertices> vertices;  ///< each after the last
  std::vector<Faces> faces;        ///< each after the last
  std::vector<int> place;          ///< per node of the file: its place in Gltf::nodes
  std::vector<size_t> animations;  ///< per clip: its number in the file
};

/// What read_gltf() gives. With `runs`: as GltfLook::file is, weights of morph targets not read;
/// clips of weights alone are there, and begin at infinity.
Gltf build(const Document& document, Allowance& allowance, Runs* runs = nullptr);

}  // namespace restage::gltf
