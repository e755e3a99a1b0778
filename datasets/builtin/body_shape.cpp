#include "datasets/builtin/body_shape.h"

#include <algorithm>

namespace restage {
namespace {

double mix(double a, double b, double t) { return a + t * (b - a); }

// Girth of a part: fat and muscle act on each part with their own strength.
double girth(const BodyShape& s, double fat, double muscle) {
  const double f = s.fat > 0 ? s.fat : 0.55 * s.fat;
  return 1 + fat * f + muscle * (s.muscle - 0.4);
}

void add_trunk(const BodyShape& s, ImplicitSurface& out) {
  struct Row {
    double y, male_a, male_b, female_a, female_b, z, fat_a, fat_b;
  };
  static constexpr Row kRows[] = {{.478, .040, .046, .042, .048, -.006, .10, .10},
                                  {.495, .080, .060, .086, .064, -.003, .18, .20},
                                  {.530, .094, .068, .102, .072, -.004, .25, .28},
                                  {.570, .092, .065, .097, .066, -.001, .32, .40},
                                  {.620, .084, .059, .074, .054, .004, .42, .55},
                                  {.660, .088, .060, .076, .054, .004, .38, .50},
                                  {.710, .099, .066, .085, .059, .002, .26, .34},
                                  {.760, .106, .066, .091, .059, -.002, .20, .25},
                                  {.800, .100, .054, .088, .048, -.006, .14, .18},
                                  {.830, .066, .038, .060, .036, -.007, .08, .12},
                                  {.850, .036, .034, .032, .031, -.006, .10, .12}};
  std::vector<Ring> rings;
  for (const Row& r : kRows) {
    const double chest = std::clamp((r.y - .62) / .12, 0.0, 1.0);
    const double wide = mix(s.hips, s.shoulders, chest);
    const double m = girth(s, 0, .22 * chest);
    rings.push_back({map_height(s, r.y),
                     wide * mix(r.female_a, r.male_a, s.sex) * girth(s, r.fat_a, 0) * m,
                     mix(r.female_b, r.male_b, s.sex) * girth(s, r.fat_b, 0) * m, 0, r.z});
  }
  out.add_loft(1, std::move(rings), .02);
}

void add_trunk_details(const BodyShape& s, ImplicitSurface& out) {
  const auto y = [&](double v) { return map_height(s, v); };
  const double fat = std::max(s.fat, 0.0), female = 1 - s.sex;
  const double seat = girth(s, .22, .1) * mix(1.08, 1, s.sex);
  out.add_ellipsoid({.044 * s.hips, y(.515), -.036}, Vec3(.047, .050, .042) * seat, .03);
  const double belly = fat * s.belly;
  out.add_ellipsoid({0, y(.595), .022 + .028 * belly}, Vec3(.062, .066, .040) * (.75 + .75 * belly),
                    .05);
  const double bust = (.021 + .016 * fat) * female;
  if (bust > .006)
    out.add_ellipsoid({.040 * s.shoulders, y(.738), .046 + .010 * fat},
                      Vec3(.019, .019, .016).array() + bust * .75, .022);
  const double chest = .010 * s.muscle * s.sex;
  out.add_ellipsoid({.046 * s.shoulders, y(.762), .036}, Vec3(.040, .026, .022).array() + chest,
                    .025);
  // From the neck to the shoulder, and the shoulder blades.
  const double trap = .018 + .009 * s.muscle * s.sex;
  out.add_cone({.016, y(.846), -.010}, trap, {.090 * s.shoulders, y(.812), -.008}, trap * .9, .03);
  out.add_ellipsoid({.055 * s.shoulders, y(.755), -.040}, {.035, .050, .020}, .03);
}

void add_leg(const BodyShape& s, const Joints& joints, ImplicitSurface& out) {
  struct Row {
    double y, a, b, z, fat, muscle;
  };
  static constexpr Row kRows[] = {
      {.022, .0185, .024, -.010, .02, 0},    {.045, .0195, .026, -.009, .05, 0},
      {.080, .0200, .0235, -.010, .10, .05}, {.140, .0265, .030, -.011, .20, .25},
      {.200, .0340, .040, -.010, .24, .32},  {.250, .0335, .036, -.003, .22, .20},
      {.285, .0330, .037, .003, .22, .08},   {.350, .0420, .047, .004, .30, .26},
      {.420, .0520, .058, .002, .36, .26},   {.475, .0560, .065, -.002, .34, .22},
      {.515, .0500, .058, -.004, .28, .12},  {.545, .0370, .044, -.004, .24, .05},
      {.565, .0220, .028, -.004, .20, 0}};
  const Vec3 &hip = joints[1], &knee = joints[4], &ankle = joints[7];
  std::vector<Ring> rings;
  for (const Row& r : kRows) {
    const double y = map_height(s, r.y);
    const double x = y > knee.y()
                         ? mix(knee.x(), hip.x(), (y - knee.y()) / (hip.y() - knee.y()))
                         : mix(ankle.x(), knee.x(), (y - ankle.y()) / (knee.y() - ankle.y()));
    const double g = girth(s, r.fat, r.muscle) * mix(r.y > .4 ? 1.04 : .97, 1, s.sex);
    rings.push_back({y, r.a * g, r.b * g, x + (g - 1) * .4 * r.a, r.z});
  }
  out.add_loft(1, std::move(rings), .035, .010);
  // Foot: heel, arch and toes, flat below because the floor cuts it.
  const double f = s.feet, x = ankle.x(), out_x = joints[10].x() + .004;
  const double high = mix(.95, 1, s.sex);
  out.add_loft(2,
               {{-.048 * f, .0130, .014, x, .014},
                {-.036 * f, .0185, .024 * high, x, .013},
                {-.012 * f, .0200, .036 * high, x, .014},
                {.020 * f, .0200, .034 * high, mix(x, out_x, .3), .010},
                {.050 * f, .0235, .023 * high, mix(x, out_x, .7), .007},
                {.080 * f, .0260, .0165, out_x, .005},
                {.100 * f, .0220, .0130, out_x - .002, .004},
                {.108 * f, .0120, .0090, out_x - .004, .004}},
               .012);
}

void add_arm(const BodyShape& s, const Joints& joints, ImplicitSurface& out) {
  struct Row {
    double u;  // -1 collar side, 0 shoulder, 1 elbow, 2 wrist
    double thick, wide, fat, muscle;
  };
  static constexpr Row kRows[] = {{-.20, .031, .033, .20, .30},   {.05, .0345, .036, .24, .40},
                                  {.30, .0295, .031, .32, .40},   {.60, .0270, .0280, .34, .45},
                                  {.85, .0225, .0235, .26, .20},  {1.0, .0210, .0225, .20, .10},
                                  {1.25, .0225, .0230, .22, .30}, {1.6, .0180, .0195, .18, .20},
                                  {1.9, .0130, .0170, .08, .04},  {2.05, .0120, .0170, .05, 0}};
  const Vec3 &shoulder = joints[16], &elbow = joints[18], &wrist = joints[20];
  std::vector<Ring> rings;
  for (const Row& r : kRows) {
    const double x =
        r.u < 1 ? mix(shoulder.x(), elbow.x(), r.u) : mix(elbow.x(), wrist.x(), r.u - 1);
    const double g = girth(s, r.fat, r.muscle) * mix(.90, 1.02, s.sex);
    rings.push_back({x, r.thick * g, r.wide * g, shoulder.y() - .15 * r.thick, shoulder.z()});
  }
  out.add_loft(0, std::move(rings), .022);
  const double deltoid = girth(s, .22, .45) * mix(.92, 1.03, s.sex);
  out.add_ellipsoid(shoulder + Vec3(.002, -.007, 0), Vec3(.038, .032, .035) * deltoid, .025);
  // Mitten: palm and fingers, palm down, and a thumb that points forward and outward.
  const double h = s.hands * mix(.95, 1.03, s.sex), x = wrist.x(), y = shoulder.y() - .002;
  const double z = shoulder.z() + .001;
  out.add_loft(0,
               {{x - .012, .0110, .0150, y, z},
                {x + .012 * h, .0125 * h, .0200 * h, y, z},
                {x + .036 * h, .0120 * h, .0245 * h, y, z},
                {x + .058 * h, .0105 * h, .0240 * h, y, z},
                {x + .080 * h, .0090 * h, .0215 * h, y - .001, z},
                {x + .100 * h, .0075 * h, .0155 * h, y - .003, z},
                {x + .108 * h, .0050 * h, .0080 * h, y - .004, z}},
               .008);
  out.add_cone({x + .012 * h, y - .003, z + .014 * h}, .0100 * h,
               {x + .046 * h, y - .009, z + .046 * h}, .0075 * h, .008);
}

void add_head(const BodyShape& s, ImplicitSurface& out) {
  const double k = s.head, jaw = mix(.93, 1.05, s.sex) * girth(s, .10, .05);
  const double neck = mix(.84, 1.04, s.sex) * girth(s, .16, .12);
  const auto y = [&](double v) { return map_height(s, v); };
  out.add_loft(1,
               {{y(.825), .037 * neck, .037 * neck, 0, -.006},
                {y(.850), .0325 * neck, .0345 * neck, 0, -.003},
                {y(.875), .0315 * neck, .034 * neck, 0, .001},
                {y(.905), .031, .034, 0, .004}},
               .018);
  out.add_loft(1,
               {{y(.864), .0130 * jaw, .014, 0, .046 * k},
                {y(.872), .0220 * jaw, .024, 0, .040 * k},
                {y(.890), .0330 * jaw * k, .040 * k, 0, .027 * k},
                {y(.915), .0405 * k, .0515 * k, 0, .016 * k},
                {y(.940), .0445 * k, .0570 * k, 0, .010 * k},
                {y(.965), .0435 * k, .0560 * k, 0, .006 * k},
                {y(.985), .0340 * k, .0440 * k, 0, .004 * k},
                {y(.997), .0180 * k, .0230 * k, 0, .003 * k},
                {y(1.000), .0080 * k, .0100 * k, 0, .003 * k}},
               .014);
  out.carve_ellipsoid({.0185 * k, y(.937), .0690 * k}, {.0115 * k, .0075, .0085 * k}, .010);
  out.add_cone({.0, y(.9485), .0650 * k}, .0065, {.022 * k, y(.9475), .0560 * k}, .0060, .008);
  out.add_cone({0, y(.940), .0660 * k}, .0048, {0, y(.917), .0768 * k}, .0080, .008);
  out.add_ellipsoid({0, y(.898), .0630 * k}, {.0150, .0060, .0060}, .006);
  out.add_ellipsoid({0, y(.872), .0590 * k}, Vec3(.0120, .0090, .0085) * jaw, .010);
  out.add_ellipsoid({.0440 * k, y(.927), .0040}, {.0060, .0175, .0105}, .005);
}

}  // namespace

BodyShape draw_body_shape(const RngKey& key) {
  Rng rng(key);
  BodyShape s;
  // One draw per statement: the order of evaluation inside an expression is not fixed.
  const double around = rng.uniform() < 0.5 ? 0.12 : 0.88;
  s.sex = std::clamp(around + 0.12 * rng.normal(), 0.0, 1.0);
  s.height = rng.uniform(1.45, 1.80);
  s.height += 0.20 * mix(0.15, 1, s.sex) * rng.uniform();
  s.fat = rng.uniform(-1, 1);
  s.muscle = rng.uniform();
  s.belly = rng.uniform();
  const auto factor = [&](double spread) {
    return 1 + spread * std::clamp(rng.normal(), -2.0, 2.0);
  };
  s.legs = factor(.025);
  s.arms = factor(.03);
  s.shoulders = mix(.93, 1.04, s.sex) * factor(.03);
  s.hips = mix(1.05, .98, s.sex) * factor(.03);
  s.head = mix(1.06, .96, (s.height - 1.45) / .55) * factor(.02);
  s.hands = factor(.04);
  s.feet = factor(.035);
  return s;
}

double map_height(const BodyShape& s, double y) {
  constexpr double kHipHeight = .52, kNeckHeight = .85;
  const double trunk =
      (1 - kHipHeight * s.legs - (1 - kNeckHeight) * s.head) / (kNeckHeight - kHipHeight);
  if (y <= kHipHeight) return y * s.legs;
  if (y <= kNeckHeight) return kHipHeight * s.legs + (y - kHipHeight) * trunk;
  return 1 - (1 - y) * s.head;
}

double shoulder_x(const BodyShape& s) { return .110 * s.shoulders; }
double wrist_x(const BodyShape& s) { return shoulder_x(s) + .308 * s.arms; }

Joints shape_joints(const BodyShape& s) {
  const double arm = map_height(s, .805), elbow = shoulder_x(s) + .163 * s.arms;
  const auto at = [&](double x, double y, double z) { return Vec3(x, map_height(s, y), z); };
  const double spread = girth(s, .12, 0);  // heavy legs stand a little farther apart
  Joints j;
  j[0] = at(0, .545, -.004);
  j[1] = at(.054 * s.hips, .520, -.002);
  j[4] = at(.064 * s.hips * spread, .285, .002);
  j[7] = at(.072 * s.hips * spread, .045, -.010);
  j[10] = at(.080 * s.hips * spread, .012, .072 * s.feet);
  j[3] = at(0, .592, -.008);
  j[6] = at(0, .650, -.010);
  j[9] = at(0, .710, -.010);
  j[12] = at(0, .846, -.006);
  j[15] = at(0, .900, .006);
  j[13] = Vec3(.030 * s.shoulders, arm, -.004);
  j[16] = Vec3(shoulder_x(s), arm, -.006);
  j[18] = Vec3(elbow, arm, -.006);
  j[20] = Vec3(wrist_x(s), arm, -.006);
  for (const int left : {1, 4, 7, 10, 13, 16, 18, 20})
    j[kMirror[left]] = Vec3(-j[left].x(), j[left].y(), j[left].z());
  return j;
}

ImplicitSurface shape_surface(const BodyShape& s) {
  const Joints joints = shape_joints(s);
  ImplicitSurface out;
  add_trunk(s, out);
  add_trunk_details(s, out);
  add_leg(s, joints, out);
  add_arm(s, joints, out);
  add_head(s, out);
  out.set_floor(0);
  return out;
}

}  // namespace restage
