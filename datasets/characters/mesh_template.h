// A target's own PLY or OBJ file with its vertices elsewhere: all else of the file stays.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "nn/geometry/mesh_file.h"

namespace restage {

/// Of a PLY file: its format, colours and all other properties and elements but the normals of its
/// vertices, which would be those of another pose. Of an OBJ file: its lines (faces of any number
/// of corners, groups, texture coordinates, materials) but normals; `mtllib` names the same file as
/// seen from the new folder.
class MeshTemplate {
 public:
  /// Null where `path` is neither PLY nor OBJ by its name, or where the vertices do not lie in it
  /// one by one so that they could be put back (a PLY file whose vertices are not its first element
  /// or are no floats, an OBJ file with lines that are continued). `vertices`: how many were read.
  static std::unique_ptr<const MeshTemplate> of(const std::string& path, size_t vertices);

  MeshFormat format() const { return format_; }
  bool had_normals() const { return had_normals_; }
  /// The file's bytes with these vertices, to be written into `folder`.
  std::string with(const Points& vertices, const std::string& folder) const;

 private:
  struct Place {
    size_t at;  ///< in kept_: the coordinate comes before this byte
    uint8_t axis;
    bool wide;  ///< of a binary file: float64
  };
  bool take_obj(std::string_view content);
  void take_obj_line(std::string_view line);
  bool take_ply(std::string_view content);
  bool take_rows(std::string_view rows, size_t count, const std::vector<std::string>& types,
                 const std::vector<std::string>& names);

  std::string path_;
  MeshFormat format_ = MeshFormat::ply;
  bool had_normals_ = false, text_ = true, big_endian_ = false;
  std::string kept_;           ///< all but coordinates, normals, and what `mtllib` lines say
  std::vector<Place> places_;  ///< in rising order, three a vertex
  std::vector<std::string> libraries_;
};

}  // namespace restage
