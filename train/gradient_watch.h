// Looks at the gradients of a training's steps for what is hours lost: parameters and units that do
// not learn, norms that explode. What it looks at was computed anyway, or is a number of each row.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "autograd/tape/tape.h"
#include "nn/weights/state.h"

namespace restage {

class Optimiser;

/// Something that a user should know now, in one line, with the mend. Said once for a stage.
struct TrainWarning {
  std::string kind;  ///< "dead_units"
  std::string said;
};

class GradientWatch {
 public:
  /// Rows of gradients are looked at in every so many steps, and are dead after so many.
  static constexpr int64_t kEvery = 10, kDeadAfter = 200;
  /// The norm is so many times what it was.
  static constexpr double kExploded = 1000;

  /// `stage`: its name; `state`: its parameters.
  GradientWatch(std::string stage, const std::vector<StateEntry>& state);
  /// A step's gradients of an optimiser, and their norm.
  void look(const Optimiser* optimiser, const Gradients& gradients, double norm);
  /// What was found since the last call.
  std::vector<TrainWarning> take();

 private:
  struct Watched {
    std::string name;
    uint64_t id;
    int64_t still = 0;          // looks in a row at which all of the gradient was zero
    std::vector<int64_t> rows;  // the same of each row
  };
  struct Norms {
    int64_t steps = 0, high = 0;
    double usual = 0;  // running mean of the logarithm
    double begun = 0;  // that when it was far exceeded for the first time
  };
  void look_at(const Gradients& gradients, Watched* w);
  void say(const std::string& kind, const std::string& text);

  std::string stage_;
  std::vector<Watched> parameters_;
  std::map<const Optimiser*, Norms> norms_;
  std::vector<TrainWarning> found_;
};

}  // namespace restage
