#include "datasets/importers/joints/turn_net.h"

#include <memory>
#include <string>

#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rotation.h"
#include "datasets/embedded_weights.h"
#include "nn/weights/state.h"

namespace restage::joints_detail {
namespace {

Vec3 middle(const SeenFrame& frame, int left, int right) {
  return 0.5 * (*frame[static_cast<size_t>(left)] + *frame[static_cast<size_t>(right)]);
}

bool has_trunk(const SeenFrame& frame) {
  return frame[kLeftHip] && frame[kRightHip] && frame[kLeftShoulder] && frame[kRightShoulder];
}

}  // namespace

double trunk_length(const SeenFrame& frame) {
  if (!has_trunk(frame)) return 0;
  return (middle(frame, kLeftShoulder, kRightShoulder) - middle(frame, kLeftHip, kRightHip)).norm();
}

std::optional<Trunk> trunk_of(const SeenFrame& frame) {
  constexpr double kLeast = 1e-6;  // of directions that are across each other
  if (!has_trunk(frame)) return {};
  Trunk out;
  out.origin = middle(frame, kLeftHip, kRightHip);
  const Vec3 up = (middle(frame, kLeftShoulder, kRightShoulder) - out.origin).normalized();
  const Vec3 hips = (*frame[kLeftHip] - *frame[kRightHip]).normalized(),
             shoulders = (*frame[kLeftShoulder] - *frame[kRightShoulder]).normalized();
  const Vec3 across = hips + shoulders, left = across - across.dot(up) * up;
  if (!(left.norm() > kLeast) || !up.allFinite()) return {};
  out.axes.col(0) = left.normalized();
  out.axes.col(1) = up;
  out.axes.col(2) = out.axes.col(0).cross(up);
  return out;
}

void fill_input(const std::array<const SeenFrame*, kMoments.size()>& around, const Trunk& trunk,
                double length, float* input) {
  const Mat3 turn = trunk.axes.transpose() / length;
  for (const SeenFrame* frame : around)
    for (size_t j = 0; j < kJoints; ++j, input += 4) {
      const bool known = frame != nullptr && (*frame)[j].has_value();
      const Vec3 x = known ? Vec3(turn * (*(*frame)[j] - trunk.origin)) : Vec3::Zero();
      for (int axis = 0; axis < 3; ++axis) input[axis] = static_cast<float>(x[axis]);
      input[3] = known ? 1.0f : 0.0f;
    }
}

Var TurnNet::operator()(Context& ctx, const Var& seen) const { return layers(ctx, seen); }

TurnAnswer answer_of(const Var& outputs) {
  const Var each = reshape(outputs, {outputs.size(0), kJoints, 7});
  return {sixd_to_matrix(slice(each, 2, 0, 6)),
          reshape(slice(each, 2, 6, 7), {outputs.size(0), kJoints})};
}

const TurnNet& turn_net() {
  static const auto net = [] {
    auto out = std::make_unique<TurnNet>(Init{});
    const std::string where = "the built-in network of turns";
    load_state(*out, parse_safetensors(embedded::turn_weights(), where), "", where);
    return out;
  }();
  return *net;
}

}  // namespace restage::joints_detail
