// Actions of the arms and the upper body.
#include <algorithm>
#include <cmath>

#include "datasets/builtin/action_tools.h"

namespace restage {

Choreography throw_ball(const Temper& s, Rng& r) {
  const double e = s.energy, h = r.uniform(.5, .9) / s.tempo, high = r.uniform(-25, 45);
  const double lift = r.uniform(0, 60);
  Timeline k;
  k.add(0, stand());
  k.add(h, stand()
               .trunk({-8, 6, 38 * e})
               .head({0, -25})
               .arm(0, {-10, -15 + .5 * high, -65, 95})
               .arm(1, {70, -60, 10, 25})
               .leg(1, {15 + lift * .6, 6, 10 + lift, 5})
               .leg(0, {-5, 6, 14, 8})
               .hand(0, {0, -35}));
  k.add(1.55 * h, stand()
                      .trunk({2, 4, 8})
                      .arm(0, {10, high, -80, 105})
                      .arm(1, {30, -55, 10, 60})
                      .leg(1, {36, 6, 14, 4})
                      .leg(0, {-18, 6, 12, 10})
                      .hand(0, {0, -45})
                      .head({0, -5}));
  k.add(1.95 * h, stand()
                      .trunk({18, -4, -26 * e})
                      .arm(0, {85, -40 + .4 * high, 5, 12})
                      .arm(1, {0, -65, 20, 75})
                      .leg(1, {34, 6, 26, 10})
                      .leg(0, {-26, 6, 22, 0})
                      .hand(0, {20, 30}));
  k.add(2.6 * h, stand()
                     .trunk({36 * e, -8, -44 * e})
                     .head({-15, 20})
                     .arm(0, {55, -115, 30, 25})
                     .arm(1, {-20, -60, 10, 50})
                     .leg(1, {42, 6, 40, 14})
                     .leg(0, {-22, 8, 34, 0}));
  k.add(2.6 * h + r.uniform(.6, 1), stand());
  return play(s, r, k, 2.6 * h + r.uniform(1.1, 1.8));
}

Choreography punch(const Temper& s, Rng& r) {
  const double reach = 12 * s.energy, beat = r.uniform(.22, .36) / s.tempo;
  const Angles guard = crouch(30, 8)
                           .trunk({10, 0, -15})
                           .head({8, 10})
                           .arms({32, -82, 25, 125})
                           .leg(1, {30, 8, 28, 5})
                           .leg(0, {-8, 8, 24, 10})
                           .hand(0, {30, 0})
                           .hand(1, {30, 0});
  Timeline k;
  double t = 0;
  k.add(t, guard);
  const int punches = 4 + static_cast<int>(r.below(5));
  for (int i = 0; i < punches; ++i) {
    PoseOf hit(guard);
    const int hand = static_cast<int>(r.below(2));
    const double twist = (hand == 0 ? -1 : 1) * (25 + reach), style = r.uniform();
    if (style < .6)
      hit.trunk({14, 0, twist}).arm(hand, {vary(r, 88), -84, 20, 8}).hand(hand, {60, 0});
    else if (style < .8)
      hit.trunk({8, 0, 1.3 * twist}).arm(hand, {60, -20, 10, 85});  // hook
    else
      hit.trunk({4, 0, twist})
          .arm(hand, {vary(r, 105), -82, 10, 95})
          .hand(hand, {-60, 0});  // uppercut
    k.add(t += vary(r, beat), hit);
    k.add(t += vary(r, 1.3 * beat), guard);
    if (r.uniform() < .4)
      t += r.uniform(.1, .5), k.add(t, PoseOf(guard).head({14, 0}).trunk({22, vary(r, 10), 0}));
  }
  return play(s, r, k, std::clamp(t + .3, 2.0, 6.0));
}

Choreography kick(const Temper& s, Rng& r) {
  const double h = r.uniform(.38, .6) / s.tempo, e = s.energy, side = r.uniform(5, 55);
  const double yaw = r.uniform(-30, 30);
  Timeline k;
  k.add(0, stand());
  k.add(h, stand()
               .trunk({8, 0, -14})
               .arm(0, {35, -45, 0, 40})
               .arm(1, {10, -35, 0, 40})
               .leg(0, {-24, 4, 60, 0})
               .leg(1, {10, 4, 22, 10}));
  k.add(1.6 * h, stand()
                     .trunk({4, 5, 10})
                     .arms({25, -30, 0, 45})
                     .leg(0, {60 * e, side, 85, -10})
                     .leg(1, {2, 4, 16, 10})
                     .set(kYaw, .6 * yaw));
  k.add(2.1 * h, stand()
                     .trunk({-6, 8, 22})
                     .arm(0, {-30, -45, 0, 20})
                     .arm(1, {60, -40, 0, 30})
                     .leg(0, {92 * e, side, 8, -30})
                     .leg(1, {-4, 4, 12, 8})
                     .set(kPitch, -10)
                     .set(kYaw, yaw));
  k.add(2.8 * h, stand()
                     .trunk({8, 0, 6})
                     .arms({20, -50, 0, 50})
                     .leg(0, {55, .5 * side, 80, 0})
                     .leg(1, {4, 4, 18, 8})
                     .set(kYaw, yaw));
  k.add(3.6 * h, stand().set(kYaw, yaw));
  return play(s, r, k, 3.6 * h + r.uniform(.4, 1.2));
}

Choreography wave(const Temper& s, Rng& r) {
  const double rate = r.uniform(1.1, 2.1) * s.tempo, high = r.uniform(-20, 60),
               wide = r.uniform(12, 32);
  const bool both = r.uniform() < .25;
  Timeline up;
  PoseOf raised =
      stand().trunk({0, -3, 6}).head({-4, 8}).arm(0, {15, high, -70, 60}).hand(0, {0, -10});
  if (both) raised.arm(1, {15, high, -70, 60});
  up.add(.1, stand());
  up.add(.9, raised);
  const double seconds = r.uniform(2.8, 5);
  up.add(seconds - .9, raised);
  up.add(seconds - .1, stand());
  Choreography p = play(s, r, up, seconds);
  p.angles = [inner = p.angles, rate, wide, seconds](double t) {
    Angles a = inner(t);
    const double on = std::clamp(std::min(t - .5, seconds - .5 - t) / .5, 0.0, 1.0);
    const double w = on * on * (3 - 2 * on) * std::sin(kTau * rate * t);
    for (int side = 0; side < 2; ++side)
      if (a[channel(side, kArmTwist)] < -30) {
        a[channel(side, kElbow)] += wide * w;
        a[channel(side, kWristTilt)] += 14 * std::sin(kTau * rate * t - .8) * on;
      }
    return a;
  };
  return p;
}

Choreography reach(const Temper& s, Rng& r) {
  Timeline k;
  double t = 0;
  k.add(t, stand());
  const int times = 2 + static_cast<int>(r.below(3));
  for (int i = 0; i < times; ++i) {
    const int hand = static_cast<int>(r.below(2));
    const double up = r.uniform(), across = r.uniform(-115, -20), sign = hand == 0 ? 1 : -1;
    PoseOf p = crouch(r.uniform(0, 60 * (1 - up)));
    p.trunk({50 * (1 - up), 0, sign * (across + 60) * .4})
        .head({35 - 70 * up, sign * 20 * r.normal()});
    p.arm(hand, {45 + 125 * up, across, r.uniform(-20, 20), r.uniform(5, 40)});
    if (r.uniform() < .4) p.arm(1 - hand, {45 + 125 * up, -80, 0, 20});
    if (up > .75)
      p.set(channel(0, kAnkle), -25)
          .set(channel(1, kAnkle), -25)
          .set(channel(0, kToes), 25)
          .set(channel(1, kToes), 25);
    p.hand(hand, {r.uniform(-50, 50), r.uniform(-40, 30)});
    k.add(t += r.uniform(.6, 1.0) / s.tempo, p);
    k.add(t += r.uniform(.15, .4), p);
    if (r.uniform() < .5) k.add(t += r.uniform(.6, .9) / s.tempo, stand());
  }
  k.add(t += .8, stand());
  return play(s, r, k, std::clamp(t, 2.0, 6.0));
}

Choreography bow(const Temper& s, Rng& r) {
  const double down = r.uniform(.7, 1.3) / s.tempo, deep = r.uniform(40, 85),
               hold = r.uniform(.3, 1);
  const bool touch = r.uniform() < .5;
  PoseOf low = stand().trunk({deep, 0, 0}).head({.3 * deep, 0}).set(kPitch, touch ? 45 : 20);
  if (touch)
    low.arms({100, -85, 0, 6}).legs({40, 4, 8, 6});
  else
    low.arm(0, {40, -100, 50, 95}).arm(1, {-15, -45, 0, 20}).legs({20, 4, 6, 0});
  Timeline k;
  k.add(.2, stand());
  k.add(.2 + down, low);
  k.add(.2 + down + hold, low);
  k.add(.2 + 2 * down + hold, stand().trunk({-8, 0, 0}));
  return play(s, r, k, std::clamp(.8 + 2 * down + hold, 2.0, 6.0));
}

Choreography clap(const Temper& s, Rng& r) {
  const double rate = r.uniform(1.2, 2.2) * s.tempo, high = r.uniform(45, 150),
               open = r.uniform(18, 45);
  const double sway = 8 * r.normal(), bent = r.uniform(25, 70), bounce = r.uniform(0, 18);
  auto angles = [=](double t) {
    const double u = .5 - .5 * std::cos(kTau * rate * t), on = std::clamp(t / .8, 0.0, 1.0);
    const double w = on * on * (3 - 2 * on), sag = bounce * (.5 - .5 * std::cos(kTau * rate * t));
    Angles a = crouch(2 + sag)
                   .arms({high * w, -76 - w * (24 - open * u), 20 * w, 14 + w * bent})
                   .head({-.1 * high * w, 6 * std::sin(t)});
    a[kSpineSide] = sway * std::sin(.5 * kTau * rate * t);
    return a;
  };
  return {r.uniform(2, 4.5), angles, nullptr, {}};
}

Choreography look_around(const Temper& s, Rng& r) {
  Timeline k;
  double t = 0;
  k.add(t, stand());
  const double seconds = r.uniform(3, 6);
  while (t < seconds) {
    const double turn = r.uniform(-75, 75), weight = r.uniform(-1, 1);
    PoseOf p =
        stand().head({r.uniform(-30, 30), turn}).trunk({r.uniform(-5, 12), 6 * weight, .3 * turn});
    p.leg(0, {4 + 8 * std::max(0.0, weight), 4, 4 + 22 * std::max(0.0, weight), 4});
    p.leg(1, {4 + 8 * std::max(0.0, -weight), 4, 4 + 22 * std::max(0.0, -weight), 4})
        .set(kRoll, 4 * weight);
    const double mood = r.uniform();
    if (mood < .2)
      p.arms({28, -100, 60, 100});  // crossed
    else if (mood < .4)
      p.arm(0, {60, -70, -10, 130});  // hand over the eyes
    else if (mood < .6)
      p.arms({-25, -58, 60, 85});  // hands on the hips
    else if (mood < .7)
      p.arms({110, -70, -20, 140});  // behind the head
    k.add(t += r.uniform(.6, 1.3) / s.tempo, p);
    k.add(t += r.uniform(.1, .7), p);
  }
  return play(s, r, k, seconds);
}

Choreography stretch(const Temper& s, Rng& r) {
  Timeline k;
  double t = 0;
  k.add(t, stand());
  const double seconds = r.uniform(3.5, 6);
  while (t < seconds) {
    const double side = r.uniform(-38, 38), kind = r.uniform();
    PoseOf p = stand().legs({0, r.uniform(2, 20), 2, 0});
    if (kind < .35)
      p.trunk({-15, side, 0}).head({-25, 0}).arms({r.uniform(150, 180), -80, 0, r.uniform(0, 30)});
    else if (kind < .6)
      p.trunk({0, 0, 1.3 * side}).arms({0, r.uniform(-15, 10), 0, r.uniform(0, 90)});
    else if (kind < .8)
      p.trunk({0, 32, 0}).arm(0, {0, 80, 0, 30}).arm(1, {-20, -60, 60, 80});
    else
      p.arms({90, -108, 20, 15}).trunk({25, 0, .5 * side});
    p.hand(0, {40 * r.normal(), 30 * r.normal()}).hand(1, {40 * r.normal(), 30 * r.normal()});
    k.add(t += r.uniform(.8, 1.4) / s.tempo, p);
    k.add(t += r.uniform(.1, .6), p);
  }
  return play(s, r, k, seconds);
}

}  // namespace restage
