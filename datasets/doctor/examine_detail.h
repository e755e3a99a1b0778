// Shared by the doctor's examinations of single surfaces and of sequences; internal.
#pragma once

#include "datasets/doctor/examine.h"

namespace restage::doctor_detail {

inline constexpr size_t kEnoughPoints = 64;  // distinct points that the skeleton extractor needs
inline constexpr double kUnsure = 0.5;       // a lower probability is called unsure
inline constexpr double kNobody = 1.0 / 3;   // of the up axis: not even a person is seen
inline constexpr double kSure = 0.9;         // from here on a fault is wrong, below a note
inline constexpr double kVerySure = 0.98;    // from here on retargeting refuses
inline constexpr double kTPoseAngle = 30;    // degrees, as the retargeter asks
inline constexpr double kLegAngle = 25;      // degrees from straight down; seated legs have 35
inline constexpr double kOneSided = 0.75;
inline constexpr double kTurnMatters = 20;  // degrees: less is as exact as the angle that is found
inline constexpr double kLevel =
    0.003;  // share of a cloud's points that noise puts under the floor

/// What is measured of somebody, in one frame or many.
struct Seen {
  double size = 0;  ///< PersonShape::size; of many frames the median
  OrientationVote vote;
  double stray_share = 0;  ///< of all points
};

/// Unit and orientation as found, or as the options say. InputError for options that contradict.
void recognise(Diagnosis& d, const Seen& seen, const ExamineOptions& options);
void judge_units(Diagnosis& d, bool target);
void judge_up(Diagnosis& d, const Seen& seen, const ExamineOptions& options, size_t clouds);
void judge_facing(Diagnosis& d, const ExamineOptions& options);
/// Transform, height and floor; heights along the up axis found, in the data's units. `planes`: in
/// view.
void judge_frame(Diagnosis& d, double lowest, double highest, const std::vector<FlatPlane>& planes);
void judge_points(Diagnosis& d, size_t distinct);
/// Of clouds: whether a person's points (of many frames the median) are too few for the confidence.
void judge_sparse(Diagnosis& d, size_t points, bool many);
/// Of one cloud: whether it is the path of one point.
void judge_path(Diagnosis& d, const Points& points);
/// Scale and axes are of no consequence but for the up axis; a target must be in T-pose.
void judge_pose(Diagnosis& d, const PersonShape& shape, const ExamineOptions& options);
/// `where` is added to each sentence (" in frame 7"), and may be empty.
void judge_duplicates(Diagnosis& d, size_t equal, bool cloud, const std::string& where);
void judge_plane(Diagnosis& d, const Parts& parts, const std::string& where);
void judge_parts(Diagnosis& d, const PersonShape& shape, const std::string& where);

/// All of it for one cloud or surface, `equal` of whose points are repetitions.
Diagnosis judge_surface(const Mesh& mesh, const PersonShape& shape, size_t equal,
                        const ExamineOptions& options);

}  // namespace restage::doctor_detail
