#include "infer/system.h"

#include <algorithm>

#include "autograd/base/error.h"

namespace restage {

void System::push(const Points& cloud, const std::string& source, const Show& show) {
  take([&] { answer(cloud, source, show); });
}

void System::miss() {
  ++frames_;
  ++missed_;
}

void System::finish(const Show& show) {
  if (begun_) answer_rest(show);
  restart();
}

void System::restart() {
  frames_ = missed_ = shown_ = 0;
  begun_ = false;
  forget();
}

void System::wear(std::shared_ptr<const OwnRig> own) {
  own_ = std::move(own);
  own_weights_ = own_->weights();
  system_rig_.emplace(SystemRig{own_->rest(), own_weights_});
}

void System::place_by_rig(RetargetedFrame& frame) const {
  if (!own_) return place(frame);
  frame.joints.emplace();
  own_->place(frame.pose, nullptr, &*frame.joints, &frame.vertices);
}

Points System::posed(const Pose& pose) const {
  RetargetedFrame frame;
  frame.pose = pose;
  place_by_rig(frame);
  return std::move(frame.vertices);
}

void System::hand_out(RetargetedFrame& frame, const Show& show) {
  {
    const Stopwatch watch(&times_.deformation);
    place_by_rig(frame);
  }
  const auto finite = [](const auto& places) {
    return std::all_of(places.begin(), places.end(), [](const auto& p) { return p.allFinite(); });
  };
  if ((frame.joints && !finite(*frame.joints)) || !finite(frame.vertices))
    throw InputError("", "frame " + std::to_string(shown_) + " of the result is not finite",
                     "check that source and target are in metres");
  ++shown_;
  show(frame);
}

}  // namespace restage
