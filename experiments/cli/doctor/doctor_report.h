// What `restage doctor` says about scans, surfaces and sequences, and draws of them.
#pragma once

#include <optional>
#include <string>

#include "datasets/doctor/examine.h"
#include "datasets/doctor/mended_file.h"
#include "experiments/cli/output.h"

namespace restage::cli {

/// What the data's own frame is found to be: unit, metres_per_unit, up and facing ("+z"), degrees
/// turned from there to the person's left, height in metres; null where it is unsure (below one
/// half).
Json frame_json(const Diagnosis& diagnosis);
Json to_json(const Finding& finding);
/// {"file", "transform_file", "usable", "still_wrong", "remarks"}.
Json to_json(const Repaired& repaired);
/// One finding as a few lines of text.
std::string to_text(const Finding& finding);
/// `of`: what it moves, if not the file as it is.
std::string to_text(const Similarity& transform, const std::string& of);
std::string to_text(const Repaired& repaired);

/// Of what lies far from the origin: `origin` was taken off the file's coordinates, of which
/// `points` are left, those of the first frame. Nothing if it is zero.
std::optional<Finding> far_from_origin(const Vec3& origin, const Points& points);

/// Front, side and top of what was found, brought into our frame, and as it is: the person blue,
/// stray points red, somebody or something else orange, marks for floor, height and facing. The
/// bytes of a PNG file that is to be called `out`.
std::string picture_of(const std::string& out, const std::string& title, const Mesh& mesh,
                       const Diagnosis& diagnosis);

}  // namespace restage::cli
