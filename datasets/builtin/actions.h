// What the built-in actions do with the angles over time.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "autograd/base/rng.h"
#include "datasets/builtin/pose_channels.h"

namespace restage {

/// How one subject does everything.
struct Temper {
  Angles posture{};   ///< added to every pose, degrees
  double tempo = 1;   ///< factor on speed
  double energy = 1;  ///< factor on amplitudes
  double arm_swing = 1;
  bool left_handed = false;
};

Temper draw_temper(const RngKey& key);

/// One performance: angles and height of flight (metres) at a time in seconds.
struct Choreography {
  double seconds = 3;
  std::function<Angles(double)> angles;
  std::function<double(double)> flight;  ///< null: never leaves the floor
  /// Metres per second in the direction that the body faces; unset: whatever keeps the standing
  /// foot in place.
  std::optional<double> speed;
};

struct Action {
  std::string name;
  Choreography (*perform)(const Temper&, Rng&);
};

const std::vector<Action>& actions();

/// Poses at given times with smooth passages between; holds before the first and after the last.
class Timeline {
 public:
  void add(double time, const Angles& pose) { keys_.push_back({time, pose}); }
  Angles operator()(double time) const;

 private:
  struct Key {
    double time;
    Angles pose;
  };
  std::vector<Key> keys_;
};

}  // namespace restage
