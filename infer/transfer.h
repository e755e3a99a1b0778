// A network that poses the target's vertices without a skeleton (role `transfer`): NPT, LART,
// 3D-CoreNet and others of their kind.
#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "infer/each_cloud.h"
#include "infer/retargeter.h"
#include "nn/geometry/embedded_mesh.h"
#include "nn/models/transfer.h"
#include "nn/weights/bundle.h"

namespace restage {

/// Whether the network of the role `transfer` needs point i of a cloud to be vertex i of the
/// target.
bool needs_correspondence(const Bundle& weights);

/// Every cloud is centred by its bounding box, as in training, and given to the network with the
/// clouds before it that its window holds (at the start the first cloud stands for them). The
/// answer is put where the source is: its box stands over the source's, both paths scaled by the
/// ratio of the boxes' heights, the tallest of the source so far counting. Turns of the source
/// about y go through the network like all else. One frame of the result for each of the source: in
/// a gap, LART decodes what lies between the codes of its ends; vertices of other networks go
/// straight.
///
/// A network moves about as many vertices as bodies had in its training. Where these were thinned,
/// it is shown as many evenly spread vertices of the target, and the others follow them
/// (nn/geometry/embedded_mesh.h). A network that needs correspondence (TST) takes clouds whose
/// points are the target's vertices in their order, and is shown the very vertices of its training.
class Transfer final : public EachCloud {
 public:
  /// `where` names the target in errors, `weights_name` the weights. InputError: no network of this
  /// role; a target of another mesh than a network that needs correspondence was trained on.
  Transfer(const Bundle& weights, const std::string& weights_name, Mesh target,
           const std::string& where, const RetargetOptions& options);

  const Mesh& target() const override { return target_; }
  const Joints* target_joints() const override { return nullptr; }
  const Joints* source_joints() const override { return nullptr; }

 private:
  void answer(const Points& cloud, const std::string& source, const Show& show) override;
  void forget() override;
  void place(RetargetedFrame&) const override {}
  void mix(const RetargetedFrame& before, double share, RetargetedFrame& frame) const override;
  void perform(const Points& cloud, const std::string& source);
  [[noreturn]] void refuse_mesh(const std::string& where, const std::string& weights_name) const;
  Points seen_of(const Points& cloud, const std::string& source) const;
  Tensor seen_window() const;
  Points of_all(const Tensor& moved) const;

  /// What the network saw of a cloud, and the middle of the floor of the target's box then.
  struct Moment {
    Tensor window;
    Point below = {};
  };

  std::shared_ptr<TransferModel> model_;
  Mesh target_;
  // The vertices that the network moves. Trainings shuffle them, and 3D-CoreNet looks at neighbours
  // in the list, so they are shuffled here too, unless they correspond.
  std::optional<EmbeddedMesh> embedded_;
  Tensor identity_;  // [1, v, 3] in that order
  uint64_t seed_;
  int64_t points_;             // of a cloud that the network is given
  float height_ = 0;           // of the target
  float tallest_ = 0;          // cloud so far
  std::deque<Points> window_;  // centred, the newest last
  Moment before_, now_;        // of the last cloud and the one before it
  RetargetedFrame frame_;      // of the last cloud
};

}  // namespace restage
