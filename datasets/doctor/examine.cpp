#include "datasets/doctor/examine.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "datasets/doctor/examine_detail.h"
#include "datasets/doctor/words.h"

namespace restage {

using namespace doctor_detail;

const char* name(Weight weight) {
  return weight == Weight::fact ? "fact" : weight == Weight::note ? "note" : "wrong";
}

bool Diagnosis::usable() const {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& f) { return f.weight == Weight::wrong; });
}

const Finding* Diagnosis::find(const std::string& topic) const {
  for (const Finding& f : findings)
    if (f.topic == topic) return &f;
  return nullptr;
}

namespace doctor_detail {

namespace {

constexpr double kFloorMatters = 0.05;  // metres; less is noise, or a shoe's sole

}  // namespace

void recognise(Diagnosis& d, double size, const OrientationVote& vote,
               const ExamineOptions& options) {
  d.size = size;
  d.unit = guess_unit(size);
  if (options.scale) d.unit = {{"", *options.scale}, 1, d.unit.deviation};
  d.orientation = options.up ? vote.result(*options.up) : vote.result();
  if (!options.facing) return;
  if (*options.facing / 2 == d.orientation.up / 2)
    throw InputError("",
                     std::string("nobody whose head points along ") +
                         kDirections[static_cast<size_t>(d.orientation.up)] + " faces " +
                         kDirections[static_cast<size_t>(*options.facing)],
                     "give --up too");
  d.orientation.facing = *options.facing;
  d.orientation.facing_sure = 1;
  d.orientation.turned = 0;
}

void judge_units(Diagnosis& d) {
  const UnitGuess& guess = d.unit;
  Finding f{"units", Weight::fact, "", guess.sure, "", ""};
  f.evidence = "half of the points lie within " + number(d.size) +
               " units of the middle; of people it is 0.26 to 0.63 m in any pose";
  if (guess.sure < kUnsure) {
    f.weight = Weight::note;
    f.what = "no unit (m, dm, inch, cm, mm) clearly makes a person of it";
    f.fix = "give metres per unit with --scale if they are not metres";
  } else if (guess.unit.metres == 1) {
    f.what = "metres";
  } else if (*guess.unit.name == 0) {
    f.what = "1 unit is " + number(guess.unit.metres) + " m, as given";
    f.evidence = "given";
  } else {
    f.weight = guess.sure >= kSure ? Weight::wrong : Weight::note;
    f.what = std::string("1 unit is 1 ") + guess.unit.name + ", not 1 m";
    f.fix = "--scale " + number(guess.unit.metres) + ", or --fix";
  }
  d.findings.push_back(f);
}

void judge_up(Diagnosis& d, size_t clouds) {
  const Orientation& o = d.orientation;
  Finding f{"up",      Weight::fact, std::string(kDirections[static_cast<size_t>(o.up)]) + " is up",
            o.up_sure, "",           ""};
  f.evidence = "where a person's points lie, in 144 attitudes" +
               (clouds > 1 ? ", over " + counted(clouds, "frame") : std::string());
  if (o.up_sure < kUnsure) {
    f.weight = Weight::note;
    f.what = std::string("which axis is up cannot be told (perhaps ") +
             kDirections[static_cast<size_t>(o.up)] + ")";
    f.fix = "say it with --source-up if it is not y; is it one whole person?";
  } else if (o.up != 2) {
    // What is of no person's size may be no person: then only a note.
    f.weight = o.up_sure >= kSure && d.unit.sure >= kUnsure ? Weight::wrong : Weight::note;
    f.what += ", not +y";
    f.fix = o.up == 4 ? "--source-up z, or --fix" : "--fix turns it";
  }
  d.findings.push_back(f);
}

void judge_facing(Diagnosis& d, bool target) {
  const Orientation& o = d.orientation;
  if (o.up_sure < kUnsure) return;
  Finding f{"facing", Weight::fact, "", o.facing_sure, "", ""};
  f.evidence = "feet, knees, seat and chest are not the same before and behind";
  if (o.facing_sure < kUnsure) {
    f.weight = Weight::note;
    f.what = std::string("which way the person faces cannot be told (perhaps ") +
             kDirections[static_cast<size_t>(o.facing)] + ")";
  } else {
    f.what = std::string("faces ") + kDirections[static_cast<size_t>(o.facing)];
    if (std::abs(o.turned) > 20)
      f.what += ", turned by about " + number(std::round(std::abs(o.turned) / 5) * 5) +
                " degrees to their " + (o.turned > 0 ? "left" : "right");
    // With another up axis the turn is part of that repair.
    if (target && o.up == 2 && o.facing != 4) {
      f.weight = o.facing_sure >= kSure ? Weight::wrong : Weight::note;
      f.fix = "--fix turns it; a target has to face +z";
    }
  }
  d.findings.push_back(f);
}

/// The proper turn: as found where that is sure, else as few axes exchanged as possible.
Mat3 best_turn(const Orientation& o) {
  if (o.facing_sure >= kUnsure) return o.turn();
  Orientation guess = o;
  Mat3 best = Mat3::Zero();
  for (guess.facing = 0; guess.facing < 6; ++guess.facing)
    if (guess.facing / 2 != o.up / 2 && (best.isZero() || guess.turn().trace() > best.trace()))
      best = guess.turn();
  return best;
}

void judge_frame(Diagnosis& d, double lowest, double highest) {
  if (d.unit.sure < kUnsure || d.orientation.up_sure < kUnsure) {
    d.findings.push_back({"transform", Weight::note,
                          "how to bring it into our frame cannot be told", 1,
                          "units or up axis are unsure", ""});
    return;
  }
  Similarity t;
  t.scale = d.unit.unit.metres;
  t.rotation = best_turn(d.orientation);
  d.height = t.scale * (highest - lowest);
  const double floor = t.scale * lowest;
  if (std::abs(floor) > kFloorMatters) t.offset = lowest * direction(d.orientation.up);
  d.transform = t;
  d.findings.push_back({"height", Weight::fact, number(d.height) + " m from the floor to the top",
                        1, "in the pose that it shows", ""});
  Finding f{"floor", Weight::fact, "at 0", 1, "lowest points of the person", ""};
  if (!t.offset.isZero()) {
    f.weight = Weight::note;
    f.what = "at " + number(floor) + " m, not 0";
    f.fix = "--fix moves it";
  }
  d.findings.push_back(f);
}

void judge_points(Diagnosis& d, size_t distinct) {
  if (distinct >= kEnoughPoints) return;
  d.findings.push_back({"points", Weight::wrong,
                        "only " + std::to_string(distinct) + " distinct points; networks need " +
                            std::to_string(kEnoughPoints),
                        1, "counted", "scan it more finely"});
}

void judge_parts(Diagnosis& d, const PersonShape& shape, const std::string& where) {
  const Parts& parts = shape.parts;
  const auto all = static_cast<double>(parts.part.size());
  const double metres = d.unit.sure >= kUnsure ? d.unit.unit.metres : 1;
  if (parts.stray > 0)
    d.findings.push_back({"outliers", Weight::note,
                          counted(parts.stray, "stray point") + " (" +
                              per_cent(static_cast<double>(parts.stray) / all) + ")" + where,
                          1, "far from all others", "--fix removes them"});
  if (parts.other > 0) {
    const auto person = static_cast<double>(shape.points.size());
    const bool somebody = static_cast<double>(parts.largest_other) > 0.4 * person;
    Finding f{"others", somebody ? Weight::wrong : Weight::note, "", 0.9, "", "--fix removes it"};
    f.what = (somebody ? "a second person" : "part of somebody or something else") +
             (" (" + counted(parts.other, "point")) + ")" + where;
    f.evidence = "a separate piece, " + number(parts.gap * metres) +
                 (d.unit.sure >= kUnsure ? " m" : " units") + " from the person";
    d.findings.push_back(f);
  }
  if (parts.pieces > 1)
    d.findings.push_back({"holes", Weight::note,
                          "the person is in " + std::to_string(parts.pieces) + " pieces" + where, 1,
                          "gaps between groups of points", "scan from more sides if you can"});
}

}  // namespace doctor_detail

