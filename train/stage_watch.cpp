#include "train/stage_watch.h"

#include "autograd/base/format.h"

namespace restage {

StageWatch::StageWatch(Stage& stage) : stage_(stage), gradients_(stage.name(), stage.state()) {
  stage_.show_gradients(&gradients_);
}

/// Those of a kind that has not been said yet.
std::vector<TrainWarning> StageWatch::fresh(std::vector<TrainWarning> found) {
  std::erase_if(found, [&](const TrainWarning& one) { return !said_.insert(one.kind).second; });
  return found;
}

std::vector<TrainWarning> StageWatch::after_step(const NamedValues& values,
                                                 const PhaseTimes& times) {
  std::vector<TrainWarning> found = gradients_.take();
  const char* stage = stage_.name().c_str();
  draw_ += times.of(Phase::draw), work_ += times.work();
  if (++timed_ == kTimed) {
    if (draw_ > kDrawShare * work_)
      found.push_back({"slow_examples",
                       format("%s: the networks wait for examples: %.0f %% of a step is spent on "
                              "drawing them; give more --threads, or take fewer or smaller "
                              "distortions of them in the section %s",
                              stage, 100 * draw_ / work_, stage)});
    timed_ = 0, draw_ = work_ = 0;
  }
  same_loss_ = !values.empty() && values.front().second == loss_ ? same_loss_ + 1 : 0;
  if (!values.empty()) loss_ = values.front().second;
  if (same_loss_ == kSameSteps)
    found.push_back({"constant_loss",
                     format("%s: the loss has been %.6g for %d steps, to the last bit: is the rate "
                            "0, is everything frozen, or are the weights of its terms 0?",
                            stage, loss_, int{kSameSteps})});
  return fresh(std::move(found));
}

std::vector<TrainWarning> StageWatch::after_validation(const NamedValues& figures, int64_t steps) {
  const bool moved = steps > validated_at_;
  validated_at_ = steps;
  if (!moved) return {};
  same_figures_ = !figures.empty() && figures == figures_ ? same_figures_ + 1 : 1;
  figures_ = figures;
  if (same_figures_ != kSameValidations) return {};
  return fresh(
      {{"constant_figures",
        format("%s: %d validations have given the same figures, to the last bit (%s %.6g): "
               "the weights do not move; is the rate 0, or is everything frozen?",
               stage_.name().c_str(), int{kSameValidations}, figures.front().first.c_str(),
               figures.front().second)}});
}

}  // namespace restage
