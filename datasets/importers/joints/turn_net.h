// The network that turns positions of joints into turns of bones. Positions say where a bone
// points; how it is turned about itself they only say together with those of its neighbours, a
// little before and after. The weights (turns.safetensors, part of the program) are fitted by
// `joints_bench fit` (bench/joints) to motions of the data folder. Internal to this folder and to
// that program.
#pragma once

#include <optional>
#include <vector>

#include "nn/geometry/skeleton.h"
#include "nn/layers/mlp.h"

namespace restage::joints_detail {

/// Positions of one frame, metres, any axes; a joint that is not known is left out.
using SeenFrame = std::array<std::optional<Vec3>, kJoints>;

/// What the network looks at: the frame itself and frames before and after it, at 30 fps.
inline constexpr std::array<int, 9> kMoments = {0, -1, -2, -4, -8, 1, 2, 4, 8};
inline constexpr int kInputs = static_cast<int>(kMoments.size()) * kJoints * 4;
inline constexpr int kOutputs = kJoints * 7;  ///< six numbers and the logarithm of an error, each

/// The axes of the trunk: columns left, up, forward; the middle of the hips. Any person has them
/// who has both hips and both shoulders, whichever way up.
struct Trunk {
  Mat3 axes;
  Vec3 origin;
};
std::optional<Trunk> trunk_of(const SeenFrame& frame);
/// From the middle of the hips to that of the shoulders, metres; 0 where they are not known.
double trunk_length(const SeenFrame& frame);

/// One frame with its neighbours (in the order of kMoments; null: there is none) as the network
/// wants it: in the axes of `trunk`, divided by `length`, each joint x y z and whether it is known.
void fill_input(const std::array<const SeenFrame*, kMoments.size()>& around, const Trunk& trunk,
                double length, float* input);

struct TurnNet : Module {
  explicit TurnNet(const Init& init) : layers({kInputs, 448, 448, kOutputs}, init) {}
  /// [n, kInputs] to [n, kOutputs].
  Var operator()(Context& ctx, const Var& seen) const;
  void visit(Fields& f) override { f("layers", layers); }
  const char* kind() const override { return "TurnNet"; }
  ReluChain layers;
};
/// World turns from the T-pose in the axes of the trunk, [n, 22, 3, 3], and the logarithm of their
/// expected error (the length of the difference of two columns), [n, 22].
struct TurnAnswer {
  Var turns, log_error;
};
TurnAnswer answer_of(const Var& outputs);

/// With the weights that are part of the program.
const TurnNet& turn_net();

}  // namespace restage::joints_detail
