// Shared by the doctor's examinations of single surfaces and of sequences; internal.
#pragma once

#include "datasets/doctor/examine.h"

namespace restage::doctor_detail {

inline constexpr size_t kEnoughPoints = 64;  // distinct points that the skeleton extractor needs
inline constexpr double kUnsure = 0.5;       // a lower probability is called unsure
inline constexpr double kSure = 0.9;         // from here on a fault is wrong, below a note
inline constexpr double kVerySure = 0.98;    // from here on retargeting refuses
inline constexpr double kTPoseAngle = 30;    // degrees, as the retargeter asks
inline constexpr double kOneSided = 0.75;
inline constexpr double kLevel =
    0.003;  // share of a cloud's points that noise puts under the floor

/// Unit and orientation as found, or as the options say. InputError for options that contradict.
void recognise(Diagnosis& d, double size, const OrientationVote& vote,
               const ExamineOptions& options);
void judge_units(Diagnosis& d);
void judge_up(Diagnosis& d, size_t clouds);
void judge_facing(Diagnosis& d, bool target);
/// Transform, height and floor; heights along the up axis found, in the data's units.
void judge_frame(Diagnosis& d, double lowest, double highest);
void judge_points(Diagnosis& d, size_t distinct);
/// `where` is added to each sentence (" in frame 7"), and may be empty.
void judge_duplicates(Diagnosis& d, size_t repeats, bool cloud, const std::string& where);
void judge_parts(Diagnosis& d, const PersonShape& shape, const std::string& where);

}  // namespace restage::doctor_detail