namespace {

void judge_cover(Diagnosis& d, const Mesh& mesh, const PersonShape& shape) {
  const double one = one_sidedness(shape.points, shape.parts.spacing);
  if (one > kOneSided && shape.points.size() >= 200)
    d.findings.push_back({"holes", Weight::note, "seen from one side only", 0.9,
                          "rays through it hit a single surface: " + per_cent(one),
                          "scan from more sides if you can"});
  if (mesh.faces.empty()) return;
  const Borders open = borders(mesh);
  if (open.edges > 0)
    d.findings.push_back(
        {"holes", Weight::note,
         counted(open.loops, "open border") + " with " + counted(open.edges, "edge"), 1,
         "edges with one triangle", "close them in a mesh editor if they are not meant"});
}

void judge_duplicates(Diagnosis& d, const Mesh& mesh, size_t equal) {
  if (equal == 0) return;
  const bool cloud = mesh.faces.empty();
  d.findings.push_back({"duplicates", cloud ? Weight::note : Weight::fact,
                        counted(equal, "point") + " equal to another", 1, "counted",
                        cloud ? "--fix removes them" : ""});
}

void judge_pose(Diagnosis& d, const PersonShape& shape, bool target) {
  if (!d.transform || d.orientation.facing_sure < kUnsure) return;
  Points ours;
  for (const Point& p : shape.points) ours.push_back((*d.transform)(p));
  const auto angles = arm_angles(ours);
  const double worst = angles ? std::max(std::abs((*angles)[0]), std::abs((*angles)[1])) : 90;
  if (worst <= kTPoseAngle) {
    d.findings.push_back({"pose", Weight::fact, "T-pose", 0.95,
                          "arms within " + number(std::ceil(worst)) + " degrees of the horizontal",
                          ""});
    return;
  }
  Finding f{"pose", target ? Weight::wrong : Weight::note, "not a T-pose", 0.95, "", ""};
  f.evidence = angles ? "arms point " + number(std::round((*angles)[0])) + " and " +
                            number(std::round((*angles)[1])) + " degrees below the horizontal"
                      : "no arms stretched out at the sides";
  if (!target) f.weight = Weight::fact;
  f.what += target ? "" : " (a target needs one, a source does not)";
  if (target) f.fix = "pose it with the arms along x, or --force";
  d.findings.push_back(f);
}

}  // namespace

