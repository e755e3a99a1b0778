// What `restage doctor` says about scans, surfaces and sequences, draws of them, and writes.
#pragma once

#include <string>

#include "datasets/doctor/examine.h"
#include "experiments/cli/output.h"

namespace restage::cli {

/// What the data's own frame is found to be: unit, metres_per_unit, up and facing ("+z"), height in
/// metres; null where it is unsure (below one half).
Json frame_json(const Diagnosis& diagnosis);
Json to_json(const Finding& finding);
/// {"scale", "rotation" (rows), "offset", "formula"}.
Json to_json(const Similarity& transform);
/// One finding as a few lines of text.
std::string to_text(const Finding& finding);
std::string to_text(const Similarity& transform);

/// Front, side and top of what was found, brought into our frame, and as it is: the person blue,
/// stray points red, somebody or something else orange, marks for floor, height and facing. The
/// bytes of a PNG file that is to be called `out`.
std::string picture_of(const std::string& out, const std::string& title, const Mesh& mesh,
                       const Diagnosis& diagnosis);

/// Writes the repaired file (X.ply, X.obj, X.h5, or a folder) and its transform: in an HDF5 file's
/// attribute `transform`, else in the file returned, X.transform.json beside it; empty for HDF5.
/// InputError if it cannot be told how to repair it; then nothing is written.
std::string write_repaired(const std::string& path, const std::string& out,
                           const Diagnosis& diagnosis, uint64_t max_memory);

}  // namespace restage::cli
