// Actions of the whole body.
#include <algorithm>
#include <cmath>

#include "datasets/builtin/action_tools.h"

namespace restage {

Choreography sit(const Temper& s, Rng& r) {
  const double down = r.uniform(.9, 1.6) / s.tempo, stay = r.uniform(.8, 2),
               knee = r.uniform(78, 100);
  const Angles leaning = crouch(60).trunk({34, 0, 0}).head({-10, 0}).arms({30, -78, 5, 25});
  PoseOf seated = stand()
                      .legs({knee - 8, r.uniform(3, 14), knee, 4})
                      .trunk({r.uniform(0, 22), 0, 8 * r.normal()})
                      .head({r.uniform(-5, 20), 20 * r.normal()});
  const double hands = r.uniform();
  if (hands < .5)
    seated.arms({r.uniform(25, 40), -84, 15, r.uniform(25, 50)});  // on the thighs
  else if (hands < .75)
    seated.arms({35, -97, 55, 105});  // folded
  else
    seated.arm(0, {25, -80, 30, 120}).arm(1, {30, -95, 40, 90});  // chin on a hand
  if (r.uniform() < .15) seated.leg(0, {knee + 6, -4, knee - 40, 0});
  Timeline k;
  k.add(.2, stand());
  k.add(.2 + .55 * down, leaning);
  k.add(.2 + down, seated);
  k.add(.2 + down + .5 * stay,
        PoseOf(seated).set(kNeckTurn, 35 * r.normal()).set(kSpineTwist, 12 * r.normal()));
  k.add(.2 + down + stay, seated);
  if (r.uniform() < .6) {
    k.add(.2 + 1.5 * down + stay, leaning);
    k.add(.2 + 2.1 * down + stay, stand());
  }
  return play(s, r, k, std::clamp(.5 + 2.1 * down + stay, 2.0, 6.0));
}

Choreography squat(const Temper& s, Rng& r) {
  const double rate = r.uniform(.35, .6) * s.tempo,
               deep = r.uniform(80, 128) * std::min(s.energy, 1.1);
  const double wide = r.uniform(4, 22), forward = r.uniform(0, 95), start = r.uniform(0, .3);
  const double bent = r.uniform(0, 90), out = r.uniform(-88, -60);
  auto angles = [=](double t) {
    const double u = std::pow(.5 - .5 * std::cos(kTau * (rate * t + start)), .9);
    Angles a = stand()
                   .legs({.78 * deep * u, wide, deep * u, std::min(30.0, .3 * deep * u)})
                   .trunk({26 * u, 0, 0})
                   .head({-20 * u, 0})
                   .arms({forward * u, out, 10, 14 + bent * u});
    for (int side = 0; side < 2; ++side) a[channel(side, kHipTwist)] = wide + 6;
    a[kPitch] = 8 * u;
    return a;
  };
  return {r.uniform(2.5, 5), angles, nullptr, {}};
}

Choreography jump(const Temper& s, Rng& r) {
  const double pre = r.uniform(.5, .8) / s.tempo, air = r.uniform(.38, .56) * std::sqrt(s.energy);
  const double turn = r.uniform() < .35 ? r.uniform(-180, 180) : 0, apart = r.uniform(2, 32);
  const double up = r.uniform(60, 170), high = 9.81 * air * air / 8, tuck = r.uniform(5, 80);
  const double off = pre + .27, land = off + air, out = r.uniform(-80, -40);
  Timeline k;
  k.add(.1, stand());
  k.add(pre, crouch(vary(r, 85)).trunk({34, 0, 0}).head({-18, 0}).arms({-30, -75, 0, 20}));
  k.add(off, stand()
                 .trunk({-4, 0, 0})
                 .arms({.5 * up, out, 0, 20})
                 .legs({-6, 3, 3, -38})
                 .set(channel(0, kToes), 25)
                 .set(channel(1, kToes), 25)
                 .set(kYaw, .1 * turn));
  k.add(.5 * (off + land), stand()
                               .trunk({8, 0, 0})
                               .arms({up, out, 0, 15})
                               .legs({.7 * tuck, apart, tuck, -25})
                               .set(kYaw, .5 * turn));
  k.add(land, stand()
                  .trunk({10, 0, 0})
                  .arms({50, -60, 0, 25})
                  .legs({16, .6 * apart, 18, -8})
                  .set(kYaw, .95 * turn));
  k.add(land + .22,
        crouch(70).trunk({30, 0, 0}).head({-12, 0}).arms({20, -65, 0, 30}).set(kYaw, turn));
  k.add(land + .8, stand().set(kYaw, turn));
  Choreography p = play(s, r, k, std::max(2.0, land + r.uniform(1, 1.6)));
  p.flight = [=](double t) {
    const double u = (t - off) / (land - off);
    return u <= 0 || u >= 1 ? 0.0 : 4 * high * u * (1 - u);
  };
  return p;
}

Choreography turn_around(const Temper& s, Rng& r) {
  const double way = r.uniform() < .5 ? -1 : 1, total = way * r.uniform(90, 360);
  const double seconds = std::clamp(std::abs(total) / r.uniform(70, 120) / s.tempo, 2.0, 6.0);
  const double rate = r.uniform(1, 1.5) * s.tempo, lift = r.uniform(18, 40), arm = r.uniform(5, 20);
  const double out = r.uniform(-78, -40), ahead = std::copysign(25, total);
  auto angles = [=](double t) {
    Angles a = neutral_angles();
    const double u = std::clamp((t - .3) / (seconds - .6), 0.0, 1.0);
    const double on = std::min(1.0, 6 * u * (1 - u)), p = kTau * rate * t;
    for (int side = 0; side < 2; ++side) {  // small steps on the spot
      const double step = on * std::pow(std::max(0.0, side == 0 ? std::sin(p) : -std::sin(p)), 2.0);
      a[channel(side, kHipFlex)] = 3 + lift * step;
      a[channel(side, kKnee)] = 5 + 1.8 * lift * step;
      a[channel(side, kAnkle)] = 2 + .8 * lift * step;
      a[channel(side, kArmFlex)] = (side == 0 ? arm : -arm) * std::sin(p) * on;
      a[channel(side, kArmSide)] = out;
    }
    a[kYaw] = total * u * u * (3 - 2 * u);
    a[kNeckTurn] = ahead * on;
    a[kSpineTwist] = .5 * ahead * on;
    return a;
  };
  return {seconds, angles, nullptr, {}};
}

Choreography lunge(const Temper& s, Rng& r) {
  Timeline k;
  double t = .1;
  const double e = s.energy, seconds = r.uniform(3, 5.5);
  k.add(t, stand());
  while (t < seconds - .5) {
    PoseOf p = stand()
                   .trunk({10 * r.normal(), 0, 20 * r.normal()})
                   .leg(0, {62 * e, 4, 72 * e, 10})
                   .leg(1, {-28 * e, 4, 42 * e, 18});
    p.set(channel(1, kToes), 30)
        .arms({r.uniform(0, 170), r.uniform(-80, -30), 0, r.uniform(5, 60)});
    k.add(t += r.uniform(.6, .9) / s.tempo, p);
    k.add(t += r.uniform(.1, .4), p);
    k.add(t += r.uniform(.6, .9) / s.tempo, stand());
    if (r.uniform() < .5) k.add(t += .7, crouch(80, 25).trunk({15, 0, 0}).arms({80, -70, 0, 20}));
  }
  return play(s, r, k, seconds);
}

/// Every channel swings at multiples of half the beat.
Choreography dance(const Temper& s, Rng& r) {
  struct Wave {
    double middle, size, harmonic, phase, slow, slow_phase;
  };
  std::array<Wave, kChannels> waves;
  const auto set = [&](int c, double middle, double size) {
    static constexpr double kHarmonics[] = {.5, .5, 1, 1, 2};
    waves[c] = {middle,
                size * r.uniform(.1, 1) * s.energy,
                kHarmonics[r.below(5)],
                r.uniform(0, kTau),
                r.uniform(.15, .5),
                r.uniform(0, kTau)};
  };
  const double beat = r.uniform(1.4, 2.3) * s.tempo;
  set(kYaw, 0, 60), set(kPitch, 2, 5), set(kRoll, 0, 8);
  set(kSpineBend, 6, 18), set(kSpineSide, 0, 22), set(kSpineTwist, 0, 28);
  set(kNeckNod, 0, 18), set(kNeckSide, 0, 16), set(kNeckTurn, 0, 35);
  for (int side = 0; side < 2; ++side) {
    const double up = r.uniform(0, 130);
    const auto at = [&](SideChannel c) { return channel(side, c); };
    set(at(kShrug), 4, 10), set(at(kCollarForward), 0, 8);
    set(at(kArmFlex), up, 60), set(at(kArmSide), r.uniform(-85, 10), 40),
        set(at(kArmTwist), r.uniform(-30, 30), 35);
    set(at(kElbow), r.uniform(30, 85), 45), set(at(kPronate), 0, 50), set(at(kWristBend), 0, 35),
        set(at(kWristTilt), 0, 15);
    set(at(kHipFlex), 16, 24), set(at(kHipSide), 7, 12), set(at(kHipTwist), 8, 16);
    set(at(kKnee), 28, 34), set(at(kAnkle), 10, 8), set(at(kAnkleRoll), 0, 4), set(at(kToes), 4, 8);
  }
  waves[kYaw].harmonic = .5;
  waves[kYaw].slow_phase = 0;
  const double spin = r.uniform() < .3 ? r.uniform(-90, 90) : 12 * r.normal();
  const double hop = r.uniform() < .3 ? r.uniform(.03, .08) : 0;
  auto angles = [=](double t) {
    Angles a;
    for (int c = 0; c < kChannels; ++c) {
      const Wave& w = waves[c];
      const double sway = w.size * std::sin(kTau * w.harmonic * beat * .5 * t + w.phase);
      a[c] = w.middle + sway * (.65 + .35 * std::sin(kTau * w.slow * t + w.slow_phase));
    }
    a[kYaw] += spin * t;
    // Ankles follow so that the feet stay roughly flat.
    for (int side = 0; side < 2; ++side)
      a[channel(side, kAnkle)] = .4 * a[channel(side, kAnkle)] +
                                 .8 * (a[channel(side, kKnee)] - a[channel(side, kHipFlex)]);
    return a;
  };
  std::function<double(double)> flight;
  if (hop > 0)
    flight = [=](double t) { return hop * std::pow(.5 - .5 * std::cos(kTau * beat * t), 3); };
  return {r.uniform(3, 6), angles, flight, {}};
}

/// Wanders through random poses within the joint limits.
Choreography freestyle(const Temper& s, Rng& r) {
  Timeline k;
  double t = 0, yaw = 0;
  const double seconds = r.uniform(3.5, 6);
  while (t < seconds + 1) {
    const double knee = std::pow(r.uniform(), 2) * 100;
    PoseOf p = crouch(knee, r.uniform(0, 18));
    p.trunk({r.uniform(-10, 55), r.uniform(-30, 30), r.uniform(-45, 45)})
        .head({r.uniform(-35, 35), r.uniform(-60, 60)});
    for (int side = 0; side < 2; ++side) {
      p.arm(side, {r.uniform(-40, 165), r.uniform(-115, 75), r.uniform(-60, 65),
                   135 * std::pow(r.uniform(), 1.3)});
      p.hand(side, {r.uniform(-65, 65), r.uniform(-50, 50)});
      p.set(channel(side, kHipTwist), r.uniform(-15, 35))
          .set(channel(side, kShrug), r.uniform(-5, 22));
      p.set(channel(side, kWristTilt), r.uniform(-20, 20))
          .set(channel(side, kCollarForward), r.uniform(-12, 20));
    }
    const int leg = static_cast<int>(r.below(2));
    if (r.uniform() < .4)
      p.leg(leg, {r.uniform(-20, 95), r.uniform(-5, 50), r.uniform(0, 110), r.uniform(-30, 15)});
    p.set(kYaw, yaw += 40 * r.normal())
        .set(kNeckSide, 14 * r.normal())
        .set(kPitch, r.uniform(-8, 18))
        .set(kRoll, 5 * r.normal());
    k.add(t, p);
    t += r.uniform(.7, 1.3) / s.tempo;
  }
  return play(s, r, k, seconds);
}

}  // namespace restage
