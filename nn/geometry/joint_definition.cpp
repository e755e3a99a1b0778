#include "nn/geometry/joint_definition.h"

#include "autograd/base/error.h"
#include "autograd/base/log.h"

namespace restage {

JointConversion::JointConversion(const JointDefinition& from, const JointDefinition& to,
                                 const std::string& where) {
  rows_.setZero();
  if (from == to) {
    rows_.setIdentity();
    return;
  }
  const bool there = from == "makehuman" && to == "smpl";
  if (!there && !(from == "smpl" && to == "makehuman"))
    throw InputError(
        where,
        (from.empty() ? "does not say which joints it holds" : "holds joints of '" + from + "'") +
            ", which cannot be turned into joints of '" + to + "'",
        "conversions exist between makehuman and smpl (docs/joints.md)");
  for (const auto& [joint, of] : there ? makehuman_to_smpl() : smpl_to_makehuman())
    for (const auto& [other, weight] : of) {
      const auto side = static_cast<size_t>(joint), at = static_cast<size_t>(other);
      rows_(joint, other) = weight;
      rows_(kMirror[side], kMirror[at]) = weight;
    }
}

Joints JointConversion::operator()(const Joints& joints) const {
  Joints out;
  for (int j = 0; j < kJoints; ++j) {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < kJoints; ++k) sum += rows_(j, k) * joints[static_cast<size_t>(k)];
    out[static_cast<size_t>(j)] = sum;
  }
  return out;
}

void JointConversion::convert(std::span<double> frames) const {
  using Frame = Eigen::Matrix<double, kJoints, 3, Eigen::RowMajor>;
  for (size_t at = 0; at + 3 * kJoints <= frames.size(); at += 3 * kJoints) {
    Eigen::Map<Frame> frame(&frames[at]);
    frame = (rows_ * frame).eval();
  }
}

JointDefinition common_definition(const std::vector<NamedDefinition>& all,
                                  const std::string& mend) {
  const NamedDefinition* first = nullptr;
  for (const NamedDefinition& one : all) {
    if (one.definition.empty()) continue;
    if (first == nullptr) first = &one;
    if (one.definition == first->definition) continue;
    const std::string wrong = "has joints of '" + one.definition + "', but " + first->where +
                              " has those of '" + first->definition + "'";
    if (one.definition != "builtin" && first->definition != "builtin")
      throw InputError(one.where, wrong, mend);
    log_warning(one.where + " " + wrong + ": a part of the errors is that difference");
  }
  return first == nullptr ? "" : first->definition;
}

}  // namespace restage
