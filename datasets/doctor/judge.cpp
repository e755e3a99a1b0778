// The doctor's judgements: from what was measured to findings.
#include <algorithm>
#include <cmath>

#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/pose.h"
#include "datasets/doctor/words.h"
#include "datasets/readers/clouds/point_path.h"
#include "nn/models/extraction.h"

namespace restage {

namespace doctor_detail {

namespace {

constexpr double kFloorMatters = 0.05;  // metres; less is noise, or a shoe's sole
constexpr double kPoseSure = 0.75;      // of the up axis: seated people are seldom more certain
constexpr double kPlaneMatters = 0.03;  // share of all points
constexpr double kNearlyLevel = 0.8;    // cosine: a floor, as a sensor that looks down sees it
constexpr double kTiltMatters = 2;      // degrees

}  // namespace

void recognise(Diagnosis& d, const Seen& seen, const ExamineOptions& options) {
  d.size = seen.size;
  d.unit = guess_unit(seen.size);
  d.orientation = seen.vote.result();
  // Another unit than metres is told by a person's size: only where a person is seen.
  const double by_chance = 1.0 / kDirections.size();
  if (d.unit.unit.metres != 1)
    d.unit.sure *= std::max(0.0, (d.orientation.up_sure - by_chance) / (1 - by_chance)) *
                   (1 - seen.stray_share);
  if (options.joints) {
    d.unit = {kUnits[0], 1};
    d.orientation = {2, 1, 4, 1};
  } else if (options.y_up) {
    d.orientation = seen.vote.result(2);
  }
  if (options.scale) d.unit = {{"", *options.scale}, 1};
  if (options.up && !(options.joints && *options.up == 2))
    d.orientation = seen.vote.result(*options.up);
  if (!options.facing) return;
  if (*options.facing / 2 == d.orientation.up / 2)
    throw InputError("",
                     cat("nobody whose head points along ", kDirections[d.orientation.up],
                         " faces ", kDirections[*options.facing]),
                     "give two directions at right angles, {up} and {facing}");
  d.orientation.facing = *options.facing;
  d.orientation.facing_sure = 1;
  d.orientation.turned = d.orientation.turned_sure = 0;
}

void judge_units(Diagnosis& d, bool target) {
  const UnitGuess& guess = d.unit;
  Finding f{"units", Weight::fact, "", guess.sure, "", ""};
  f.evidence = "half of the points lie within " + number(d.size) +
               " units of the middle; of people it is 0.26 to 0.63 m in any pose";
  // What is metres, or is taken as such.
  const double taken = *guess.unit.name == 0 ? guess.unit.metres : 1;
  const bool sized = is_person_sized(d.size * taken);
  if (!sized) f.weight = Weight::wrong;
  const std::string tall = "somebody about " + number(d.size * taken / kSizeOfHeight) + " m tall";
  if (*guess.unit.name == 0) {
    f.what = "1 unit is " + number(guess.unit.metres) + " m, as given";
    if (!sized) f.what += ", which makes " + tall;
    const UnitGuess found = guess_unit(d.size);
    if (!sized && found.sure >= kUnsure)
      f.fix = "{scale} " + number(found.unit.metres) + " makes a person of it";
  } else if (guess.sure < kUnsure) {
    if (sized) f.weight = Weight::note;
    f.what = "no unit (m, dm, inch, cm, mm) clearly makes a person of it";
    if (!sized && d.size > 0) f.what += "; in metres it is " + tall;
    f.fix = "give metres per unit with {scale} if they are not metres";
  } else if (guess.unit.metres == 1) {
    f.what = "metres";
  } else {
    f.what = cat("1 unit is 1 ", guess.unit.name, ", not 1 m");
    f.fix = target ? "{fix} makes metres of it"
                   : "{fix}; or give retarget {scale} " + number(guess.unit.metres);
  }
  d.say(f);
}

void judge_up(Diagnosis& d, const Seen& seen, const ExamineOptions& options, size_t clouds) {
  const Orientation o = d.orientation;
  Finding f{"up", Weight::fact, cat(kDirections[o.up], " is up"), o.up_sure, "", ""};
  f.evidence = "where a person's points lie, in 144 attitudes" +
               (clouds > 1 ? ", over " + counted(clouds, "frame") : std::string());
  const Orientation shape = seen.vote.result();
  if (options.joints && o.up == 2) {
    f.evidence = "the rig's joints";
  } else if (options.y_up && !options.up) {
    f.evidence = "the format says so";
    if (shape.up != 2 && shape.up_sure >= kUnsure) {
      f.weight = Weight::note;
      f.what += cat(", though its shape looks as if ", kDirections[shape.up], " were");
      f.fix = "say it with {up} if the shape is right";
    }
  } else if (o.up_sure < kNobody) {
    f.weight = Weight::wrong;
    f.what = "nobody can be made out, and which axis is up cannot be told";
    f.fix = "is it one whole person, and nothing else? If so, say {up}";
  } else if (o.up_sure < kUnsure) {
    f.weight = Weight::note;
    f.what = cat("which axis is up cannot be told (perhaps ", kDirections[o.up], ")");
    f.fix = "say it with {up}; is it one whole person?";
  } else if (o.up != 2) {
    // What is of no person's size may be no person: then only a note.
    f.weight = o.up_sure >= kSure && d.unit.sure >= kUnsure ? Weight::wrong : Weight::note;
    f.what += ", not +y";
    if (o.up_sure >= kSure || options.target) {
      f.fix = o.up == 4 && !options.target ? "{fix} turns it; or give retarget {source-up} z"
                                           : "{fix} turns it";
    } else {
      // Somebody who crawls or lies looks like that, too, and a target has to stand.
      f.what = cat(kDirections[o.up], " may be up, not +y");
      f.fix = cat("{fix} leaves it as it is; say {up}=", kDirections[o.up], " if so");
      d.orientation = seen.vote.result(2);
      d.orientation.up_sure = kUnsure;
    }
  }
  d.say(f);
}

/// Whether a repair turns by the very angle.
bool turns_exactly(const Orientation& o) {
  return o.is_turn_sure() && std::abs(o.turned) > kTurnMatters;
}

void judge_facing(Diagnosis& d, const ExamineOptions& options) {
  const Orientation& o = d.orientation;
  if (o.up_sure < kUnsure) return;
  Finding f{"facing", Weight::fact, "", o.facing_sure, "", ""};
  f.evidence = options.joints && o.up == 2
                   ? "the rig's joints"
                   : "feet, knees, seat and chest are not the same before and behind";
  if (o.facing_sure < kUnsure && !o.is_turn_sure()) {
    f.weight = Weight::note;
    f.what = cat("which way the person faces cannot be told (perhaps ", kDirections[o.facing], ")");
  } else {
    f.what = cat("faces ", kDirections[o.facing]);
    if (std::abs(o.turned) > kTurnMatters)
      f.what += ", turned by about " + number(std::round(std::abs(o.turned) / 5) * 5) +
                " degrees to their " + (o.turned > 0 ? "left" : "right");
    if (turns_exactly(o)) f.fix = "{fix} turns it by that angle";
    // With another up axis the turn is part of that repair.
    if (options.target && o.up == 2 && o.facing != 4) {
      f.weight = o.facing_sure >= kSure ? Weight::wrong : Weight::note;
      f.fix = "{fix} turns it; a target has to face +z";
    }
  }
  d.say(f);
}

/// The proper turn: as found where that is sure, else as few axes exchanged as possible.
Mat3 best_turn(const Orientation& o) {
  if (o.facing_sure >= kUnsure || o.is_turn_sure()) return o.turn();
  Orientation guess = o;
  Mat3 best = Mat3::Zero();
  for (guess.facing = 0; guess.facing < 6; ++guess.facing)
    if (guess.facing / 2 != o.up / 2 && (best.isZero() || guess.turn().trace() > best.trace()))
      best = guess.turn();
  return best;
}

/// Heights that people have, and what it may be that has another. In a pose people are less tall,
/// and with raised arms more.
Finding height_finding(const Diagnosis& d) {
  constexpr double kLeast = 1.1, kMost = 2.2, kNearOne = 0.03;  // metres
  Finding f{"height",
            Weight::fact,
            number(d.height) + " m from the floor to the top",
            1,
            "in the pose that it shows",
            ""};
  if (d.height >= kLeast && d.height <= kMost) return f;
  f.weight = Weight::note;
  if (std::abs(d.height - 1) < kNearOne) {
    f.what += ", as clouds have that were scaled to height 1";
  } else if (d.height < kLeast) {
    f.what += ", which is a small child, somebody who crouches, or units that are not quite metres";
  } else {
    f.what += ", which is nobody unless arms are raised: units that are not quite metres";
  }
  f.fix = "if a person of 1.7 m should stand there, {scale} " +
          number(d.unit.unit.metres * 1.7 / d.height) + " makes it so";
  return f;
}

/// Turns the frame so that a floor in view is level, and at 0: that says more exactly which way is
/// up than a person does.
void level(Diagnosis& d, const std::vector<FlatPlane>& planes, Similarity& t) {
  for (const FlatPlane& plane : planes) {
    if (plane.normal.dot(direction(d.orientation.up)) < kNearlyLevel) continue;
    const Vec3 normal = t.rotation * plane.normal;
    const double tilt = std::acos(std::clamp(normal.y(), -1.0, 1.0)) * 180 / 3.14159265358979;
    if (tilt < kTiltMatters) return;
    t.rotation =
        Eigen::Quaterniond::FromTwoVectors(normal, Vec3::UnitY()).toRotationMatrix() * t.rotation;
    t.offset = plane.offset * plane.normal;
    d.say({"tilt", Weight::note, "the floor is tilted by " + number(std::round(tilt)) + " degrees",
           0.95, "the plane under the person", "{fix} levels it"});
    return;
  }
}

void judge_frame(Diagnosis& d, double lowest, double highest,
                 const std::vector<FlatPlane>& planes) {
  if (d.unit.sure < kUnsure || d.orientation.up_sure < kUnsure) {
    d.say({"transform", Weight::note, "how to bring it into our frame cannot be told", 1,
           "units or up axis are unsure", ""});
    return;
  }
  Similarity t;
  t.scale = d.unit.unit.metres;
  const bool exactly = turns_exactly(d.orientation);
  t.rotation = exactly ? d.orientation.exact_turn() : best_turn(d.orientation);
  if (exactly) d.turned = d.orientation.turned;
  d.height = t.scale * (highest - lowest);
  const double floor = t.scale * lowest;
  if (std::abs(floor) > kFloorMatters) t.offset = lowest * direction(d.orientation.up);
  level(d, planes, t);
  d.transform = t;
  d.say(height_finding(d));
  Finding f{"floor", Weight::fact, "at 0", 1, "lowest points of the person", ""};
  if (!t.offset.isZero()) {
    f.weight = Weight::note;
    f.what = "at " + number(floor) + " m, not 0";
    f.fix = "{fix} moves it";
  }
  d.say(f);
}

void judge_points(Diagnosis& d, size_t distinct) {
  if (distinct >= kEnoughPoints) return;
  d.say({"points", Weight::wrong,
         cat("only ", distinct, " distinct points; networks need ", kEnoughPoints), 1, "counted",
         "scan it more finely"});
}

void judge_sparse(Diagnosis& d, size_t points, bool many) {
  if (points >= kEnoughToTrust || points < kEnoughPoints) return;
  d.say(
      {"sparse", Weight::note,
       cat(points, " points show the person", many ? " in a frame (median)" : "",
           ": too few for the confidence, which then promises too much"),
       1,
       cat("counted; of clouds that show one side it can be trusted from ", kEnoughToTrust, " on"),
       "come nearer, or join what several scanners see"});
}

void judge_path(Diagnosis& d, const Points& points) {
  if (!is_path(points)) return;
  d.say(
      {"path", Weight::wrong, kPath, 0.99, "each is near the one before, in even steps", kPathFix});
}

void judge_plane(Diagnosis& d, const Parts& parts, const std::string& where) {
  if (parts.flat == 0) return;
  const double share = static_cast<double>(parts.flat) / static_cast<double>(parts.part.size());
  const bool level =
      std::abs(parts.planes[0].normal.dot(direction(d.orientation.up))) > kNearlyLevel;
  const char* what = d.orientation.up_sure < kUnsure ? "a floor or a wall"
                     : level                         ? "a floor"
                                                     : "a wall";
  d.say(
      {"plane", share >= kPlaneMatters ? Weight::wrong : Weight::note,
       cat(what, " is in view (", counted(parts.flat, "point"), ", ", per_cent(share), ")", where),
       0.95, "points in one plane that reaches far beyond the person", "{fix} removes it"});
}

void judge_parts(Diagnosis& d, const PersonShape& shape, const std::string& where) {
  const Parts& parts = shape.parts;
  const auto all = static_cast<double>(parts.part.size());
  judge_plane(d, parts, where);
  const double metres = d.unit.sure >= kUnsure ? d.unit.unit.metres : 1;
  if (parts.stray > 0)
    d.say({"outliers", Weight::note,
           counted(parts.stray, "stray point") + " (" +
               per_cent(static_cast<double>(parts.stray) / all) + ")" + where,
           1, "far from all others", "{fix} removes them"});
  if (parts.other > 0) {
    const auto person = static_cast<double>(shape.points.size());
    const bool somebody = static_cast<double>(parts.largest_other) > 0.4 * person;
    Finding f{"others",
              somebody ? Weight::wrong : Weight::note,
              "",
              0.9,
              "",
              somebody ? "{fix} removes it; retarget --person N follows one of them"
                       : "{fix} removes it"};
    f.what = (somebody ? "a second person" : "part of somebody or something else") +
             (" (" + counted(parts.other, "point")) + ")" + where;
    f.evidence = "a separate piece, " + number(parts.gap * metres) +
                 (d.unit.sure >= kUnsure ? " m" : " units") + " from the person";
    d.say(f);
  }
  if (parts.pieces > 1)
    d.say({"holes", Weight::note, cat("the person is in ", parts.pieces, " pieces", where), 1,
           "gaps between groups of points", "scan from more sides if you can"});
}

void judge_pose(Diagnosis& d, const PersonShape& shape, const ExamineOptions& options) {
  const bool target = options.target;
  const Orientation& o = d.orientation;
  Finding f{"pose", Weight::fact, "", std::min(0.95, o.up_sure), "", ""};
  if (o.up_sure < kUnsure) {
    f.weight = Weight::note;
    f.what = "whether it stands in T-pose cannot be told, as the up axis is unsure";
    if (target) d.say(f);
    return;
  }
  if (!target && o.facing_sure < kUnsure) return;
  const bool rig = options.joints && o.up == 2;
  std::optional<TPoseAngles> angles;
  if (rig) {
    angles = t_pose_angles(*options.joints);
  } else {
    const Eigen::Matrix3f turn = best_turn(o).cast<float>();
    Points ours;
    for (const Point& p : shape.points) ours.push_back(turn * p);
    angles = t_pose_angles(ours);
  }
  const double arms = angles ? std::max(angles->arms[0], angles->arms[1]) : 90,
               legs = angles ? angles->legs : 0;
  const auto degrees = [](double x) { return number(std::round(x)); };
  if (arms <= kTPoseAngle && legs <= kLegAngle) {
    f.what = "T-pose";
    f.evidence = "arms within " + number(std::ceil(arms)) + " degrees of where they belong";
    if (rig)
      f.evidence += ", by the rig's joints";
    else if (target)
      f.evidence += "; retarget also measures them by the joints that its network finds";
    d.say(f);
    return;
  }
  if (target) f.weight = o.up_sure >= kPoseSure ? Weight::wrong : Weight::note;
  f.what = target ? "not a T-pose" : "not a T-pose (a target needs one, a source does not)";
  f.fix = target
              ? "pose it with the arms along x and the legs straight down; a mesh in an A-pose or "
                "another calm pose is put into T-pose by retarget"
              : "";
  if (!angles) {
    f.evidence = "no arms stretched out at the sides";
  } else if (arms <= kTPoseAngle) {
    f.evidence = "a leg is " + degrees(legs) + " degrees from straight down";
  } else if (std::abs(angles->turned) > kTPoseAngle) {
    f.evidence = "the arms are turned by " + degrees(std::abs(angles->turned)) +
                 " degrees to their " + (angles->turned > 0 ? "left" : "right");
    if (target) f.fix = "turn it to face +z";
  } else {
    f.evidence = "arms point " + degrees(angles->below[0]) + " and " + degrees(angles->below[1]) +
                 " degrees below the horizontal";
  }
  d.say(f);
}

void judge_duplicates(Diagnosis& d, size_t equal, bool cloud, const std::string& where) {
  if (equal == 0) return;
  d.say({"duplicates", cloud ? Weight::note : Weight::fact,
         counted(equal, "point") + " equal to another" + where, 1, "counted",
         cloud ? "{fix} removes them" : ""});
}

}  // namespace doctor_detail

Finding non_finite(size_t points, const std::string& where, bool target) {
  return {"non-finite",
          target ? Weight::wrong : Weight::note,
          counted(points, "point") + " with a NaN or infinite coordinate" + where +
              (target ? "" : ", which retarget leaves out"),
          1,
          "counted",
          spelled("{fix} leaves them out")};
}

}  // namespace restage
