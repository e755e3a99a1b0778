// What `restage doctor --fix` writes.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "datasets/doctor/examine.h"
#include "datasets/readers/frames/frame_folder.h"
#include "datasets/schema.h"

namespace restage {

/// What is examined, drawn and repaired: one and the same, whatever file it came from.
struct Subject {
  std::string path;
  std::optional<Mesh> mesh;             ///< one cloud or surface
  std::unique_ptr<FrameSource> frames;  ///< a sequence; everybody reads it from its start
  std::optional<Inspection> stored;     ///< what an HDF5 file says of itself
  std::string taken_as;                 ///< what `mesh` is, if not simply the file's
  Vec3 origin = Vec3::Zero();           ///< what was taken off the file's coordinates
};

/// From the file's frame into ours.
inline Similarity from_file(const Subject& subject, const Similarity& transform) {
  return transform.after({1, Mat3::Identity(), subject.origin});
}

/// The mesh, or frame number `index`.
Mesh frame_of(const Subject& subject, int64_t index);

/// As a JSON document: {"formula", "scale", "rotation" (rows), "offset"}.
std::string to_json(const Similarity& transform);
/// The same read again; nothing if the text is no such document.
std::optional<Similarity> similarity_from(const std::string& json);

enum class RepairKind { ply, obj, hdf5, folder };

/// By the name alone, before anything is read. InputError with the list of what can be written.
RepairKind repair_kind(const std::string& out);

struct Repaired {
  std::string file;
  std::vector<Finding> still_wrong;  ///< what the doctor says against the file (for the caller)
  std::string transform_file;        ///< empty for HDF5, which has it as an attribute
  std::vector<std::string> remarks;  ///< what was left out, or not kept
};

/// Writes the repaired data and its transform: in an HDF5 file's attribute `transform`, else in
/// OUT.transform.json. InputError before anything is written: it cannot be told how to repair it,
/// or a file of that kind cannot hold it.
Repaired write_repaired(const Subject& subject, const std::string& out, const Diagnosis& diagnosis);

}  // namespace restage
