// Gaits: one stride machine, many settings.
#include <algorithm>
#include <cmath>

#include "datasets/builtin/action_tools.h"

namespace restage {
namespace {

struct Gait {
  double rate;         // strides per second (two steps)
  double contact;      // share of the stride that a foot stands
  double travel;       // metres that the body passes over the standing foot
  double clearance;    // metres that the ankle rises in the swing
  double crouch;       // metres that the hips are lower than with straight legs
  double heel;         // degrees that the heel rises before the foot leaves
  double arm, elbow;   // amplitude of the swing, bend
  double lean, twist;  // of the trunk
  double turn;         // degrees per second
  double flight;       // metres
};

constexpr double kThigh = 0.40, kShank = 0.41, kFoot = 0.14;  // of the average body

// Angles of one leg by inverse kinematics in its plane: phase 0 = touches down in front. The foot
// stands on the floor while the body passes at constant speed, then swings forward.
void gait_leg(const Gait& g, double phase, double hip_height, double pitch, int side, Angles& a) {
  const double p = phase - std::floor(phase);
  double forward, up = 0, tilt = 0;  // ankle before the hip, above its rest height; toes down
  if (p < g.contact) {
    const double u = p / g.contact, rise = std::clamp((u - .62) / .38, 0.0, 1.0);
    forward = g.travel * (.5 - u);
    tilt = g.heel * rise * rise;
    const double land = std::max(0.0, 1 - u / .15);
    tilt -= .35 * g.heel * land * land;
  } else {
    const double u = (p - g.contact) / (1 - g.contact);
    const double slope = -g.travel * (1 - g.contact) / g.contact;  // no jump of speed at the ends
    forward = g.travel * (-.5 + u * u * (3 - 2 * u)) + slope * u * (1 - u) * (1 - 2 * u);
    up = g.clearance * std::pow(std::sin(3.14159265358979 * std::pow(u, .85)), 2);
    const double late = u * u * (3 - 2 * u);
    tilt = g.heel * (1 - late) * (1 + 1.5 * u) - .35 * g.heel * late;
  }
  const double t = tilt * kTau / 360;
  if (t > 0) {  // the foot turns about the ball while the heel is up
    forward += kFoot * (1 - std::cos(t));
    up += kFoot * std::sin(t);
  }
  const double y = hip_height - up;
  const double d = std::min(std::hypot(forward, y), .998 * (kThigh + kShank));
  const double inner = (kThigh * kThigh + kShank * kShank - d * d) / (2 * kThigh * kShank);
  const double upper = (kThigh * kThigh + d * d - kShank * kShank) / (2 * kThigh * d);
  const double knee = 180 - std::acos(std::clamp(inner, -1.0, 1.0)) * 360 / kTau;
  const double hip =
      (std::atan2(forward, y) + std::acos(std::clamp(upper, -1.0, 1.0))) * 360 / kTau;
  a[channel(side, kHipFlex)] = hip + pitch;
  a[channel(side, kKnee)] = knee;
  a[channel(side, kAnkle)] = knee - hip - tilt;
  a[channel(side, kToes)] = std::max(0.0, .8 * tilt * (p < g.contact));
}

Choreography gait(const Temper& s, Rng& r, Gait g, double way, double seconds) {
  g.rate = vary(r, g.rate, .12) * s.tempo;
  g.travel = vary(r, g.travel, .18) * std::sqrt(s.energy);
  g.clearance = vary(r, g.clearance, .25);
  g.arm = vary(r, g.arm, .4) * s.arm_swing;
  g.elbow = vary(r, g.elbow, .3);
  g.turn += r.normal() * 8;
  g.lean += 3 * r.normal();
  const double start = r.uniform(), limp = .01 * r.normal(), wide = r.uniform(0, 5);
  const double splay = r.uniform(-70, -80), look = 12 * r.normal(), curve = 20 * r.normal();
  const double bend_with_turn = .06 * g.turn;
  // At both ends of the stance as high as the leg reaches; walkers vault over the standing leg,
  // joggers sink on it.
  const double leg = kThigh + kShank, end = .5 * g.travel;
  const double ends = std::sqrt(leg * leg * .99 - end * end) - g.crouch;
  const double vault = g.contact < .5 ? -.015 : .5 * (.99 * leg - g.crouch - ends);
  auto angles = [=](double t) {
    Angles a = neutral_angles();
    const double phase = start + way * g.rate * t;
    const double pitch = .4 * g.lean;
    const double bob = ends + vault * (1 + std::cos(2 * kTau * (phase - .5 * g.contact)));
    gait_leg(g, phase, bob, pitch, 0, a);
    gait_leg(g, phase + .5, bob + limp, pitch, 1, a);
    const double c = std::cos(kTau * phase), c2 = std::cos(2 * kTau * phase);
    for (int side = 0; side < 2; ++side) {
      const double swing = side == 0 ? -c : c;
      a[channel(side, kArmFlex)] = 4 + g.arm * swing;
      a[channel(side, kArmSide)] = splay;
      a[channel(side, kElbow)] = g.elbow + .35 * g.arm * (1 + swing);
      a[channel(side, kHipSide)] = 1 + wide + (side == 0 ? 3 : -3) * std::sin(kTau * phase);
    }
    a[kYaw] = g.turn * t + 5 * std::sin(kTau * phase) + curve * std::sin(.9 * t);
    a[kPitch] = pitch;
    a[kRoll] = 2.5 * std::sin(kTau * phase) - bend_with_turn;
    a[kSpineBend] = .6 * g.lean + c2;
    a[kSpineTwist] = -g.twist * c;
    a[kSpineSide] = -3 * std::sin(kTau * phase);
    a[kNeckTurn] = .6 * g.twist * c + look * std::sin(1.3 * t + start);
    a[kNeckNod] = -.5 * g.lean + 2 * c2;
    return a;
  };
  Choreography p{seconds, angles, nullptr, {}};
  if (g.contact < .5) {  // no foot to go by in the air
    p.speed = way * g.travel * g.rate / g.contact;
    p.flight = [=](double t) {  // airborne twice per stride, between two contacts
      const double away = std::remainder(start + g.rate * t - .5 * (g.contact + .5), .5);
      const double u = away / (.5 - g.contact);
      return g.flight * std::max(0.0, 1 - 4 * u * u);
    };
  }
  return p;
}

}  // namespace

Choreography walk(const Temper& s, Rng& r) {
  return gait(s, r, {1.0, .60, .54, .05, .0, 30, 24, 14, 3, 7, 0, 0}, 1, r.uniform(3, 6));
}

Choreography jog(const Temper& s, Rng& r) {
  return gait(s, r, {1.35, .36, .58, .24, .03, 30, 36, 75, 9, 12, 0, .05}, 1, r.uniform(2.5, 5));
}

Choreography march(const Temper& s, Rng& r) {
  return gait(s, r, {.9, .58, .46, .30, .0, 18, 45, 22, -1, 8, 0, 0}, 1, r.uniform(3, 5));
}

Choreography walk_in_circle(const Temper& s, Rng& r) {
  const double way = r.uniform() < .5 ? -1 : 1, turn = way * r.uniform(35, 75);
  return gait(s, r, {.95, .60, .48, .06, .005, 24, 20, 16, 3, 7, turn, 0}, 1, r.uniform(3.5, 6));
}

Choreography walk_backward(const Temper& s, Rng& r) {
  return gait(s, r, {.8, .62, .40, .06, .005, 16, 14, 18, 2, 5, 0, 0}, -1, r.uniform(3, 5));
}

Choreography sneak(const Temper& s, Rng& r) {
  Choreography p =
      gait(s, r, {.55, .64, .56, .16, .14, 16, 14, 85, 26, 6, 0, 0}, 1, r.uniform(3.5, 6));
  const double phase = r.uniform(0, 6);
  p.angles = [inner = p.angles, phase](double t) {
    Angles a = inner(t);
    a[kNeckTurn] += 45 * std::sin(1.7 * t + phase);
    for (int side = 0; side < 2; ++side) a[channel(side, kArmFlex)] += 25;
    return a;
  };
  return p;
}

}  // namespace restage
