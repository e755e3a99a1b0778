// The role `transfer`: a network that poses a mesh by looking at another body, without a skeleton.
#pragma once

#include <optional>

#include "nn/module.h"

namespace restage {

struct TransferInput {
  Var pose;           ///< [n, t, p, 3]: windows of the performer, clouds or vertices, metres
  Var identity;       ///< [n, v, 3]: the target's mesh, in a rest pose or in any
  bool last = false;  ///< only the window's last frame is wanted, [n, 1, v, 3]
};

struct TransferModel : Module {
  /// Vertices of the target in the poses of the window, in the identity's order, [n, t, v, 3].
  /// ShapeError where the window has another length than frames(), or points are not as many as the
  /// model needs.
  virtual Var forward(Context& ctx, const TransferInput& in) = 0;
  /// The target at `share` of the way from the last frame of a window to that of another, in.pose
  /// [2, t, p, 3] -> [1, 1, v, 3]; nothing of a model without codes of frames that may be mixed.
  virtual std::optional<Var> between(Context&, const TransferInput&, double) const {
    return std::nullopt;
  }
  /// Frames of a window; 1: the network looks at each frame alone.
  virtual int64_t frames() const { return 1; }
  /// Whether point i of the pose must be point i of the identity.
  virtual bool corresponding() const { return false; }
  /// Whether the pose needs as many points as the target has vertices.
  virtual bool equal_counts() const { return corresponding(); }
};

}  // namespace restage
