#include "train/phases.h"

#include <atomic>
#include <chrono>

#include "autograd/base/module_path.h"
#include "autograd/base/op_watch.h"

namespace restage {
namespace {

std::array<std::atomic<int64_t>, kPhases> spent{};

int64_t nanoseconds_now() {
  using namespace std::chrono;
  return duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

}  // namespace

const char* name_of(Phase phase) {
  constexpr const char* kNames[kPhases] = {"draw",     "forward", "backward", "optimiser",
                                           "validate", "save",    "step"};
  return kNames[static_cast<size_t>(phase)];
}

PhaseTimes take_phase_times() {
  PhaseTimes out;
  for (size_t i = 0; i < kPhases; ++i)
    out.seconds[i] = 1e-9 * static_cast<double>(spent[i].exchange(0));
  return out;
}

PhaseScope::PhaseScope(Phase phase) : phase_(phase), start_(nanoseconds_now()) {
  if (OpWatcher* told = op_watcher())
    told->begin(name_of(phase), module_path(), OpWatcher::Kind::phase);
}

PhaseScope::~PhaseScope() {
  if (OpWatcher* told = op_watcher()) told->end();
  spent[static_cast<size_t>(phase_)].fetch_add(nanoseconds_now() - start_,
                                               std::memory_order_relaxed);
}

}  // namespace restage
