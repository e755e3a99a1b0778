#include "datasets/builtin/actions.h"

#include <algorithm>

#include "datasets/builtin/action_tools.h"

namespace restage {

Choreography play(const Temper& s, Rng& r, Timeline line, double seconds) {
  const bool swap = s.left_handed != (r.uniform() < 0.85);
  return {seconds,
          [line = std::move(line), swap](double t) { return swap ? mirrored(line(t)) : line(t); },
          nullptr,
          {}};
}

Angles Timeline::operator()(double time) const {
  if (time <= keys_.front().time) return keys_.front().pose;
  if (time >= keys_.back().time) return keys_.back().pose;
  size_t k = 0;
  while (keys_[k + 1].time <= time) ++k;
  const double u = (time - keys_[k].time) / (keys_[k + 1].time - keys_[k].time);
  const double v = u * u * u * (10 + u * (6 * u - 15));  // rests at every key, no jerk
  Angles a;
  for (int c = 0; c < kChannels; ++c)
    a[c] = keys_[k].pose[c] + v * (keys_[k + 1].pose[c] - keys_[k].pose[c]);
  return a;
}

Temper draw_temper(const RngKey& key) {
  Rng r(key);
  Temper s;
  for (int c = 1; c < kChannels; ++c) s.posture[c] = 3 * std::clamp(r.normal(), -2.0, 2.0);
  for (int side = 0; side < 2; ++side) {
    s.posture[channel(side, kKnee)] = r.uniform(0, 3);
    s.posture[channel(side, kElbow)] = r.uniform(0, 8);
    for (const SideChannel c : {kHipFlex, kHipSide, kAnkle, kAnkleRoll, kToes})
      s.posture[channel(side, c)] *= .4;
    s.posture[channel(side, kPronate)] *= 5;
    s.posture[channel(side, kArmTwist)] *= 2;
  }
  for (const int c : {kPitch, kRoll}) s.posture[c] *= .4;
  s.posture[kSpineBend] += r.uniform(-3, 8);
  s.tempo = r.uniform(.82, 1.2);
  s.energy = r.uniform(.75, 1.15);
  s.arm_swing = r.uniform(.4, 1.5);
  s.left_handed = r.uniform() < .2;
  return s;
}

const std::vector<Action>& actions() {
  static const std::vector<Action> list = {{"walk", walk},
                                           {"jog", jog},
                                           {"throw", throw_ball},
                                           {"dance", dance},
                                           {"freestyle", freestyle},
                                           {"sit", sit},
                                           {"turn", turn_around},
                                           {"wave", wave},
                                           {"reach", reach},
                                           {"punch", punch},
                                           {"kick", kick},
                                           {"jump", jump},
                                           {"squat", squat},
                                           {"look_around", look_around},
                                           {"walk_in_circle", walk_in_circle},
                                           {"stretch", stretch},
                                           {"march", march},
                                           {"lunge", lunge},
                                           {"bow", bow},
                                           {"sneak", sneak},
                                           {"clap", clap},
                                           {"walk_backward", walk_backward}};
  return list;
}

}  // namespace restage