Diagnosis examine_surface(const Mesh& mesh, const ExamineOptions& options) {
  Diagnosis d;
  d.kind = mesh.faces.empty() ? "cloud" : "mesh";
  d.faces = static_cast<int64_t>(mesh.faces.size());
  d.fewest_points = d.most_points = static_cast<int64_t>(mesh.vertices.size());
  const size_t equal = duplicates(mesh.vertices);
  judge_points(d, mesh.vertices.size() - equal);
  const PersonShape shape = shape_of(mesh);
  OrientationVote vote;
  vote.add(shape.points);
  recognise(d, shape.size, vote, options);
  judge_units(d);
  judge_up(d, 1);
  judge_facing(d, options.target);
  const Vec3 up = direction(d.orientation.up);
  judge_frame(d, quantile(shape.points, up, kLevel), quantile(shape.points, up, 1 - kLevel));
  judge_pose(d, shape, options.target);
  judge_parts(d, shape, "");
  judge_cover(d, mesh, shape);
  judge_duplicates(d, mesh, equal);
  return d;
}

std::optional<bool> is_mirrored(const Joints& joints, const Vec3& up) {
  Vec3 toes = Vec3::Zero();
  for (const int side : {0, 1}) {
    const auto ankle = static_cast<size_t>(7 + side), foot = static_cast<size_t>(10 + side);
    toes += joints[foot] - joints[ankle];
  }
  const Vec3 left = joints[1] - joints[2] + joints[16] - joints[17];
  const Vec3 forward = toes - toes.dot(up) * up;
  if (!(forward.norm() > 0.25 * toes.norm())) return std::nullopt;  // on tiptoe: noise
  const double turn = up.cross(forward).dot(left);
  if (!(std::abs(turn) > 0.3 * forward.norm() * left.norm())) return std::nullopt;
  return turn < 0;
}

}  // namespace restage
