// A network that poses the target's vertices without a skeleton (role `transfer`): NPT, LART,
// 3D-CoreNet and others of their kind.
#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "infer/retargeter.h"
#include "infer/system.h"
#include "nn/models/transfer.h"
#include "nn/weights/bundle.h"

namespace restage {

/// Every cloud is centred by its bounding box, as in training, and given to the network with the
/// clouds before it that its window holds (at the start the first cloud stands for them). The
/// answer is put where the source is: its box stands over the source's, both paths scaled by the
/// ratio of the boxes' heights, the tallest of the source so far counting. Turns of the source
/// about y go through the network like all else. One frame of the result for each of the source.
class Transfer final : public System {
 public:
  /// `where` names the target in errors, `weights_name` the weights. InputError: no network of this
  /// role, or one that needs points in correspondence.
  Transfer(const Bundle& weights, const std::string& weights_name, Mesh target,
           const std::string& where, const RetargetOptions& options);

  std::span<const RetargetedFrame> push(const Points& cloud, const std::string& source) override;
  void miss() override { ++missed_; }
  std::span<const RetargetedFrame> finish() override;
  void restart() override;
  const Mesh& target() const override { return target_; }
  const SystemRig* rig() const override { return nullptr; }
  Points posed(const Pose&) const override { return {}; }
  const Joints* target_joints() const override { return nullptr; }
  const Joints* source_joints() const override { return nullptr; }
  FrameTimes times() const override { return times_; }

 private:
  Points answer();

  std::shared_ptr<TransferModel> model_;
  Mesh target_;
  // Trainings shuffle vertices, and 3D-CoreNet looks at neighbours in the list, so it has to see
  // them shuffled here too. `order_`: the vertex of the target at each place.
  std::vector<size_t> order_;
  Tensor identity_;  // [1, v, 3] in that order
  uint64_t seed_;
  int64_t points_;               // of a cloud that the network is given
  float height_ = 0;             // of the target
  float tallest_ = 0;            // cloud so far
  std::deque<Points> window_;    // centred, the newest last
  std::optional<Points> shown_;  // for the last cloud
  int64_t missed_ = 0;           // frames of the source since the last cloud
  FrameTimes times_;
  std::vector<RetargetedFrame> frames_;  // of the last push
};

}  // namespace restage
