// A small language for poses. Arguments come in braces because their order of evaluation is then
// fixed, and with it the order of random numbers on every compiler.
#pragma once

#include "datasets/builtin/actions.h"

namespace restage {

/// A pose written as changes of another. Side 0 acts, side 1 assists; angles in degrees.
class PoseOf {
 public:
  struct Trunk {
    double bend, side, twist;
  };
  struct Head {
    double nod, turn;
  };
  struct Arm {
    double flex, out, twist, elbow;
  };
  struct Hand {
    double pronate, bend;
  };
  struct Leg {
    double hip, out, knee, ankle;
  };

  explicit PoseOf(const Angles& from) : a_(from) {}
  PoseOf& trunk(const Trunk& v) {
    return set(kSpineBend, v.bend).set(kSpineSide, v.side).set(kSpineTwist, v.twist);
  }
  PoseOf& head(const Head& v) { return set(kNeckNod, v.nod).set(kNeckTurn, v.turn); }
  PoseOf& arm(int side, const Arm& v) {
    set(channel(side, kArmFlex), v.flex).set(channel(side, kArmSide), v.out);
    return set(channel(side, kArmTwist), v.twist).set(channel(side, kElbow), v.elbow);
  }
  PoseOf& arms(const Arm& v) { return arm(0, v).arm(1, v); }
  PoseOf& hand(int side, const Hand& v) {
    return set(channel(side, kPronate), v.pronate).set(channel(side, kWristBend), v.bend);
  }
  PoseOf& leg(int side, const Leg& v) {
    set(channel(side, kHipFlex), v.hip).set(channel(side, kHipSide), v.out);
    return set(channel(side, kKnee), v.knee).set(channel(side, kAnkle), v.ankle);
  }
  PoseOf& legs(const Leg& v) { return leg(0, v).leg(1, v); }
  PoseOf& both(SideChannel which, double value) {
    return set(channel(0, which), value).set(channel(1, which), value);
  }
  PoseOf& set(int which, double value) {
    a_[which] = value;
    return *this;
  }
  operator Angles() const { return a_; }

 private:
  Angles a_;
};

inline constexpr double kTau = 6.283185307179586;

inline PoseOf stand() { return PoseOf(neutral_angles()); }

/// Knees bent by `knee` with the feet flat and the body upright.
inline PoseOf crouch(double knee, double out = 4) {
  return stand().legs({0.52 * knee, out, knee, 0.48 * knee});
}

inline double vary(Rng& r, double value, double share = 0.2) {
  return value * r.uniform(1 - share, 1 + share);
}

/// Plays a timeline for the acting hand of the subject, mostly the good one.
Choreography play(const Temper& s, Rng& r, Timeline line, double seconds);

// action_gaits.cpp
Choreography walk(const Temper& s, Rng& r);
Choreography jog(const Temper& s, Rng& r);
Choreography march(const Temper& s, Rng& r);
Choreography walk_in_circle(const Temper& s, Rng& r);
Choreography walk_backward(const Temper& s, Rng& r);
Choreography sneak(const Temper& s, Rng& r);
// action_gestures.cpp
Choreography throw_ball(const Temper& s, Rng& r);
Choreography punch(const Temper& s, Rng& r);
Choreography kick(const Temper& s, Rng& r);
Choreography wave(const Temper& s, Rng& r);
Choreography reach(const Temper& s, Rng& r);
Choreography bow(const Temper& s, Rng& r);
Choreography clap(const Temper& s, Rng& r);
Choreography look_around(const Temper& s, Rng& r);
Choreography stretch(const Temper& s, Rng& r);
// action_moves.cpp
Choreography sit(const Temper& s, Rng& r);
Choreography squat(const Temper& s, Rng& r);
Choreography jump(const Temper& s, Rng& r);
Choreography turn_around(const Temper& s, Rng& r);
Choreography lunge(const Temper& s, Rng& r);
Choreography dance(const Temper& s, Rng& r);
Choreography freestyle(const Temper& s, Rng& r);

}  // namespace restage
