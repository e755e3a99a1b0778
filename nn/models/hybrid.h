// `smrm/hybrid`: geometry does what it can, the network the rest.
//
// SMRM (spec 3) has to learn the identity before it can be of use: fed with true skeletons it is
// worse than the closed form of them, and than copying (docs/method.md, "Past SMRM"). Here the same
// recurrent layers say, per frame, how much of what is seen of each joint is to be believed against
// what was believed before (a filter whose gain is learned), and correct the joints, the twist
// about each bone, and the rotations of head, hands and feet; all other rotations are the closed
// form of these joints on B's rest joints, inside the tape. Before training that is very nearly the
// closed form itself.
#pragma once

#include <optional>

#include "nn/config/rules.h"
#include "nn/layers/gru.h"
#include "nn/layers/linear.h"
#include "nn/models/motion.h"
#include "nn/models/surface_turns.h"

namespace restage {

struct HybridConfig {
  int64_t hidden = 256;
  int layers = 2;
  int64_t latency = 0;
  double dropout = 0;
  double reach = 2, turn_reach = 0.15;
  bool orientation = true, uncertainty = true, contact = false, smoothing = false;
};

template <class V>
void visit(V& v, HybridConfig& c) {
  v("hidden", c.hidden, "size of the hidden states", between(1, kMostWidth));
  v("dropout", c.dropout, "between the layers", below(0, 1));
  v("latency", c.latency, "frames that it looks ahead: so much later it answers", between(0, 60));
  v("smoothing", c.smoothing, "the filters, too, know the frames that it looks ahead",
    added("false"));
  v("reach", c.reach,
    "farthest that a coordinate of a joint is corrected, in units of its uncertainty", at_least(0));
  v("turn_reach", c.turn_reach,
    "farthest that a twist or a leaf is corrected, radians for every 5 mm of uncertainty",
    at_least(0));
  v("orientation", c.orientation, "sees the rotations that the extractor reads from the surface");
  v("uncertainty", c.uncertainty, "sees how far the extractor's joints may be off");
  v("contact", c.contact, "also says which feet stand");
  v("layers", c.layers, "of the encoder and of the decoder", added("2", between(1, 16)));
}

/// The state is {encoder, decoder}, both [layers, n, hidden], the three states of the filter, [n,
/// 121], the last `latency` frames of what is filtered, or of what comes of it where they are
/// smoothed; with `contact` also the state of `footing` and the joints of the last frame; where
/// they are smoothed the last `latency` uncertainties.
struct Hybrid final : MotionModel {
  using Config = HybridConfig;
  Hybrid(const HybridConfig& c, const Init& init);
  MotionOutput forward(Context& ctx, const MotionInput& in, MotionState* state) const override;
  void standardise(const MotionStatistics& statistics) override;
  int64_t latency() const override { return config.latency; }
  void visit(Fields& f) override;
  const char* kind() const override { return "Hybrid"; }

  HybridConfig config;
  GruLayer enc, dec;
  /// Before training the answers of all of these are near zero.
  Linear gate, trend, correction, twist, leaves, path;
  std::optional<Linear> back;       ///< how much later frames change earlier ones
  std::optional<GruLayer> footing;  ///< reads how the feet move in the world; with config.contact
  std::optional<Linear> contact;
  MotionStatistics units;  ///< all but `sixd`

 private:
  Var seen(const MotionInput& in, const SurfaceTurns& surface, const Var& uncertainty) const;
  Var calmed(Context& ctx, const Var& now, const Var& decoded, MotionState* state) const;
};

}  // namespace restage
