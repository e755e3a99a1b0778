// One sequence as a folder of files: what goes in, and the true answer.
#pragma once

#include <string>
#include <vector>

#include "datasets/sampling/evaluation.h"
#include "datasets/schema.h"

namespace restage {

/// Writes into an existing folder:
///   source.h5   A's clouds frame by frame, and A's true joints
///   target.ply  B's T-pose
///   rest.h5     its joints and vertices, one frame (`restage eval --rest`)
///   truth.h5    joints, vertices and, if asked for, world rotations of B performing the motion
/// Frames are made on all threads, a few at a time: memory does not depend on their number.
void write_sequence(const Performance& performance, const FileInfo& info, const std::string& folder,
                    bool rotations = true);

/// The source's own vertices, frame by frame, as FOLDER/source_mesh.h5: for networks that need
/// correspondence.
void write_source_mesh(const Performance& performance, const FileInfo& info,
                       const std::string& folder);

/// The names that write_sequence() writes to.
std::vector<std::string> sequence_files(const std::string& folder);

/// The last three of them. `source_to_world` (may be null): where the source's scans were put.
void write_truth(const Performance& performance, const FileInfo& info, const std::string& folder,
                 const Eigen::Matrix<double, 3, 4>* source_to_world = nullptr,
                 bool rotations = true);

}  // namespace restage
