#include "train/gradient_watch.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "autograd/base/words.h"

namespace restage {
namespace {

constexpr int64_t kDeadLooks = GradientWatch::kDeadAfter / GradientWatch::kEvery;
constexpr int64_t kNormsKnownAfter = 30, kHighSteps = 3;  // steps
constexpr double kNormMemory = 0.98;
constexpr double kDeadShare = 0.5;  // of a layer's units; in a good training a quarter may be off

}  // namespace

GradientWatch::GradientWatch(std::string stage, const std::vector<StateEntry>& state)
    : stage_(std::move(stage)) {
  for (const StateEntry& entry : state) {
    if (entry.parameter == nullptr) continue;
    const bool rows = entry.value->rank() >= 2 && entry.value->dtype() == DType::f32 &&
                      entry.value->device() == Device{};
    parameters_.push_back(
        {entry.name, entry.parameter->id, 0,
         std::vector<int64_t>(rows ? static_cast<size_t>(entry.value->size(0)) : 0)});
  }
}

void GradientWatch::say(const std::string& kind, const std::string& text) {
  found_.push_back({kind, stage_ + ": " + text});
}

std::vector<TrainWarning> GradientWatch::take() {
  std::vector<TrainWarning> out;
  out.swap(found_);
  return out;
}

void GradientWatch::look(const Optimiser* optimiser, const Gradients& gradients, double norm) {
  Norms& n = norms_[optimiser];
  if (norm > 0 && std::isfinite(norm)) {
    const double now = std::log(norm);
    const bool known = n.steps >= kNormsKnownAfter;
    n.high = known && now > n.usual + std::log(kExploded) ? n.high + 1 : 0;
    if (n.high == kHighSteps)
      say("exploding_gradient",
          format("the norm of the gradient has grown from %.3g to %.3g: lower "
                 "%s.optimiser.schedule.rate, warm up longer, or set %s.optimiser.clip",
                 std::exp(n.usual), norm, stage_.c_str(), stage_.c_str()));
    // What is far too high must not become usual before it is said.
    if (n.high == 0) n.usual = n.steps == 0 ? now : kNormMemory * n.usual + (1 - kNormMemory) * now;
  }
  if (n.steps++ % kEvery == 0)
    for (Watched& w : parameters_) look_at(gradients, &w);
}

void GradientWatch::look_at(const Gradients& gradients, Watched* w) {
  const Tensor* g = gradients.find(w->id);
  if (g == nullptr) return;  // it takes no part, or another optimiser's it is
  w->still = gradients.norm({&w->id, 1}) == 0 ? w->still + 1 : 0;
  if (w->still == kDeadLooks)
    say("dead_parameters",
        format("all gradients of %s have been zero for %d steps: it does not learn; is a weight "
               "of the loss 0, or are all of its ReLUs off? Lower the rate, or freeze it in "
               "optimiser.groups",
               w->name.c_str(), int{kDeadAfter}));
  if (w->rows.empty() || g->device() != Device{} || w->still > 0) return;
  const int64_t width = g->numel() / std::max<int64_t>(1, g->size(0));
  const float* row = g->data<float>();
  int64_t dead = 0, fresh = 0;
  for (int64_t& looks : w->rows) {
    looks = std::all_of(row, row + width, [](float x) { return x == 0; }) ? looks + 1 : 0;
    row += width;
    dead += looks >= kDeadLooks;
    fresh += looks == kDeadLooks;
  }
  if (fresh > 0 && static_cast<double>(dead) >= kDeadShare * static_cast<double>(w->rows.size()))
    say("dead_units", cat(dead, " of ", w->rows.size(), " units of ", w->name,
                          " have had no gradient for ", kDeadAfter,
                          " steps (ReLUs that are always off): lower the rate, warm up longer, or "
                          "make the layer narrower"));
}

}  // namespace restage
