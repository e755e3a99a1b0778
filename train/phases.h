// What a step spends its time on, counted always: two looks at the clock for each part of a step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace restage {

/// `draw`: examples are made, or waited for while they are. `step`: all of it.
enum class Phase { draw, forward, backward, optimise, validate, save, step };
inline constexpr size_t kPhases = 7;
const char* name_of(Phase phase);

/// Seconds of each phase, of all threads together.
struct PhaseTimes {
  std::array<double, kPhases> seconds{};
  double of(Phase phase) const { return seconds[static_cast<size_t>(phase)]; }
  /// Of the phases of which a step consists.
  double work() const {
    return of(Phase::draw) + of(Phase::forward) + of(Phase::backward) + of(Phase::optimise);
  }
};
/// What was counted since the last call.
PhaseTimes take_phase_times();

/// Is in a phase while it lives, and tells who watches ops.
class PhaseScope {
 public:
  explicit PhaseScope(Phase phase);
  ~PhaseScope();
  PhaseScope(const PhaseScope&) = delete;
  PhaseScope& operator=(const PhaseScope&) = delete;

 private:
  Phase phase_;
  int64_t start_;  // nanoseconds
};

}  // namespace restage
