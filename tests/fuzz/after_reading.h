// What the commands do with what was read, as functions of bytes like the readers (targets.h): the
// doctor and its repair, import, the extractor, retargeting. Work and memory are bounded by the
// longest input.
#pragma once

#include <string>

namespace restage::fuzz {

/// A mesh or cloud: examined as scan or as target, or mended as the user says, written, read and
/// examined again.
void doctor_surface(const std::string& bytes);
/// The frames of an array, examined as one sequence, and the first one mended.
void doctor_sequence(const std::string& bytes);
/// A file whose first byte says its kind (kImported), imported; the data file has no problems.
void import_file(const std::string& bytes);
/// The joints of a cloud, by a small untrained extractor.
void extract(const std::string& bytes);
/// A mesh is the target, its vertices are the source, small untrained networks do the work; a GLB
/// and a BVH file are written.
void retarget(const std::string& bytes);

/// Ends of the names that the first byte stands for: 0 is the first.
inline constexpr const char* kImported[] = {".bvh", ".gltf", ".glb", ".obj", ".ply", ".npy"};

}  // namespace restage::fuzz
